"""What use reveals over time: when, how long and how often each place was used, and shares revealed as curves.

A place walked on was free to walk, a place sat on was a seat, a place touched was in reach. All functions take arrays,
so that they serve captures with known poses as well as generated truth. Our own definitions:

- a body uses the floor within ``FEET_M`` of its pelvis while it stands or interacts without a seat below it;
- a seat is used within ``SEAT_M`` of the pelvis while an event of the person says that the pelvis is in contact;
- a part is used within ``HAND_M`` of a finger tip while an event says that this hand is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.events import EventTable
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import SKELETONS
from hsbench.schema.states import Action, Affordance
from hsbench.truth.sittable import PATCH_M
from hsbench.truth.walkable import RADIUS_M
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, Int32Array, UInt8Array

FEET_M = RADIUS_M  # the body of task affordance-topdown
SEAT_M = PATCH_M / 2  # its clear patch of a seat
HAND_M = 0.10  # half the length of a hand, about a finger tip
GAP_S = 0.5  # moments of a person farther apart than this do not join: nobody knows what was between
HANDS = {"hand_left": "hand_tip_left", "hand_right": "hand_tip_right"}  # contact of an event: joint
PELVIS = "spine_base"


@dataclass(frozen=True, eq=False)
class CellUse:
    """Use of each cell of a plan, rows and columns as ``AffordanceTruth`` has them.

    first_s: (h, w) float32 seconds after t0, +inf = never. dwell_s: (h, w) float32 seconds of all persons together.
    visits: (h, w) int32, how often a person came, having been elsewhere or unseen before.
    """

    first_s: Float32Array
    dwell_s: Float32Array
    visits: Int32Array


def cell_use(
    position_xy: FloatArray, times_s: FloatArray, person: AnyArray, radius_m: float, side_cells: int, cell_m: float
) -> CellUse:
    """(N, 2) places in the episode frame, (N,) seconds after t0 and (N,) persons, rows by time -> use of each cell
    whose centre lies within a radius.

    A moment lasts until the person's next one, ``GAP_S`` at most, and the last one no time. A visit goes on while the
    moments of a person that follow each other within ``GAP_S`` hold the cell. Raises SchemaError for rows out of order.
    """
    times = np.ascontiguousarray(times_s, dtype=np.float64)
    if (np.diff(times) < 0).any():
        raise SchemaError("times_s decrease; expected rows ordered by time")
    first = np.full((side_cells, side_cells), np.inf)
    dwell, visits = np.zeros(first.shape), np.zeros(first.shape, dtype=np.int32)
    for number in np.unique(person):
        rows = np.flatnonzero(np.asarray(person) == number)
        cells = side_cells / 2 - np.ascontiguousarray(position_xy[rows]) / cell_m - 0.5
        _use(cells, times[rows], radius_m / cell_m, first, dwell, visits)
    return CellUse(first.astype(np.float32), dwell.astype(np.float32), visits)


def revealed(
    poses: PoseTable, action: UInt8Array, events: EventTable, t0_ns: int, side_cells: int, cell_m: float
) -> dict[Affordance, CellUse]:
    """True poses with (N,) actions and events -> use of the floor, of seats and of parts for hands, per cell.

    Poses are 3D; an event counts for its person from its first to its last moment. Raises SchemaError for poses without
    metres or a skeleton without the joints of ``PELVIS`` and ``HANDS``.
    """
    if poses.joints_m is None:
        raise SchemaError("poses have no joints in metres; expected true poses")
    names = SKELETONS[poses.skeleton].names
    missing = sorted({PELVIS, *HANDS.values()}.difference(names))
    if missing:
        raise SchemaError(f"skeleton {poses.skeleton} has no joint {', '.join(missing)}; expected kinect-v2-25")
    seated = in_contact(poses, events, "pelvis")
    upright = np.isin(action, (Action.STAND, Action.INTERACT)) & ~seated
    touching = {tip: in_contact(poses, events, hand) for hand, tip in HANDS.items()}
    return {
        kind: _joint_use(poses, t0_ns, held, radius_m, side_cells, cell_m)
        for kind, held, radius_m in (
            (Affordance.WALKABLE, {PELVIS: upright}, FEET_M),
            (Affordance.SITTABLE, {PELVIS: seated}, SEAT_M),
            (Affordance.INTERACTABLE, touching, HAND_M),
        )
    }


def _joint_use(
    poses: PoseTable, t0_ns: int, held: Mapping[str, BoolArray], radius_m: float, side_cells: int, cell_m: float
) -> CellUse:
    """Use about joints by name, each in some (N,) of the poses. Each joint of a person comes and goes by itself."""
    assert poses.joints_m is not None
    names = SKELETONS[poses.skeleton].names
    row = np.concatenate([np.flatnonzero(rows) for rows in held.values()])
    joint = np.repeat([names.index(name) for name in held], [rows.sum() for rows in held.values()])
    order = np.argsort(poses.timestamp_ns[row], kind="stable")
    row, joint = row[order], joint[order]
    limb = poses.track_id[row].astype(np.int64) * len(names) + joint
    seconds = (poses.timestamp_ns[row] - t0_ns) / NS_PER_S
    return cell_use(poses.joints_m[row, joint, :2].astype(np.float64), seconds, limb, radius_m, side_cells, cell_m)


def in_contact(poses: PoseTable, events: EventTable, contact: str) -> BoolArray:
    """(N,) bool: an event says at the time of each pose that this part of the person's body is in contact."""
    held = np.zeros(len(poses), dtype=np.bool_)
    first = np.searchsorted(poses.timestamp_ns, events.start_ns, side="left")
    stop = np.searchsorted(poses.timestamp_ns, events.end_ns, side="right")
    for k, parts in enumerate(events.contact):
        if contact in parts.split(","):
            now = slice(first[k], stop[k])
            held[now] |= poses.track_id[now] == events.person_id[k]
    return held


