"""Pieces and items: a built object, a pose for it, and what it takes from the room where it stands there."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import cos_sin, planar
from hsbench.schema.scene import Part
from hsbench.synth.furniture import WALL_HUNG
from hsbench.synth.furniture.shapes import QUANTA_PER_M, quantised
from hsbench.synth.rooms.clearance import CLEAR_FRONT_M, CLEAR_SIDE_M, OPENING_ROLES, SITTING_M, SITTING_ROLES
from hsbench.synth.rooms.config import RoomConfig
from hsbench.truth.walkable import HEAD_ROOM_M, STEP_M, Shadows, shadows
from hsbench.typing import FloatArray

ON_FLOOR_M = 0.05  # what begins below this height stands on the floor and meets the skirting
BACKING_M, BACKING_SIDE_M = (0.04, 0.05), 0.01  # behind what hangs on a wall there is wall, but for its very sides
LOW_M = 0.42  # the lowest seats of chairs at a table
BEFORE_TOILET_M, STANDS_M = 0.3, 0.15  # somebody stands there before sitting down, or this near to it
BEDSIDE_SHARES = (0.3, 0.5)  # places along a bed's side, from its foot, where one gets in


@dataclass(frozen=True)
class Pose:
    """Where an object stands: x, y, z of its origin in metres and its yaw, quantised."""

    x: float
    y: float
    yaw: float = 0.0
    z: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "y", "z"):
            object.__setattr__(self, name, quantised(getattr(self, name)))
        object.__setattr__(self, "yaw", quantise_angle(math.remainder(self.yaw, 2 * math.pi)))

    def then(self, x: float, y: float, yaw: float = 0.0, z: float = 0.0) -> Pose:
        """The pose of something at (x, y, z) and a yaw in this object's frame."""
        c, s = self.direction
        return Pose(self.x + c * x - s * y, self.y + s * x + c * y, self.yaw + yaw, self.z + z)

    def plane(self, points_xy: FloatArray) -> FloatArray:
        """(n, 2) points of the object frame -> (n, 2) in the room."""
        c, s = self.direction
        return np.asarray(points_xy @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y]))

    @cached_property
    def direction(self) -> tuple[float, float]:
        """Cosine and sine of the yaw."""
        return cos_sin(self.yaw)

    @property
    def scene_T_object(self) -> FloatArray:
        """(4, 4) transform."""
        return planar(self.x, self.y, self.yaw, self.z)


@dataclass(frozen=True, eq=False)
class Piece:
    """A built object that has no place yet."""

    category_name: str
    parts: tuple[Part, ...]

    @cached_property
    def bounds(self) -> FloatArray:
        """(2, 3) lowest and highest corner in the object frame."""
        points = np.concatenate([p.vertices for p in self.parts])
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @cached_property
    def width(self) -> float:
        """Size along x."""
        return float(self.bounds[1, 0] - self.bounds[0, 0])

    @cached_property
    def depth(self) -> float:
        """Size along y."""
        return float(self.bounds[1, 1] - self.bounds[0, 1])

    @cached_property
    def height(self) -> float:
        """Highest point above the origin."""
        return float(self.bounds[1, 2])

    @cached_property
    def box(self) -> tuple[float, float, float, float, float, float]:
        """x0, y0, z0, x1, y1, z1 of the bounds."""
        (x0, y0, z0), (x1, y1, z1) = self.bounds.tolist()
        return x0, y0, z0, x1, y1, z1

    @cached_property
    def seat_z(self) -> tuple[float, ...]:
        """Heights of what one sits or lies on."""
        return tuple(float(p.vertices[:, 2].max()) for p in self.parts if p.role in SITTING_ROLES)

    @cached_property
    def low_parts(self) -> FloatArray:
        """(n, 4, 2) rectangles about the parts that reach below where one sits: legs, panels, shelves."""
        ends = [(p.vertices.min(axis=0), p.vertices.max(axis=0)) for p in self.parts]
        boxes = [(a[0], a[1], b[0], b[1]) for a, b in ends if a[2] < LOW_M]
        return np.array([[(x0, y0), (x1, y0), (x1, y1), (x0, y1)] for x0, y0, x1, y1 in boxes]).reshape(-1, 4, 2)

    def middles(self, roles: Iterable[str]) -> FloatArray:
        """(n, 2) middles of the parts with one of the roles."""
        wanted = frozenset(roles)
        found = [p.vertices.min(axis=0) + p.vertices.max(axis=0) for p in self.parts if p.role in wanted]
        return np.array(found).reshape(-1, 3)[:, :2] / 2

    def shadows(self, z_m: float) -> Shadows:
        """What a body hits of it, in the object frame, when its origin is at a height."""
        if z_m not in self._shadows:
            solids = [p.solid for p in self.parts if p.solid is not None]
            self._shadows[z_m] = shadows(solids, HEAD_ROOM_M - z_m, STEP_M - z_m)
        return self._shadows[z_m]

    @cached_property
    def _shadows(self) -> dict[float, Shadows]:
        return {}


