"""What of a building is wall, and whose: everything between its rooms and its outer outline, exact, in few boxes.

Each piece belongs to the wall face it touches or is nearest to, so that a wall between two rooms is cut in the middle
of its thickness and each half can be painted in the colour of its own room. With its walls a room has a territory: what
its floor covers.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hsbench.synth.rooms.plan import OUTSIDE, FloorPlan
from hsbench.synth.rooms.regions import Lines, Rect, inside, to_mm
from hsbench.typing import BoolArray, IntArray

SHORT_MM = 1200  # sides of piers and shafts are shorter
SOLID = -1  # number of the opening in cells where the wall is whole


@dataclass(frozen=True)
class WallBox:
    """A box of wall: its rectangle and heights in millimetres, and the room and wall face whose it is."""

    room: int
    wall: int
    rect: Rect
    low: int
    high: int


@dataclass(frozen=True, eq=False)
class Masonry:
    """A building cut into boxes of wall, and into a territory, as rectangles, for each room; millimetres."""

    boxes: tuple[WallBox, ...]
    territories: tuple[tuple[Rect, ...], ...]
    footprint: tuple[Rect, ...]


def masonry(plan: FloorPlan) -> Masonry:
    """The walls of a plan with their openings left free."""
    rooms = [to_mm(room.outline_xy) for room in plan.rooms]
    building = to_mm(plan.outline_xy)
    holes = [_hole(plan, i) for i in range(len(plan.openings))]
    corners = np.concatenate([building, *rooms, *(np.reshape(h, (2, 2)) for h in holes)])
    lines = _split(Lines.of(corners[:, 0], corners[:, 1]), rooms)
    room_of = np.full((len(lines.xs) - 1, len(lines.ys) - 1), OUTSIDE)
    for i, outline in enumerate(rooms):
        room_of[inside(outline, lines)] = i
    wall = inside(building, lines) & (room_of == OUTSIDE)
    face_room, face_wall = _nearest_faces(rooms, lines, room_of)
    hole_of = np.full(room_of.shape, SOLID)
    for i, hole in enumerate(holes):
        hole_of[lines.mask([hole]) & wall] = i

    boxes = []
    height = int(to_mm(np.array(plan.height_m)))
    for i, outline in enumerate(rooms):
        for k in range(len(outline)):
            own = wall & (face_room == i) & (face_wall == k)
            along_x = bool(plan.walls[i][k].along[0])
            for number in np.unique(hole_of[own]):
                for rect in lines.rectangles(own & (hole_of == number), along_x):
                    boxes += [WallBox(i, k, rect, *z) for z in _heights(plan, int(number), height)]
    owner = np.where(wall, face_room, room_of)
    territories = tuple(tuple(lines.rectangles(owner == i)) for i in range(len(rooms)))
    return Masonry(tuple(boxes), territories, tuple(lines.rectangles(wall | (room_of != OUTSIDE))))


def _hole(plan: FloorPlan, index: int) -> Rect:
    """The rectangle of an opening, through the whole thickness of its wall."""
    hole = plan.openings[index]
    wall = plan.walls[hole.front][hole.wall]
    half = hole.width_m / 2
    ends = [wall.point(hole.middle_m - half, 0.0), wall.point(hole.middle_m + half, -hole.thickness_m)]
    (x0, y0), (x1, y1) = np.sort(to_mm(np.array(ends)), axis=0).tolist()
    return x0, y0, x1, y1


def _heights(plan: FloorPlan, number: int, height: int) -> list[tuple[int, int]]:
    """Ranges of z where there is wall: all of it, or what is above and below an opening."""
    if number == SOLID:
        return [(0, height)]
    hole = plan.openings[number]
    low, high = to_mm(np.array([hole.low_m, hole.high_m])).tolist()
    return [z for z in ((0, low), (high, height)) if z[0] < z[1]]


def _split(lines: Lines, rooms: list[IntArray]) -> Lines:
    """The lines, and those in the middle of every gap between rooms that face each other and of every short wall.

    With the latter each side of a pier has a piece of wall that touches no other.
    """
    taken = np.zeros((len(lines.xs) - 1, len(lines.ys) - 1), dtype=np.bool_)
    xs, ys = list(lines.xs), list(lines.ys)
    for outline in rooms:
        taken |= inside(outline, lines)
        for (x0, y0), (x1, y1) in zip(outline.tolist(), np.roll(outline, -1, axis=0).tolist(), strict=True):
            if abs(x1 - x0) + abs(y1 - y0) < SHORT_MM:
                xs.append((x0 + x1) // 2)
                ys.append((y0 + y1) // 2)
    return Lines.of([*xs, *_middles(taken, lines.xs)], [*ys, *_middles(taken.T, lines.ys)])


def _middles(taken: BoolArray, at: IntArray) -> list[int]:
    """Middles of the runs of free cells between taken ones, along the first axis of (n, m) cells between ``at``."""
    found = set()
    for column in taken.T:
        cells = np.flatnonzero(column)
        for a, b in pairwise(cells):
            if b > a + 1:
                found.add(int(at[a + 1] + at[b]) // 2)
    return sorted(found)


def _nearest_faces(rooms: list[IntArray], lines: Lines, room_of: IntArray) -> tuple[IntArray, IntArray]:
    """(nx, ny) room and wall number of the wall face nearest to the middle of each cell; the first of equals.

    A cell that touches a room is that room's, however near another one is: its side is a face of the room.
    """
    x, y = (lines.xs[1:] + lines.xs[:-1])[:, None], (lines.ys[1:] + lines.ys[:-1])[None, :]  # doubled: whole numbers
    around = np.pad(room_of, 1, constant_values=OUTSIDE)
    beside = (around[:-2, 1:-1], around[2:, 1:-1], around[1:-1, :-2], around[1:-1, 2:])
    touched = np.maximum.reduce(beside)
    best = np.full(room_of.shape, np.iinfo(np.int64).max)
    face_room, face_wall = np.zeros_like(best), np.zeros_like(best)
    for i, outline in enumerate(rooms):
        for k, (start, end) in enumerate(zip(2 * outline, 2 * np.roll(outline, -1, axis=0), strict=True)):
            low, high = np.minimum(start, end), np.maximum(start, end)
            dx = np.maximum(np.maximum(low[0] - x, x - high[0]), 0)
            dy = np.maximum(np.maximum(low[1] - y, y - high[1]), 0)
            away = dx**2 + dy**2
            nearer = (away < best) & ((touched == OUTSIDE) | (touched == i))
            best[nearer] = away[nearer]
            face_room[nearer], face_wall[nearer] = i, k
    return face_room, face_wall
