"""One who explores tries all of a seat: moves from place to place on it until its whole surface has been sat on.

Sat on is what lies within ``truth.revealed.SEAT_M`` of a pelvis, of the surface where it is at t0. On a bed one gets
deeper in than the legs reach to the floor, and lays them on it.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.distance import cdist

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.states import Action
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.diary import rows_of
from hsbench.synth.activities.drawing import log_shifts
from hsbench.synth.activities.seating import PULLS_M
from hsbench.synth.activities.seats import DEEPEST_M, Seat, Surface, deepest, facing_of
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose_block
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.lounging import shuffle
from hsbench.synth.people.motion import stand
from hsbench.truth.revealed import SEAT_M
from hsbench.typing import BoolArray, FloatArray, UInt8Array

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person

CELL_M = 0.05
LONG_M, EVERY = 1.0, 2  # what is longer is sat on at its rim, and within at every second cell along and across
INSET_M = 0.10  # of a pelvis from the edges of what is sat on, at least, where it is wide enough
LEAST_CELLS = 2  # a place is worth moving to that adds so many
STRIDE_M = 0.15  # one moves along a seat in steps no longer than this
STRIDE_S = 0.7
MOMENT_S = 0.5  # one stays at each place for this long
TUCKS_M = (0.0, 0.12, 0.24)  # feet are drawn up by so much where they would be in the way, with less if that will do
CHECK_FPS = 10.0  # a way is looked at so often
GRAZE_M = 0.025
SUNK_M = 0.01  # a pelvis that its legs draw down by more has lost its seat
ROOF_M, ROOF_SHARE = (0.3, 1.0), 0.5  # how high over a seat, and over how much of it, an upper bunk is in the way


@dataclass(frozen=True, eq=False)
class Spots:
    """A seat's surface at t0, scene frame. cells: (N, 2) centres. places: (M, 2) where a pelvis may be, some of them.

    outline: (E, 3) unit normals and offsets, with n x + d <= 0 inside. near: (M, N) float32, 1 for the cells that are
    sat on from a place, so that a product counts.

    sat: (N,) bool, by anybody so far: the one thing that changes.
    """

    cells: FloatArray
    places: FloatArray
    outline: FloatArray
    near: FloatArray
    sat: BoolArray

    @classmethod
    def of(cls, surface: Surface) -> Spots:
        """Those of a convex part."""
        low, high = surface.part.vertices[:, :2].min(axis=0), surface.part.vertices[:, :2].max(axis=0)
        middle, counts = (low + high) / 2, ((high - low) / 2 / CELL_M).astype(np.int64)
        index = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in counts.tolist()), indexing="ij"), axis=-1)
        index = index.reshape(-1, 2)
        xy = _on_floor_plan(surface, middle + CELL_M * index)
        outline = ConvexHull(_on_floor_plan(surface, surface.part.vertices[:, :2])).equations
        inset = np.round(_inset(xy, outline), 6)
        every = EVERY if (high - low).max() > LONG_M else 1
        at_rim = (inset >= INSET_M) & (inset < INSET_M + CELL_M)
        cells, places = xy[inset >= 0.0], xy[(inset >= 0.0) & ((index % every == 0).all(axis=1) | at_rim)]
        near = (np.round(cdist(places, cells), 6) <= SEAT_M).astype(np.float32)
        return cls(cells, places, outline, near, np.zeros(len(cells), dtype=np.bool_))

    def holds(self, shift_xy: FloatArray) -> BoolArray:
        """(M,) bool: the places at which one is over the seat when it has been moved."""
        inset = np.round(_inset(self.places - shift_xy, self.outline), 6)
        return np.asarray(inset >= min(INSET_M, float(inset.max(initial=0.0))))

    def gains(self) -> FloatArray:
        """(M,) how many cells are sat on anew from each place."""
        return np.asarray(self.near @ (~self.sat).astype(np.float32))

    def sit(self, pelvis_xy: FloatArray) -> None:
        """Somebody sits over a point (2,)."""
        self.sat[np.round(np.sum((self.cells - pelvis_xy) ** 2, axis=1), 6) <= SEAT_M**2] = True


def is_roofed(surface: Surface) -> bool:
    """Whether something of the same object hangs over most of a seat, so low that one does not move along below it."""
    seat = surface.part.vertices
    low, high = seat[:, :2].min(axis=0), seat[:, :2].max(axis=0)
    for part in surface.item.parts:
        if part.solid is None or not ROOF_M[0] < part.vertices[:, 2].min() - seat[:, 2].max() < ROOF_M[1]:
            continue
        shared = np.minimum(high, part.vertices[:, :2].max(axis=0)) - np.maximum(low, part.vertices[:, :2].min(axis=0))
        if (shared > 0).all() and shared.prod() > ROOF_SHARE * (high - low).prod():
            return True
    return False


def _on_floor_plan(surface: Surface, local_xy: FloatArray) -> FloatArray:
    """(N, 2) points of the object's frame, scene frame."""
    return quantise_m(apply(surface.item.scene_T_object, np.pad(local_xy, ((0, 0), (0, 1))))[:, :2])


