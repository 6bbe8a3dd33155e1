"""Poses in pixels to metres: how far away a person is, from a stature of 1.7 m.

A body is taken as a flat upright figure that faces the camera. The slope of the ray to a joint is its height over the
camera divided by the distance along the floor, so two joints whose heights differ by a known length give the distance:
neck and hips always, neck and ankles of a body that stands; and so does an ankle, which is near the floor, where the
height of the camera is known. Where it is not given it comes from the same lengths, as a median over poses.

Source of the lengths: D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, figure 4.1, after
Drillis and Contini 1966. The stature is the one that task affordance-topdown allows to assume. The rest is an hsbench
default.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.typing import FloatArray

STATURE_M = 1.7
NECK, HIP, ANKLE = (share * STATURE_M for share in (0.818, 0.530, 0.039))
"""Heights of joints of an upright body in metres; the neck of a detector lies between the shoulders."""

STANDING_NECK_M = 1.2  # a neck above it stands: half way from 1.39 m to that of a seated body, about 1.05 m
FARTHEST_M = 10.0  # beyond any room; a figure that small says nothing
DEFAULT_HEIGHT_M = 1.6  # of a camera that nobody tells the height of
HEIGHT_ROUNDS = 3  # who stands depends on the height of the camera, and that on who stands


def lifted(poses: PoseTable, sensor: Sensor) -> PoseTable:
    """The same rows with joints in metres, episode frame; those whose distance is unknown lose all joints.

    Poses that have metres are returned as they are. Lengths to .1 mm.
    """
    if poses.joints_m is not None:
        return poses
    height = camera_height(poses, sensor)
    flat, neck, hip, ankle = _slopes(poses, sensor)
    torso, body = _distance(NECK - HIP, neck - hip), _distance(NECK - ANKLE, neck - ankle)
    foot = _distance(height - ANKLE, -ankle)
    seated = np.where(np.isfinite(foot), foot, torso)
    stands = height + seated * neck > STANDING_NECK_M
    distance = np.where(stands & np.isfinite(body), body, seated)
    joints = flat * distance[:, None, None]
    joints[..., 2] += height
    near = (np.abs(joints) < FARTHEST_M).all(axis=-1)  # a joint right above the camera is nowhere
    kept = (poses.joint_state != JointState.MISSING) & near
    joints = np.where(kept[..., None], quantise_m(joints), np.nan)
    state = np.where(kept, poses.joint_state, JointState.MISSING).astype(np.uint8)
    return PoseTable(poses.skeleton, poses.timestamp_ns, poses.track_id, state, joints.astype(np.float32))


def camera_height(poses: PoseTable, sensor: Sensor) -> float:
    """Metres above the floor: as the sensor tells, else from where feet meet the floor and necks of those who stand."""
    if sensor.height_m is not None:
        return sensor.height_m
    if poses.joints_px is None:
        return DEFAULT_HEIGHT_M
    _, neck, hip, ankle = _slopes(poses, sensor)
    torso, body = _distance(NECK - HIP, neck - hip), _distance(NECK - ANKLE, neck - ankle)
    height = _median(ANKLE - torso * ankle, DEFAULT_HEIGHT_M)
    for _ in range(HEIGHT_ROUNDS):
        stands = height + torso * neck > STANDING_NECK_M
        height = _median((NECK - body * neck)[stands], height)
    return height


def joint_mean(poses: PoseTable, values: FloatArray, name: str) -> FloatArray:
    """(N, J) values of joints -> (N,) mean over the known joints of a name, left and right; NaN where neither is."""
    columns = [k for k, joint in enumerate(poses.layout.names) if joint in (name, f"{name}_left", f"{name}_right")]
    known = poses.joint_state[:, columns] != JointState.MISSING
    total = np.where(known, values[:, columns], 0.0).sum(axis=1)
    return np.where(known.any(axis=1), total / np.maximum(known.sum(axis=1), 1), np.nan)


def _slopes(poses: PoseTable, sensor: Sensor) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(N, J, 3) rays that go one metre along the floor, and (N,) slopes of neck, hips and ankles; NaN where unknown."""
    assert poses.joints_px is not None
    turn = world_T_camera(DEFAULT_HEIGHT_M, sensor.tilt_rad, sensor.roll_rad)[:3, :3]
    rays = sensor.camera.rays_at(poses.joints_px.astype(np.float64)) @ turn.T
    with np.errstate(invalid="ignore", divide="ignore"):
        flat = rays / np.linalg.norm(rays[..., :2], axis=-1, keepdims=True)
    neck, hip, ankle = (joint_mean(poses, flat[..., 2], name) for name in ("neck", "hip", "ankle"))
    return flat, neck, hip, ankle


def _distance(length_m: float, slope: FloatArray) -> FloatArray:
    """(N,) metres along the floor at which a vertical length has a slope; NaN where that is in no room."""
    with np.errstate(invalid="ignore", divide="ignore"):
        distance = length_m / slope
    return np.where((distance > 0) & (distance < FARTHEST_M), distance, np.nan)


def _median(values: FloatArray, default: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else default
