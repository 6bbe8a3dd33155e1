"""Work places: a desk with its chair and screen, at walls, free in the room, in pairs, blocks and rows."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from hsbench.synth.furniture.pieces import draw, pick
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls, at_wall, in_room, jitter
from hsbench.synth.rooms.search import HANG_GAP_M, fits, standing, top_m

CHAIR_GAP_M = (0.05, 0.11)  # desk to the chair before it
CHAIR_TURN_DEG = 6.0
BEHIND_DESK_M = (0.95, 1.3)  # desk front to wall where the user sits with the back to it
ROW_AISLE_M = 0.5  # behind a chair in a row of desks
DESK_GAP_M = 0.01  # between desks that stand together
SIDE_GAP_M = 0.03  # between the side of a desk and a wall
AROUND_M = 0.4  # free round a block in the middle of a room, at least
LEGS_M = (0.15, 0.55)  # heights between which knees and shins need space
KNEE_DEPTH_M = 0.35  # of the front of a desk, where it needs to be free
HAND_M = 0.36  # front of a desk to what one who sits there touches
EDGE_M = 0.06  # what stands on a desk keeps this far from its edge
LAPTOP_SHARE, LAMP_SHARE, SHELF_SHARE = 0.3, 0.35, 0.4
FREE_PAIR_SHARE = 0.4  # of pairs that stand free rather than with a side at a wall
CHAIRS = ("office_chair", "office_chair", "chair")
HALF_TURN = 2 * QUARTER


def desk(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Work places: at a ``wall``, ``free`` with the user's back to a wall; ``pair``: two face to face; ``four``: two
    pairs side by side; ``rows``: two behind each other, looking the same way.

    What is too large falls back to a desk at a wall in its smallest size.
    """
    rng = ctx.rng("desk")
    place = WorkPlace(ctx, rng)
    if mode in ("pair", "four"):
        yield from _block(place, 2 if mode == "four" and ctx.fit > 0.0 else 1, rng)
    elif mode == "rows":
        yield from _rows(place, rng)
    elif mode == "free":
        yield from _free(place, rng)
    if mode == "wall" or ctx.fit == 0.0:
        yield from _at_walls(place, rng)


class WorkPlace:
    """A desk, a chair before its knee space, and what one works with; only built once the desk has a place."""

    def __init__(self, ctx: Context, rng: np.random.Generator) -> None:
        self.ctx = ctx
        self.desk = ctx.piece("desk")
        self._rng = rng
        self._chair = pick(rng, CHAIRS)
        self._gap = draw(rng, CHAIR_GAP_M)
        self._knee_x = _knee_x(self.desk)
        self._tools = ("laptop",) if rng.random() < LAPTOP_SHARE else ("monitor", "keyboard")
        self._lamp = rng.random() < LAMP_SHARE

    @property
    def depth(self) -> float:
        """Of the desk with its chair."""
        return self.desk.depth + CHAIR_GAP_M[1] + self.ctx.piece(self._chair).depth

    def at(self, poses: Iterator[Pose] | list[Pose]) -> list[Item]:
        """The items of a work place at each pose of its desk; none if a desk alone does not fit."""
        poses = list(poses)
        if not all(fits(self.ctx, self.desk, pose) for pose in poses):
            return []
        return [item for pose in poses for item in self._items(pose)]

    def _items(self, pose: Pose) -> list[Item]:
        chair, x = self.ctx.piece(self._chair), self._knee_x
        y = -(self.desk.depth / 2 + chair.depth / 2 + self._gap)
        items = [Item(self.desk, pose)]
        items.append(Item(chair, pose.then(x, y, HALF_TURN + jitter(self._rng, CHAIR_TURN_DEG))))
        for name in self._tools:
            tool = self.ctx.piece(name)
            way = 1 if name == "monitor" else -1  # at the back of the top, or before the hands
            items.append(self._on_top(tool, pose, x, way, optional=name == "keyboard"))
        if self._lamp:
            lamp = self.ctx.piece("table_lamp")
            side = -1 if x > 0 else 1  # beside the knees
            items.append(self._on_top(lamp, pose, side * (self.desk.width / 2 - lamp.width / 2 - EDGE_M), 1, True))
        return items

    def _on_top(self, tool: Piece, pose: Pose, x: float, way: int, optional: bool) -> Item:
        """Something on the top, as far back as a hand reaches (``way`` 1) or at its front (-1)."""
        half = self.desk.depth / 2
        y = way * (half - tool.depth / 2 - EDGE_M)
        y = min(y, -half + HAND_M + tool.depth / 2)
        return Item(tool, pose.then(x, y, 0.0, top_m(self.desk)), optional)


