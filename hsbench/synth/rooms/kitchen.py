"""Kitchen: units in a row with flush fronts, along one wall, round a corner or along two facing walls; an island.

A line holds fridge, sink, a place to cook, and worktop between and beside them as its length allows (NKBA Kitchen
Planning Guidelines: worktop on both sides of sink and hob, the dishwasher beside the sink). A hood hangs over the hob,
cabinets over the worktops.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise, product

import numpy as np

from hsbench.synth.furniture.kitchen import kitchen_counter_of, wall_cabinet_of
from hsbench.synth.furniture.pieces import draw
from hsbench.synth.rooms.items import Item, Piece
from hsbench.synth.rooms.placing import APART_M
from hsbench.synth.rooms.poses import QUARTER, WALL_GAP_M, Context, Proposal, along_walls, at_wall
from hsbench.synth.rooms.search import HANG_GAP_M, across_m, below_window, standing, stretches, together, top_m
from hsbench.synth.rooms.shell import Wall

Stretch = tuple[Wall, float, float]
"""A wall and the places from and to which units may stand side by side along it."""

UNIT_GAP_M = APART_M + 0.001
SINK_M = (0.6, 0.9)  # counter that holds the sink
HOB_M = 0.6  # counter that holds a hob
BETWEEN_M = 0.8  # worktop between sink and hob that is enough
LEAST_COUNTER_M = 0.3
DISHWASHER_FROM_M = 0.9  # spare length from which a dishwasher joins the line
RUN_M = (2.8, 4.2)  # wanted length of a line
COOK_RUN_M = (1.2, 2.2)  # of the run with the hob, where the line is on two walls
LEAST_REST_M = 0.5  # a line that would leave less of its wall fills it
WIDEST_CABINET_M, LEAST_CABINET_M = 1.0, 0.3  # of those on the wall
BLIND_M = 0.66  # counter in a corner, behind the other run: nothing of it opens
OPENED_ROLES = ("door", "drawer", "handle")
KITCHENETTE_M = 1.2  # one counter with sink and hob
AISLE_M = (0.95, 1.2)  # between counter and island
GALLEY_M = (0.9, 1.7)  # way between two runs
STOOL_PITCH_M, STOOL_GAP_M = 0.6, 0.05
STRETCH_CHANCE_M = 1.5  # a stretch may come before one that is longer by this
STOVE_SHARE = 0.5  # of kitchens with a free-standing cooker instead of a hob in the counter
HALF_TURN = 2 * QUARTER


def kitchen(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A run of units at a wall; ``corner``: along two walls; ``galley``: along two facing walls; ``island``: an island
    with bar stools before the run.

    The smallest size falls back to a plain run, then to a kitchenette with the fridge somewhere else.
    """
    rng = ctx.rng("kitchen")
    units = _Units(ctx, rng)
    below = []  # a window: there one cooks only where nothing else is left
    for proposal in _lines(ctx, mode, units, rng):
        if any(item.piece is units.hood and below_window(ctx, item) for item in proposal):
            below.append(proposal)
        else:
            yield proposal
    if ctx.fit == 0.0:
        yield from below


def _lines(ctx: Context, mode: str, units: _Units, rng: np.random.Generator) -> Iterator[Proposal]:
    free = stretches(ctx, "kitchen_counter", units.depth, units.height)
    order = [STRETCH_CHANCE_M * rng.random() - (high - low) for _, low, high in free]  # the longest first, by and large
    free = [free[int(i)] for i in np.argsort(order, kind="stable")]
    if mode == "corner":
        yield from _corners(units, free)
    elif mode == "galley":
        yield from _galleys(units, free)
    elif mode == "island":
        yield from _islands(units, free, draw(rng, AISLE_M))
    if mode == "" or ctx.fit == 0.0:
        for _, line in _runs(units, free):
            yield units.dressed(line)
    if ctx.fit == 0.0:
        yield from _kitchenettes(units, rng)


