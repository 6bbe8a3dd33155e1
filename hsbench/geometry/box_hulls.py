"""What just holds two boxes, for GIoU: an aligned box, an upright prism over a convex outline, or a convex hull.

Outlines are compiled; hulls in space are Qhull's. Swapping the boxes gives the same volumes, bit for bit.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import FloatArray

POINTS, CHAIN = 8, 17
"""Rows of scratch for an outline: the corners in order, and the chain around them with what it drops."""


def aligned(a: FloatArray, b: FloatArray) -> FloatArray:
    """Aligned boxes a (N, 6), b (M, 6) -> (N, M) volumes of the smallest aligned boxes that hold both."""
    size_a, size_b = a[:, None, 3:], b[None, :, 3:]
    reach = (size_a + size_b) / 2 + np.abs(a[:, None, :3] - b[None, :, :3])
    return np.asarray(np.maximum(np.maximum(size_a, size_b), reach).prod(axis=2))


def upright(a: FloatArray, b: FloatArray) -> FloatArray:
    """Upright boxes a (N, 7), b (M, 7) -> (N, M) volumes of the smallest upright prisms that hold both."""
    outlines = np.empty((len(a), len(b)))
    _fill_outlines(a, np.cos(a[:, 6]), np.sin(a[:, 6]), b, np.cos(b[:, 6]), np.sin(b[:, 6]), outlines)
    height_a, height_b = a[:, None, 5], b[None, :, 5]
    reach = (height_a + height_b) / 2 + np.abs(a[:, None, 2] - b[None, :, 2])
    return np.asarray(outlines * np.maximum(np.maximum(height_a, height_b), reach))


def oriented(a: FloatArray, b: FloatArray) -> FloatArray:
    """Oriented boxes a (N, 15), b (M, 15), rotations orthonormal -> (N, M) volumes of their convex hulls."""
    from scipy.spatial import ConvexHull  # a quarter second to import, for one measure

    signs = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
    hulls = np.empty((len(a), len(b)))
    for i in range(len(a)):
        for j in range(len(b)):
            # in coordinates where one box is the cube [-1, 1]^3, so that a thin one does not look flat; a total order
            # of rows chooses which, the smaller if they differ
            f, g = sorted((a[i], b[j]), key=lambda box: (box[3:6].prod(), *box))
            f_R, g_R, f_half = f[6:].reshape(3, 3), g[6:].reshape(3, 3), f[3:6] / 2
            g_corners = ((signs * g[3:6] / 2) @ (f_R.T @ g_R).T + (g[:3] - f[:3]) @ f_R) / f_half
            hulls[i, j] = ConvexHull(np.concatenate([signs, g_corners])).volume * f_half.prod()
    return hulls


@numba.njit(cache=True, error_model="numpy")
def _fill_outlines(
    a: FloatArray,
    cos_a: FloatArray,
    sin_a: FloatArray,
    b: FloatArray,
    cos_b: FloatArray,
    sin_b: FloatArray,
    out: FloatArray,
) -> None:
    """Areas of the convex hulls of two footprints each, (N, M) (Andrew's monotone chain)."""
    scratch = np.empty((POINTS + CHAIN, 2))
    for i in range(len(a)):
        for j in range(len(b)):
            # about the middle of the two, which does not depend on their order
            x, y = 0.5 * (a[i, 0] + b[j, 0]), 0.5 * (a[i, 1] + b[j, 1])
            _insert_corners(scratch, 0, a[i, 0] - x, a[i, 1] - y, a[i, 3], a[i, 4], cos_a[i], sin_a[i])
            _insert_corners(scratch, 4, b[j, 0] - x, b[j, 1] - y, b[j, 3], b[j, 4], cos_b[j], sin_b[j])
            out[i, j] = _outline_area(scratch)


@numba.njit(cache=True, error_model="numpy")
def _insert_corners(
    points: FloatArray, n: int, x: float, y: float, length: float, width: float, c: float, s: float
) -> None:
    """Insert a rectangle's corners into n points that are sorted by x, then y."""
    for k in range(4):
        u, v = (0.5 - (k & 1)) * length, (0.5 - (k >> 1)) * width
        px, py = x + c * u - s * v, y + s * u + c * v
        at = n + k
        while at > 0 and (points[at - 1, 0] > px or (points[at - 1, 0] == px and points[at - 1, 1] > py)):
            points[at] = points[at - 1]
            at -= 1
        points[at, 0], points[at, 1] = px, py


@numba.njit(cache=True, error_model="numpy")
def _outline_area(scratch: FloatArray) -> float:
    chain = scratch[POINTS:]
    n = 0
    for k in range(POINTS):
        n = _append(chain, n, scratch[k], 0)
    lower = n - 1
    for k in range(POINTS - 2, -1, -1):
        n = _append(chain, n, scratch[k], lower)
    twice = 0.0
    for k in range(1, n - 1):
        twice += _turn(chain[0], chain[k], chain[k + 1])
    return 0.5 * twice


@numba.njit(cache=True, error_model="numpy")
def _append(chain: FloatArray, n: int, point: FloatArray, start: int) -> int:
    """Put a point at the end of a left-turning chain that began at ``start``; return its new length."""
    while n >= start + 2 and _turn(chain[n - 2], chain[n - 1], point) <= 0.0:
        n -= 1
    chain[n] = point
    return n + 1


@numba.njit(cache=True, error_model="numpy")
def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the signed area of a triangle of (2,) corners."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
