"""A floor plan: rooms, the openings between them and to the outside, thicknesses and height; no furniture.

Scene frame: the smallest x and y of all rooms are 0, walls along x and y, floor z = 0. Lengths are whole centimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import Room
from hsbench.synth.rooms.shell import Opening, Shell, Wall, walls_of
from hsbench.typing import FloatArray

OUTSIDE = -1  # number of the room beyond an outer wall


@dataclass(frozen=True)
class PlanOpening:
    """A hole in a wall, seen from the room in front of it: the one that a leaf swings into.

    kind: ``door``, ``passage`` or ``window``. front, back: numbers of the rooms on its sides, back may be ``OUTSIDE``.
    wall: number of the wall in front. middle_m: along it. low_m, high_m: lower and upper edge. thickness_m: of the
    wall. hinge: the sign of x, in the frame of the door object, of the side where the leaf hangs. open_rad: how far it
    stands open, 0 for a closed door.
    """

    kind: str
    front: int
    back: int
    wall: int
    middle_m: float
    width_m: float
    low_m: float
    high_m: float
    thickness_m: float
    hinge: int = 1
    open_rad: float = 0.0


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """Rooms in plan order, openings (the entrance first), ceiling height and thickness of the outer walls, metres.

    outline_xy: (n, 2) outer outline of the building, rectilinear, counter-clockwise; what of it is not room is wall.
    Raises SchemaError for an opening that leaves its wall or the height of the rooms.
    """

    rooms: tuple[Room, ...]
    openings: tuple[PlanOpening, ...]
    height_m: float
    outer_m: float
    outline_xy: FloatArray

    def __post_init__(self) -> None:
        for i, hole in enumerate(self.openings):
            length = self.walls[hole.front][hole.wall].length_m
            if not hole.width_m / 2 <= hole.middle_m <= length - hole.width_m / 2:
                raise SchemaError(
                    f"opening {i} ({hole.kind}) is {hole.width_m} m wide at {hole.middle_m} m; expected within its wall"
                    f" of {length} m"
                )
            if not 0 <= hole.low_m < hole.high_m < self.height_m:
                raise SchemaError(
                    f"opening {i} ({hole.kind}) reaches from {hole.low_m} to {hole.high_m} m; expected between floor"
                    f" and ceiling at {self.height_m} m"
                )

    @cached_property
    def walls(self) -> tuple[tuple[Wall, ...], ...]:
        """The inner wall faces of each room, scene frame."""
        return tuple(walls_of(room.outline_xy) for room in self.rooms)

    def ways(self, room: int) -> list[PlanOpening]:
        """The doors and passages of a room."""
        return [o for o in self.openings if o.kind != "window" and room in (o.front, o.back)]

    def behind(self, hole: PlanOpening) -> tuple[int, float]:
        """(wall, middle along it in metres) of an opening as seen from the room behind it."""
        front = self.walls[hole.front][hole.wall]
        through = front.point(hole.middle_m, -hole.thickness_m)
        for i, wall in enumerate(self.walls[hole.back]):
            along, off = ((through - wall.start) @ v for v in (wall.along, wall.inward))
            if wall.inward @ front.inward < 0 and abs(off) < 1e-6 and 0 <= along <= wall.length_m:
                return i, float(quantise_m(along))
        raise SchemaError(f"opening at {through} m has no wall of room {hole.back} behind it (is its thickness wrong?)")

    def shell(self, room: int) -> Shell:
        """A room with its openings, in its own frame."""
        origin = self.rooms[room].outline_xy.min(axis=0)
        outline = quantise_m(self.rooms[room].outline_xy - origin)
        holes = []
        for hole in self.openings:
            size = (hole.width_m, hole.low_m, hole.high_m)
            if hole.front == room:
                # x of the object runs against the wall's direction.
                leaf = (-hole.hinge, hole.open_rad) if hole.open_rad > 0 else (0, 0.0)
                holes.append(Opening(hole.kind, hole.wall, hole.middle_m, *size, *leaf))
            elif hole.back == room:
                holes.append(Opening(hole.kind, *self.behind(hole), *size))
        return Shell(outline, self.height_m, tuple(holes), np.asarray(origin))
