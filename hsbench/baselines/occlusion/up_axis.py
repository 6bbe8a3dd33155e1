"""Which way is up, and how high the camera stands, from one depth frame alone: the floor is the lowest large plane.

The picture is cut into blocks; the mean of a block is a point with little noise, and its neighbours give the normal.
Every point and normal that may be floor is tried as one (RANSAC without chance: there are few enough); the best are
fitted to what lies on them. The plane with the most area on it and upright to it wins, if next to nothing lies below
it. The yaw of the walls in the upright frame is that of ``hsbench.baselines.occlusion.boundary.wall_yaw``. All
constants are hsbench defaults.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.schema.sensor import Sensor
from hsbench.typing import AnyArray, BoolArray, FloatArray

BLOCK_PX = 8
LEVEL = np.array([0.0, -1.0, 0.0])
"""Up in the frame of a camera that is held level."""
USUAL_HEIGHT_M = 1.5  # of a camera that sees no floor
LARGEST_LEAN = math.cos(math.radians(45.0))  # a camera looks more along the floor than down on it
NORMALS_AGREE = math.cos(math.radians(15.0))
NEAR_M, NEAR_PER_M2 = 0.02, 0.003  # on the plane: about twice a Kinect's noise, which grows with the squared distance
BELOW_SHARE = 0.01  # of the area, that may lie below the floor: reflections and lost edges
BELOW_FACTOR = 3.0  # of what counts as on the plane
LEAST_SHARE = 0.005  # of the area, that a floor has
LEAST_HEIGHT_M = 0.5  # of a camera above the floor: a wall seen along itself may pass below it more closely
UPRIGHT = math.sin(math.radians(7.0))  # of a wall's normal along up
LEAST_FACING = 0.1  # cosine, by which the area that a pixel shows is divided: an edge is no large surface
MOST_TRIED = 600
MOST_FITTED = 20
FITS = 5


def sensor_from_depth(camera: PinholeCamera, depth_m: AnyArray) -> Sensor:
    """Height, tilt and roll of a camera from its depth image (h, w) in metres, 0 = none.

    Without a plane that may be the floor the camera is level and ``USUAL_HEIGHT_M`` high.
    """
    found = floor_plane(camera, depth_m)
    up, height_m = (LEVEL, USUAL_HEIGHT_M) if found is None else found
    return Sensor(
        "rgbd",
        camera,
        float(quantise_m(height_m)),
        quantise_angle(math.asin(min(1.0, max(-1.0, -float(up[2]))))),
        quantise_angle(math.atan2(-up[0], -up[1])),
    )


def floor_plane(camera: PinholeCamera, depth_m: AnyArray) -> tuple[FloatArray, float] | None:
    """((3,) unit vector up in the camera frame, metres of the camera above the floor); None where no floor is seen."""
    seen = _patches(camera, depth_m)
    candidates = np.flatnonzero(seen.normals @ LEVEL > LARGEST_LEAN)
    tried = [
        (seen.normals[k], -float(seen.points[k] @ seen.normals[k]))
        for k in candidates[:: max(1, -(-len(candidates) // MOST_TRIED))]
    ]
    scores = np.array([seen.score(*plane) for plane in tried])
    best = [tried[k] for k in np.argsort(-scores, kind="stable")[:MOST_FITTED] if scores[k] > 0]
    fitted = [plane for plane in map(seen.fitted, best) if seen.score(*plane) > 0]
    return max(fitted, key=lambda plane: seen.score(*plane), default=None)


@dataclass(frozen=True, eq=False)
class _Patches:
    """N blocks of a picture: points (N, 3) in the camera frame, unit normals (N, 3) towards the camera, area (N,) as
    shares of all that is seen, and near_m (N,), how far from a plane a point of it may lie.
    """

    points: FloatArray
    normals: FloatArray
    area: FloatArray
    near_m: FloatArray

    def on(self, up: FloatArray, height_m: float) -> BoolArray:
        """(N,) whether a patch is part of the plane that lies ``height_m`` below the camera."""
        return np.asarray(
            (np.abs(self.points @ up + height_m) < self.near_m) & (self.normals @ up > NORMALS_AGREE), dtype=np.bool_
        )

    def score(self, up: FloatArray, height_m: float) -> float:
        """The area on a plane and upright to it; 0 where it can be no floor."""
        floor = float(self.area[self.on(up, height_m)].sum())
        below = float(self.area[self.points @ up + height_m < -BELOW_FACTOR * self.near_m].sum())
        if height_m < LEAST_HEIGHT_M or floor < LEAST_SHARE or below > BELOW_SHARE:
            return 0.0
        return floor + float(self.area[np.abs(self.normals @ up) < UPRIGHT].sum())

    def fitted(self, plane: tuple[FloatArray, float]) -> tuple[FloatArray, float]:
        """A plane fitted to what lies on it by least squares, and again to what then lies on it."""
        for _ in range(FITS):
            on = self.on(*plane)
            if not on.any():
                break
            plane = _fit(self.points[on], self.area[on] / self.near_m[on] ** 2)
        return plane


def _fit(points: FloatArray, weight: FloatArray) -> tuple[FloatArray, float]:
    """((3,) unit normal towards ``LEVEL``, distance of the origin above it) of a plane through (N, 3) points."""
    middle = weight @ points / weight.sum()
    spread = points - middle
    normal = np.linalg.eigh((spread * weight[:, None]).T @ spread)[1][:, 0]
    normal *= np.sign(normal @ LEVEL) or 1.0
    return normal, -float(normal @ middle)


def _patches(camera: PinholeCamera, depth_m: AnyArray) -> _Patches:
    """Those of a depth image (h, w) whose neighbours have depth too."""
    depth = np.asarray(depth_m, dtype=np.float64)
    rows, columns = (size // BLOCK_PX for size in depth.shape)
    whole = camera.unproject(depth)[: rows * BLOCK_PX, : columns * BLOCK_PX]
    blocks = whole.reshape(rows, BLOCK_PX, columns, BLOCK_PX, 3)
    weight = blocks[..., 2] > 0
    count = weight.sum(axis=(1, 3))
    mean = blocks.sum(axis=(1, 3)) / np.maximum(count, 1)[..., None]
    known: BoolArray = count >= BLOCK_PX**2 // 2
    # Two blocks across: a difference over one alone is half noise.
    along, down = mean[1:-1, 2:] - mean[1:-1, :-2], mean[2:, 1:-1] - mean[:-2, 1:-1]
    normal, middle = np.cross(along, down), mean[1:-1, 1:-1]
    length = np.linalg.norm(normal, axis=-1)
    known = known[1:-1, 1:-1] & known[1:-1, 2:] & known[1:-1, :-2] & known[2:, 1:-1] & known[:-2, 1:-1] & (length > 0)
    normals = normal[known] / length[known][:, None]
    points = middle[known]
    facing = np.einsum("ij,ij->i", normals, points)
    normals *= -np.sign(facing)[:, None]
    distance = np.linalg.norm(points, axis=1)
    area = distance**2 / np.maximum(np.abs(facing) / distance, LEAST_FACING)
    near_m = NEAR_M + NEAR_PER_M2 * points[:, 2] ** 2
    return _Patches(points, normals, area / max(float(area.sum()), 1e-12), near_m)
