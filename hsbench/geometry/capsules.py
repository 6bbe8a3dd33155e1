"""Tapered capsules: what bodies are made of. Exact, closed-form tests of points and segments against them.

A tapered capsule is the union of the spheres whose centre runs from a to b while their radius runs from ra to rb.
Every test minimises |x - c(u)|^2 - r(u)^2 over the capsule's parameter u in [0, 1] (and a segment's in [0, 1]): a
quadratic, so that its least value is at its stationary point or on the border.
"""

from __future__ import annotations

import numba

from hsbench.typing import FloatArray

PARALLEL = 1e-18  # a determinant below this has no stationary point of its own


@numba.njit(cache=True)
def edge_gap(px: float, py: float, pz: float, dx: float, dy: float, dz: float, r0: float, dr: float) -> float:
    """Least of |p - u d|^2 - (r0 + u dr)^2 over u in [0, 1]."""
    a = dx * dx + dy * dy + dz * dz - dr * dr
    b = px * dx + py * dy + pz * dz + r0 * dr
    c = px * px + py * py + pz * pz - r0 * r0
    least = min(c, a - 2.0 * b + c)
    if a > 0.0 and 0.0 < b < a:
        least = min(least, c - b * b / a)
    return least


@numba.njit(cache=True)
def point_gap(x: float, y: float, z: float, a: FloatArray, b: FloatArray, ra: float, rb: float) -> float:
    """Negative inside, zero on, positive outside the tapered capsule from a (3,) to b (3,); not a distance."""
    return edge_gap(x - a[0], y - a[1], z - a[2], b[0] - a[0], b[1] - a[1], b[2] - a[2], ra, rb - ra)


@numba.njit(cache=True)
def segment_hits(p: FloatArray, q: FloatArray, a: FloatArray, b: FloatArray, ra: float, rb: float) -> bool:
    """Whether the segment p q (3,) meets the tapered capsule from a (3,) to b (3,)."""
    ex, ey, ez = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    dr = rb - ra
    if edge_gap(wx, wy, wz, dx, dy, dz, ra, dr) <= 0.0:
        return True
    if edge_gap(wx + ex, wy + ey, wz + ez, dx, dy, dz, ra, dr) <= 0.0:
        return True
    if edge_gap(-wx, -wy, -wz, ex, ey, ez, ra, 0.0) <= 0.0:
        return True
    if edge_gap(dx - wx, dy - wy, dz - wz, ex, ey, ez, rb, 0.0) <= 0.0:
        return True
    ee = ex * ex + ey * ey + ez * ez
    ed = ex * dx + ey * dy + ez * dz
    dd = dx * dx + dy * dy + dz * dz - dr * dr
    we = wx * ex + wy * ey + wz * ez
    wd = wx * dx + wy * dy + wz * dz + ra * dr
    determinant = ee * dd - ed * ed
    if determinant <= PARALLEL:
        return False
    t = (ed * wd - dd * we) / determinant
    u = (ee * wd - ed * we) / determinant
    if not (0.0 < t < 1.0 and 0.0 < u < 1.0):
        return False
    gx, gy, gz = wx + t * ex - u * dx, wy + t * ey - u * dy, wz + t * ez - u * dz
    r = ra + u * dr
    return gx * gx + gy * gy + gz * gz - r * r <= 0.0