class _Units:
    """The units of one kitchen, each width built once, and the lines made of them."""

    def __init__(self, ctx: Context, rng: np.random.Generator) -> None:
        self.ctx = ctx
        self.rng = rng
        self._counters: dict[tuple[float, bool, bool], Piece] = {}
        self._cabinets: dict[float, Piece] = {}
        self._fitted: dict[Piece, tuple[bool, bool]] = {}
        self.fridge, self.hood = ctx.piece("fridge"), ctx.piece("range_hood", fit=0.0)
        self.dishwasher = ctx.piece("dishwasher")
        self.sink = self.counter(draw(rng, SINK_M, ctx.fit), sink=True)
        self.cook = ctx.piece("stove") if rng.random() < STOVE_SHARE else self.counter(HOB_M, hob=True)
        fixed = (p for p in self.counter(BLIND_M).parts if p.role not in OPENED_ROLES)
        self.blind = Piece("kitchen_counter", tuple(fixed))
        self.depth, self.height = self.sink.depth, top_m(self.sink)

    def counter(self, width_m: float, sink: bool = False, hob: bool = False) -> Piece:
        """A counter of a width, to the centimetre."""
        key = (round(width_m, 2), sink, hob)
        if key not in self._counters:
            rng = self.ctx.rng("shape-units")  # one stream: all units of a kitchen are painted alike
            piece = Piece("kitchen_counter", kitchen_counter_of(rng, self.ctx.style, *key))
            self._counters[key], self._fitted[piece] = piece, (sink, hob)
        return self._counters[key]

    def cabinet(self, width_m: float) -> Piece:
        """A wall cabinet of a width, to the centimetre."""
        key = round(width_m, 2)
        if key not in self._cabinets:
            rng = self.ctx.rng("shape-units")
            self._cabinets[key] = Piece("wall_cabinet", wall_cabinet_of(rng, self.ctx.style, key))
        return self._cabinets[key]

    def width(self, piece: Piece) -> float:
        """Width a unit takes in a line: that of the hood above it where it is wider."""
        return max(piece.width, self.hood.width) if piece is self.cook else piece.width

    def length(self, pieces: Sequence[Piece]) -> float:
        """Of a line."""
        return sum(self.width(p) for p in pieces) + UNIT_GAP_M * (len(pieces) - 1)

    def line(self, length_m: float) -> list[Piece]:
        """Fridge, sink and hob with as much between them as a length allows; none if it is too short for the three."""
        spare = length_m - self.length([self.fridge, self.sink, self.cook])
        if spare < 0:
            return []
        middle: list[Piece] = []
        if spare >= DISHWASHER_FROM_M and self.dishwasher.width + UNIT_GAP_M < spare:
            middle = [self.dishwasher]
            spare -= self.dishwasher.width + UNIT_GAP_M
        return [self.fridge, self.sink, *middle, *self.worktops(spare, before=self.cook)]

    def worktops(self, spare_m: float, before: Piece) -> list[Piece]:
        """A piece with worktop on one side or on both, as a spare length allows."""
        whole = spare_m - UNIT_GAP_M
        if whole < LEAST_COUNTER_M:
            return [before]
        if whole < 2 * LEAST_COUNTER_M + UNIT_GAP_M:
            return [self.counter(_down(whole)), before]
        first = min(BETWEEN_M, (whole - UNIT_GAP_M) / 2)
        return [self.counter(_down(first)), before, self.counter(_down(whole - UNIT_GAP_M - first))]

    def joined(self, pieces: Sequence[Piece]) -> list[Piece]:
        """The same line with neighbouring counters under one worktop, sink and hob in it."""
        line: list[Piece] = []
        for fitted, group in groupby(pieces, key=lambda piece: piece in self._fitted):
            members = list(group)
            if fitted and len(members) > 1:
                sink, hob = (any(self._fitted[piece][k] for piece in members) for k in range(2))
                line.append(self.counter(_down(self.length(members)), sink, hob))
            else:
                line += members
        return line

    def laid(self, stretch: Stretch, pieces: Sequence[Piece], from_high: bool) -> list[Item]:
        """Pieces side by side from one end of a stretch; of equal depth, their fronts are in one plane."""
        wall, low, high = stretch
        items = []
        at, way = (high, -1) if from_high else (low, 1)
        for piece in self.joined(pieces):
            width = self.width(piece)
            items.append(Item(piece, at_wall(wall, piece, at + way * width / 2)))
            at += way * (width + UNIT_GAP_M)
        return items

    def dressed(self, line: Sequence[Item]) -> list[Item]:
        """A line with what hangs above it: a hood over the place to cook, cabinets over all but fridge and corner."""
        hung = []
        for item in line:
            piece = item.piece
            if piece.category_name == "fridge" or piece is self.blind:
                continue
            left, right = -piece.width / 2, piece.width / 2
            hob_x = _hob_x(piece)
            if hob_x is not None:
                hung.append(self._above(item, self.hood, hob_x))
                low, high = hob_x - self.hood.width / 2 - UNIT_GAP_M, hob_x + self.hood.width / 2 + UNIT_GAP_M
                spans = [(left, low), (high, right)]
            else:
                spans = [(left, right)]
            for x0, x1 in spans:
                count = max(1, math.ceil((x1 - x0) / WIDEST_CABINET_M))
                width = (x1 - x0 - UNIT_GAP_M * (count - 1)) / count
                if width >= LEAST_CABINET_M:
                    places = (x0 + width / 2 + k * (width + UNIT_GAP_M) for k in range(count))
                    hung += [self._above(item, self.cabinet(_down(width)), x) for x in places]
        return [*line, *hung]

    def _above(self, item: Item, piece: Piece, x: float) -> Item:
        """What hangs at the wall over a place along a unit."""
        pose = item.pose.then(x, (item.piece.depth - piece.depth) / 2 + WALL_GAP_M - HANG_GAP_M)
        return Item(piece, pose, optional=piece is not self.hood or self.ctx.fit == 0.0)


def _hob_x(piece: Piece) -> float | None:
    """Where along a unit one cooks, None where one does not."""
    hob = next((p.vertices[:, 0] for p in piece.parts if p.name == "hob"), None)
    return None if hob is None else float(hob.min() + hob.max()) / 2


