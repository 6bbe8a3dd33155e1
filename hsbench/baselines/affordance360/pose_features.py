"""What a pose looks like, whoever and wherever the person is: joint offsets over torso length, and joint angles.

Source of the idea: S. Fowler, "Visual Analysis of Human Activity", PhD thesis, University of Surrey, 2019, chapter 4,
which compares features and classifiers. Which features these are is an hsbench default.
"""

from __future__ import annotations

import numpy as np

from hsbench.baselines.lift import DEFAULT_HEIGHT_M, joint_mean
from hsbench.geometry.cameras import world_T_camera
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.typing import FloatArray

SIDES = ("left", "right")
OFFSETS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
ANGLES = (
    ("hip", "shoulder", "elbow"),
    ("shoulder", "elbow", "wrist"),
    ("shoulder", "hip", "knee"),
    ("hip", "knee", "ankle"),
)
"""Joints of one side; the angle is at the middle one."""
FARTHEST = 8.0  # torso lengths: a joint farther off is another person's


def pose_features(poses: PoseTable, sensor: Sensor) -> FloatArray:
    """(N, F) float64, NaN where a joint is missing.

    Offsets from the neck of six joints a side and of the head, over the length of the torso; the cosines of four angles
    a side; and how the torso is seen: of poses in pixels its apparent length and the slope of the ray to the neck, of
    those in metres its length and the height of the neck.
    Poses in pixels are seen on the upright plane that faces the person (x right, y up): two numbers an offset. Poses in
    metres are turned about the vertical until the shoulders point along x: three.
    """
    joints = _facing(poses) if poses.joints_m is not None else _on_plane(poses, sensor)
    neck, hips = _middle(poses, joints, "neck"), _middle(poses, joints, "hip")
    torso = np.linalg.norm(neck - hips, axis=-1)
    head = _middle(poses, joints, "head" if "head" in poses.layout.names else "nose")
    at = {(name, side): joints[:, poses.layout.index(f"{name}_{side}")] for name in OFFSETS for side in SIDES}
    with np.errstate(invalid="ignore", divide="ignore"):
        offsets = np.stack([joint - neck for joint in (head, *at.values())], axis=1) / torso[:, None, None]
        offsets[~(np.abs(offsets) < FARTHEST)] = np.nan
        angles = [_cosine(at[a, side], at[b, side], at[c, side]) for a, b, c in ANGLES for side in SIDES]
    flat = offsets.reshape(len(poses), offsets.shape[1] * offsets.shape[2])
    return np.column_stack([flat, *angles, torso, neck[:, -1]])


def _middle(poses: PoseTable, joints: FloatArray, name: str) -> FloatArray:
    """(N, d) a joint, or the middle of its left and right one."""
    return np.stack([joint_mean(poses, joints[..., axis], name) for axis in range(joints.shape[-1])], axis=-1)


def _cosine(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """(N,) cosine of the angle at b."""
    u, v = a - b, c - b
    return np.asarray((u * v).sum(axis=-1) / (np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)))


def _on_plane(poses: PoseTable, sensor: Sensor) -> FloatArray:
    """(N, J, 2) joints on a vertical plane at unit distance whose middle column shows the person's neck or hips."""
    assert poses.joints_px is not None
    turn = world_T_camera(DEFAULT_HEIGHT_M, sensor.tilt_rad, sensor.roll_rad)[:3, :3]
    rays = sensor.camera.rays_at(poses.joints_px.astype(np.float64)) @ turn.T
    towards = np.stack([_middle(poses, rays, name)[:, :2] for name in ("neck", "hip")])
    towards = np.where(np.isfinite(towards[0]), towards[0], towards[1])
    with np.errstate(invalid="ignore", divide="ignore"):
        towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
        ahead = rays[..., :2] @ towards[..., None]
        right = rays[..., 0] * towards[:, None, 1] - rays[..., 1] * towards[:, None, 0]
        seen = np.stack([right, rays[..., 2]], axis=-1) / np.where(ahead > 0.0, ahead, np.nan)
    return np.where((poses.joint_state == JointState.MISSING)[..., None], np.nan, seen)


def _facing(poses: PoseTable) -> FloatArray:
    """(N, J, 3) joints turned about the vertical so that the shoulders point along x; unturned where one is missing."""
    assert poses.joints_m is not None
    joints = poses.joints_m.astype(np.float64)
    across = (joints[:, poses.layout.index("shoulder_left")] - joints[:, poses.layout.index("shoulder_right")])[:, :2]
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        cos, sin = np.where(length > 0.0, across / length, (1.0, 0.0)).T[..., None]
    x, y, z = np.moveaxis(joints, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)
