"""Placement: proposals of groups, and a layout that accepts only what keeps its guarantees.

A group proposes arrangements in the order of its preference; the layout takes the first one whose pieces hit nothing
and after which the room still keeps every promise: seats and handles reached, floor free, all doors connected.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.categories import category
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.synth.furniture.openings import HANDLE_FROM_M
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.items import ON_FLOOR_M, Item
from hsbench.synth.rooms.occupied import BODY, KEEP_OUT, ZONE, Inside, Prisms, Taken, any_near, flood, meet
from hsbench.synth.rooms.shell import SKIRTING_M, Shell, rectangles
from hsbench.truth.walkable import ENTRY_INSET_M, HEAD_ROOM_M, WalkMap, nearest_free_cell, shaded, walk_map
from hsbench.typing import BoolArray, FloatArray

APART_M = 0.005  # bodies of two objects keep this far from each other
MAX_TRIED = 14  # arrangements of one group that get the full check


@dataclass(frozen=True, eq=False)
class Mark:
    """A state of a layout to come back to."""

    items: tuple[Item, ...]
    free: BoolArray
    reached: BoolArray


@dataclass
class Layout:
    """A room being furnished. structure: what it is bounded by, scene frame. room_type: "" for none in particular.

    ``items`` are final once placed. Everything else is in the room frame.
    """

    shell: Shell
    structure: Sequence[SceneObject]
    config: RoomConfig
    room_type: str = ""
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
        opened = [o for o in self.shell.openings if not o.is_way and o.width_m > HANDLE_FROM_M]
        handles = [quantise_m(self.shell.walls[o.wall].point(o.middle_m, 0.0)[None]) for o in opened]
        reach_m = self.config.window_reach_m
        self._handles = [(p, reach_m) for p in handles if self._near(self._reached, p, reach_m)]
        self._inside = Inside(self.shell.size_m[:2], np.array(self.shell.outside).reshape(-1, 4, 2))
        self._pack()

    @property
    def furniture_count(self) -> int:
        """Objects of the furniture group so far."""
        return sum(_counts(item) for item in self.items)

    @property
    def widest_m(self) -> float:
        """How far from everything the middle of a body can stand at most, beyond its own radius."""
        return float(ndimage.distance_transform_edt(np.pad(self._reached, 1)).max()) * self.walk.cell_m

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
        self._needs = [*self._handles, *(need for item in self.items for need in item.needs(self.config))]
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

    def _near(self, reached: BoolArray, points: FloatArray, limit_m: float) -> bool:
        """Whether a reached cell is within a distance of one of the points (n, 2)."""
        return bool(any_near(reached, self.walk.origin_xy, self.walk.cell_m, points, limit_m))

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
        if not all(self._near(reached, points, limit) for points, limit in needs):
            return False
        self.items += new
        self.walk, self._reached = walk, reached
        self._pack()
        return True


def _counts(item: Item) -> int:
    return int(category(item.piece.category_name).group == "furniture")


def _footprint(item: Item) -> float:
    """Floor covered by an item that stands on the floor and is no rug."""
    return item.piece.width * item.piece.depth if item.stands else 0.0
