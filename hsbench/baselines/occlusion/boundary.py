"""The boundary a method estimates for itself: a rectangle along the walls, from depth and tracked joints.

hsbench default: the yaw of the walls is the 90-degree-periodic mean of the surface normals' directions; the sides are
the 1st and 99th percentile of the points, grown so that every tracked joint lies inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.geometry.transforms import apply
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.typing import AnyArray, BoolArray, FloatArray

PERCENTILES = (1.0, 99.0)
STRIDE_PX = 4  # normals over a few pixels drown less in depth noise
MIN_WALL_HEIGHT_M = 0.1  # floor points say nothing of walls
LEVEL_NORMAL = 0.3  # |n_z| below it: a vertical surface


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
    yaw = wall_yaw(points, valid)
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


def wall_yaw(points: FloatArray, valid: BoolArray) -> float:
    """Yaw of the walls in radians, modulo 90 degrees, from organised points (h, w, 3) in the z-up episode frame.

    Normals are cross products of neighbours ``STRIDE_PX`` apart; the mean direction is that of exp(4 i yaw).
    """
    step = STRIDE_PX
    across = points[::step, step::step] - points[::step, :-step:step]
    down = points[step::step, ::step] - points[:-step:step, ::step]
    rows, columns = min(len(across), len(down)), min(across.shape[1], down.shape[1])
    normals = np.cross(across[:rows, :columns], down[:rows, :columns])
    length = np.linalg.norm(normals, axis=-1)
    coarse = valid[::step, ::step]
    whole = coarse[:rows, :columns] & coarse[1 : rows + 1, :columns] & coarse[:rows, 1 : columns + 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = normals / length[..., None]
    height = points[::step, ::step][:rows, :columns, 2]
    walls = whole & (length > 0) & (np.abs(unit[..., 2]) < LEVEL_NORMAL) & (height > MIN_WALL_HEIGHT_M)
    if not walls.any():
        return 0.0
    angle = np.arctan2(unit[walls][:, 1], unit[walls][:, 0])
    return float(np.angle(np.exp(4j * angle).mean()) / 4)
