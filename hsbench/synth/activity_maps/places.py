"""Where a life in the plane goes: spots of the floor, seats, parts to touch, and for each a field of steps towards it.

All of it follows from the affordance truth: seats are the places where shoulders of sitters are, parts are touched at
points that a hand reaches. The frame is the scene's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.schema.states import Affordance
from hsbench.synth.people.navigation import costs_from
from hsbench.truth.affordance import AffordanceScene
from hsbench.truth.reach import REACH_M
from hsbench.truth.sittable import SHOULDER_STANDING_M
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

EXPLORE, SIT, TOUCH = 0, 1, 2  # kinds of places
SPOTS = 32  # places of the floor that are visited for their own sake
SEAT_WIDTH_M = 0.55  # from one sitter to the next
NEAR_SEAT_M = 1.0  # from a sitter to the cell one comes from: .7 m (task affordance-topdown) from a patch of .35 m
HANDS_PER_PART = 3
MOST_HANDS = 64  # in one scene
STAND_OFF_M = 0.4  # from a hand's point to the body before it, if the floor allows
WRIST_M = 0.18  # from a finger tip to the wrist: .108 of 1.7 m (Drillis & Contini, after Winter)


@dataclass(frozen=True, eq=False)
class Places:
    """K places of a scene. kind: (K,) ``EXPLORE``, ``SIT`` or ``TOUCH``. body_xy: (K, 2) where a body is that stays.

    shoulder_m: (K,) height of its shoulders. hand_xy: (K, 2) the point of the part that is touched, else the body's.
    group: (K,) what is liked or not as a whole: places of one part have one number.
    cell: (K,) int64 flat cell of the walk map from which the place is taken.
    toward: (K, nx * ny) int32 the next flat cell on the way to ``cell``; -1 there and where no way leads.
    beside: (K, m) bool, whether who sits here has touch place ``touches[m]`` within reach.
    """

    walk: WalkMap
    kind: IntArray
    body_xy: FloatArray
    shoulder_m: FloatArray
    hand_xy: FloatArray
    group: IntArray
    cell: IntArray
    toward: Int32Array
    beside: BoolArray

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def touches(self) -> IntArray:
        """Indices of the touch places."""
        return np.flatnonzero(self.kind == TOUCH)


def find_places(found: AffordanceScene, rng: np.random.Generator) -> Places:
    """The places of a scene; of many parts to touch some are drawn. A scene without a walkable cell has none."""
    walk = found.walk
    cells, centres = np.flatnonzero(walk.free.ravel()), walk.centres().reshape(-1, 2)
    spots = cells[_spread(centres[cells], SPOTS)]
    seats, seat_cell = _kept(_seats(found), lambda seat: _nearest(seat[:, :2], centres, cells, NEAR_SEAT_M))
    touched, hand_cell = _kept(_hands(found, rng), lambda hand: _before(hand, centres, cells))
    hands = touched[:, :3]
    counts = (len(spots), len(seats), len(hands))
    floor, sitting = counts[0], counts[0] + counts[1]  # where seats and hands begin
    cell = np.concatenate([spots, seat_cell, hand_cell])
    body = np.concatenate([centres[spots], seats[:, :2], centres[hand_cell]])
    shoulder = np.full(len(cell), SHOULDER_STANDING_M)
    shoulder[floor:sitting] = seats[:, 2]
    beside = np.zeros((len(cell), counts[2]), dtype=np.bool_)
    beside[floor:sitting] = np.linalg.norm(seats[:, None] - hands, axis=-1).round(6) <= REACH_M
    return Places(
        walk,
        np.repeat((EXPLORE, SIT, TOUCH), counts),
        body,
        shoulder,
        np.concatenate([body[:sitting], hands[:, :2]]),
        np.concatenate([np.arange(sitting), sitting + touched[:, 6].astype(np.int64)]),
        cell,
        _fields(walk, cell),
        beside,
    )


def _kept(rows: FloatArray, cell_of: Callable[[FloatArray], IntArray]) -> tuple[FloatArray, IntArray]:
    """The rows for which there is a cell, and the cells."""
    cell = cell_of(rows)
    return rows[cell >= 0], cell[cell >= 0]


def wrist(hand_xy: FloatArray, body_xy: FloatArray) -> FloatArray:
    """(2,) finger tips and body -> (2,) the wrist, behind the tips on the way to the body."""
    away = body_xy - hand_xy
    return np.asarray(hand_xy + away * (WRIST_M / max(float(np.hypot(*away)), WRIST_M)))


def _spread(points: FloatArray, count: int) -> IntArray:
    """Indices of up to ``count`` of (N, 2) points, each the farthest from those before it; the first is the first."""
    if not len(points):
        return np.empty(0, dtype=np.int64)
    chosen = [0]
    away = ((points - points[0]) ** 2).sum(axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(away.round(6))))
        away = np.minimum(away, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return np.array(chosen, dtype=np.int64)


def _seats(found: AffordanceScene) -> FloatArray:
    """(S, 3) shoulders of sitters, one for each width of a sitter that a seat offers."""
    points = np.concatenate([np.empty((0, 3)), *(group.points_m for group in found.shoulders[1:])])
    chosen: list[int] = []
    for k, point in enumerate(points):
        if not chosen or np.hypot(*(points[chosen, :2] - point[:2]).T).min().round(6) >= SEAT_WIDTH_M:
            chosen.append(k)
    return points[chosen]


def _hands(found: AffordanceScene, rng: np.random.Generator) -> FloatArray:
    """(H, 7) points of parts for hands, normals there, numbers of the parts: a few of each, ``MOST_HANDS`` in all."""
    patches = found.patches
    patch = rng.permutation(np.flatnonzero(found.labels & (1 << Affordance.INTERACTABLE)))
    owner = patches.owner[patch]
    order = np.argsort(owner, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.searchsorted(owner[order], owner[order])
    few = patch[np.flatnonzero(rank < HANDS_PER_PART)[:MOST_HANDS]]
    return np.column_stack([patches.point[few], patches.normal[patches.face[few]], patches.owner[few]])


def _nearest(points: FloatArray, centres: FloatArray, cells: IntArray, limit_m: float) -> IntArray:
    """(N,) the flat cell of ``cells`` whose centre is nearest to each point (N, 2), -1 where none is within a limit."""
    if not len(cells):
        return np.full(len(points), -1, dtype=np.int64)
    away = np.linalg.norm(points[:, None] - centres[cells], axis=-1).round(6)
    best = away.argmin(axis=1)
    return np.where(away[np.arange(len(points)), best] <= limit_m, cells[best], -1)


def _before(hands: FloatArray, centres: FloatArray, cells: IntArray) -> IntArray:
    """(H,) the flat cell to stand on for a hand at each of ``_hands``: that nearest to ``STAND_OFF_M`` before its face
    if a shoulder there has it in reach, else -1.
    """
    cell = _nearest(hands[:, :2] + STAND_OFF_M * hands[:, 3:5], centres, cells, np.inf)
    shoulder = np.column_stack([centres[cell], np.full(len(cell), SHOULDER_STANDING_M)])
    return np.where(np.linalg.norm(shoulder - hands[:, :3], axis=1).round(6) <= REACH_M, cell, -1)


def _fields(walk: WalkMap, cell: IntArray) -> Int32Array:
    """(K, nx * ny) int32 next cells towards each of (K,) flat cells."""
    centres = walk.centres().reshape(-1, 2)
    different, which = np.unique(cell, return_inverse=True)
    steps = [costs_from(walk, centres[c])[1].ravel().astype(np.int32) for c in different]
    return np.array(steps, dtype=np.int32).reshape(len(different), walk.free.size)[which]


@numba.njit(cache=True)
def follow(
    toward: Int32Array, start: int, columns: int, origin: FloatArray, cell_m: float, stride_m: float, out: FloatArray
) -> int:
    """Walk down a field from a flat cell, writing a position every ``stride_m`` into ``out`` (T, 2) until it is full.

    The first position is one stride away from the start. Returns how many were written before the goal.
    """
    at, count, due = start, 0, stride_m
    while count < len(out) and toward[at] >= 0:
        x, y = at // columns, at % columns
        at = toward[at]
        dx, dy = at // columns - x, at % columns - y
        length = cell_m * np.sqrt(float(dx * dx + dy * dy))
        while due <= length and count < len(out):
            out[count, 0] = origin[0] + (x + 0.5 + dx * due / length) * cell_m
            out[count, 1] = origin[1] + (y + 0.5 + dy * due / length) * cell_m
            count += 1
            due += stride_m
        due -= length
    return count
