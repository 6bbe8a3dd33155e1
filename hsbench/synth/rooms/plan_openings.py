"""Doors, passages and windows of a floor plan: between which walls they may be, and where on them they are put.

Every room but the first has one way in, from a room that is already reached; its leaf swings into it and stands open.
The first room has the entrance, closed. Windows are on outer walls only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_angle
from hsbench.geometry.polygons import contains
from hsbench.schema.scene import Room
from hsbench.synth.rooms.plan import OUTSIDE, PlanOpening
from hsbench.synth.rooms.room_kinds import ROOM_KINDS, Range, Windows
from hsbench.synth.rooms.shell import Opening, Wall, rectangles, walls_of
from hsbench.typing import FloatArray

CORNER_M = 0.15  # from a door's opening to a corner of the room: its casing, and a leaf that stands open
WINDOW_CORNER_M = 0.3
BETWEEN_M = 0.3  # from one opening of a wall to the next
ENTRANCE_M, DOOR_M = (0.98, 1.04), (0.9, 0.96)  # widths of openings, with the frame; .83 m or more are clear
WIDE_PASSAGE_M = (1.0, 1.8)
DOOR_HEIGHT_M = (2.02, 2.1)
LINTEL_M = 0.15  # least height of wall above an opening
OPEN_DEG, FAR_OPEN_DEG = (
    (82.0, 90.0),
    (92.0, 100.0),
)  # leaves near a corner stand at the wall beside them, others farther
CLOSED_SWING_RAD = quantise_angle(math.pi / 2)  # floor that a closed door needs to be opened
FAR_M = 0.35  # from the hinge to the corner, for a leaf that is turned beyond the right angle
PAST_LEAF_M = 0.75  # from the tip of a leaf to the wall opposite
INNER_LIMIT_M = 0.25  # walls between rooms are thinner than this
LEAST_WINDOW_M = 0.4  # high
VIEW_M = 3.0  # a window looks out at least so far
NEAR_END_SHARE = 0.75  # of doors stand near an end of their wall, the others anywhere
SMALL_M2 = 8.0  # in rooms below this size doors are always near an end of their wall
TRIED = 24  # places tried for one opening
LEAFLESS_SHARE = 0.4
LEAFLESS = frozenset(("living", "kitchen", "dining"))
"""Rooms that may have a passage without a leaf."""
PRIVATE = frozenset(("bedroom", "study", "office", "meeting"))
"""Rooms that no way should lead through."""
OPEN_PLAN = (("living", "dining"), ("kitchen", "dining"), ("living", "kitchen"))
"""Neighbours that may have a wide passage besides their doors."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Where an opening may be: ``low``..``high`` metres along a wall of a room, towards another room or outside."""

    room: int
    wall: int
    low: float
    high: float
    back: int
    thickness_m: float

    @property
    def length_m(self) -> float:
        """How long it is."""
        return self.high - self.low


