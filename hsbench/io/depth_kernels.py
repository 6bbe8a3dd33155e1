"""Compiled loops of depth noise: angles, shade, and readings of every pixel.

Apart, since numba is slow to load and data without depth need none.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from hsbench.typing import BoolArray, Float32Array, UInt16Array

SLOPE_PX = 4  # slopes are measured over so many pixels: millimetres make a difference of one pixel too coarse
SQUARE_ON = math.radians(89.0)  # steeper angles are noise of the slope
STEEPEST = 2.0  # theta / (pi/2 - theta) at 60 degrees, up to where Nguyen et al. measured: steeper ones err no more
SHADE_SLACK_PX = 0.5  # of the pattern
ARCCOS = (1.5707288, -0.2121144, 0.0742610, -0.0187293)  # Abramowitz, Stegun, 4.4.45: within 6.7e-5 rad
MM_PER_M = 1000.0


@numba.njit(cache=True, error_model="numpy")
def viewing_angle(depth_m: Float32Array, focal_px: float) -> Float32Array:
    """(h, w) depth of a camera whose principal point is the middle -> (h, w) angles of surfaces to the line of sight.

    0 is square on. Of the slopes to either side the gentler one counts: an edge is no surface. On a plane this is exact
    but for the curvature of depth over SLOPE_PX pixels. In float32 throughout, eight pixels at a time.
    """
    height, width = depth_m.shape
    angle = np.empty((height, width), dtype=np.float32)
    one, focal, steepest = np.float32(1.0), np.float32(focal_px), np.float32(SQUARE_ON)
    nearest = np.float32(1e-3)
    a, b, c, d = np.float32(ARCCOS[0]), np.float32(ARCCOS[1]), np.float32(ARCCOS[2]), np.float32(ARCCOS[3])
    across = ((np.arange(width) + 0.5 - width / 2) / focal_px).astype(np.float32)
    gx, gy = np.zeros(width, dtype=np.float32), np.zeros(width, dtype=np.float32)
    for i in range(height):
        y = np.float32((i + 0.5 - height / 2) / focal_px)
        row = depth_m[i]
        for j in range(SLOPE_PX, width - SLOPE_PX):
            gx[j] = _gentler(row[j + SLOPE_PX] - row[j], row[j] - row[j - SLOPE_PX])
        for j in range(width):
            if j < SLOPE_PX or j >= width - SLOPE_PX:
                gx[j] = _slope_at_rim(row, j)
        if SLOPE_PX <= i < height - SLOPE_PX:
            above, below = depth_m[i - SLOPE_PX], depth_m[i + SLOPE_PX]
            for j in range(width):
                gy[j] = _gentler(below[j] - row[j], row[j] - above[j])
        else:
            for j in range(width):
                gy[j] = _slope_at_rim(depth_m[:, j], i)
        for j in range(width):
            per_depth = focal / (max(row[j], nearest) * np.float32(SLOPE_PX))
            sx, sy, x = gx[j] * per_depth, gy[j] * per_depth, across[j]
            along = one + sx * x + sy * y
            square = (one + x * x + y * y) * (sx * sx + sy * sy + along * along)
            cosine = min(one / np.sqrt(square), one)
            found = np.sqrt(one - cosine) * (a + cosine * (b + cosine * (c + cosine * d)))
            angle[i, j] = min(found, steepest)
    return angle


@numba.njit(cache=True, error_model="numpy", inline="always")
def _gentler(ahead: np.float32, behind: np.float32) -> np.float32:
    return ahead if abs(ahead) < abs(behind) else behind


@numba.njit(cache=True, error_model="numpy")
def _slope_at_rim(line_m: Float32Array, k: int) -> np.float32:
    """SLOPE_PX steps ahead of or behind place k of a line, whose first and last step go on beyond its ends."""
    ahead = behind = np.float32(0.0)
    last = len(line_m) - 1
    for step in range(SLOPE_PX if last > 0 else 0):
        after, before = min(k + step, last - 1), min(max(k - SLOPE_PX + step, 0), last - 1)
        ahead += line_m[after + 1] - line_m[after]
        behind += line_m[before + 1] - line_m[before]
    return _gentler(ahead, behind)


@numba.njit(cache=True, error_model="numpy")
def shaded(depth_m: Float32Array, disparity_px_m: float) -> BoolArray:
    """(h, w) bool: pixels that a light beside the camera, to its right, does not reach past what stands before them.

    disparity_px_m: focal length times baseline. A point at column u and depth z lies at column u - disparity / z of the
    light's own image. Going left, these columns fall; where one does not, something nearer to the right covers it.
    """
    covered = np.zeros(depth_m.shape, dtype=np.bool_)
    for i in range(depth_m.shape[0]):
        least = np.inf
        for j in range(depth_m.shape[1] - 1, -1, -1):
            if depth_m[i, j] > 0.0:
                column = j - disparity_px_m / depth_m[i, j]
                covered[i, j] = column > least + SHADE_SLACK_PX
                least = min(least, column)
    return covered


@numba.njit(cache=True, error_model="numpy")
def readings(
    clean_m: Float32Array, angle: Float32Array, drawn: UInt16Array, normal: Float32Array,
    lateral: tuple[float, float], axial: tuple[float, float, float, float], near_m: float, far_m: float,
) -> Float32Array:  # fmt: skip
    """(h, w) noisy metres, whole millimetres; 0 where what is read lies outside of near_m..far_m.

    drawn: (3, h, w) places in ``normal``, a table of equally likely values of the standard normal distribution, for the
    shift down, to the right and along. lateral, axial: the constants of ``DepthNoise``, of which the last by the angle.
    """
    height, width = clean_m.shape
    base, square, offset_m, slanted = axial
    noisy = np.zeros((height, width), dtype=np.float32)
    for i in range(height):
        for j in range(width):
            turned = min(angle[i, j] / (math.pi / 2 - angle[i, j]), STEEPEST)
            spread = lateral[0] + lateral[1] * turned
            row = min(max(i + int(np.rint(normal[drawn[0, i, j]] * spread)), 0), height - 1)
            column = min(max(j + int(np.rint(normal[drawn[1, i, j]] * spread)), 0), width - 1)
            depth = clean_m[row, column]
            if near_m <= depth <= far_m:
                sigma = base + square * (depth - offset_m) ** 2 + slanted * turned * turned / math.sqrt(depth)
                noisy[i, j] = np.rint((depth + sigma * normal[drawn[2, i, j]]) * MM_PER_M) / MM_PER_M
    return noisy
