"""The boundary a method estimates for itself: a rectangle along the walls, from depth and tracked joints.

hsbench default: the yaw of the walls is the one along which the points are sharpest; the sides are the 1st and 99th
percentile of the points, grown so that every tracked joint lies inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.geometry.transforms import apply
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.typing import AnyArray, BoolArray, FloatArray

PERCENTILES = (1.0, 99.0)
MIN_WALL_HEIGHT_M = 0.15  # floor points say nothing of walls
BIN_M = 0.05  # of the histograms across walls: about the depth noise of a far wall
COARSE_DEG, FINE_DEG = 1.0, 0.1
FINE_BIN_M = 0.02


@dataclass(frozen=True, eq=False)
class Boundary:
    """A rectangle on the floor: ``yaw_rad`` of its axes, ``low`` and ``high`` (2,) metres along them."""

    yaw_rad: float
    low: FloatArray
    high: FloatArray

    def to_axes(self, points: FloatArray) -> FloatArray:
        """(..., 2) episode coordinates -> coordinates along the rectangle's axes."""
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.asarray(points @ np.array([[c, -s], [s, c]]))

    def from_axes(self, points: FloatArray) -> FloatArray:
        """The inverse of ``to_axes``."""
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.asarray(points @ np.array([[c, s], [-s, c]]))

    @property
    def centre(self) -> FloatArray:
        """(2,) middle of the rectangle in episode coordinates."""
        return self.from_axes((self.low + self.high) / 2)

    @property
    def corners(self) -> FloatArray:
        """(4, 2) corners in episode coordinates, counter-clockwise."""
        (x0, y0), (x1, y1) = self.low, self.high
        return self.from_axes(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))

    def contains(self, points: FloatArray) -> BoolArray:
        """(..., 2) -> (...) bool."""
        along = self.to_axes(points)
        return np.asarray(((along >= self.low) & (along <= self.high)).all(axis=-1))


def estimate_boundary(sensor: Sensor, depth_m: AnyArray, poses: PoseTable | None) -> Boundary:
    """The boundary from one depth image (h, w), 0 = none, and the tracked joints.

    Without any depth or joint it is the square metre around the camera.
    """
    points = apply(sensor.world_T_camera, sensor.camera.unproject(depth_m))
    valid = np.asarray(depth_m) > 0
    yaw = wall_yaw(points[valid])
    known = [points[valid][:, :2]]
    if poses is not None and poses.joints_m is not None:
        known.append(poses.joints_m[poses.joint_state == JointState.TRACKED][:, :2].astype(np.float64))
    unbounded = Boundary(yaw, np.full(2, -0.5), np.full(2, 0.5))
    depth_along, *joints_along = (unbounded.to_axes(p) for p in known)
    low, high = unbounded.low, unbounded.high
    if len(depth_along):
        low, high = np.percentile(depth_along, PERCENTILES, axis=0)
    for along in joints_along:
        if len(along):
            low, high = np.minimum(low, along.min(axis=0)), np.maximum(high, along.max(axis=0))
    return Boundary(yaw, low, high)


def wall_yaw(points: FloatArray) -> float:
    """Yaw of the walls in radians, in [-45, 45) degrees, from (N, 3) points in the z-up episode frame.

    Seen along a wall, its points fall into few bins of a histogram across it: the yaw with the greatest sum of squared
    counts along both axes wins. Every voxel counts once, so that what is near has no more say than what is far. Depth
    noise, which bends single normals towards the camera, does not move it.
    """
    high = points[points[:, 2] > MIN_WALL_HEIGHT_M]
    if not len(high):
        return 0.0
    voxels, voxel = np.unique(np.floor(high / BIN_M).astype(np.int64), axis=0, return_inverse=True)
    _, column = np.unique(voxels[:, :2], axis=0, return_inverse=True)
    height, points_of = np.bincount(column), column[voxel.ravel()]
    sums: FloatArray = np.stack([np.bincount(points_of, weights=high[:, axis]) for axis in range(2)], axis=1)
    plan: FloatArray = sums / np.bincount(points_of)[:, None]

    def sharpness(yaw: float, bin_m: float) -> float:
        c, s = np.cos(yaw), np.sin(yaw)
        return _sharpness(plan @ np.array([c, s]), height, bin_m) + _sharpness(plan @ np.array([-s, c]), height, bin_m)

    yaw = max(np.deg2rad(np.arange(-45.0, 45.0, COARSE_DEG)), key=lambda yaw: sharpness(yaw, BIN_M))
    nearby = yaw + np.deg2rad(np.arange(-COARSE_DEG, COARSE_DEG, FINE_DEG))
    return float(max(nearby, key=lambda yaw: sharpness(yaw, FINE_BIN_M)))


def _sharpness(along: FloatArray, weight: AnyArray, bin_m: float) -> float:
    """Sum of squares of a histogram; each count is shared between the two nearest bins, wherever these begin."""
    scaled = (along - along.min()) / bin_m
    low = np.floor(scaled).astype(np.int64)
    upper = (scaled - low) * weight
    counts = np.bincount(np.r_[low, low + 1], weights=np.r_[weight - upper, upper])
    return float((counts**2).sum())
