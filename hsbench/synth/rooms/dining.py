"""Dining groups: a table with chairs round it, in the middle of the room, at a wall, or with a bench."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import zip_longest

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import cos_sin
from hsbench.synth.furniture.pieces import draw, pick
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls, in_room, jitter
from hsbench.synth.rooms.search import fits

SEAT_PITCH_M = 0.56  # along a table, a person
SEAT_GAP_M = (0.02, 0.07)  # table edge to seat front
STRAIGHT_DEG = 4.0  # chairs that were pushed back to their table are turned by no more
STRAIGHT_GAP_M, TURNED_GAP_M = 0.02, 0.16  # what these need more, and those that stand turned
END_SEAT_M = 1.35  # a table this long has seats at its ends
FOUR_ROUND_M = 0.98  # a round table of this width has four seats
LEG_ROOM_M = 0.35  # wide and deep before a seat (task affordance-topdown)
LEG_SIDE_M = 0.02  # more on either side, for chairs that stand a little turned
CORNER_M = 0.04  # at each end of a long side without a seat
WALK_BEHIND_M = 0.55
LEAST_CHAIRS = 2  # at a table
PULL_M = 0.25  # free behind a chair at a table: to push it back and get up
AROUND_M = 0.1  # a table in a small room to the wall
WALL_M, BENCH_GAP_M = 0.03, 0.04  # a table to the wall behind it, to its bench
BENCH_WALL_M = 0.1  # a bench to the wall: who sits there has a window sill behind the back
ROUND_SHARE = 0.8  # of the half width plus half depth: a top whose corners reach less far along the diagonal is round
HALF_TURN = 2 * QUARTER
WALL_END = 1  # sign of x of the table's end that stands at the wall after a quarter turn


def dining(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A table with chairs: ``middle`` of the room, an end at a ``wall``, or with a ``bench`` between table and wall."""
    rng = ctx.rng("dining")
    table, chair = ctx.piece("dining_table"), ctx.piece("chair")
    if mode == "bench":
        yield from _with_bench(ctx, table, chair, rng)
    elif mode == "middle":
        yield from in_middle(ctx, table, chair, rng)
    else:
        for _, _, pose in along_walls(ctx, table, rng, "any", WALL_M, turn=QUARTER):
            if fits(ctx, table, pose):
                chairs = chairs_round(ctx, table, chair, pose, rng, open_end=pick(rng, (True, False)), closed=WALL_END)
                yield [Item(table, pose), *chairs]
    if ctx.fit == 0.0:
        yield from cramped(ctx, table, chair, rng)