def _inset(xy: FloatArray, outline: FloatArray) -> FloatArray:
    """(N,) how far points lie within an outline."""
    return np.asarray(-(xy @ outline[:, :2].T + outline[:, 2]).max(axis=1))


def is_tried(person: Person, surface: Surface) -> bool:
    """Whether there is nothing left to try of a surface, for this body."""
    spots = person.places.spots(surface)
    if id(surface) in person.unfit or spots is None:
        return id(surface) in person.unfit or (surface.item.object_id, surface.part.name) in person.places.tried
    found = person.room.get(id(surface))
    gains = spots.gains() if found is None else spots.gains()[found.any(axis=0)]
    return bool(gains.max(initial=0.0) < LEAST_CELLS)


def try_all(person: Person, surface: Surface, seat: Seat, end: int) -> Generator[None, None, None]:
    """From sitting on a seat to where nobody has sat, place by place, until a frame; and back again.

    A seat that has been drawn back is moved along, to where it was and in between.
    """
    spots = person.places.spots(surface)
    if spots is None:
        return
    diary, start = person.diary, Place(person.diary.here.xy[0], np.array(seat.shift_xy))
    shifts, found = _shifts(surface, seat), person.room.get(id(surface))
    if found is None or len(found) < len(shifts):
        found = person.room[id(surface)] = np.stack([room(person, surface, spots, xy) for xy in shifts])
    spots.sit(start.pelvis_xy)
    here, done = start, list[tuple[Channels, Place]]()
    while diary.frame < end and not person.traffic.is_asked(person.number):
        best = _best(spots, found[: len(shifts)], shifts, here)
        if best is None:
            break
        goal = Place(spots.places[best[1]], shifts[best[0]], TUCKS_M[found[best] - 1])
        way = next((way for way in _ways(person, surface, here, goal) if _is_sound(person, surface, goal, way)), None)
        if way is None:
            found[best] = (found[best] + 1) % (len(TUCKS_M) + 1)  # with the feet drawn up more, and then not at all
            continue
        if not _go(person, surface, here, goal, way, _lines(way)[-1]):
            break
        done.append((way, here))
        spots.sit(goal.pelvis_xy)
        here = goal
        yield
    back = (way for way in _ways(person, surface, here, start) if _is_sound(person, surface, start, way))
    straight = next(back, None)
    if straight is not None:
        done = [(straight, start)] if done else []
    else:
        done = [(way.backwards(), place) for way, place in done[::-1]]
    for way, there in done:
        while not _go(person, surface, here, there, way, seat.line if there is start else _lines(way)[-1]):
            yield from person.hold(MOMENT_S, Action.SIT)
        here = there
        yield


@dataclass(frozen=True, eq=False)
class Place:
    """Where one sits: the pelvis (2,), how far the seat has been moved (2,), scene frame, and the feet drawn up."""

    pelvis_xy: FloatArray
    shift_xy: FloatArray
    tuck_m: float = 0.0


def _shifts(surface: Surface, seat: Seat) -> list[FloatArray]:
    """How far a seat may be moved while one sits on it: (2,) each, no farther than it has been drawn."""
    if not seat.is_drawn:
        return [np.zeros(2)]
    drawn_m = max(float(np.sqrt(np.sum(np.square(xy)))) for xy in (seat.entry_xy, seat.shift_xy))
    return [quantise_m(-pull_m * facing_of(surface)) for pull_m in PULLS_M if pull_m <= drawn_m + CELL_M]


def _best(spots: Spots, found: UInt8Array, shifts: list[FloatArray], here: Place) -> tuple[int, int] | None:
    """The shift and the cell that add most in the time it takes to get there; None if none adds enough."""
    gains = np.where(found > 0, spots.gains(), 0.0)
    away_m = np.sqrt(np.sum((spots.places - here.pelvis_xy) ** 2, axis=1))
    moved_m = np.sqrt(np.sum((np.array(shifts) - here.shift_xy) ** 2, axis=1))
    cost_s = MOMENT_S + STRIDE_S * (away_m + moved_m[:, None]) / STRIDE_M
    value = np.round(np.where(gains < LEAST_CELLS, 0.0, gains / cost_s), 6)
    row, cell = np.unravel_index(int(np.argmax(value)), value.shape)
    return (int(row), int(cell)) if value[row, cell] > 0.0 else None


def _ways(person: Person, surface: Surface, here: Place, goal: Place) -> Iterator[Channels]:
    """Along a seat to a place: in steps, and, between the floor and a bed, with one swing of the legs."""
    away = goal.pelvis_xy - here.pelvis_xy
    steps = max(1, int(np.ceil(np.round(np.sqrt(np.sum(away**2)) / STRIDE_M, 6))))
    chunks, body, fps = [person.diary.here], person.body, person.fps
    for k in range(steps):
        xy = quantise_m(here.pelvis_xy + (k + 1) / steps * away)
        chunks.append(shuffle(body, chunks[-1], xy, _ground_m(surface, xy, body), STRIDE_S, fps, goal.tuck_m))
    yield concatenate(chunks[1:])
    ground_m = _ground_m(surface, goal.pelvis_xy, body)
    if steps > 1 and ground_m != _ground_m(surface, here.pelvis_xy, body):
        yield shuffle(body, chunks[0], goal.pelvis_xy, ground_m, STRIDE_S * steps, fps, goal.tuck_m)


