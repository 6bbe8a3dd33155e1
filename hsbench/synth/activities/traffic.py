"""Who is where, and will be: walks are checked in space and time before they are begun, so that nobody meets anybody.

People are planned one at a time, whoever is free first. All that has been planned for the others is known, and after it
they stay where they are. A walk or a place that comes too near to any of that is refused. Floor plan, metres; time in
frames.

What a person takes up at rest is a line on the floor: from the free cell where one stands, or got up from, to where one
sits or what one touches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numba
import numpy as np

from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray, IntArray

APART_M = 0.66  # between two of whom one walks; bodies are up to .6 m wide, elbows included
APART_AT_REST_M = 0.68  # between two at rest, who move their elbows: neighbours on a sofa
STRIDE_FRAMES = 2  # walks are compared every so many frames
ROUNDING_M = 1e-6
FEET_AHEAD = 3  # places: .2 s, after which a walker is where a foot is now, and before which where the other one was
SHARE_LEFT = 0.5  # whoever rests leaves everybody else at least this share of the floor to go to


@dataclass(frozen=True, eq=False)
class Stay:
    """From a frame on: a walk over places (n, 2), one every ``STRIDE_FRAMES``, then at rest on a line (2, 2).

    Who moves along a seat, legs ahead, takes up a line at each place: (n, 2, 2).
    """

    start: int
    places: FloatArray
    rest: FloatArray

    @property
    def arrival(self) -> int:
        """The frame from which on one is at rest."""
        return self.start + STRIDE_FRAMES * len(self.places)


@dataclass(frozen=True, eq=False)
class Moved:
    """Cells (nx, ny) that a thing moved by a person takes away from the others from ``start`` until before ``end``."""

    object_id: int
    cells: BoolArray
    start: int
    end: float
    person: int = -1


@dataclass(frozen=True, eq=False)
class Way:
    """A way in over places (n, 2), and cells (nx, ny) that its door needs."""

    places: FloatArray
    cells: BoolArray


class Traffic:
    """The plans of all people on one floor; persons are 0, 1, ..."""

    def __init__(self, walk: WalkMap, reachable: BoolArray, people: int) -> None:
        self.walk, self.reachable = walk, reachable
        self.plans: list[list[Stay]] = [[] for _ in range(people)]
        self.moved: list[Moved] = []
        self.awaited: Way | None = None  # of somebody who is kept outside

    def conflict(self, person: int, start: int, xy: FloatArray, rest: FloatArray) -> str:
        """Why a walk over xy (n, 2), a place or a line (n, 2, 2) a frame, that ends at rest on a line (2, 2) cannot
        begin; "" if it can.
        """
        mine = Stay(start, np.ascontiguousarray(xy[::STRIDE_FRAMES]), rest)
        for other, plans in enumerate(self.plans):
            if other != person and plans and self._meets(mine, plans):
                return f"person {other + 1} is in the way"
        for moved in self.moved:
            if moved.person != person and self._on_cells(mine, moved):
                return f"object {moved.object_id} is in the way"
        return ""

    def refusal(self, person: int, rest: FloatArray) -> str:
        """Why nobody is to be at rest on a line (2, 2) while the others are where they go now; "" if one may."""
        if self._shuts_out(rest):
            return "somebody is to come in there"
        return self.taken(person, rest) or self._shut_in(person, rest)

    def taken(self, person: int, rest: FloatArray) -> str:
        """Why nobody can be on a line (2, 2) for a moment while the others are where they go now; "" if one can."""
        for other, plans in enumerate(self.plans):
            if other != person and plans and _gap2(rest, plans[-1].rest) < (APART_AT_REST_M - ROUNDING_M) ** 2:
                return f"person {other + 1} is there"
        return ""

    def is_asked(self, person: int) -> bool:
        """Whether a person is to finish, for somebody is kept outside by where this one is at rest."""
        return bool(self.plans[person]) and self._shuts_out(self.plans[person][-1].rest)

    def go(self, person: int, start: int, xy: FloatArray, rest: FloatArray) -> None:
        """Plan what ``conflict`` has found free."""
        self.plans[person].append(Stay(start, np.ascontiguousarray(xy[::STRIDE_FRAMES]), rest))

    def settle(self, person: int, start: int, rest: FloatArray) -> None:
        """Take up less than before from a frame on: a line (2, 2) within the one so far."""
        self.go(person, start, np.empty((0, 2)), rest)

    def leave(self, person: int) -> None:
        """A person is there no more; all others have been planned up to now."""
        self.plans[person] = []

    def rests(self, person: int) -> list[FloatArray]:
        """The lines (2, 2) on which the others will be at rest at last."""
        return [plans[-1].rest for other, plans in enumerate(self.plans) if other != person and plans]

    def open_floor(self) -> WalkMap:
        """The cells that one gets to and that no moved object takes away."""
        free = self.reachable.copy()
        for moved in self.moved:
            if moved.end == np.inf:
                free &= ~moved.cells
        return WalkMap(self.walk.origin_xy, free, self.walk.cell_m)

    def can_move(self, person: int, cells: BoolArray, start: int) -> bool:
        """Whether an object that takes away cells (nx, ny) from a frame on is in nobody else's way."""
        moved = Moved(0, cells, start, np.inf)
        others = (plans for other, plans in enumerate(self.plans) if other != person)
        return not any(self._on_cells(stay, moved) for plans in others for stay in _from(plans, start))

    def move(self, object_id: int, cells: BoolArray, start: int) -> None:
        """An object leaves its place."""
        self.moved.append(Moved(object_id, cells, start, np.inf))

    def is_away(self, object_id: int, frame: int) -> bool:
        """Whether a thing is not where it belongs at a frame."""
        return any(m.object_id == object_id and m.start <= frame < m.end for m in self.moved)

    def lend(self, person: int, object_id: int, cells: BoolArray, start: int, end: int) -> None:
        """A person alone may be where a door swings until a frame."""
        self.moved.append(Moved(object_id, cells, start, end, person))

    def move_back(self, object_id: int, end: int) -> None:
        """It is back."""
        self.moved = [replace(m, end=end) if m.object_id == object_id and m.end == np.inf else m for m in self.moved]

    def forget(self, before: int) -> None:
        """Drop what nobody asks for again: all that has ended before a frame."""
        self.plans = [_from(plans, before) for plans in self.plans]
        self.moved = [m for m in self.moved if m.end >= before]

    def _shuts_out(self, rest: FloatArray) -> bool:
        """Whether a rest on a line (2, 2) is where somebody is to come in."""
        if self.awaited is None:
            return False
        index, inside = self.walk.index(rest[:1])
        if inside[0] and self.awaited.cells[tuple(index[0])]:
            return True
        return any(_gap2(rest, np.stack([xy, xy])) < APART_M**2 for xy in self.awaited.places)

    def _meets(self, mine: Stay, plans: list[Stay]) -> bool:
        theirs = _from(plans, mine.start)
        stop = max(mine.arrival, theirs[-1].arrival)
        frames = np.arange(mine.start, stop + 1, STRIDE_FRAMES)
        if len(theirs) > 1 or len(theirs[0].places):
            lines, moving = _lines(theirs, frames)
        else:
            lines, moving = theirs[0].rest[None], np.zeros(1, dtype=np.bool_)
        own, walking = _lines([mine], frames)
        return bool(_too_near(own, walking, lines, moving))

    def _on_cells(self, stay: Stay, moved: Moved) -> bool:
        frames = stay.start + STRIDE_FRAMES * np.arange(len(stay.places) + 1)
        ends = np.append(frames[1:], np.inf)
        points = np.concatenate([stay.places if stay.places.ndim == 2 else stay.places[:, 0], stay.rest[:1]])
        points = points[(frames < moved.end) & (ends > moved.start)]
        index, inside = self.walk.index(points)
        return bool(moved.cells[tuple(index[inside].T)].any())

    def _shut_in(self, person: int, rest: FloatArray) -> str:
        """Whom a rest on a line (2, 2) would keep from most of the floor, the person's self included.

        Whoever has less than that anyway does not count.
        """
        before = [plans[-1].rest if plans else None for plans in self.plans]
        after = [*before[:person], rest, *before[person + 1 :]]
        without = [*before[:person], None, *before[person + 1 :]]
        least = SHARE_LEFT * self.reachable.sum()
        for other, line in enumerate(after):
            if line is None or self._floor_left(other, after) >= least:
                continue
            if other == person and before[person] is None:
                return "one would be shut in"
            if self._floor_left(other, before if other == person else without) >= least:
                return f"it would shut in person {other + 1}"
        return ""

    def _floor_left(self, person: int, lines: Sequence[FloatArray | None]) -> int:
        """Cells that a person gets to when all others are at rest on their lines."""
        free = self.open_floor().free
        for other, line in enumerate(lines):
            if other != person and line is not None:
                _clear_line(free, self.walk.origin_xy, self.walk.cell_m, line, APART_M)
        line = lines[person]
        assert line is not None
        return int(_flooded(free, self.walk.index(line[:1])[0][0]))


