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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def shade(rgb: UInt8Array, left: FloatArray) -> None:
    """Leave to (h, w, 3) sRGB pixels, in place, (h, w) shares of their light."""
    for i in range(rgb.shape[0]):
        for j in range(rgb.shape[1]):
            if left[i, j] < 1.0:
                # The display curve is close to a power, so bytes scale with a root of the light.
                share = left[i, j] ** (1.0 / GAMMA)
                for c in range(3):
                    rgb[i, j, c] = np.rint(rgb[i, j, c] * share)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def light_left(
    depth_m: AnyArray,
    rays: FloatArray,
    world_T_camera: FloatArray,
    from_above: bool,
    ends: FloatArray,
    radii: FloatArray,
    farthest_m: float = math.inf,
) -> FloatArray:
    """(h, w) depths along (h, w, 3) rays, (C, 2, 3) ends and (C, 2) radii of capsules -> (h, w) share of light left.

    Each capsule takes from a level surface what its nearest sphere covers of the sky: cos (r / d)^2 (Lambert's law),
    faded to nothing at REACH_M. Capsules of one body overlap, so that the one that covers most counts.
    Where depth is 0, nothing is lost; from above, depths are heights and rays as ``ray_table`` has them.
    farthest_m: no depth beyond it is in their reach; given, it saves time.
    """
    left: FloatArray = np.ones(depth_m.shape)
    m = world_T_camera
    capsules = _packed(ends, radii)
    x0, y0, z0 = capsules[:, 0].min(), capsules[:, 1].min(), capsules[:, 2].min()
    x1, y1, z1 = capsules[:, 3].max(), capsules[:, 4].max(), capsules[:, 5].max()
    for i in range(left.shape[0]):
        for j in range(left.shape[1]):
            depth = float(depth_m[i, j])
            if depth > farthest_m or (depth == 0.0 and not from_above):
                continue
            level = 1.0 if from_above else depth
            u, v, w = level * rays[i, j, 0], level * rays[i, j, 1], depth * rays[i, j, 2]
            z = m[2, 0] * u + m[2, 1] * v + m[2, 2] * w + m[2, 3]
            if not z0 < z < z1:
                continue
            x = m[0, 0] * u + m[0, 1] * v + m[0, 2] * w + m[0, 3]
            y = m[1, 0] * u + m[1, 1] * v + m[1, 2] * w + m[1, 3]
            if not (x0 < x < x1 and y0 < y < y1):
                continue
            covered = LEAST_COVERED
            for k in range(len(capsules)):
                if (
                    capsules[k, 2] < z < capsules[k, 5]
                    and capsules[k, 0] < x < capsules[k, 3]
                    and capsules[k, 1] < y < capsules[k, 4]
                ):
                    covered = _covered(x, y, z, capsules, k, covered)
            if covered > LEAST_COVERED:
                left[i, j] = 1.0 - SKY_SHARE * covered
    return left


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _packed(ends: FloatArray, radii: FloatArray) -> FloatArray:
    """(C, 17): low and high corner of what a capsule can shade, start, axis, axis / length^2, radius and its growth."""
    rows = np.empty((len(ends), 17))
    for k in range(len(ends)):
        reach = _reach(radii[k].max())
        square = 0.0
        for c in range(3):
            axis = ends[k, 1, c] - ends[k, 0, c]
            square += axis * axis
            rows[k, c] = ends[k, :, c].min() - reach
            rows[k, 3 + c] = ends[k, :, c].max() + (reach if c < 2 else 0.0)
            rows[k, 6 + c], rows[k, 9 + c] = ends[k, 0, c], axis
        for c in range(3):
            rows[k, 12 + c] = rows[k, 9 + c] / max(square, 1e-12)
        rows[k, 15], rows[k, 16] = radii[k, 0], radii[k, 1] - radii[k, 0]
    return rows


@numba.njit(cache=True, nogil=True, error_model="numpy")
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


@numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _covered(x: float, y: float, z: float, capsules: FloatArray, k: int, least: float) -> float:
    """What a packed capsule covers of the sky over a point, or ``least`` where that is more."""
    ax, ay, az = x - capsules[k, 6], y - capsules[k, 7], z - capsules[k, 8]
    along = min(max(ax * capsules[k, 12] + ay * capsules[k, 13] + az * capsules[k, 14], 0.0), 1.0)
    dx, dy, up = ax - along * capsules[k, 9], ay - along * capsules[k, 10], along * capsules[k, 11] - az
    radius = capsules[k, 15] + along * capsules[k, 16]
    square = dx * dx + dy * dy + up * up
    # The square of the ratio is the most it can be, and told without a root.
    if up <= 0.0 or square >= (radius + REACH_M) ** 2 or radius**2 <= least * square:
        return least
    distance = max(math.sqrt(square), radius)
    fade = 1.0 - (distance - radius) / REACH_M
    return max(up / distance * (radius / distance) ** 2 * fade, least)
