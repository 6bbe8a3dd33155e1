"""Poses of people over time: observed ones (input) and true ones (truth), as structs of arrays.

Rows are ordered by time, then track. 3D joints are metres in the episode frame; 2D joints are pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.skeletons import SKELETONS, Skeleton
from hsbench.schema.states import Action
from hsbench.typing import AnyArray, Float32Array, Int32Array, IntArray, UInt8Array

MAX_COORDINATE_M = 1000.0  # beyond it, a room's joints are surely in the wrong unit


class JointState(IntEnum):
    """As the Kinect v2 SDK's TrackingState."""

    MISSING = 0
    INFERRED = 1
    TRACKED = 2


@dataclass(frozen=True, eq=False)
class PoseTable:
    """N poses of a skeleton with J joints.

    skeleton: name, a key of ``SKELETONS``.
    timestamp_ns: (N,) int64, never decreasing.
    track_id: (N,) int32, the detector's identity of a person; not more than one row per time and track.
    joint_state: (N, J) uint8 of ``JointState``.
    joints_m: (N, J, 3) float32 metres in the episode frame, or None. Joints MISSING are NaN, others finite.
    joints_px: (N, J, 2) float32 pixels, or None. Joints MISSING are NaN, others finite.
    Raises SchemaError otherwise.
    """

    skeleton: str
    timestamp_ns: IntArray
    track_id: Int32Array
    joint_state: UInt8Array
    joints_m: Float32Array | None = None
    joints_px: Float32Array | None = None

    def __post_init__(self) -> None:
        if self.skeleton not in SKELETONS:
            raise SchemaError(f"poses.skeleton is {self.skeleton!r}; expected one of {', '.join(SKELETONS)}")
        n, j = len(self.timestamp_ns), len(SKELETONS[self.skeleton].names)
        require(self.timestamp_ns, "poses.timestamp_ns", (n,), np.int64)
        require(self.track_id, "poses.track_id", (n,), np.int32)
        require(self.joint_state, "poses.joint_state", (n, j), np.uint8)
        if n and (np.diff(self.timestamp_ns) < 0).any():
            row = int(np.argmax(np.diff(self.timestamp_ns) < 0)) + 1
            raise SchemaError(f"poses.timestamp_ns decreases at row {row}; expected rows ordered by time")
        same = (np.diff(self.timestamp_ns) == 0) & (np.diff(self.track_id) <= 0)
        if same.any():
            row = int(np.argmax(same)) + 1
            raise SchemaError(
                f"poses row {row} repeats or disorders a track at one time; expected rows by time, then track"
            )
        if n and self.joint_state.max() > max(JointState):
            raise SchemaError(
                f"poses.joint_state holds {self.joint_state.max()}; expected 0 missing, 1 inferred, 2 tracked"
            )
        if self.joints_m is None and self.joints_px is None:
            raise SchemaError("poses have neither joints_m nor joints_px; expected at least one")
        missing = self.joint_state == JointState.MISSING
        for name, joints, width in (("joints_m", self.joints_m, 3), ("joints_px", self.joints_px, 2)):
            if joints is None:
                continue
            require(joints, f"poses.{name}", (n, j, width), np.float32)
            fits = np.where(missing, np.isnan(joints).all(axis=-1), np.isfinite(joints).all(axis=-1))
            if not fits.all():
                row, joint = map(int, np.argwhere(~fits)[0])
                raise SchemaError(
                    f"poses.{name} row {row} joint {self.layout.names[joint]} is {joints[row, joint]} with state "
                    f"{self.joint_state[row, joint]}; expected NaN where, and only where, the state is 0 (missing)"
                )
        if self.joints_m is not None and n:
            largest = float(np.nanmax(np.abs(self.joints_m), initial=0.0))
            if largest > MAX_COORDINATE_M:
                raise SchemaError(f"poses.joints_m reaches {largest:.0f} m; expected a room (are these millimetres?)")

    def __len__(self) -> int:
        return len(self.timestamp_ns)

    @property
    def layout(self) -> Skeleton:
        """The skeleton's joint names and bones."""
        return SKELETONS[self.skeleton]

    def select(self, rows: AnyArray) -> PoseTable:
        """The rows of a boolean mask or ascending indices."""
        return PoseTable(
            self.skeleton,
            self.timestamp_ns[rows],
            self.track_id[rows],
            self.joint_state[rows],
            None if self.joints_m is None else self.joints_m[rows],
            None if self.joints_px is None else self.joints_px[rows],
        )

    def until(self, timestamp_ns: int) -> PoseTable:
        """The poses up to and including a time."""
        return self.select(self.timestamp_ns <= timestamp_ns)


@dataclass(frozen=True, eq=False)
class TruePoseTable:
    """True poses and what they mean.

    poses: track_id is the person's id, all joints TRACKED, metres in the episode frame.
    action: (N,) uint8 of ``Action``.
    match: (M,) int64 for the M observed poses of the episode: row of the true pose, -1 for a false detection.
    """

    poses: PoseTable
    action: UInt8Array
    match: IntArray

    def __post_init__(self) -> None:
        n = len(self.poses)
        if self.poses.joints_m is None or (self.poses.joint_state != JointState.TRACKED).any():
            raise SchemaError(
                "true_poses lack joints in metres or have one that is not tracked; truth knows every joint"
            )
        require(self.action, "true_poses.action", (n,), np.uint8)
        if n and self.action.max() > max(Action):
            raise SchemaError(f"true_poses.action holds {self.action.max()}; expected 0..{max(Action)}")
        require(self.match, "true_poses.match", (len(self.match),), np.int64)
        if len(self.match) and not (self.match.min() >= -1 and self.match.max() < n):
            raise SchemaError(f"true_poses.match points outside rows -1..{n - 1} of the true poses")


def require(array: AnyArray, name: str, shape: tuple[int | None, ...], dtype: type) -> None:
    """Raise SchemaError unless an array has exactly this dtype and shape (None: any length)."""
    if not isinstance(array, np.ndarray):
        raise SchemaError(f"{name} is a {type(array).__name__}; expected a numpy array")
    if array.dtype != np.dtype(dtype):
        raise SchemaError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("any" if s is None else str(s) for s in shape)
        raise SchemaError(f"{name} has shape {array.shape}; expected ({wanted})")
