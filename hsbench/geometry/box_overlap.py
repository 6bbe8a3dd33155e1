"""Compiled kernels of ``boxes``: intersection volumes of prepared boxes, without any tolerance.

One box of a pair, the smaller, is the frame: scaled to the cube [-1, 1]^3 at the origin, with the other box, then a
parallelepiped, around it. Over the cube, d/dz clamp(z, -1, 1) = 1 inside and 0 above and below, so by the
divergence theorem the common volume is the sum over the faces of the other box of

    integral of clamp(z, -1, 1) dx dy over the face's projection to xy, cut to |x| <= 1 and |y| <= 1,

signed by which way the face looks. In the plane the same holds with edges: integral of clamp(y, -1, 1) dx, cut to
|x| <= 1. Each face is cut on its own and nothing needs to be linked or closed. The sum is a continuous function of the
corners: a face that grazes z = 1 meets clamp where it is continuous, and one that grazes x = 1 has no projected area
to lose there. So rounding of a corner by 1e-16 moves a volume by about 1e-16, also where faces coincide.

Rows of prepared boxes: ``boxes.prepared_*``. Everything runs on one thread.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import FloatArray

INTERSECTION, IOU, GIOU = 0, 1, 2
"""What a kernel writes: common volume in cubic metres, its ratio to the union, or that less the hull's empty share."""

ALIGNED_COLUMNS = 7  # centre 3, half size 3, volume
UPRIGHT_COLUMNS = 10  # centre 3, half size 3, cos yaw, sin yaw, radius of the footprint, volume
ORIENTED_COLUMNS = 17  # centre 3, half size 3, row-major rotation 9, radius, volume

# where scratch holds a face (4 vertices) and its cuts: a cut emits at most 3 vertices an edge, 4 -> 12 -> 36
FACE = 12
CUT = FACE + 3 * 4
CUT_AGAIN = CUT + 3 * 12
SCRATCH = CUT_AGAIN + 3 * 36


# ---------------------------------------------------------------- all pairs, or row i with row i


@numba.njit(cache=True, error_model="numpy")
def fill_aligned(a: FloatArray, b: FloatArray, paired: bool, measure: int, out: FloatArray) -> None:
    """Measure of prepared aligned boxes a (N, 7), b (M, 7) into out (N, M), or (N, 1) where ``paired``."""
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            common = 1.0
            hull = 1.0
            for k in range(3):
                gap = abs(b[j, k] - a[i, k])
                overlap = _overlap(gap, a[i, 3 + k], b[j, 3 + k])
                common *= overlap
                hull *= _extent(gap, a[i, 3 + k], b[j, 3 + k])
            out[i, j - start] = _measure(common, a[i, 6], b[j, 6], hull, measure)


@numba.njit(cache=True, error_model="numpy")
def fill_upright(a: FloatArray, b: FloatArray, paired: bool, measure: int, out: FloatArray) -> None:
    """Measure of prepared upright boxes a (N, 10), b (M, 10) into out (N, M), or (N, 1) where ``paired``."""
    points = np.empty((8, 2))
    chain = np.empty((17, 2))
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            dx, dy = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
            reach = a[i, 8] + b[j, 8]
            common = 0.0
            if dx * dx + dy * dy < reach * reach:
                height = _overlap(abs(b[j, 2] - a[i, 2]), a[i, 5], b[j, 5])
                if height > 0.0:
                    common = height * (_footprint(a, i, b, j) if is_frame(a, i, b, j, 9) else _footprint(b, j, a, i))
            hull = 0.0
            if measure == GIOU:
                hull = _extent(abs(b[j, 2] - a[i, 2]), a[i, 5], b[j, 5])
                if is_frame(a, i, b, j, 9):
                    hull *= _hull_area(a, i, b, j, points, chain)
                else:
                    hull *= _hull_area(b, j, a, i, points, chain)
            out[i, j - start] = _measure(common, a[i, 9], b[j, 9], hull, measure)