def _lines(way: Channels) -> FloatArray:
    """(n, 2, 2) what one takes up on a way along a seat: from between the feet to the pelvis."""
    return np.stack([way.feet.ball.mean(axis=1)[:, :2], way.xy], axis=1)


def _go(person: Person, surface: Surface, here: Place, goal: Place, way: Channels, line: FloatArray) -> bool:
    """Stay a moment, and move to a place, with the seat, to take up a line (2, 2) there; unless that is too near to
    others or to where they get up.
    """
    diary, traffic, number = person.diary, person.traffic, person.number
    pause = stand(diary.here, MOMENT_S, person.fps)
    lines = np.concatenate([_lines(pause), _lines(way)])
    if not person.is_apart(line) or traffic.conflict(number, diary.frame, lines, line):
        return False
    traffic.go(number, diary.frame, lines, line)
    diary.add(pause, Action.SIT)
    if (goal.shift_xy != here.shift_xy).any():
        log_shifts(person, surface, here.shift_xy, goal.shift_xy, len(way))
        person.obstacles = person.places.setting(surface.item, goal.shift_xy).obstacles
    diary.add(way, Action.SIT)
    return True


def room(person: Person, surface: Surface, spots: Spots, shift_xy: FloatArray) -> UInt8Array:
    """(M,) the places over a moved seat where the body runs into nothing, sitting as now: 1 with feet as usual, then
    as many more as of ``TUCKS_M`` it takes; 0 where it finds no room.
    """
    found = np.zeros(len(spots.places), dtype=np.uint8)
    left = spots.holds(shift_xy)
    for k, tuck_m in enumerate(TUCKS_M):
        found[_fits(person, surface, spots, shift_xy, left, tuck_m)] = k + 1
        left &= found == 0
    return found


def _fits(
    person: Person, surface: Surface, spots: Spots, shift_xy: FloatArray, asked: BoolArray, tuck_m: float
) -> BoolArray:
    """(M,) bool: those of the places asked for where the body runs into nothing."""
    fits, here = asked.copy(), person.diary.here
    allowed = np.maximum(GRAZE_M, _depth(person, person.obstacles, here))
    there = person.places.setting(surface.item, shift_xy).obstacles
    ground_m = np.array([_ground_m(surface, xy, person.body) for xy in spots.places])
    for height_m in sorted(set(ground_m[fits].tolist())):
        rows = np.flatnonzero(fits & (ground_m == height_m))
        at_one = shuffle(person.body, here, spots.places[rows[0]], height_m, STRIDE_S, person.fps, tuck_m).last()
        xy = spots.places[rows]
        away = np.pad(xy - xy[0], ((0, 0), (0, 1)))[:, None]
        at_all = at_one.hold(len(rows))
        at_all = replace(at_all, xy=xy, feet=replace(at_all.feet, ball=at_all.feet.ball + away))
        fits[rows] = (_depth(person, there, at_all) <= allowed).all(axis=1)
    return fits


def _ground_m(surface: Surface, pelvis_xy: FloatArray, body: Body) -> float:
    """How high the feet of who sits over a point (2,) are put: on the floor, or on the bed if one sits deep in it."""
    if surface.part.role != "mattress":
        return 0.0
    facing = facing_of(surface)
    edge_m = float((apply(surface.item.scene_T_object, surface.part.vertices)[:, :2] @ facing).max())
    return surface.top_m if edge_m - pelvis_xy @ facing > min(DEEPEST_M, deepest(surface, body)) else 0.0


def _is_sound(person: Person, surface: Surface, goal: Place, way: Channels) -> bool:
    """Whether a motion runs into nothing, keeps to the joints' ranges, and leaves the pelvis on its seat.

    While a seat moves along with who sits on it, it is in no way. Who is in touch with something may stay so.
    """
    there = person.places.setting(surface.item, goal.shift_xy).obstacles
    still = there if there is person.obstacles else person.places.without(surface.item)
    rows = slice(None, None, max(1, round(person.fps / CHECK_FPS)))
    allowed = np.maximum(GRAZE_M, _depth(person, still, way.part(0, 1)))
    if any((_depth(person, o, part) > allowed).any() for o, part in ((there, way.last()), (still, rows_of(way, rows)))):
        return False
    joints = _joints(person, rows_of(way, rows))
    sunk_m = np.abs(joints[:, J["spine_base"], 2] - way.height[rows])
    return bool((sunk_m <= SUNK_M).all() and not limit_violations(joints).any())


def _depth(person: Person, obstacles: Obstacles, frames: Channels) -> FloatArray:
    return body_depth(obstacles, person.body, _joints(person, frames), person.used_id)


def _joints(person: Person, frames: Channels) -> FloatArray:
    return pose_block(person.body, frames, 0, 1.0, None)