def in_middle(ctx: Context, table: Piece, chair: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    """A table with chairs all round, near the middle of the room."""
    margin = min(table.width, table.depth) / 2 + chair.depth + WALK_BEHIND_M
    for pose in in_room(ctx, rng, margin):
        if fits(ctx, table, pose):
            yield [Item(table, pose), *chairs_round(ctx, table, chair, pose, rng, open_end=True)]


def cramped(ctx: Context, table: Piece, chair: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    """For small rooms, by turns: a table with a side at a wall, with an end there, in the room; two or four chairs."""

    def before() -> Iterator[Proposal]:
        for _, _, pose in along_walls(ctx, table, rng, "any", WALL_M):
            if fits(ctx, table, pose):
                if len(side_places(table)) >= LEAST_CHAIRS:
                    yield [Item(table, pose), *chairs_before(table, chair, pose, rng)]
                for chairs in _chairs_at_corner(table, chair, pose, rng):
                    yield [Item(table, pose), *chairs]

    def at_end() -> Iterator[Proposal]:
        for _, _, pose in along_walls(ctx, table, rng, "any", WALL_M, turn=QUARTER):
            if fits(ctx, table, pose):
                yield [Item(table, pose), *chairs_round(ctx, table, chair, pose, rng, False, WALL_END)[:4]]

    def free() -> Iterator[Proposal]:
        for pose in in_room(ctx, rng, min(table.width, table.depth) / 2 + AROUND_M):
            if fits(ctx, table, pose):
                yield [Item(table, pose), *chairs_round(ctx, table, chair, pose, rng, False)[:2]]

    for turn in zip_longest(before(), at_end(), free()):
        yield from (proposal for proposal in turn if proposal is not None)


def chairs_round(
    ctx: Context, table: Piece, chair: Piece, pose: Pose, rng: np.random.Generator, open_end: bool, closed: int = 0
) -> list[Item]:
    """Chairs round a table: two across from each other, and more such pairs as there is space.

    ``closed``: the sign of x of an end that stands at a wall.
    """
    places = _round_places(table, chair, rng) if _is_round(table) else _long_places(table, chair, open_end, closed)
    items = []
    for i, ((x, y, yaw), pull) in enumerate(zip(places, _pulls(table, chair, places), strict=True)):
        gap = draw(rng, SEAT_GAP_M)
        if rng.random() < ctx.config.turned_chair_share:
            gap += TURNED_GAP_M
            turn = jitter(rng, ctx.config.turned_chair_deg)
        else:
            gap += STRAIGHT_GAP_M
            turn = jitter(rng, STRAIGHT_DEG)
        # The front (-y) of a chair looks at the table; back off along it.
        off_x, off_y = -math.sin(yaw) * gap, math.cos(yaw) * gap
        at = pose.then(x + off_x, y + off_y, yaw + turn)
        items.append(Item(chair, at, optional=i >= LEAST_CHAIRS, behind_m=max(PULL_M, pull - gap)))
    # Those across from each other stay or go together.
    pairs = [items[i : i + 2] for i in range(0, len(items), 2)]
    free = (pair for pair in pairs[1:] if all(ctx.layout.free_of(item, ()) for item in pair))
    return [*pairs[0], *(item for pair in free for item in pair)]


def _pulls(table: Piece, chair: Piece, places: Sequence[tuple[float, float, float]]) -> list[float]:
    """How far back, metres, from each place (x, y, yaw in a table's frame) a chair's front has no leg of the table
    before it where those of who sits there are.
    """
    c, s = np.array([cos_sin(yaw) for _, _, yaw in places]).T[:, :, None, None]
    x, y = np.array([place[:2] for place in places]).T[:, :, None, None]
    rel_x, rel_y = table.low_parts[..., 0] - x, table.low_parts[..., 1] - y
    # Corners in the frame of the chair: (places, parts, 4).
    aside, back = c * rel_x + s * rel_y, c * rel_y - s * rel_x
    half = LEG_ROOM_M / 2 + LEG_SIDE_M
    before = (aside.min(axis=2) < half) & (aside.max(axis=2) > -half)
    into = np.where(before, back.max(axis=2) - (chair.box[1] - LEG_ROOM_M), 0.0)
    pulls: list[float] = quantise_m(into.max(axis=1, initial=0.0)).tolist()
    return pulls


def _is_round(table: Piece) -> bool:
    """Whether the top of a table is a disc."""
    top = next(p for p in table.parts if p.role == "top").vertices
    return float((top[:, 0] + top[:, 1]).max()) < ROUND_SHARE * (table.width + table.depth) / 2


def _long_places(table: Piece, chair: Piece, open_end: bool, closed: int) -> list[tuple[float, float, float]]:
    """Seats along both long sides of a table, then at its free ends: x, y, yaw in the table's frame."""
    out = table.depth / 2 + chair.depth / 2
    places = []
    for x in side_places(table):
        places += [(x, out, 0.0), (x, -out, HALF_TURN)]
    if open_end and table.width >= END_SEAT_M:
        end = table.width / 2 + chair.depth / 2
        places += [(s * end, 0.0, -s * QUARTER) for s in (1, -1) if s != closed]
    return places


def side_places(table: Piece) -> list[float]:
    """Where (x) the seats are along one long side of a table."""
    count = max(1, int((table.width - 2 * CORNER_M) / SEAT_PITCH_M))
    return [(i + 0.5) * table.width / count - table.width / 2 for i in range(count)]


def _round_places(table: Piece, chair: Piece, rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Seats around a round table, the first two opposite each other."""
    count = 4 if table.width > FOUR_ROUND_M else pick(rng, (2, 3))
    radius = table.width / 2 + chair.depth / 2
    order = (0, 2, 1, 3) if count == 4 else tuple(range(count))
    angles = [2 * math.pi * k / count for k in order]
    return [(-radius * math.sin(a), radius * math.cos(a), a) for a in angles]


def chairs_before(table: Piece, chair: Piece, pose: Pose, rng: np.random.Generator) -> list[Item]:
    """Chairs along the side of a table whose other side is at a wall; the first two must fit."""
    y = -(table.depth / 2 + chair.depth / 2 + SEAT_GAP_M[1])
    places = [(x, y, HALF_TURN) for x in side_places(table)]
    pulls = _pulls(table, chair, places)
    seats = [pose.then(x, y, yaw + jitter(rng, STRAIGHT_DEG)) for x, y, yaw in places]
    return [
        Item(chair, seat, optional=i >= LEAST_CHAIRS, behind_m=max(PULL_M, pull))
        for i, (seat, pull) in enumerate(zip(seats, pulls, strict=True))
    ]


def _chairs_at_corner(table: Piece, chair: Piece, pose: Pose, rng: np.random.Generator) -> Iterator[list[Item]]:
    """Two chairs at a table whose side is at a wall: at both ends, or one before it and one at an end."""
    end, out = (table.width + chair.width) / 2 + SEAT_GAP_M[1], (table.depth + chair.depth) / 2 + SEAT_GAP_M[1]
    right, left, before = (end, 0.0, -QUARTER), (-end, 0.0, QUARTER), (0.0, -out, HALF_TURN)
    for places in ((right, left), (before, right), (before, left)):
        seats = [(x, y, yaw + jitter(rng, STRAIGHT_DEG)) for x, y, yaw in places]
        pulls = _pulls(table, chair, places)
        yield [
            Item(chair, pose.then(*seat), behind_m=max(PULL_M, pull)) for seat, pull in zip(seats, pulls, strict=True)
        ]


def _with_bench(ctx: Context, table: Piece, chair: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    """Bench with its back to a wall, table before it, chairs on the other long side."""
    bench = ctx.piece("bench")
    out = bench.depth / 2 + table.depth / 2 + BENCH_GAP_M
    for _, _, pose in along_walls(ctx, bench, rng, "middle", BENCH_WALL_M, half_m=max(bench.width, table.width) / 2):
        at = pose.then(0.0, -out)
        yield [Item(bench, pose), Item(table, at), *chairs_before(table, chair, at, rng)]
