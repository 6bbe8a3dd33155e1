"""What each observed pose does, and where: standing or sitting, and the person's place on the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.errors import SchemaError
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.schema.states import Action
from hsbench.typing import BoolArray, FloatArray, Int32Array, UInt8Array

TORSO = tuple(
    KINECT_V2.index(name)
    for name in (
        "spine_base",
        "spine_mid",
        "spine_shoulder",
        "neck",
        "hip_left",
        "hip_right",
        "shoulder_left",
        "shoulder_right",
    )
)
PELVIS = tuple(KINECT_V2.index(name) for name in ("spine_base", "hip_left", "hip_right"))
HEAD = tuple(KINECT_V2.index(name) for name in ("head", "neck"))
LEGS = tuple((KINECT_V2.index(f"hip_{side}"), KINECT_V2.index(f"knee_{side}")) for side in ("left", "right"))
HEAD_OVER_NECK_M = 0.20  # from the neck joint to the middle of the head, where only the neck is tracked


@dataclass(frozen=True, eq=False)
class Activity:
    """N poses that have an action: position (N, 2) metres on the floor, action (N,) ``Action.STAND`` or ``SIT``,
    pelvis_m (N,) height of the pelvis, NaN where it was not tracked.
    """

    position: FloatArray
    action: UInt8Array
    pelvis_m: FloatArray

    def of(self, action: Action) -> Activity:
        """The poses of one action."""
        rows = self.action == action
        return Activity(self.position[rows], self.action[rows], self.pelvis_m[rows])


def recognise(poses: PoseTable, config: CarveConfig) -> Activity:
    """Stand or sit for every pose that tracked joints decide; the others are left out.

    ``poses`` are Kinect v2 skeletons in metres, episode frame. Raises SchemaError for others.
    """
    if poses.skeleton != KINECT_V2.name or poses.joints_m is None:
        raise SchemaError(f"poses are {poses.skeleton!r}; expected joints of {KINECT_V2.name} in metres")
    joints = poses.joints_m.astype(np.float64)
    tracked = poses.joint_state == JointState.TRACKED
    pelvis = _mean(joints[..., 2], tracked, PELVIS)
    vote = _vote(joints, tracked, pelvis, config)
    action = _pool_votes(vote, poses.track_id, config.vote_frames)
    position = np.stack([_mean(joints[..., axis], tracked, TORSO) for axis in range(2)], axis=-1)
    known = (action != Action.IGNORED) & np.isfinite(position).all(axis=1)
    return Activity(position[known], action[known], pelvis[known])


def _mean(values: FloatArray, tracked: BoolArray, joints: tuple[int, ...]) -> FloatArray:
    """(N,) mean of a coordinate (N, J) over the tracked ones of some joints, NaN where none is."""
    columns = list(joints)
    weight = tracked[:, columns]
    count = weight.sum(axis=1)
    total = np.where(weight, values[:, columns], 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _vote(joints: FloatArray, tracked: BoolArray, pelvis: FloatArray, config: CarveConfig) -> UInt8Array:
    """(N,) ``Action`` of each pose alone; IGNORED where its joints do not say."""
    ratio = np.full((len(joints), len(LEGS)), np.nan)
    for k, (hip, knee) in enumerate(LEGS):
        seen = tracked[:, hip] & tracked[:, knee]
        thigh = np.linalg.norm(joints[seen, hip] - joints[seen, knee], axis=1)
        ratio[seen, k] = (joints[seen, hip, 2] - joints[seen, knee, 2]) / np.maximum(thigh, 1e-6)
    has_leg = np.isfinite(ratio).any(axis=1)
    # The straighter leg decides: a walking person lifts one knee.
    straight = np.where(has_leg, np.max(np.nan_to_num(ratio, nan=-np.inf), axis=1, initial=-np.inf), np.nan)
    head = _mean(joints[..., 2], tracked, HEAD[:1])
    neck = _mean(joints[..., 2], tracked, HEAD[1:]) + HEAD_OVER_NECK_M
    head = np.where(np.isfinite(head), head, neck)
    with np.errstate(invalid="ignore"):  # comparisons with NaN are false: no vote
        by_leg_stand = (straight > config.stand_ratio) & (pelvis > config.pelvis_stand_m)
        by_leg_sit = (
            (straight < config.sit_ratio) & (pelvis > config.pelvis_sit_m[0]) & (pelvis < config.pelvis_sit_m[1])
        )
        by_head_stand = ~has_leg & (head > config.head_stand_m)
        by_head_sit = ~has_leg & (head > config.head_sit_m[0]) & (head < config.head_sit_m[1])
    vote = np.full(len(joints), Action.IGNORED, dtype=np.uint8)
    vote[by_leg_stand | by_head_stand] = Action.STAND
    vote[by_leg_sit | by_head_sit] = Action.SIT
    return vote


def _pool_votes(vote: UInt8Array, track_id: Int32Array, frames: int) -> UInt8Array:
    """(N,) majority of the votes among the ``frames`` poses of the same track around each pose (a running median
    of a two-valued vote); a tie, or no vote at all, is IGNORED.
    """
    pooled = np.full_like(vote, Action.IGNORED)
    for track in np.unique(track_id):
        rows = np.flatnonzero(track_id == track)
        balance = (vote[rows] == Action.STAND).astype(np.int64) - (vote[rows] == Action.SIT)
        total = np.convolve(balance, np.ones(frames, dtype=np.int64), mode="full")[(frames - 1) // 2 :][: len(rows)]
        pooled[rows] = np.where(total > 0, Action.STAND, np.where(total < 0, Action.SIT, Action.IGNORED))
    return pooled
