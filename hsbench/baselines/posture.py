"""Who stands, who sits, and whose hand reaches out, from joints in metres.

hsbench default: a body stands where its neck is above 1.2 m, which tells both a Kinect's skeletons and lifted poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.baselines.lift import STANDING_NECK_M, joint_mean
from hsbench.schema.poses import JointState, PoseTable
from hsbench.typing import BoolArray, FloatArray

REACH_M = 0.35  # of a wrist from the hips along the floor: a hand that hangs or rests is nearer
HANDS = ("wrist_left", "wrist_right")


@dataclass(frozen=True, eq=False)
class Postures:
    """N poses in the episode frame, metres; NaN where unknown.

    place: (N, 3) middle of the hips, or of the neck where they are unknown. neck_m: (N,) its height.
    hands: (N, 2, 3) wrists, left and right. reach_m: (N, 2) of each from the place, along the floor.
    """

    place: FloatArray
    neck_m: FloatArray
    hands: FloatArray
    reach_m: FloatArray

    @property
    def stands(self) -> BoolArray:
        """(N,) bool."""
        return np.asarray(self.neck_m > STANDING_NECK_M)

    @property
    def sits(self) -> BoolArray:
        """(N,) bool: neither where the neck is unknown."""
        return np.asarray(self.neck_m <= STANDING_NECK_M)


def postures(poses: PoseTable) -> Postures:
    """The postures of poses that have metres, row by row."""
    assert poses.joints_m is not None
    joints = poses.joints_m.astype(np.float64)
    hips, neck = (
        np.stack([joint_mean(poses, joints[..., axis], name) for axis in range(3)], axis=-1) for name in ("hip", "neck")
    )
    place = np.where(np.isfinite(hips), hips, neck)
    columns = [poses.layout.index(name) for name in HANDS]
    hands = np.where(poses.joint_state[:, columns, None] == JointState.MISSING, np.nan, joints[:, columns])
    reach = np.linalg.norm(hands[..., :2] - place[:, None, :2], axis=-1)
    return Postures(place, neck[:, 2], hands, reach)