def _down(width_m: float) -> float:
    """A width rounded down to the centimetre."""
    return int(100 * width_m + 1e-6) / 100


def _runs(units: _Units, free: Sequence[Stretch]) -> Iterator[tuple[Wall, list[Item]]]:
    """The whole line along one stretch, from either end, either way round."""
    wish = max(draw(units.rng, RUN_M, units.ctx.fit), units.length([units.fridge, units.sink, units.cook]))
    ends = (True, False) if units.rng.random() < 0.5 else (False, True)
    for stretch in free:
        room_m = stretch[2] - stretch[1]
        line = units.line(room_m if room_m - wish < LEAST_REST_M else wish)
        if line:
            for from_high in ends:
                yield stretch[0], units.laid(stretch, line, from_high)
                yield stretch[0], units.laid(stretch, line[::-1], from_high)


def _corners(units: _Units, free: Sequence[Stretch]) -> Iterator[Proposal]:
    """Two runs that meet in a corner: sink and fridge along one wall, the place to cook along the other."""
    walls = units.ctx.layout.shell.walls
    for wall, after in pairwise((*walls, walls[0])):
        first = next((s for s in free if s[0] is wall and s[2] > wall.length_m - 2 * WALL_GAP_M), None)
        second = next((s for s in free if s[0] is after and s[1] < 2 * WALL_GAP_M), None)
        if first is not None and second is not None and wall.inward @ after.along > 0:
            yield from _corner(units, first, second, True)
            yield from _corner(units, second, first, False)


def _corner(units: _Units, long: Stretch, short: Stretch, from_high: bool) -> Iterator[Proposal]:
    """One corner: ``long`` has its corner at its high end or at its low one, ``short`` at the other."""
    length = long[2] - long[1]
    line = [units.blind, units.sink, units.fridge]
    wish = min(length, draw(units.rng, RUN_M, units.ctx.fit))
    if units.length([*line, units.dishwasher]) <= wish:
        line.insert(2, units.dishwasher)
    off = WALL_GAP_M + units.depth + UNIT_GAP_M
    wall, low, high = short
    rest = (wall, low + off, high) if from_high else (wall, low, high - off)
    spare = min(rest[2] - rest[1], draw(units.rng, COOK_RUN_M)) - units.width(units.cook)
    if units.length(line) <= length and spare >= 0:
        cooking = units.worktops(spare, before=units.cook)
        yield units.dressed([*units.laid(long, line, from_high), *units.laid(rest, cooking, not from_high)])


def _galleys(units: _Units, free: Sequence[Stretch]) -> Iterator[Proposal]:
    """Fridge and sink along one wall, the place to cook along the wall across."""
    bodies = 2 * (units.depth + WALL_GAP_M)
    line = [units.fridge, units.sink, units.dishwasher]
    for first, second in product(free, free):
        way = across_m(units.ctx.layout.shell, second[0], (second[1] + second[2]) / 2) - bodies
        if first[0].inward @ second[0].inward > -0.5 or not GALLEY_M[0] <= way <= GALLEY_M[1]:
            continue
        spare = min(second[2] - second[1], draw(units.rng, COOK_RUN_M)) - units.width(units.cook)
        if units.length(line) <= first[2] - first[1] and spare >= LEAST_COUNTER_M + UNIT_GAP_M:
            cooking = units.worktops(spare, before=units.cook)
            for from_high in (True, False):
                yield units.dressed([*units.laid(first, line, from_high), *units.laid(second, cooking, not from_high)])


def _islands(units: _Units, free: Sequence[Stretch], aisle_m: float) -> Iterator[Proposal]:
    """An island before the middle of a run, its back to the room, with bar stools there."""
    ctx = units.ctx
    island, stool = ctx.piece("kitchen_island"), ctx.piece("bar_stool")
    count = max(1, int(island.width / STOOL_PITCH_M))
    for wall, line in _runs(units, free):
        ends = np.array([[item.pose.x, item.pose.y] for item in (line[0], line[-1])])
        along = float(((ends - wall.start) @ wall.along).mean())
        pose = standing(wall, along, WALL_GAP_M + units.depth + aisle_m + island.depth / 2, HALF_TURN)
        y = island.depth / 2 + stool.depth / 2 + STOOL_GAP_M
        places = [(i + 0.5) * island.width / count - island.width / 2 for i in range(count)]
        stools = [Item(stool, pose.then(at, y), optional=i > 0) for i, at in enumerate(places)]
        yield [*units.dressed(line), Item(island, pose), *stools]


def _kitchenettes(units: _Units, rng: np.random.Generator) -> Iterator[Proposal]:
    """One counter with sink and hob, and the fridge wherever it fits beside it."""
    ctx = units.ctx
    units.cook = units.counter(KITCHENETTE_M, sink=True, hob=True)
    counters = [units.dressed([Item(units.cook, p)]) for _, _, p in along_walls(ctx, units.cook, rng, "corner")]
    fridges = [[Item(units.fridge, p)] for _, _, p in along_walls(ctx, units.fridge, rng, "corner")]
    yield from together(ctx, (counters, fridges))
    yield from counters
