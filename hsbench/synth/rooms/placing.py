"""Placement: pieces with poses, proposals of groups, and a layout that accepts only what keeps its guarantees.

A group proposes arrangements in the order of its preference; the layout takes the first one whose pieces hit nothing
and after which the room still keeps every promise: seats and handles reached, floor free and connected.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numba
import numpy as np
from scipy import ndimage

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply, cos_sin, planar
from hsbench.schema.categories import category
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.rooms.clearance import CLEAR_FRONT_M, OPENING_ROLES, SITTING_M, SITTING_ROLES
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.shell import SKIRTING_M, Shell
from hsbench.truth.walkable import ENTRY_INSET_M, HEAD_ROOM_M, STEP_M, WalkMap, blocked, connected, walk_map
from hsbench.typing import FloatArray

APART_M = 0.005  # bodies of two objects keep this far from each other
ON_FLOOR_M = 0.05  # what begins below this height stands on the floor and meets the skirting
DOOR_SIDE_M = 0.1  # the door zone is wider than the door by this on each side
WINDOW_DEPTH_M = 0.45
MAX_TRIED = 14  # arrangements of one group that get the full check


@dataclass(frozen=True)
class Pose:
    """Where an object stands: x, y, z of its origin in metres and its yaw, quantised."""

    x: float
    y: float
    yaw: float = 0.0
    z: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "y", "z"):
            object.__setattr__(self, name, float(quantise_m(getattr(self, name))))
        object.__setattr__(self, "yaw", quantise_angle(math.remainder(self.yaw, 2 * math.pi)))

    def then(self, x: float, y: float, yaw: float = 0.0, z: float = 0.0) -> Pose:
        """The pose of something at (x, y, z) and a yaw in this object's frame."""
        c, s = cos_sin(self.yaw)
        return Pose(self.x + c * x - s * y, self.y + s * x + c * y, self.yaw + yaw, self.z + z)

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

    @property
    def width(self) -> float:
        """Size along x."""
        return float(self.bounds[1, 0] - self.bounds[0, 0])

    @property
    def depth(self) -> float:
        """Size along y."""
        return float(self.bounds[1, 1] - self.bounds[0, 1])

    @property
    def height(self) -> float:
        """Highest point above the origin."""
        return float(self.bounds[1, 2])


