"""The soft dark rim where bodies touch floors and seats: light from above that a body nearby keeps out."""

from __future__ import annotations

import math

import numba
import numpy as np

from hsbench.typing import FloatArray

REACH_M = 0.3
"""Bodies shade what is at most so far from them."""


@numba.njit(cache=True, error_model="numpy")
def light_left(points: FloatArray, ends: FloatArray, radii: FloatArray) -> FloatArray:
    """(h, w, 3) points, (C, 2, 3) ends and (C, 2) radii of capsules -> (h, w) share of light that is left there.

    Each capsule takes from a level surface what its nearest sphere covers of the sky: cos (r / d)^2 (Lambert's law),
    faded to nothing at REACH_M.
    """
    left = np.ones(points.shape[:2])
    low, high = np.empty(3), np.empty(3)
    for c in range(3):
        low[c] = ends[:, :, c].min() - radii.max() - REACH_M
        high[c] = ends[:, :, c].max() + radii.max() + REACH_M
    for i in range(points.shape[0]):
        for j in range(points.shape[1]):
            x, y, z = points[i, j]
            if not (low[0] < x < high[0] and low[1] < y < high[1] and low[2] < z < high[2]):
                continue
            for k in range(len(ends)):
                left[i, j] *= 1.0 - _covered(x, y, z, ends[k], radii[k])
    return left


@numba.njit(cache=True, error_model="numpy")
def _covered(x: float, y: float, z: float, ends: FloatArray, radii: FloatArray) -> float:
    ax, ay, az = x - ends[0, 0], y - ends[0, 1], z - ends[0, 2]
    bx, by, bz = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1], ends[1, 2] - ends[0, 2]
    along = min(max((ax * bx + ay * by + az * bz) / max(bx * bx + by * by + bz * bz, 1e-12), 0.0), 1.0)
    dx, dy, up = ax - along * bx, ay - along * by, along * bz - az
    radius = radii[0] + along * (radii[1] - radii[0])
    distance = max(math.sqrt(dx * dx + dy * dy + up * up), radius)
    if up <= 0.0 or distance >= radius + REACH_M:
        return 0.0
    fade = 1.0 - (distance - radius) / REACH_M
    return up / distance * (radius / distance) ** 2 * fade