def are_apart(a: FloatArray, b: FloatArray) -> bool:
    """Whether two can be at rest on lines (2, 2)."""
    return bool(_gap2(a, b) >= (APART_AT_REST_M - ROUNDING_M) ** 2)


def without_lines(walk: WalkMap, lines: Sequence[FloatArray]) -> WalkMap:
    """The cells that are left beside people at rest on lines (2, 2)."""
    free = walk.free.copy()
    for line in lines:
        _clear_line(free, walk.origin_xy, walk.cell_m, line, APART_M)
    return WalkMap(walk.origin_xy, free, walk.cell_m)


def is_bottleneck(walk: WalkMap, reachable: BoolArray, xy: FloatArray, least_cells: int) -> bool:
    """Whether someone who stands at a point (2,) parts ``least_cells`` or more of the floor from the rest."""
    free = reachable.copy()
    _clear_line(free, walk.origin_xy, walk.cell_m, np.stack([xy, xy]), APART_M)
    return bool(_second_largest(free) >= least_cells)


def _from(plans: list[Stay], frame: int) -> list[Stay]:
    """The plans that last to a frame or later."""
    later = [k for k in range(1, len(plans)) if plans[k].start <= frame]
    return plans[later[-1] :] if later else plans


def _lines(plans: Sequence[Stay], frames: IntArray) -> tuple[FloatArray, BoolArray]:
    """(n,) frames -> (n, 2, 2) what is taken up then, and (n,) whether it is walked.

    A walker takes up the way from where the hind foot is to where the front one is, and so nobody treads on heels.
    """
    lines, moving = np.empty((len(frames), 2, 2)), np.zeros(len(frames), dtype=np.bool_)
    for stay in plans:
        first = int(np.searchsorted(frames, stay.start))
        lines[first:] = stay.rest
        moving[first:] = False
        step = (frames[first:] - stay.start) // STRIDE_FRAMES
        step = step[step < len(stay.places)]
        lines[first : first + len(step)] = _taken_up(stay.places, step)
        moving[first : first + len(step)] = True
        if first > 0 and stay is plans[0]:  # not there yet: as it will be
            lines[:first] = lines[first] if first < len(frames) else stay.rest
    return lines, moving