@dataclass(frozen=True, eq=False)
class Item:
    """A piece at a pose; an optional one is dropped where it does not fit."""

    piece: Piece
    pose: Pose
    optional: bool = False

    @cached_property
    def corners(self) -> FloatArray:
        """(4, 2) footprint rectangle in the room."""
        (x0, y0, _), (x1, y1, _) = self.piece.bounds
        return self.rectangle(x0, y0, x1, y1)

    @cached_property
    def z_range(self) -> tuple[float, float]:
        """Lowest and highest point."""
        return float(self.piece.bounds[0, 2]) + self.pose.z, float(self.piece.bounds[1, 2]) + self.pose.z

    @cached_property
    def taken_z(self) -> tuple[float, float]:
        """Heights that others keep clear of: the body and, over a seat or mattress, the head of who sits there."""
        low, high = self.z_range
        seat = [float(p.vertices[:, 2].max()) for p in self.piece.parts if p.role in SITTING_ROLES]
        return low, max([high, *(self.pose.z + z + SITTING_M for z in seat)])

    @cached_property
    def zone(self) -> FloatArray | None:
        """(4, 2) floor in front that others leave free, or None."""
        depth = CLEAR_FRONT_M.get(self.piece.category_name)
        if depth is None:
            return None
        (x0, y0, _), (x1, _, _) = self.piece.bounds
        return self.rectangle(x0, y0 - depth, x1, y0)

    @cached_property
    def solids(self) -> list[ConvexSolid]:
        """The parts in the room frame."""
        return [p.solid.transformed(self.pose.scene_T_object) for p in self.piece.parts if p.solid is not None]

    def rectangle(self, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
        """(4, 2) a rectangle of the object frame in the room, counter-clockwise, quantised."""
        flat = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
        return np.ascontiguousarray(quantise_m(apply(self.pose.scene_T_object, flat)[:, :2]))

    def middles(self, roles: Iterable[str]) -> FloatArray:
        """(n, 2) middles of the parts with one of the roles, in the room."""
        wanted = frozenset(roles)
        found = [p.vertices.min(axis=0) + p.vertices.max(axis=0) for p in self.piece.parts if p.role in wanted]
        return quantise_m(apply(self.pose.scene_T_object, np.array(found).reshape(-1, 3) / 2)[:, :2])


@dataclass
class Layout:
    """A room being furnished. ``items`` are final once placed."""

    shell: Shell
    structure: Sequence[SceneObject]
    config: RoomConfig
    items: list[Item] = field(default_factory=list)

    def __post_init__(self) -> None:
        w, d, h = self.shell.size_m
        # Sills, casings and skirting boards stand out from the walls: the empty room's cells know them.
        self.walk: WalkMap = walk_map(Scene("shell", (Room("", self.shell.outline_xy),), h, tuple(self.structure)))
        door = self.shell.openings[0]
        self._entry = self.shell.walls[door.wall].point(door.middle_m, ENTRY_INSET_M)
        self._keep_out = [self._opening_zone(i) for i in range(len(self.shell.openings))]
        self._area = w * d
        self._covered = 0.0

    @property
    def furniture_count(self) -> int:
        """Objects of the furniture group so far."""
        return sum(_counts(item) for item in self.items)

    def place(self, proposals: Iterable[Sequence[Item]]) -> list[Item]:
        """Put the first acceptable arrangement into the room; returns its items, none if no arrangement fits."""
        tried = 0
        for proposal in proposals:
            kept = self._fitting(proposal)
            if not kept:
                continue
            walk = self._accepts(kept)
            if walk is not None:
                self.items += kept
                self.walk = walk
                self._covered += sum(_footprint(item) for item in kept)
                return kept
            tried += 1
            if tried >= MAX_TRIED:
                break
        return []

    def free_of(self, item: Item, others: Sequence[Item]) -> bool:
        """Whether an item is inside the room and hits no body, no zone and no opening's keep-out."""
        z0, z1 = item.z_range
        w, d, h = self.shell.size_m
        margin = SKIRTING_M[1] + 0.001 if z0 < ON_FLOOR_M else -1e-6
        corners = item.corners
        if corners.min() < margin or corners[:, 0].max() > w - margin or corners[:, 1].max() > d - margin or z1 > h:
            return False
        if any(_meet(zone, low, high, corners, z0, z1, 0.0) for zone, low, high in self._keep_out):
            return False
        for other in (*self.items, *others):
            low, high = other.taken_z
            if _meet(other.corners, low, high, corners, z0, max(z1, item.taken_z[1]), APART_M):
                return False
        return self._zones_free(item)

    def _zones_free(self, item: Item) -> bool:
        z0, z1 = item.z_range
        blocks = z1 > STEP_M and z0 < ON_FLOOR_M
        zone = item.zone
        if zone is not None:
            w, d, _ = self.shell.size_m
            if zone.min() < 0 or zone[:, 0].max() > w or zone[:, 1].max() > d:
                return False
        for other in self.items:
            low, high = other.z_range
            if blocks and other.zone is not None and _meet(other.zone, 0.0, HEAD_ROOM_M, item.corners, z0, z1, 0.0):
                return False
            stands = high > STEP_M and low < ON_FLOOR_M
            if stands and zone is not None and _meet(zone, 0.0, HEAD_ROOM_M, other.corners, low, high, 0.0):
                return False
        return True

    def _fitting(self, proposal: Sequence[Item]) -> list[Item]:
        """The items that fit, or none if a required one does not."""
        kept: list[Item] = []
        room_left = self.config.furniture[1] - self.furniture_count
        for item in proposal:
            if _counts(item) <= room_left and self.free_of(item, kept):
                kept.append(item)
                room_left -= _counts(item)
            elif not item.optional:
                return []
        return kept

    def _accepts(self, new: Sequence[Item]) -> WalkMap | None:
        """The walkable cells with the new items, or None if a promise would break."""
        if self._covered + sum(_footprint(item) for item in new) > (1 - self.config.free_floor_share) * self._area:
            return None
        walk = blocked(self.walk, [s for item in new for s in item.solids])
        reached = connected(walk, self._entry)
        cell = walk.cell_m**2
        if reached.sum() * cell < self.config.walkable_share * self._area:
            return None
        if (walk.free & ~reached).sum() * cell > self.config.pocket_m2:
            return None
        distance = ndimage.distance_transform_edt(~reached) * walk.cell_m
        if all(self._reached(item, walk, distance) for item in (*self.items, *new)):
            return walk
        return None

    def _reached(self, item: Item, walk: WalkMap, distance_m: FloatArray) -> bool:
        """Whether every seat, one part that opens, and one side of a mattress are near enough to walkable cells."""
        near = _Nearness(walk, distance_m)
        seats = item.middles(("seat",))
        if len(seats) and not (near(seats) <= self.config.seat_reach_m).all():
            return False
        opening = item.middles(OPENING_ROLES)
        if len(opening) and not (near(opening) <= self.config.hand_reach_m).any():
            return False
        if item.piece.category_name == "bed":
            (x0, y0, _), (x1, y1, _) = item.piece.bounds
            sides = np.array([[x, y0 + s * (y1 - y0), 0.0] for x in (x0, x1) for s in (0.3, 0.5)])
            if not (near(quantise_m(apply(item.pose.scene_T_object, sides)[:, :2])) <= self.config.bedside_m).any():
                return False
        return True

    def _opening_zone(self, index: int) -> tuple[FloatArray, float, float]:
        """Rectangle and height range before an opening where nothing may stand."""
        hole = self.shell.openings[index]
        wall = self.shell.walls[hole.wall]
        is_door = hole.kind == "door"
        half = hole.width_m / 2 + DOOR_SIDE_M
        depth = self.config.door_clear_m if is_door else WINDOW_DEPTH_M
        ends = [(-half, 0.0), (half, 0.0), (half, depth), (-half, depth)]
        corners = np.array([wall.point(hole.middle_m + a, b) for a, b in ends])
        low = 0.0 if is_door else hole.low_m - 0.05
        return np.ascontiguousarray(corners), low, hole.high_m + 0.1


@dataclass(frozen=True, eq=False)
class _Nearness:
    """Distance of points (n, 2) to the nearest reached cell, by the cell they lie in."""

    walk: WalkMap
    distance_m: FloatArray

    def __call__(self, points_xy: FloatArray) -> FloatArray:
        index, _ = self.walk.index(points_xy)
        i, j = np.clip(index, 0, np.array(self.walk.free.shape) - 1).T
        return np.asarray(self.distance_m[i, j])


def _counts(item: Item) -> int:
    return int(category(item.piece.category_name).group == "furniture")


def _footprint(item: Item) -> float:
    """Floor covered by an item that stands on the floor and is no rug."""
    z0, z1 = item.z_range
    return item.piece.width * item.piece.depth if z0 < ON_FLOOR_M and z1 > STEP_M else 0.0


@numba.njit(cache=True)
def _meet(a: FloatArray, a_low: float, a_high: float, b: FloatArray, b_low: float, b_high: float, apart: float) -> bool:
    """Whether two upright prisms over counter-clockwise convex quads come nearer than ``apart`` (separating axes)."""
    if min(a_high, b_high) - max(a_low, b_low) <= 1e-6:
        return False
    for first, second in ((a, b), (b, a)):
        for e in range(4):
            dx, dy = first[(e + 1) % 4, 0] - first[e, 0], first[(e + 1) % 4, 1] - first[e, 1]
            length = np.sqrt(dx * dx + dy * dy)
            nearest = np.inf
            for v in range(4):
                beyond = ((second[v, 0] - first[e, 0]) * dy - (second[v, 1] - first[e, 1]) * dx) / length
                nearest = min(nearest, beyond)
            if nearest >= apart - 1e-9:
                return False
    return True