@numba.njit(cache=True, error_model="numpy")
def fill_oriented(a: FloatArray, b: FloatArray, paired: bool, measure: int, out: FloatArray) -> None:
    """Intersection or IoU of prepared oriented boxes a (N, 17), b (M, 17) into out (N, M), or (N, 1)."""
    work = np.empty(SCRATCH)
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            dx, dy, dz = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1], b[j, 2] - a[i, 2]
            reach = a[i, 15] + b[j, 15]
            common = 0.0
            if dx * dx + dy * dy + dz * dz < reach * reach:
                if is_frame(a, i, b, j, 16):
                    common = _common_volume(a, i, b, j, work)
                else:
                    common = _common_volume(b, j, a, i, work)
            out[i, j - start] = _measure(common, a[i, 16], b[j, 16], 0.0, measure)


@numba.njit(cache=True, error_model="numpy")
def _measure(common: float, volume_a: float, volume_b: float, hull: float, measure: int) -> float:
    common = min(common, volume_a, volume_b)
    if measure == INTERSECTION:
        return common
    union = volume_a + volume_b - common
    if measure == IOU:
        return common / union
    hull = max(hull, union)
    return common / union - (hull - union) / hull


@numba.njit(cache=True, error_model="numpy")
def is_frame(a: FloatArray, i: int, b: FloatArray, j: int, volume: int) -> bool:
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


@numba.njit(cache=True, error_model="numpy")
def _extent(gap: float, half_a: float, half_b: float) -> float:
    """Length of the smallest interval that holds both."""
    return max(2.0 * half_a, 2.0 * half_b, half_a + half_b + gap)


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
        # the parts below, between and above, weighted by their share: weights add to 1, nothing cancels
        bottom, top = max(low, -1.0), min(high, 1.0)
        mean = (low - bottom + 0.5 * (top - bottom) * (top + bottom) + high - top) / (high - low)
    return (xb - xa) * mean


@numba.njit(cache=True, error_model="numpy")
def _hull_area(a: FloatArray, i: int, b: FloatArray, j: int, points: FloatArray, chain: FloatArray) -> float:
    """Area in square metres of the convex hull of two footprints (Andrew's monotone chain). The rest is scratch."""
    px, py, c, s = _relative(a, i, b, j)
    for k in range(8):
        x, y = 1.0 - 2.0 * (k & 1), 1.0 - (k & 2)
        if k >= 4:
            u, v = x * b[j, 3], y * b[j, 4]
            x, y = (px + c * u - s * v) / a[i, 3], (py + s * u + c * v) / a[i, 4]
        at = k
        while at > 0 and (points[at - 1, 0] > x or (points[at - 1, 0] == x and points[at - 1, 1] > y)):
            points[at] = points[at - 1]
            at -= 1
        points[at, 0], points[at, 1] = x, y
    n = 0
    for k in range(8):
        n = _append(chain, n, points[k], 0)
    lower = n - 1
    for k in range(6, -1, -1):
        n = _append(chain, n, points[k], lower)
    twice = 0.0
    for k in range(1, n - 1):
        twice += _turn(chain[0], chain[k], chain[k + 1])
    return 0.5 * twice * a[i, 3] * a[i, 4]


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


# ---------------------------------------------------------------- oriented: two boxes in space


@numba.njit(cache=True, error_model="numpy")
def _common_volume(a: FloatArray, i: int, b: FloatArray, j: int, work: FloatArray) -> float:
    """Common volume in cubic metres of rows a[i], the frame, and b[j]. ``work`` (``SCRATCH``,) is scratch."""
    if _place(a, i, b, j, work) or _edges_part(work):
        return 0.0
    total = 0.0
    for k in range(3):
        total += _under_faces(work, 3 + 3 * k, 3 + 3 * ((k + 1) % 3), 3 + 3 * ((k + 2) % 3))
    return max(0.0, total) * a[i, 3] * a[i, 4] * a[i, 5]