def _taken_up(places: FloatArray, step: IntArray) -> FloatArray:
    """(n, 2, 2) lines at some steps of places (m, 2), or (m, 2, 2) if lines are given."""
    if places.ndim == 3:
        return np.asarray(places[step])
    last = len(places) - 1
    return np.stack([places[np.maximum(step - FEET_AHEAD, 0)], places[np.minimum(step + FEET_AHEAD, last)]], axis=1)


@numba.njit(cache=True)
def _too_near(own: FloatArray, walking: BoolArray, lines: FloatArray, moving: BoolArray) -> bool:
    """Whether lines (n, 2, 2) ever come too near to others, (n, 2, 2) or (1, 2, 2)."""
    for t in range(len(own)):
        u = min(t, len(lines) - 1)
        limit = APART_M if walking[t] or moving[u] else APART_AT_REST_M
        if _gap2(own[t], lines[u]) < (limit - ROUNDING_M) ** 2:
            return True
    return False


@numba.njit(cache=True)
def _gap2(a: FloatArray, b: FloatArray) -> float:
    """Squared distance of two lines (2, 2)."""
    ux, uy = a[1, 0] - a[0, 0], a[1, 1] - a[0, 1]
    vx, vy = b[1, 0] - b[0, 0], b[1, 1] - b[0, 1]
    wx, wy = b[0, 0] - a[0, 0], b[0, 1] - a[0, 1]
    cross = ux * vy - uy * vx
    if cross != 0.0:
        s, t = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    gap = np.inf
    for k in range(2):
        gap = min(gap, _away2(a[k, 0], a[k, 1], b), _away2(b[k, 0], b[k, 1], a))
    return gap


