"""A room as its furniture sees it: inner wall faces and the openings in them, and the floor openings keep free.

Room frame: the smallest x and y of the room's outline are 0, walls along x and y, floor z = 0. ``origin_xy`` places it
in the scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.transforms import cos_sin
from hsbench.synth.furniture.openings import CASING_M, LEAF_M
from hsbench.synth.rooms.regions import MM_PER_M, Lines, inside, rectangles_of, to_mm
from hsbench.typing import FloatArray

DOOR_SIDE_M = 0.1  # what is kept free before an opening is wider than it by this on each side
DOOR_PASS_M = 0.75  # between an open leaf and whatever stands beside the way in
LEAF_PLAY_M = 0.08  # a handle and a finger beside an open leaf
SKIRTING_M = (0.07, 0.012)  # height, thickness
SWITCH_M = (0.08, 0.012, 1.1)  # side, thickness, height above the floor of a light switch
SWITCH_GAP_M = 0.1  # from the casing of a door to its switch
SWITCH_ZONE_M = (0.2, 0.3, 0.2)  # width, depth, and height above and below a switch that tall things leave free
WINDOW_DEPTH_M = 0.45
WINDOW_BELOW_M, OPENING_ABOVE_M = 0.05, 0.1  # the kept heights reach a sill below a window and a casing above openings


@dataclass(frozen=True, eq=False)
class Wall:
    """One inner wall face: (2,) start corner, unit vectors along it (counter-clockwise) and into the room, length."""

    start: FloatArray
    along: FloatArray
    inward: FloatArray
    length_m: float

    @cached_property
    def yaw(self) -> float:
        """Yaw of an object that stands with its back to the wall and looks into the room."""
        return math.atan2(self.inward[0], -self.inward[1])

    def place(self, along_m: float, inward_m: float) -> tuple[float, float]:
        """x, y of a place along the wall and a distance from it."""
        (x, y), (ax, ay), (nx, ny) = self._floats
        return x + along_m * ax + inward_m * nx, y + along_m * ay + inward_m * ny

    @cached_property
    def _floats(self) -> tuple[list[float], list[float], list[float]]:
        return self.start.tolist(), self.along.tolist(), self.inward.tolist()

    def point(self, along_m: float, inward_m: float) -> FloatArray:
        """(2,) point at a place along the wall and a distance from it."""
        return np.asarray(self.start + along_m * self.along + inward_m * self.inward)


def walls_of(outline_xy: FloatArray) -> tuple[Wall, ...]:
    """The walls of a rectilinear room outline (n, 2), counter-clockwise: wall i begins at corner i."""
    walls = []
    for start, end in zip(outline_xy, np.roll(outline_xy, -1, axis=0), strict=True):
        length = float(quantise_m(np.abs(end - start).sum()))
        along = np.sign(end - start) + 0.0
        walls.append(Wall(start, along, np.array([-along[1], along[0]]) + 0.0, length))
    return tuple(walls)


@dataclass(frozen=True)
class Opening:
    """A hole in wall number ``wall`` of a room: middle along it, width, lower and upper edge.

    kind: ``door``, ``passage`` or ``window``. hinge: the sign along the wall of the side where a leaf that stands open
    in this room hangs, 0 if none does; open_rad: how far it is open.
    """

    kind: str
    wall: int
    middle_m: float
    width_m: float
    low_m: float
    high_m: float
    hinge: int = 0
    open_rad: float = 0.0

    @property
    def is_way(self) -> bool:
        """Whether people go through."""
        return self.kind != "window"

    def zone(self, wall: Wall, clear_m: float) -> tuple[FloatArray, float, float]:
        """((4, 2) rectangle before the opening, lowest, highest z) where nothing may stand.

        clear_m: its depth before a door or passage. Where a leaf stands in the room it holds that and a way past it.
        """
        low, high = -self.width_m / 2 - DOOR_SIDE_M, self.width_m / 2 + DOOR_SIDE_M
        z0 = self.low_m - WINDOW_BELOW_M if self.kind == "window" else 0.0
        depth = WINDOW_DEPTH_M if self.kind == "window" else clear_m
        if self.hinge:
            c, s = cos_sin(self.open_rad)
            reach, side = self.width_m * c, LEAF_PLAY_M + LEAF_M
            depth = max(depth, self.width_m * s + LEAF_PLAY_M)
            # Measured from the hinge towards the lock: the leaf beyond the hinge, and the way past its end.
            beyond = max(DOOR_SIDE_M, -reach + side)
            past = max(self.width_m + DOOR_SIDE_M, reach + side + DOOR_PASS_M)
            low, high = sorted((self.hinge * (self.width_m / 2 + beyond), self.hinge * (self.width_m / 2 - past)))
        ends = ((low, 0.0), (high, 0.0), (high, depth), (low, depth))
        corners = quantise_m(np.array([wall.point(self.middle_m + a, b) for a, b in ends]))
        return np.ascontiguousarray(corners), z0, self.high_m + OPENING_ABOVE_M


@dataclass(frozen=True, eq=False)
class Shell:
    """One room: (n, 2) outline in the room frame, height, openings, and (2,) where the room frame lies in the scene."""

    outline_xy: FloatArray
    height_m: float
    openings: tuple[Opening, ...]
    origin_xy: FloatArray

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The inner wall faces in the order of the outline."""
        return walls_of(self.outline_xy)

    @cached_property
    def size_m(self) -> tuple[float, float, float]:
        """Width, depth and height of the box around the room."""
        w, d = self.outline_xy.max(axis=0).tolist()
        return w, d, self.height_m

    @cached_property
    def area_m2(self) -> float:
        """Floor area in square metres."""
        return signed_area(self.outline_xy)

    @cached_property
    def switches(self) -> tuple[tuple[int, float], ...]:
        """(wall, place along it) of the light switch: by the first door with space beside it; else there is none."""
        reach = SWITCH_M[0] / 2
        for hole in (o for o in self.openings if o.is_way):
            length = self.walls[hole.wall].length_m
            off = hole.width_m / 2 + CASING_M[0] + SWITCH_GAP_M
            # On the side of the lock, where a leaf does not cover it; else where the wall is longer.
            first = -hole.hinge if hole.hinge else (1 if hole.middle_m < length / 2 else -1)
            for side in (first, -first):
                place = float(quantise_m(hole.middle_m + side * off))
                others = [o for o in self.openings if o is not hole and o.wall == hole.wall]
                free = all(abs(place - o.middle_m) > o.width_m / 2 + CASING_M[0] + reach for o in others)
                if reach <= place <= length - reach and free and side != hole.hinge:
                    return ((hole.wall, place),)
        return ()

    def keep_out(self, door_clear_m: float) -> list[tuple[FloatArray, float, float]]:
        """((4, 2) rectangle, lowest, highest z) of what stays free before openings and light switches."""
        zones = [o.zone(self.walls[o.wall], door_clear_m) for o in self.openings]
        wide, deep, tall = SWITCH_ZONE_M
        for index, place in self.switches:
            ends = ((-wide / 2, 0.0), (wide / 2, 0.0), (wide / 2, deep), (-wide / 2, deep))
            corners = quantise_m(np.array([self.walls[index].point(place + a, b) for a, b in ends]))
            zones.append((np.ascontiguousarray(corners), SWITCH_M[2] - tall, SWITCH_M[2] + tall))
        return zones

    @cached_property
    def outside(self) -> tuple[FloatArray, ...]:
        """(4, 2) rectangles that make up what of the box around the room is not the room."""
        corners = to_mm(self.outline_xy)
        lines = Lines.of(corners[:, 0], corners[:, 1])
        rest = lines.rectangles(~inside(corners, lines))
        return tuple(np.array([[a, b], [c, b], [c, d], [a, d]]) / MM_PER_M for a, b, c, d in rest)

    @cached_property
    def middle_xy(self) -> FloatArray:
        """(2,) middle of the largest rectangle between the lines of the walls that fits in."""
        corners = to_mm(self.outline_xy)
        lines = Lines.of(corners[:, 0], corners[:, 1])
        full = inside(corners, lines)
        n, m = full.shape
        spans = [
            (int(lines.xs[k] - lines.xs[i]) * int(lines.ys[h] - lines.ys[j]), i, j, k, h)
            for i in range(n) for k in range(i + 1, n + 1) for j in range(m) for h in range(j + 1, m + 1)
            if full[i:k, j:h].all()
        ]  # fmt: skip
        _, i, j, k, h = max(spans)
        return np.array([lines.xs[i] + lines.xs[k], lines.ys[j] + lines.ys[h]]) / (2 * MM_PER_M)


def rectangles(outline_xy: FloatArray) -> list[FloatArray]:
    """Few disjoint (4, 2) rectangles, counter-clockwise, that make up a rectilinear outline (n, 2), metres."""
    found = rectangles_of(to_mm(outline_xy))
    return [np.array([[a, b], [c, b], [c, d], [a, d]]) / MM_PER_M for a, b, c, d in found]
