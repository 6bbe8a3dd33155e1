"""The height-and-thickness prior: occluded space is solid within d behind a surface and below h, fitted on train.

A reference of task scene-completion. It knows no activity; it is what a method must beat to claim that people help.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.sensor import Sensor
from hsbench.typing import AnyArray, BoolArray, FloatArray

DEPTH_EDGES_M = np.arange(0.0, 4.01, 0.05)
HEIGHT_EDGES_M = np.arange(0.0, 2.41, 0.05)


@dataclass(frozen=True)
class HeightPrior:
    """Occluded voxels are solid if less than ``thickness_m`` behind the surface and below ``height_m``."""

    thickness_m: float
    height_m: float

    def solid(self, behind_m: FloatArray, grid: VoxelGrid) -> BoolArray:
        """(nx, ny, nz) bool from ``behind_surface`` of the same grid."""
        return np.asarray((behind_m < self.thickness_m) & (grid.axis_centres(2) < self.height_m))


def behind_surface(sensor: Sensor, grid: VoxelGrid, depth_m: AnyArray) -> FloatArray:
    """(nx, ny, nz) metres of camera depth that a voxel centre lies behind the surface at its pixel; NaN out of view."""
    assert isinstance(sensor.camera, PinholeCamera)
    pixels, z = sensor.camera.project(apply(invert(sensor.world_T_camera), grid.centres()))
    inside = sensor.camera.contains(pixels)
    column = np.where(inside, pixels[..., 0], 0).astype(np.int64)
    row = np.where(inside, pixels[..., 1], 0).astype(np.int64)
    depth = np.asarray(depth_m, dtype=np.float64)[row, column]
    return np.where(inside & (depth > 0), z - depth, np.nan)


def fit(samples: Iterable[tuple[FloatArray, FloatArray, BoolArray]]) -> HeightPrior:
    """The thickness and height with the largest pooled IoU.

    samples: per training episode (behind_m (n,), height_m (n,), solid (n,)) of the voxels the score counts. One
    histogram over both distances gives the IoU of every pair of limits exactly. Raises ValueError without a sample.
    """
    shape = (len(DEPTH_EDGES_M) - 1, len(HEIGHT_EDGES_M) - 1)
    solid_count, count = np.zeros(shape), np.zeros(shape)
    edges = (DEPTH_EDGES_M, HEIGHT_EDGES_M)
    total_solid = 0
    for behind_m, height_m, solid in samples:
        clipped = np.clip(behind_m, 0.0, None)  # depth noise puts some voxels just in front
        count += np.histogram2d(clipped, height_m, edges)[0]
        solid_count += np.histogram2d(clipped[solid], height_m[solid], edges)[0]
        total_solid += int(solid.sum())
    if not count.sum():
        raise ValueError("the height prior has no training voxel; expected at least one episode of split train")
    true_positive = solid_count.cumsum(axis=0).cumsum(axis=1)
    predicted = count.cumsum(axis=0).cumsum(axis=1)
    iou = true_positive / np.maximum(predicted + total_solid - true_positive, 1)
    i, j = np.unravel_index(int(np.argmax(iou)), shape)
    return HeightPrior(float(round(DEPTH_EDGES_M[i + 1], 4)), float(round(HEIGHT_EDGES_M[j + 1], 4)))
