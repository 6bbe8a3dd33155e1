"""Compiled kernels of ``boxes``: intersection volumes of prepared boxes, without any tolerance.

Rows of prepared boxes are what ``boxes._prepared_*`` say. Each call runs on one thread and lets others run. One box of
a pair, the smaller, is the frame, so that far from the origin nothing is lost.

Aligned: the common lengths along the axes. Upright: common height times common area of the footprints, where the
divergence theorem gives the area as the sum over the edges of the other footprint of the integral of clamp(y, -1, 1) dx
cut to |x| <= 1, the frame being the square [-1, 1]^2. That is a continuous function of the corners, also where edges
coincide. Oriented: ``box_edges`` computes pairs in general position, many at once, ``box_faces`` the others.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.geometry import box_edges, box_faces
from hsbench.typing import FloatArray, IntArray

# ---------------------------------------------------------------- all pairs, or row i with row i


@numba.njit(cache=True, error_model="numpy", nogil=True)
def fill_aligned(a: FloatArray, b: FloatArray, paired: bool, ratio: bool, out: FloatArray) -> None:
    """Prepared aligned boxes a (N, 7), b (M, 7): IoU, or common volume unless ``ratio``, into out (N, M), or (N, 1)
    of row i with row i where ``paired``.
    """
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            common = 1.0
            for k in range(3):
                common *= _overlap(abs(b[j, k] - a[i, k]), a[i, 3 + k], b[j, 3 + k])
            out[i, j - start] = _measure(common, a[i, 6], b[j, 6], ratio)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def fill_upright(a: FloatArray, b: FloatArray, paired: bool, ratio: bool, out: FloatArray) -> None:
    """Prepared upright boxes a (N, 10), b (M, 10): IoU, or common volume unless ``ratio``, into out (N, M), or (N, 1)
    of row i with row i where ``paired``.
    """
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            dx, dy = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
            reach = a[i, 8] + b[j, 8]
            common = 0.0
            if dx * dx + dy * dy < reach * reach:
                height = _overlap(abs(b[j, 2] - a[i, 2]), a[i, 5], b[j, 5])
                if height > 0.0:
                    common = height * (_footprint(a, i, b, j) if _is_frame(a, i, b, j, 9) else _footprint(b, j, a, i))
            out[i, j - start] = _measure(common, a[i, 9], b[j, 9], ratio)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def fill_oriented(a: FloatArray, b: FloatArray, paired: bool, ratio: bool, out: FloatArray) -> None:
    """Prepared oriented boxes a (N, 17), b (M, 17): as ``fill_upright``."""
    pairs, common = np.ones((box_edges.FIELDS, box_edges.LANES)), np.empty(box_edges.LANES)
    cell_of = np.empty((box_edges.LANES, 2), np.intp)
    work = np.empty(box_faces.SCRATCH)
    lane = 0
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            if _far(a, i, b, j):
                out[i, j - start] = 0.0
                continue
            parted = _place(a, i, b, j, pairs, lane) if _is_frame(a, i, b, j, 16) else _place(b, j, a, i, pairs, lane)
            if parted:
                out[i, j - start] = 0.0
            elif not box_edges.is_general(pairs, lane):
                out[i, j - start] = box_faces.common_volume(pairs, lane, work)
            else:
                cell_of[lane] = i, j - start
                lane += 1
                if lane == box_edges.LANES:
                    _spread(pairs, common, cell_of, lane, out)
                    lane = 0
    _spread(pairs, common, cell_of, lane, out)
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            out[i, j - start] = _measure(out[i, j - start], a[i, 16], b[j, 16], ratio)


@numba.njit(cache=True, error_model="numpy")
def _spread(pairs: FloatArray, common: FloatArray, cell_of: IntArray, lanes: int, out: FloatArray) -> None:
    """Volumes of the first ``lanes`` pairs, none where 0, to the cells of ``out`` they belong to."""
    if lanes:
        box_edges.common_volumes(pairs, common)
    for lane in range(lanes):
        out[cell_of[lane, 0], cell_of[lane, 1]] = max(0.0, common[lane])


@numba.njit(cache=True, error_model="numpy")
def _measure(common: float, volume_a: float, volume_b: float, ratio: bool) -> float:
    common = min(common, volume_a, volume_b)
    return common / (volume_a + volume_b - common) if ratio else common


@numba.njit(cache=True, error_model="numpy")
def _is_frame(a: FloatArray, i: int, b: FloatArray, j: int, volume: int) -> bool:
    """Whether a[i] is the frame of the pair: the smaller volume, for accuracy. A total order on rows, so that swapping
    a and b computes the same thing. volume: the column that holds it, the last one.
    """
    if a[i, volume] != b[j, volume]:
        return a[i, volume] < b[j, volume]
    for k in range(volume):
        if a[i, k] != b[j, k]:
            return a[i, k] < b[j, k]
    return True


@numba.njit(cache=True, error_model="numpy")
def _overlap(gap: float, half_a: float, half_b: float) -> float:
    """Common length of two intervals whose centres are ``gap`` apart: no coordinate, so nothing to cancel."""
    return max(0.0, min(2.0 * half_a, 2.0 * half_b, half_a + half_b - gap))


# ---------------------------------------------------------------- upright: two rectangles


@numba.njit(cache=True, error_model="numpy")
def _relative(a: FloatArray, i: int, b: FloatArray, j: int) -> tuple[float, float, float, float]:
    """Centre of b[j] in the axes of a[i] (metres), cosine and sine of its yaw against a[i]."""
    dx, dy = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
    ca, sa, cb, sb = a[i, 6], a[i, 7], b[j, 6], b[j, 7]
    return ca * dx + sa * dy, ca * dy - sa * dx, ca * cb + sa * sb, ca * sb - sa * cb


@numba.njit(cache=True, error_model="numpy")
def _footprint(a: FloatArray, i: int, b: FloatArray, j: int) -> float:
    """Common area in square metres of the footprints of a[i], the frame, and b[j]."""
    px, py, c, s = _relative(a, i, b, j)
    fl, fw, gl, gw = a[i, 3], a[i, 4], b[j, 3], b[j, 4]
    if (
        abs(px) >= fl + abs(c) * gl + abs(s) * gw
        or abs(py) >= fw + abs(s) * gl + abs(c) * gw
        or abs(c * px + s * py) >= gl + abs(c) * fl + abs(s) * fw
        or abs(c * py - s * px) >= gw + abs(s) * fl + abs(c) * fw
    ):
        return 0.0
    px, py = px / fl, py / fw
    ux, uy, vx, vy = c * gl / fl, s * gl / fw, -s * gw / fl, c * gw / fw
    x0, y0 = px - ux - vx, py - uy - vy
    x1, y1 = px + ux - vx, py + uy - vy
    x2, y2 = px + ux + vx, py + uy + vy
    x3, y3 = px - ux + vx, py - uy + vy
    # counter-clockwise, so the area is minus the integral of clamp(y) dx
    area = -(_under(x0, y0, x1, y1) + _under(x1, y1, x2, y2) + _under(x2, y2, x3, y3) + _under(x3, y3, x0, y0))
    return max(0.0, area) * fl * fw


@numba.njit(cache=True, error_model="numpy")
def _under(x0: float, y0: float, x1: float, y1: float) -> float:
    """Integral of clamp(y, -1, 1) dx along a segment, where |x| <= 1."""
    if (x0 <= -1.0 and x1 <= -1.0) or (x0 >= 1.0 and x1 >= 1.0):
        return 0.0
    xa, ya, xb, yb = x0, y0, x1, y1
    if abs(x0) > 1.0:
        xa = -1.0 if x0 < 0.0 else 1.0
        ya = y0 + (xa - x0) / (x1 - x0) * (y1 - y0)
    if abs(x1) > 1.0:
        xb = -1.0 if x1 < 0.0 else 1.0
        yb = y1 + (xb - x1) / (x1 - x0) * (y1 - y0)
    low, high = min(ya, yb), max(ya, yb)
    if low >= 1.0:
        mean = 1.0
    elif high <= -1.0:
        mean = -1.0
    elif low >= -1.0 and high <= 1.0:
        mean = 0.5 * (low + high)
    else:
        # the parts below, between and above, by their share. Differences are exact, so brackets matter: near a tie all
        # three lengths are last bits
        bottom, top = max(low, -1.0), min(high, 1.0)
        mean = ((low - bottom) + 0.5 * (top - bottom) * (top + bottom) + (high - top)) / (high - low)
    return (xb - xa) * mean


# ---------------------------------------------------------------- oriented: two boxes in space


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _far(a: FloatArray, i: int, b: FloatArray, j: int) -> bool:
    """Whether the spheres around the boxes share nothing."""
    dx, dy, dz = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1], b[j, 2] - a[i, 2]
    reach = a[i, 15] + b[j, 15]
    return dx * dx + dy * dy + dz * dz >= reach * reach


@numba.njit(cache=True, error_model="numpy")
def _place(a: FloatArray, i: int, b: FloatArray, j: int, pairs: FloatArray, lane: int) -> bool:
    """Rows a[i], the frame, and b[j] as a column of ``pairs`` (see ``box_edges.FIELDS``).

    True where a plane along a face of either box parts them; the column is then unfinished.
    """
    dx, dy, dz = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1], b[j, 2] - a[i, 2]
    for k in range(3):
        x, y, z = a[i, 6 + k], a[i, 9 + k], a[i, 12 + k]
        centre, reach = x * dx + y * dy + z * dz, a[i, 3 + k]
        for m in range(3):
            cosine = x * b[j, 6 + m] + y * b[j, 9 + m] + z * b[j, 12 + m]
            reach += abs(cosine) * b[j, 3 + m]
            pairs[9 + 3 * k + m, lane] = cosine
        if abs(centre) >= reach:
            return True
        pairs[k, lane], pairs[3 + k, lane], pairs[6 + k, lane] = a[i, 3 + k], b[j, 3 + k], centre
    for m in range(3):
        distance, reach = 0.0, b[j, 3 + m]
        for k in range(3):
            cosine = pairs[9 + 3 * k + m, lane]
            distance += pairs[6 + k, lane] * cosine
            reach += abs(cosine) * a[i, 3 + k]
        if abs(distance) >= reach:
            return True
    return False