@numba.njit(cache=True)
def _away2(x: float, y: float, line: FloatArray) -> float:
    """Squared distance of a point from a line (2, 2)."""
    dx, dy = line[1, 0] - line[0, 0], line[1, 1] - line[0, 1]
    length2 = dx * dx + dy * dy
    share = 0.0
    if length2 > 0.0:
        share = min(1.0, max(0.0, ((x - line[0, 0]) * dx + (y - line[0, 1]) * dy) / length2))
    gap_x, gap_y = x - line[0, 0] - share * dx, y - line[0, 1] - share * dy
    return gap_x * gap_x + gap_y * gap_y


@numba.njit(cache=True)
def _clear_line(free: BoolArray, origin: FloatArray, cell: float, line: FloatArray, radius: float) -> None:
    """Clear the cells whose centre is nearer to a line (2, 2) than ``radius``."""
    i0 = max(0, int((min(line[0, 0], line[1, 0]) - radius - origin[0]) / cell) - 1)
    i1 = min(free.shape[0], int((max(line[0, 0], line[1, 0]) + radius - origin[0]) / cell) + 2)
    j0 = max(0, int((min(line[0, 1], line[1, 1]) - radius - origin[1]) / cell) - 1)
    j1 = min(free.shape[1], int((max(line[0, 1], line[1, 1]) + radius - origin[1]) / cell) + 2)
    for i in range(i0, i1):
        for j in range(j0, j1):
            x, y = origin[0] + (i + 0.5) * cell, origin[1] + (j + 0.5) * cell
            if _away2(x, y, line) < (radius - ROUNDING_M) ** 2:
                free[i, j] = False


@numba.njit(cache=True)
def _flooded(free: BoolArray, start: IntArray) -> int:
    """How many free cells one gets to from a cell (2,), which counts itself free."""
    return _take(free.copy(), start)


@numba.njit(cache=True)
def _second_largest(free: BoolArray) -> int:
    """Cells of the second largest connected part of the free cells."""
    left = free.copy()
    largest = second = 0
    start = np.empty(2, dtype=np.int64)
    for i in range(free.shape[0]):
        for j in range(free.shape[1]):
            if left[i, j]:
                start[0], start[1] = i, j
                count = _take(left, start)
                if count > largest:
                    largest, second = count, largest
                elif count > second:
                    second = count
    return second


@numba.njit(cache=True)
def _take(left: BoolArray, start: IntArray) -> int:
    """Count and clear the cells that hang together with a cell (2,)."""
    stack = [(start[0], start[1])]
    left[start[0], start[1]] = False
    count = 0
    while len(stack) > 0:
        i, j = stack.pop()
        count += 1
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            k, m = i + di, j + dj
            if 0 <= k < left.shape[0] and 0 <= m < left.shape[1] and left[k, m]:
                left[k, m] = False
                stack.append((k, m))
    return count