@numba.njit(cache=True, error_model="numpy")
def _place(a: FloatArray, i: int, b: FloatArray, j: int, work: FloatArray) -> bool:
    """Box b[j] where a[i] is the cube [-1, 1]^3: its centre into work[0:3], its half axes into work[3:12].

    True where a plane along a face of either box parts them; ``work`` is then unfinished.
    """
    dx, dy, dz = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1], b[j, 2] - a[i, 2]
    for k in range(3):
        x, y, z = a[i, 6 + k], a[i, 9 + k], a[i, 12 + k]
        work[k] = x * dx + y * dy + z * dz
        reach = a[i, 3 + k]
        for m in range(3):
            cosine = x * b[j, 6 + m] + y * b[j, 9 + m] + z * b[j, 12 + m]
            work[3 + 3 * m + k] = cosine
            reach += abs(cosine) * b[j, 3 + m]
        if abs(work[k]) >= reach:
            return True
    for m in range(3):
        x, y, z = work[3 + 3 * m], work[4 + 3 * m], work[5 + 3 * m]
        reach = b[j, 3 + m] + abs(x) * a[i, 3] + abs(y) * a[i, 4] + abs(z) * a[i, 5]
        if abs(work[0] * x + work[1] * y + work[2] * z) >= reach:
            return True
    for k in range(3):
        scale = 1.0 / a[i, 3 + k]
        work[k] *= scale
        for m in range(3):
            work[3 + 3 * m + k] *= b[j, 3 + m] * scale
    return False


@numba.njit(cache=True, error_model="numpy")
def _edges_part(work: FloatArray) -> bool:
    """Whether a plane along an edge of the cube and an edge of the other box parts them.

    The normal is axis k x half axis m, taken as it is: parallel edges give a short one or zero, which is no harm since
    all sides of the comparison shrink with it and equality does not part.
    """
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        for m in range(3):
            u, v = 3 + 3 * ((m + 1) % 3), 3 + 3 * ((m + 2) % 3)
            n_p, n_q = -work[3 + 3 * m + q], work[3 + 3 * m + p]
            reach = abs(n_p) + abs(n_q)
            reach += abs(n_p * work[u + p] + n_q * work[u + q]) + abs(n_p * work[v + p] + n_q * work[v + q])
            if abs(n_p * work[p] + n_q * work[q]) > reach:
                return True
    return False


@numba.njit(cache=True, error_model="numpy")
def _under_faces(work: FloatArray, w: int, u: int, v: int) -> float:
    """The two faces centre +- w, spanned by half axes u and v: the integral of clamp(z, -1, 1) dx dy where |x| <= 1
    and |y| <= 1, over the one at +w less that over the one at -w. w, u, v: where in ``work`` the half axes are.
    """
    ux, uy, uz, vx, vy, vz = work[u], work[u + 1], work[u + 2], work[v], work[v + 1], work[v + 2]
    if ux * vy == uy * vx:
        return 0.0  # seen edge-on from above: no projected area
    rx, ry = abs(ux) + abs(vx), abs(uy) + abs(vy)
    total = 0.0
    for side in (1.0, -1.0):
        x, y, z = work[0] + side * work[w], work[1] + side * work[w + 1], work[2] + side * work[w + 2]
        if abs(x) >= 1.0 + rx or abs(y) >= 1.0 + ry:
            continue
        at, n = FACE, 4
        _put(work, FACE, x - ux - vx, y - uy - vy, z - uz - vz)
        _put(work, FACE + 3, x + ux - vx, y + uy - vy, z + uz - vz)
        _put(work, FACE + 6, x + ux + vx, y + uy + vy, z + uz + vz)
        _put(work, FACE + 9, x - ux + vx, y - uy + vy, z - uz + vz)
        if abs(x) + rx > 1.0:
            n = _cut(work, at, n, 0, CUT)
            at = CUT
        if abs(y) + ry > 1.0:
            n = _cut(work, at, n, 1, CUT_AGAIN)
            at = CUT_AGAIN
        total += side * _under_loop(work, at, n)
    return total


