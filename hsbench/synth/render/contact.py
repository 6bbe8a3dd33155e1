"""The soft dark rim where bodies touch floors and seats: light from above that a body nearby keeps out."""

from __future__ import annotations

import math

import numba
import numpy as np

from hsbench.synth.render.shading import GAMMA
from hsbench.typing import AnyArray, FloatArray, UInt8Array

REACH_M = 0.3
"""Bodies shade what is at most so far from them."""

SKY_SHARE = 0.8
"""Of the light that comes from above; the rest is thrown back by what is near, the body among it."""

LEAST_COVERED = 0.025
"""A smaller share of the sky is not missed: two levels of 255 of a bright floor."""


@numba.njit(cache=True, error_model="numpy")
def shade(rgb: UInt8Array, left: FloatArray) -> None:
    """Leave to (h, w, 3) sRGB pixels, in place, (h, w) shares of their light."""
    for i in range(rgb.shape[0]):
        for j in range(rgb.shape[1]):
            if left[i, j] < 1.0:
                # The display curve is close to a power, so bytes scale with a root of the light.
                share = left[i, j] ** (1.0 / GAMMA)
                for c in range(3):
                    rgb[i, j, c] = np.rint(rgb[i, j, c] * share)


@numba.njit(cache=True, error_model="numpy")
def light_left(
    depth_m: AnyArray,
    rays: FloatArray,
    world_T_camera: FloatArray,
    from_above: bool,
    ends: FloatArray,
    radii: FloatArray,
) -> FloatArray:
    """(h, w) depths along (h, w, 3) rays, (C, 2, 3) ends and (C, 2) radii of capsules -> (h, w) share of light left.

    Each capsule takes from a level surface what its nearest sphere covers of the sky: cos (r / d)^2 (Lambert's law),
    faded to nothing at REACH_M. Capsules of one body overlap, so that the one that covers most counts.
    Where depth is 0, nothing is lost; from above, depths are heights and rays as ``ray_table`` has them.
    """
    left: FloatArray = np.ones(depth_m.shape)
    m = world_T_camera
    low, high = np.empty((len(ends), 3)), np.empty((len(ends), 3))  # of what each capsule can shade
    for k in range(len(ends)):
        reach = _reach(radii[k].max())
        for c in range(3):
            low[k, c] = ends[k, :, c].min() - reach
            high[k, c] = ends[k, :, c].max() + (reach if c < 2 else 0.0)
    x0, y0, z0 = low[:, 0].min(), low[:, 1].min(), low[:, 2].min()
    x1, y1, z1 = high[:, 0].max(), high[:, 1].max(), high[:, 2].max()
    for i in range(left.shape[0]):
        for j in range(left.shape[1]):
            depth = float(depth_m[i, j])
            level = 1.0 if from_above else depth
            u, v, w = level * rays[i, j, 0], level * rays[i, j, 1], depth * rays[i, j, 2]
            z = m[2, 0] * u + m[2, 1] * v + m[2, 2] * w + m[2, 3]
            if (depth == 0.0 and not from_above) or not z0 < z < z1:
                continue
            x = m[0, 0] * u + m[0, 1] * v + m[0, 2] * w + m[0, 3]
            y = m[1, 0] * u + m[1, 1] * v + m[1, 2] * w + m[1, 3]
            if not (x0 < x < x1 and y0 < y < y1):
                continue
            covered = LEAST_COVERED
            for k in range(len(ends)):
                if low[k, 2] < z < high[k, 2] and low[k, 0] < x < high[k, 0] and low[k, 1] < y < high[k, 1]:
                    covered = _covered(x, y, z, ends, radii, k, covered)
            if covered > LEAST_COVERED:
                left[i, j] = 1.0 - SKY_SHARE * covered
    return left


@numba.njit(cache=True, error_model="numpy")
def _reach(radius: float) -> float:
    """Distance from the middle of a ball beyond which it covers less than LEAST_COVERED of the sky."""
    near, far = radius, radius + REACH_M
    while far - near > 1e-3:
        middle = (near + far) / 2
        if (radius / middle) ** 2 * (1.0 - (middle - radius) / REACH_M) > LEAST_COVERED:
            near = middle
        else:
            far = middle
    return far


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _covered(x: float, y: float, z: float, ends: FloatArray, radii: FloatArray, k: int, least: float) -> float:
    """What capsule k covers of the sky over a point, or ``least`` where that is more."""
    ax, ay, az = x - ends[k, 0, 0], y - ends[k, 0, 1], z - ends[k, 0, 2]
    bx, by, bz = ends[k, 1, 0] - ends[k, 0, 0], ends[k, 1, 1] - ends[k, 0, 1], ends[k, 1, 2] - ends[k, 0, 2]
    along = min(max((ax * bx + ay * by + az * bz) / max(bx * bx + by * by + bz * bz, 1e-12), 0.0), 1.0)
    dx, dy, up = ax - along * bx, ay - along * by, along * bz - az
    radius = radii[k, 0] + along * (radii[k, 1] - radii[k, 0])
    square = dx * dx + dy * dy + up * up
    # The square of the ratio is the most it can be, and told without a root.
    if up <= 0.0 or square >= (radius + REACH_M) ** 2 or radius**2 <= least * square:
        return least
    distance = max(math.sqrt(square), radius)
    fade = 1.0 - (distance - radius) / REACH_M
    return max(up / distance * (radius / distance) ** 2 * fade, least)