def share_by_time(first_s: AnyArray, of: BoolArray, times_s: Sequence[float]) -> FloatArray | None:
    """Seconds (...) at which each cell or voxel was first used or swept, +inf = never -> (T,) share of those ``of``
    (...) bool that were so by each time, the time included. None where there are none: a ratio without a denominator.

    Of a plan: ``of`` are the cells with a label that are not ignored; of voxels those with state OCCLUDED.
    """
    if np.shape(first_s) != np.shape(of):
        raise SchemaError(f"of has shape {np.shape(of)}; expected {np.shape(first_s)} as first_s")
    chosen = np.asarray(first_s)[of]
    if not len(chosen):
        return None
    return np.array([(chosen <= chosen.dtype.type(time)).mean() for time in times_s])


@numba.njit(cache=True)
def _use(
    cells: FloatArray, times: FloatArray, reach: float, first: FloatArray, dwell: FloatArray, visits: Int32Array
) -> None:
    """Add one limb's moments at (n, 2) places, in rows and columns whose middles are whole numbers."""
    height, width = first.shape
    last = np.full((height, width), -2, dtype=np.int64)  # the moment in which a cell was last held
    for t in range(len(cells)):
        row, column = cells[t, 0], cells[t, 1]
        apart = t > 0 and times[t] - times[t - 1] > GAP_S
        length = min(times[t + 1] - times[t], GAP_S) if t + 1 < len(cells) else 0.0
        for i in range(max(0, int(np.ceil(row - reach))), min(height - 1, int(np.floor(row + reach))) + 1):
            for j in range(max(0, int(np.ceil(column - reach))), min(width - 1, int(np.floor(column + reach))) + 1):
                if (i - row) ** 2 + (j - column) ** 2 > reach * reach:
                    continue
                first[i, j] = min(first[i, j], times[t])
                dwell[i, j] += length
                if apart or last[i, j] != t - 1:
                    visits[i, j] += 1
                last[i, j] = t