@numba.njit(cache=True, error_model="numpy")
def _put(work: FloatArray, at: int, x: float, y: float, z: float) -> None:
    work[at], work[at + 1], work[at + 2] = x, y, z


@numba.njit(cache=True, error_model="numpy")
def _cut(work: FloatArray, at: int, n: int, axis: int, out: int) -> int:
    """The part of a closed loop of n vertices with -1 <= coordinate <= 1 on an axis, to ``out``; its length."""
    end = out
    last = at + 3 * (n - 1)
    x0 = work[last + axis]
    for here in range(at, at + 3 * n, 3):
        x1 = work[here + axis]
        if x0 < -1.0:
            if x1 > -1.0:
                end = _cross(work, last, here, axis, -1.0, end)
            if x1 > 1.0:
                end = _cross(work, last, here, axis, 1.0, end)
        elif x0 > 1.0:
            if x1 < 1.0:
                end = _cross(work, last, here, axis, 1.0, end)
            if x1 < -1.0:
                end = _cross(work, last, here, axis, -1.0, end)
        elif x1 > 1.0:
            if x0 < 1.0:
                end = _cross(work, last, here, axis, 1.0, end)
        elif x1 < -1.0 and x0 > -1.0:
            end = _cross(work, last, here, axis, -1.0, end)
        if -1.0 <= x1 <= 1.0:
            _put(work, end, work[here], work[here + 1], work[here + 2])
            end += 3
        last, x0 = here, x1
    return (end - out) // 3


@numba.njit(cache=True, error_model="numpy")
def _cross(work: FloatArray, p: int, q: int, axis: int, limit: float, out: int) -> int:
    """The point of segment p q at a coordinate strictly between its ends', to ``out``; where the next one goes."""
    t = (limit - work[p + axis]) / (work[q + axis] - work[p + axis])
    for k in range(3):
        work[out + k] = work[p + k] + t * (work[q + k] - work[p + k])
    work[out + axis] = limit
    return out + 3


@numba.njit(cache=True, error_model="numpy")
def _under_loop(work: FloatArray, at: int, n: int) -> float:
    """Integral of clamp(z, -1, 1) dx dy over a loop of n vertices, as a fan of triangles."""
    total = 0.0
    x, y, z = work[at], work[at + 1], work[at + 2]
    px, py, pz = work[at + 3] - x, work[at + 4] - y, work[at + 5]
    for here in range(at + 6, at + 3 * n, 3):
        qx, qy, qz = work[here] - x, work[here + 1] - y, work[here + 2]
        total += (px * qy - py * qx) * _mean_clamped(z, pz, qz)
        px, py, pz = qx, qy, qz
    return 0.5 * total


@numba.njit(cache=True, error_model="numpy")
def _mean_clamped(a: float, b: float, c: float) -> float:
    """Mean of clamp(z, -1, 1) over a triangle with corner heights a, b, c."""
    low, high = min(a, b, c), max(a, b, c)
    if low >= 1.0:
        return 1.0
    if high <= -1.0:
        return -1.0
    mean = (a + b + c) / 3.0
    if high > 1.0:
        mean -= _mean_excess(a - 1.0, b - 1.0, c - 1.0)
    if low < -1.0:
        mean += _mean_excess(-1.0 - a, -1.0 - b, -1.0 - c)
    return mean


@numba.njit(cache=True, error_model="numpy")
def _mean_excess(a: float, b: float, c: float) -> float:
    """Mean of max(0, z) over a triangle with corner heights a, b, c, not all <= 0."""
    if a < b:
        a, b = b, a
    if b < c:
        b, c = c, b
    if a < b:
        a, b = b, a
    if c >= 0.0:
        return (a + b + c) / 3.0
    if b <= 0.0:
        return a * (a / (a - b)) * (a / (a - c)) / 3.0
    return (a + b + c) / 3.0 - c * (c / (a - c)) * (c / (b - c)) / 3.0
