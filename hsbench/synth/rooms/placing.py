"""Placement: pieces with poses, proposals of groups, and a layout that accepts only what keeps its guarantees.

A group proposes arrangements in the order of its preference; the layout takes the first one whose pieces hit nothing
and after which the room still keeps every promise: seats and handles reached, floor free, all doors connected.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import LENGTH_DECIMALS, quantise_angle, quantise_m
from hsbench.geometry.transforms import cos_sin, planar
from hsbench.schema.categories import category
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.furniture import WALL_HUNG
from hsbench.synth.rooms.clearance import CLEAR_FRONT_M, OPENING_ROLES, SITTING_M, SITTING_ROLES
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.occupied import BODY, KEEP_OUT, ZONE, Inside, Prisms, Taken, any_near, flood, meet
from hsbench.synth.rooms.shell import SKIRTING_M, Shell, rectangles
from hsbench.truth.walkable import (
    ENTRY_INSET_M,
    HEAD_ROOM_M,
    STEP_M,
    Shadows,
    WalkMap,
    nearest_free_cell,
    shaded,
    shadows,
    walk_map,
)
from hsbench.typing import BoolArray, FloatArray

APART_M = 0.005  # bodies of two objects keep this far from each other
ON_FLOOR_M = 0.05  # what begins below this height stands on the floor and meets the skirting
QUANTA_PER_M = 10**LENGTH_DECIMALS
BACKING_M, BACKING_SIDE_M = (0.04, 0.05), 0.01  # behind what hangs on a wall there is wall, but for its very sides
MAX_TRIED = 14  # arrangements of one group that get the full check
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
            object.__setattr__(self, name, _quantised(getattr(self, name)))
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
    """A piece at a pose; an optional one is dropped where it does not fit."""

    piece: Piece
    pose: Pose
    optional: bool = False

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
        """(4, 2) floor in front that others leave free, or None."""
        depth = CLEAR_FRONT_M.get(self.piece.category_name)
        if depth is None:
            return None
        x0, y0, _, x1, _, _ = self.piece.box
        return self.rectangle(x0, y0 - depth, x1, y0)

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
        (c, s), px, py = self.pose.direction, self.pose.x, self.pose.y
        ends = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
        return np.array([(_quantised(px + c * x - s * y), _quantised(py + s * x + c * y)) for x, y in ends])

    def middles(self, roles: Iterable[str]) -> FloatArray:
        """(n, 2) middles of the parts with one of the roles, in the room."""
        return quantise_m(self.pose.plane(self.piece.middles(roles)))

    def needs(self, config: RoomConfig) -> list[tuple[FloatArray, float]]:
        """((n, 2) points, metres): from one point of each of these a walkable cell must be as near as this.

        Every seat, one of the parts that open, one side of a mattress.
        """
        found = [(seat[None], config.seat_reach_m) for seat in self.middles(("seat",))]
        opening = self.middles(OPENING_ROLES)
        if len(opening):
            found.append((opening, config.hand_reach_m))
        if any(p.role == "mattress" for p in self.piece.parts):
            x0, y0, _, x1, y1, _ = self.piece.box
            sides = np.array([[x, y0 + s * (y1 - y0)] for x in (x0, x1) for s in BEDSIDE_SHARES])
            found.append((quantise_m(self.pose.plane(sides)), config.bedside_m))
        return found


@dataclass(frozen=True, eq=False)
class Mark:
    """A state of a layout to come back to."""

    items: tuple[Item, ...]
    free: BoolArray
    reached: BoolArray


@dataclass
class Layout:
    """A room being furnished. structure: what it is bounded by, scene frame. ``items`` are final once placed.

    Everything else is in the room frame.
    """

    shell: Shell
    structure: Sequence[SceneObject]
    config: RoomConfig
    items: list[Item] = field(default_factory=list)

    def __post_init__(self) -> None:
        # Sills, casings, skirting and open leaves stand out from the walls: the empty room's cells know them. Cells
        # are those of the scene frame, so that what is promised here holds there.
        origin = self.shell.origin_xy
        room = Room("", quantise_m(self.shell.outline_xy + origin))
        walk = walk_map(Scene("shell", (room,), self.shell.height_m, tuple(self.structure)))
        self.walk = WalkMap(walk.origin_xy - origin, walk.free, walk.cell_m)
        self._area = room.area_m2
        ways = [o for o in self.shell.openings if o.is_way]
        entries = [self.shell.walls[o.wall].point(o.middle_m, ENTRY_INSET_M) for o in ways]
        cells = [nearest_free_cell(self.walk, entry) for entry in entries]
        self._entries = np.array([c for c in cells if c is not None], dtype=np.int64).reshape(-1, 2)
        self._reached = flood(self.walk.free, self._entries)
        self._keep_out = self.shell.keep_out(self.config.door_clear_m)
        self._floor = Prisms.of([(corners, 0.0, 1.0) for corners in rectangles(self.shell.outline_xy)])
        self._inside = Inside(self.shell.size_m[:2], np.array(self.shell.outside).reshape(-1, 4, 2))
        self._pack()

    @property
    def furniture_count(self) -> int:
        """Objects of the furniture group so far."""
        return sum(_counts(item) for item in self.items)

    def mark(self) -> Mark:
        """The state now."""
        return Mark(tuple(self.items), self.walk.free, self._reached)

    def back_to(self, mark: Mark) -> None:
        """Take out what was placed since."""
        self.items = list(mark.items)
        self.walk = WalkMap(self.walk.origin_xy, mark.free, self.walk.cell_m)
        self._reached = mark.reached
        self._pack()

    def place(self, proposals: Iterable[Sequence[Item]]) -> list[Item]:
        """Put the first acceptable arrangement into the room; returns its items, none if no arrangement fits.

        Gives up after ``MAX_TRIED`` arrangements that hit nothing but would break a promise.
        """
        tried = 0
        for proposal in proposals:
            kept = self._fitting(proposal)
            if not kept:
                continue
            if self._take(kept):
                return kept
            tried += 1
            if tried >= MAX_TRIED:
                break
        return []

    def free_of(self, item: Item, others: Sequence[Item]) -> bool:
        """Whether an item is inside the room, at a wall if it hangs there, and hits no body, zone or keep-out."""
        z0, z1 = item.z_range
        if z1 > self.shell.height_m:
            return False
        margin = SKIRTING_M[1] + 0.001 if z0 < ON_FLOOR_M else -1e-6
        corners, top = item.corners, max(z1, item.taken_z[1])
        if not self._inside.holds(corners, margin) or self._taken.meet(corners, z0, z1, top, item.stands):
            return False
        if any(meet(other.corners, *other.taken_z, corners, z0, top, APART_M) for other in others):
            return False
        if item.backing is not None and self._floor.meet(item.backing, 0.0, 1.0):
            return False
        zone = item.zone
        return zone is None or (self._inside.holds(zone, 0.0) and not self._standing.meet(zone, 0.0, HEAD_ROOM_M))

    def _pack(self) -> None:
        """The items as prisms: bodies, zones, and bodies that stand on the floor."""
        prisms = [(*zone, KEEP_OUT) for zone in self._keep_out]
        for item in self.items:
            prisms.append((item.corners, *item.taken_z, BODY))
            if item.zone is not None:
                prisms.append((item.zone, 0.0, HEAD_ROOM_M, ZONE))
        self._taken = Taken.of(prisms, APART_M)
        self._standing = Prisms.of([(i.corners, *i.z_range) for i in self.items if i.stands])
        self._needs = [need for item in self.items for need in item.needs(self.config)]
        self._covered = sum(_footprint(item) for item in self.items)

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

    def _take(self, new: Sequence[Item]) -> bool:
        """Put items into the room unless a promise would break."""
        covered = self._covered + sum(_footprint(item) for item in new)
        if covered > (1 - self.config.free_floor_share) * self._area:
            return False
        walk = self.walk
        for item in new:
            walk = shaded(walk, item.shadows)
        needs = [need for item in new for need in item.needs(self.config)]
        reached = self._reached
        if not np.array_equal(walk.free, self.walk.free):
            reached = flood(walk.free, self._entries)
            cell = walk.cell_m**2
            if not reached[tuple(self._entries.T)].all():
                return False
            if reached.sum() * cell < self.config.walkable_share * self._area:
                return False
            if (walk.free & ~reached).sum() * cell > self.config.pocket_m2:
                return False
            needs += self._needs
        if not all(any_near(reached, walk.origin_xy, walk.cell_m, points, limit) for points, limit in needs):
            return False
        self.items += new
        self.walk, self._reached = walk, reached
        self._pack()
        return True


def _quantised(length_m: float) -> float:
    """One length rounded to .1 mm, as ``quantise_m`` does it but without an array."""
    return round(length_m * QUANTA_PER_M) / QUANTA_PER_M + 0.0


def _counts(item: Item) -> int:
    return int(category(item.piece.category_name).group == "furniture")


def _footprint(item: Item) -> float:
    """Floor covered by an item that stands on the floor and is no rug."""
    return item.piece.width * item.piece.depth if item.stands else 0.0
