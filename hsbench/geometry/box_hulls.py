"""Convex hulls of two boxes, for GIoU: an area in the plane (compiled) and a volume in space (Qhull).

As in ``box_overlap`` one box is the frame and becomes the square or cube [-1, 1]; hulls do not mind an affine map, and
thin boxes then do not look flat.
"""

from __future__ import annotations

import numba

from hsbench.typing import FloatArray

POINTS, CHAIN = 8, 17
"""Rows of scratch that ``hull_area`` needs: the corners in order, and the chain around them with what it drops."""


@numba.njit(cache=True, error_model="numpy")
def hull_area(px: float, py: float, ux: float, uy: float, vx: float, vy: float, scratch: FloatArray) -> float:
    """Area of the hull of [-1, 1]^2 and the parallelogram of centre p and half axes u, v (Andrew's monotone chain)."""
    for k in range(POINTS):
        x, y = 1.0 - 2.0 * (k & 1), 1.0 - (k & 2)
        if k >= 4:
            x, y = px + x * ux + y * vx, py + x * uy + y * vy
        at = k
        while at > 0 and (scratch[at - 1, 0] > x or (scratch[at - 1, 0] == x and scratch[at - 1, 1] > y)):
            scratch[at] = scratch[at - 1]
            at -= 1
        scratch[at, 0], scratch[at, 1] = x, y
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


def hull_volume(points: FloatArray) -> float:
    """(P, 3) points -> volume of their convex hull, by Qhull."""
    from scipy.spatial import ConvexHull  # a quarter second to import, for one measure

    return float(ConvexHull(points).volume)