@dataclass(eq=False)
class OpeningPlanner:
    """Puts openings into the walls of rooms, one after the other.

    outline_xy: (n, 2) outer outline of the building. outer_m: thickness of its walls.
    """

    rooms: Sequence[Room]
    outline_xy: FloatArray
    outer_m: float
    height_m: float
    rng: np.random.Generator
    openings: list[PlanOpening] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.walls = [walls_of(room.outline_xy) for room in self.rooms]
        self._floors = [rectangles(room.outline_xy) for room in self.rooms]
        self._zones: list[list[tuple[FloatArray, bool]]] = [[] for _ in self.rooms]
        self._door_height = min(self._between(DOOR_HEIGHT_M), round(self.height_m - LINTEL_M, 2))

    def entrance(self, room: int, swings: bool = True) -> None:
        """The closed door to the outside; ``swings``: the floor that its leaf needs to open is kept from other doors.

        Raises SchemaError where no outer wall has the place.
        """
        stretches = [s for s in self.outer(room) if round(s.length_m, 2) >= ENTRANCE_M[0] + 2 * CORNER_M]
        for stretch in self._by_length(stretches):
            if self._way(stretch, "door", self._fitted(ENTRANCE_M, stretch, CORNER_M), CLOSED_SWING_RAD * swings):
                return
        raise SchemaError(f"room {room} of the plan has no outer wall that takes a door of {ENTRANCE_M[0]} m")

    def connect(self, first: int) -> None:
        """Ways such that every room is reached from the first. Raises SchemaError for a room that no wall allows."""
        reached = [first]
        while len(reached) < len(self.rooms):
            rest = [i for i in range(len(self.rooms)) if i not in reached]
            found = [(p, c) for p in reached for c in rest if self.rooms[p].room_type != "bathroom"]
            done = next((c for p, c in sorted(found, key=self._unlikely) if self._join(c, p)), None)
            if done is None:
                names = ", ".join(self.rooms[i].room_type for i in rest)
                raise SchemaError(f"plan: {names} cannot be reached; expected a wall with place for a door")
            reached.append(done)

    @property
    def through_private(self) -> bool:
        """Whether a room is reached through one of ``PRIVATE`` only."""
        ways = (o for o in self.openings if o.kind != "window" and o.back != OUTSIDE)
        return any(self.rooms[o.back].room_type in PRIVATE for o in ways)

    def open_up(self, share: float) -> None:
        """Wide passages between rooms for living, cooking and eating, where they have a common wall."""
        for kinds in OPEN_PLAN:
            for a, b in ((a, b) for a in range(len(self.rooms)) for b in range(len(self.rooms))):
                if (self.rooms[a].room_type, self.rooms[b].room_type) != kinds or self.rng.random() >= share:
                    continue
                if any({o.front, o.back} == {a, b} for o in self.openings):
                    continue
                for stretch in self.between(b, a):
                    wide = self._fitted(WIDE_PASSAGE_M, stretch, CORNER_M)
                    if wide >= WIDE_PASSAGE_M[0] and self._way(stretch, "passage", wide):
                        break

    def windows(self, room: int, blind: FloatArray, count: tuple[int, int] | None = None) -> None:
        """Windows of a room on its outer walls. blind: (k, 2) outward directions without windows."""
        kind = ROOM_KINDS[self.rooms[room].room_type].windows
        low, high = count or kind.count
        wanted = int(self.rng.integers(low, high, endpoint=True))
        stretches = self._by_length(self.lit_walls(room, blind))
        for stretch in (stretches * 2 * wanted)[: 2 * wanted]:
            if wanted and self._window(stretch, kind):
                wanted -= 1

    def lit_walls(self, room: int, blind: FloatArray) -> list[Stretch]:
        """Outer walls of a room where the smallest window of its type fits and looks out."""
        least = ROOM_KINDS[self.rooms[room].room_type].windows.width_m[0] + 2 * WINDOW_CORNER_M
        outer = [s for s in self.outer(room) if s.length_m >= least and self._sees(s)]
        directions = [self.walls[s.room][s.wall].inward for s in outer]
        return [s for s, v in zip(outer, directions, strict=True) if not (blind @ -v > 0.5).any()]

    def between(self, front: int, back: int) -> list[Stretch]:
        """Where the walls of two rooms face each other, longest first."""
        found = []
        for i, wall in enumerate(self.walls[front]):
            for other in self.walls[back]:
                gap = float((wall.start - other.start) @ wall.inward)
                if wall.inward @ other.inward > -0.5 or not 0 < gap <= INNER_LIMIT_M:
                    continue
                ends = [float((p - wall.start) @ wall.along) for p in (other.point(other.length_m, 0.0), other.start)]
                low, high = max(ends[0], 0.0), min(ends[1], wall.length_m)
                if round(high - low, 2) >= DOOR_M[0] + 2 * CORNER_M:
                    found.append(Stretch(front, i, round(low, 2), round(high, 2), back, round(gap, 3)))
        return sorted(found, key=lambda s: -s.length_m)

    def outer(self, room: int) -> list[Stretch]:
        """Where nothing but an outer wall is between a room and the outside."""
        marks = np.concatenate([self.outline_xy, *(r.outline_xy for r in self.rooms)])
        found: list[Stretch] = []
        for i, wall in enumerate(self.walls[room]):
            along = np.round((marks - wall.start) @ wall.along, 3)
            cuts = np.unique(np.clip(along, 0.0, wall.length_m))
            middles = (cuts[1:] + cuts[:-1]) / 2
            beyond = wall.start + middles[:, None] * wall.along - (self.outer_m + 0.001) * wall.inward
            free = np.append(~contains(self.outline_xy, beyond), False)
            begin = None
            for k, is_free in enumerate(free):
                if is_free and begin is None:
                    begin = float(cuts[k])
                elif not is_free and begin is not None:
                    found.append(Stretch(room, i, begin, float(cuts[k]), OUTSIDE, self.outer_m))
                    begin = None
        return found

    def _join(self, child: int, parent: int) -> bool:
        leafless = self.rooms[child].room_type in LEAFLESS and self.rng.random() < LEAFLESS_SHARE
        leafless = leafless and self.rooms[parent].room_type not in PRIVATE
        kind = "passage" if leafless else "door"
        return any(self._way(s, kind, self._fitted(DOOR_M, s, CORNER_M)) for s in self.between(child, parent))

    def _unlikely(self, pair: tuple[int, int]) -> tuple[bool, int, int]:
        """Sort key of (parent, child): from a corridor rather than through a room."""
        return self.rooms[pair[0]].room_type != "corridor", *pair

    def _way(self, stretch: Stretch, kind: str, width: float, closed_rad: float | None = None) -> bool:
        """Put a door or passage somewhere on a stretch; False if it fits nowhere.

        closed_rad: how far a door that is closed must be able to open.
        """
        swings = kind == "door" and closed_rad is None
        for place in self._places(stretch, width, CORNER_M):
            beside = self._beside(stretch, place, width)
            side = 1 if beside[1] <= beside[0] else -1  # along the wall: the leaf opens towards the nearer wall
            far = min(beside) > FAR_M and self.rng.random() < 0.5
            swing = quantise_angle(math.radians(self._between(FAR_OPEN_DEG if far else OPEN_DEG))) if swings else 0.0
            for hinge in (side, -side) if kind == "door" else (side,):
                hole = PlanOpening(
                    kind, stretch.room, stretch.back, stretch.wall, place, width, 0.0, self._door_height,
                    stretch.thickness_m, -hinge, swing,
                )  # fmt: skip
                if swings and beside[max(hinge, 0)] > FAR_M and not self._passes(stretch, place, width):
                    continue
                leaf = (hinge, closed_rad or swing) if closed_rad or swings else (0, 0.0)
                if self._put(hole, Opening(kind, 0, place, width, 0.0, self._door_height, *leaf)):
                    return True
        return False

    def _beside(self, stretch: Stretch, place: float, width: float) -> tuple[float, float]:
        """Metres from either side of an opening to the wall that stands across there, infinite where none does."""
        walls, i = self.walls[stretch.room], stretch.wall
        wall, before, after = walls[i], walls[i - 1], walls[(i + 1) % len(walls)]
        low = place - width / 2 if wall.along @ before.inward > 0 else math.inf
        high = wall.length_m - place - width / 2 if after.along @ wall.inward > 0 else math.inf
        return low, high

    def _passes(self, stretch: Stretch, place: float, width: float) -> bool:
        """Whether a body gets by between the tip of a leaf that stands in the room and the wall opposite."""
        wall = self.walls[stretch.room][stretch.wall]
        corners = np.array([wall.point(place + s * width / 2, d) for s, d in ((-1, 0.0), (1, width + PAST_LEAF_M))])
        return self._holds(stretch.room, np.sort(corners, axis=0))

    def _window(self, stretch: Stretch, kind: Windows) -> bool:
        width = self._fitted(kind.width_m, stretch, WINDOW_CORNER_M)
        sill = self._between(kind.sill_m)
        high = round(min(sill + self._between(kind.height_m), self.height_m - LINTEL_M), 2)
        if high - sill < LEAST_WINDOW_M:
            return False
        for place in self._places(stretch, width, WINDOW_CORNER_M, central=True):
            hole = PlanOpening("window", stretch.room, OUTSIDE, stretch.wall, place, width, sill, high, self.outer_m)
            if self._put(hole, Opening("window", 0, place, width, sill, high)):
                return True
        return False

    def _put(self, hole: PlanOpening, front: Opening) -> bool:
        """Take an opening into the plan if it meets no other one's leaf, and its own leaf stays in the room."""
        wall = self.walls[hole.front][hole.wall]
        sides = [(hole.front, wall, front)]
        if hole.back != OUTSIDE:
            # The same opening on the other face of the wall, seen from there.
            through = Wall(wall.point(0.0, -hole.thickness_m), wall.along, -wall.inward, wall.length_m)
            sides.append((hole.back, through, Opening(hole.kind, 0, hole.middle_m, hole.width_m, 0.0, hole.high_m)))
        zones = []
        for room, face, opening in sides:
            corners = opening.zone(face, hole.width_m)[0]
            box = np.stack([corners.min(axis=0), corners.max(axis=0)])
            if any((leaf or opening.hinge) and _overlap(box, other) for other, leaf in self._zones[room]):
                return False
            if opening.hinge and not self._holds(room, box):
                return False
            zones.append((room, box, bool(opening.hinge)))
        for other in self.openings:
            if self._apart(other, wall, hole) < BETWEEN_M:
                return False
        for room, box, leaf in zones:
            self._zones[room].append((box, leaf))
        self.openings.append(hole)
        return True

    def _apart(self, other: PlanOpening, wall: Wall, hole: PlanOpening) -> float:
        """Free wall between two openings where they are in one wall, else infinity."""
        theirs = self.walls[other.front][other.wall]
        off = abs(float((theirs.start - wall.start) @ wall.inward))
        if abs(float(theirs.inward @ wall.inward)) < 0.5 or off > max(hole.thickness_m, other.thickness_m) + 1e-6:
            return math.inf
        middle = float((theirs.point(other.middle_m, 0.0) - wall.start) @ wall.along)
        return abs(middle - hole.middle_m) - (hole.width_m + other.width_m) / 2

    def _holds(self, room: int, box: FloatArray) -> bool:
        """Whether a box (2, 2) lies in a room: as much of it as its area."""
        inside = 0.0
        for floor in self._floors[room]:
            inside += float(np.prod(np.maximum(np.minimum(box[1], floor[2]) - np.maximum(box[0], floor[0]), 0)))
        return inside >= float(np.prod(box[1] - box[0])) - 1e-6

    def _sees(self, stretch: Stretch) -> bool:
        """Whether nothing stands close before a window on a stretch: no wing of the same building."""
        wall = self.walls[stretch.room][stretch.wall]
        steps = np.arange(self.outer_m + 0.1, VIEW_M, 0.2)
        ahead = wall.point((stretch.low + stretch.high) / 2, 0.0) - steps[:, None] * wall.inward
        return not bool(contains(self.outline_xy, ahead).any())

    def _places(self, stretch: Stretch, width: float, margin: float, central: bool = False) -> Iterator[float]:
        """Middles of an opening on a stretch, whole centimetres, near an end or near the middle of it first."""
        low, high = stretch.low + margin + width / 2, stretch.high - margin - width / 2
        if high < low - 1e-9:
            return
        small = self.rooms[stretch.room].area_m2 < SMALL_M2
        near_end, first_end = small or self.rng.random() < NEAR_END_SHARE, self.rng.random() < 0.5
        for k in range(TRIED):
            share = self.rng.random()
            if central:
                share = 0.5 + (share - 0.5) * (k + 1) / TRIED
            elif near_end:
                share *= k / TRIED
            yield round(float(low + (high - low) * (share if first_end else 1 - share)), 2)

    def _by_length(self, stretches: Sequence[Stretch]) -> list[Stretch]:
        """Stretches in random order, long ones rather first."""
        weight = [-s.length_m * (0.5 + self.rng.random()) for s in stretches]
        return [stretches[i] for i in sorted(range(len(stretches)), key=lambda i: weight[i])]

    def _fitted(self, sizes: Range, stretch: Stretch, margin: float) -> float:
        """A width from a range, no wider than a stretch allows, whole centimetres."""
        return min(self._between(sizes), round(stretch.length_m - 2 * margin, 2))

    def _between(self, sizes: Range) -> float:
        """A value from a range, two decimals: lengths are whole centimetres."""
        return round(float(sizes[0] + (sizes[1] - sizes[0]) * self.rng.random()), 2)


def _overlap(a: FloatArray, b: FloatArray) -> bool:
    """Whether two boxes (2, 2) of lowest and highest corner overlap."""
    return bool((np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) > 1e-6).all())