@dataclass(frozen=True, eq=False)
class Item:
    """A piece at a pose; an optional one is dropped where it does not fit.

    front_m: depth of the floor before it that other groups leave free, None for what is usual for its category.
    behind_m: depth of the floor behind it that they leave free, to pull it back.
    """

    piece: Piece
    pose: Pose
    optional: bool = False
    front_m: float | None = None
    behind_m: float = 0.0

    @cached_property
    def corners(self) -> FloatArray:
        """(4, 2) footprint rectangle in the room."""
        x0, y0, _, x1, y1, _ = self.piece.box
        return self.rectangle(x0, y0, x1, y1)

    @cached_property
    def z_range(self) -> tuple[float, float]:
        """Lowest and highest point."""
        return self.piece.box[2] + self.pose.z, self.piece.box[5] + self.pose.z

    @cached_property
    def taken_z(self) -> tuple[float, float]:
        """Heights that others keep clear of: the body and, over a seat or mattress, the head of who sits there."""
        low, high = self.z_range
        return low, max([high, *(self.pose.z + z + SITTING_M for z in self.piece.seat_z)])

    @cached_property
    def zone(self) -> FloatArray | None:
        """(4, 2) floor in front, with that below and beside it or from its front to behind it, that others leave free;
        or None.
        """
        x0, y0, _, x1, y1, _ = self.piece.box
        if self.behind_m > 0:
            return self.rectangle(x0, y0, x1, y1 + self.behind_m)
        depth = CLEAR_FRONT_M.get(self.piece.category_name) if self.front_m is None else self.front_m
        side = CLEAR_SIDE_M.get(self.piece.category_name)
        if side is not None:
            return self.rectangle(x0 - side, y0 - (depth or 0.0), x1 + side, y1)
        return None if depth is None else self.rectangle(x0, y0 - depth, x1, y0)

    @cached_property
    def backing(self) -> FloatArray | None:
        """(4, 2) strip of the wall on which it hangs, or None for what stands."""
        if self.piece.category_name not in WALL_HUNG:
            return None
        x0, _, _, x1, y1, _ = self.piece.box
        return self.rectangle(x0 + BACKING_SIDE_M, y1 + BACKING_M[0], x1 - BACKING_SIDE_M, y1 + BACKING_M[1])

    @property
    def stands(self) -> bool:
        """Whether it takes floor from a body: it is no rug, and it does not hang."""
        low, high = self.z_range
        return high > STEP_M and low < ON_FLOOR_M

    @cached_property
    def solids(self) -> list[ConvexSolid]:
        """The parts in the room frame."""
        return [p.solid.transformed(self.pose.scene_T_object) for p in self.piece.parts if p.solid is not None]

    @cached_property
    def shadows(self) -> Shadows:
        """What a body hits of it, in the room."""
        own = self.piece.shadows(self.pose.z)
        return Shadows(self.pose.plane(own.points), own.start)

    def rectangle(self, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
        """(4, 2) a rectangle of the object frame in the room, counter-clockwise, quantised."""
        return _quad(*self.pose.direction, self.pose.x, self.pose.y, x0, y0, x1, y1)

    def middles(self, roles: Iterable[str]) -> FloatArray:
        """(n, 2) middles of the parts with one of the roles, in the room."""
        return quantise_m(self.pose.plane(self.piece.middles(roles)))

    def needs(self, config: RoomConfig) -> list[tuple[FloatArray, float]]:
        """((n, 2) points, metres): from one point of each of these a walkable cell must be as near as this.

        Every seat, one of the parts that open, one side of a mattress.
        """
        found = [(seat[None], config.seat_reach_m) for seat in self.middles(("seat",))]
        if self.piece.category_name == "toilet":
            before = np.array([[0.0, self.piece.box[1] - BEFORE_TOILET_M]])
            found.append((quantise_m(self.pose.plane(before)), STANDS_M))
        opening = self.middles(OPENING_ROLES)
        if len(opening):
            found.append((opening, config.hand_reach_m))
        if any(p.role == "mattress" for p in self.piece.parts):
            x0, y0, _, x1, y1, _ = self.piece.box
            sides = np.array([[x, y0 + s * (y1 - y0)] for x in (x0, x1) for s in BEDSIDE_SHARES])
            found.append((quantise_m(self.pose.plane(sides)), config.bedside_m))
        return found


@numba.njit(cache=True)
def _quad(c: float, s: float, x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """(4, 2) corners of a rectangle turned by a cosine and sine and put to (x, y), counter-clockwise, quantised."""
    corners = np.empty((4, 2))
    for k, (u, v) in enumerate(((x0, y0), (x1, y0), (x1, y1), (x0, y1))):
        corners[k, 0] = np.rint((x + c * u - s * v) * QUANTA_PER_M) / QUANTA_PER_M + 0.0
        corners[k, 1] = np.rint((y + s * u + c * v) * QUANTA_PER_M) / QUANTA_PER_M + 0.0
    return corners
