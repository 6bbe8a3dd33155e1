"""Joints in pixels as a heatmap detector answers them: on a patch rectified about the person, in cells of its heatmap.

Everything is in a patch: the plane at distance 1 before the camera, across the person's direction (a sphere) or the
optical axis (a pinhole: the image itself, without distortion). So errors and cells are shares of the person's size
there, the size that they would have if they stood upright at their distance: they do not depend on focal length,
resolution or scale.
"""

from __future__ import annotations

import math

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import CentralCamera, EquirectangularCamera
from hsbench.schema.poses import JointState
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import Skeleton
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.detectors.drift import drifting
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, IntArray, UInt8Array

SIGMAS = {
    "nose": 0.026, "eye": 0.025, "ear": 0.035, "neck": 0.079, "shoulder": 0.079, "elbow": 0.072, "wrist": 0.062,
    "hip": 0.107, "hip_mid": 0.107, "knee": 0.087, "ankle": 0.089, "big_toe": 0.068, "small_toe": 0.066, "heel": 0.066,
}  # fmt: skip
"""Distance between annotators (root mean square), over the root of a person's area: COCO's keypoint evaluation (its
``sigmas``); feet as COCO-WholeBody (Jin et al., ECCV 2020, of the left foot); neck and middle hip as their neighbours.
"""

ROOT_AREA = 0.5
"""Root of a person's area over their height in the image: their outline fills about half of a box .45 as wide."""

PATCH_HALF_ANGLE_RAD = math.radians(65.0)  # what a patch of a sphere holds about its middle
PATCH_DECIMALS = 6  # places in a patch are rounded to a millionth of its distance before cells decide
PIXEL_DECIMALS = 2
STRAIGHT = 1e-9  # keeps a patch defined about somebody straight above or below a sphere


def shares(skeleton: Skeleton) -> FloatArray:
    """(J,) standard deviation of a coordinate between annotators, as a share of the person's height in the image."""
    names = (n.removesuffix("_left").removesuffix("_right") for n in skeleton.names)
    return np.array([SIGMAS[n] for n in names]) * (ROOT_AREA / math.sqrt(2.0))


def patch_axes(sensor: Sensor, middle: FloatArray) -> FloatArray:
    """(N, 3) middles of people in the camera frame -> (N, 3, 3) patch axes in rows: right, down, ahead."""
    if not isinstance(sensor.camera, EquirectangularCamera):
        return np.broadcast_to(np.eye(3), (len(middle), 3, 3))
    ahead = middle / np.sqrt((middle * middle).sum(axis=1, keepdims=True))
    level = np.maximum(np.hypot(ahead[:, 0], ahead[:, 2]), STRAIGHT)
    right = np.stack([ahead[:, 2], np.zeros(len(ahead)), -ahead[:, 0]], axis=1) / level[:, None]
    return np.stack([right, np.cross(ahead, right), ahead], axis=1)


def seen_in_patch(sensor: Sensor, axes: FloatArray, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N, J, 3) joints in the camera frame -> ((N, J, 2) places in the patch, NaN outside it, (N, J) depth_m)."""
    local = joints @ np.swapaxes(axes, 1, 2)
    depth = local[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.round(local[..., :2] / depth[..., None], PATCH_DECIMALS)
    inside = depth > 0
    if isinstance(sensor.camera, EquirectangularCamera):
        inside &= (place * place).sum(axis=-1) <= math.tan(PATCH_HALF_ANGLE_RAD) ** 2
    return np.where(inside[..., None], place, np.nan), depth


def pixels(sensor: Sensor, axes: FloatArray, place: FloatArray) -> FloatArray:
    """(N, J, 2) places in the patch -> (N, J, 2) pixels, inside the image (what lies outside goes to its border)."""
    rays = np.concatenate([place, np.ones((*place.shape[:2], 1))], axis=-1) @ axes
    camera = sensor.camera
    if not isinstance(camera, CentralCamera):
        raise SchemaError(f"a {sensor.kind} sensor has no perspective; expected a detector of joints in metres")
    found = np.round(camera.project(rays)[0], PIXEL_DECIMALS)
    last = np.array([camera.width_px, camera.height_px]) - 10.0**-PIXEL_DECIMALS
    if isinstance(camera, EquirectangularCamera):
        found[..., 0] %= camera.width_px
    return np.asarray(np.clip(found, 0.0, last))


def misplaced(
    place: FloatArray,
    size: FloatArray,
    state: UInt8Array,
    skeleton: Skeleton,
    timestamp_ns: IntArray,
    config: DetectorConfig,
    seeds: Seeds,
) -> FloatArray:
    """(N, J, 2) true places of one body in its patches, (N,) its sizes there -> (N, J, 2) what the detector answers."""
    white = seeds.rng("jitter").standard_normal(place.shape)
    columns = place.shape[1] * place.shape[2]
    drift = drifting(timestamp_ns, columns, config.drift_s, seeds.rng("drift")).reshape(place.shape)
    inferred = (state == JointState.INFERRED)[..., None]
    error = np.where(inferred, config.annotators_inferred, config.annotators) * shares(skeleton)[:, None]
    hard = np.exp(config.uneven * drifting(timestamp_ns, 1, config.drift_s, seeds.rng("uneven")))
    scale = np.round(size, PATCH_DECIMALS)[:, None, None]
    error *= scale * hard[..., None]
    found = np.round(place + error * math.sqrt(0.5) * (drift + white), PATCH_DECIMALS)
    if config.cells == 0:
        return np.asarray(found)
    phase = seeds.rng("patch").random((len(place), 1, 2))  # a patch begins anywhere
    step = scale / config.cells
    return np.asarray((np.floor(found / step + phase) + 0.5 - phase) * step)