def _knee_x(table: Piece) -> float:
    """Middle of the widest free space under the front of a desk."""
    low, high = LEGS_M
    (left, front, _), (right, _, _) = table.bounds.tolist()
    spans = [(right, right)]
    for part in table.parts:
        (x0, y0, z0), (x1, _, z1) = part.vertices.min(axis=0).tolist(), part.vertices.max(axis=0).tolist()
        if y0 < front + KNEE_DEPTH_M and z0 < high and z1 > low:
            spans.append((x0, x1))
    widest, middle, reach = 0.0, 0.0, left
    for x0, x1 in sorted(spans):
        if x0 - reach > widest:
            widest, middle = x0 - reach, (x0 + reach) / 2
        reach = max(reach, x1)
    return middle


def _at_walls(place: WorkPlace, rng: np.random.Generator) -> Iterator[Proposal]:
    shelved = rng.random() < SHELF_SHARE
    for wall, along, pose in along_walls(place.ctx, place.desk, rng, "any"):
        items = place.at([pose])
        if items and shelved:
            shelf = place.ctx.piece("shelf")
            items.append(Item(shelf, at_wall(wall, shelf, along, HANG_GAP_M), optional=True))
        yield items


def _free(place: WorkPlace, rng: np.random.Generator) -> Iterator[Proposal]:
    """The user sits with the back to a wall and looks into the room."""
    space = draw(rng, BEHIND_DESK_M)
    for wall, along, _ in along_walls(place.ctx, place.desk, rng, "middle"):
        yield place.at([standing(wall, along, place.desk.depth / 2 + space, HALF_TURN)])


def _block(place: WorkPlace, columns: int, rng: np.random.Generator) -> Iterator[Proposal]:
    """Pairs face to face, one or two beside each other; a side of the block at a wall, or free in the room."""
    table = place.desk
    pitch, y = table.width + DESK_GAP_M, (table.depth + DESK_GAP_M) / 2
    half = columns * pitch / 2
    xs = [(i + 0.5) * pitch - half for i in range(columns)]
    free = in_room(place.ctx, rng, min(half, place.depth) + AROUND_M)
    at_wall = (
        standing(wall, along, half + SIDE_GAP_M, QUARTER)
        for wall, along, _ in along_walls(place.ctx, table, rng, "middle", half_m=place.depth)
    )
    for pose in chain(free, at_wall) if columns == 1 and rng.random() < FREE_PAIR_SHARE else chain(at_wall, free):
        yield place.at([pose.then(x, s * y, turn) for x in xs for s, turn in ((-1, 0.0), (1, HALF_TURN))])


def _rows(place: WorkPlace, rng: np.random.Generator) -> Iterator[Proposal]:
    """Two desks behind each other, a side of each at a wall, users looking the same way."""
    pitch = place.depth + ROW_AISLE_M
    out = place.desk.width / 2 + SIDE_GAP_M
    way = pick(rng, (-QUARTER, QUARTER))
    for turn in (way, -way):
        for wall, along, _ in along_walls(place.ctx, place.desk, rng, "middle", half_m=pitch, turn=turn):
            ends = (along - pitch / 2, along + pitch / 2)
            yield place.at([standing(wall, end, out, turn) for end in ends])
