"""Compiled kernels of ``boxes``: intersection volumes of prepared boxes, without any tolerance.

One box of a pair, the smaller, is the frame: scaled to the cube [-1, 1]^3 at the origin, with the other box, then a
parallelepiped, around it. Over the cube, d/dz clamp(z, -1, 1) = 1 inside and 0 above and below, so by the
divergence theorem the common volume is the sum over the faces of the other box of

    integral of clamp(z, -1, 1) dx dy over the face's projection to xy, cut to |x| <= 1 and |y| <= 1,

signed by which way the face looks. In the plane the same holds with edges: integral of clamp(y, -1, 1) dx, cut to
|x| <= 1. Each face is cut on its own and nothing needs to be linked or closed. The sum is a continuous function of the
corners: a face that grazes z = 1 meets clamp where it is continuous, and one that grazes x = 1 has no projected area
to lose there. So rounding of a corner by 1e-16 moves a volume by about 1e-16, also where faces coincide.

Rows of prepared boxes are what ``boxes._prepared_*`` say. Each call runs on one thread and lets others run.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import FloatArray

# where scratch holds a face (4 vertices) and its cuts: 3 vertices an edge at most, 4 -> 12 -> 36, and one to overwrite
FACE = 12
CUT = FACE + 3 * 4
CUT_AGAIN = CUT + 3 * 13
SCRATCH = CUT_AGAIN + 3 * 37


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
    work = np.empty(SCRATCH)
    for i in range(len(a)):
        start, stop = (i, i + 1) if paired else (0, len(b))
        for j in range(start, stop):
            dx, dy, dz = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1], b[j, 2] - a[i, 2]
            reach = a[i, 15] + b[j, 15]
            common = 0.0
            if dx * dx + dy * dy + dz * dz < reach * reach:
                if _is_frame(a, i, b, j, 16):
                    common = _common_volume(a, i, b, j, work)
                else:
                    common = _common_volume(b, j, a, i, work)
            out[i, j - start] = _measure(common, a[i, 16], b[j, 16], ratio)


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
    reach_x, reach_y = abs(ux) + abs(vx), abs(uy) + abs(vy)
    total = 0.0
    for side in (1.0, -1.0):
        x, y, z = work[0] + side * work[w], work[1] + side * work[w + 1], work[2] + side * work[w + 2]
        if abs(x) >= 1.0 + reach_x or abs(y) >= 1.0 + reach_y:
            continue
        _put(work, FACE, x - ux - vx, y - uy - vy, z - uz - vz)
        _put(work, FACE + 3, x + ux - vx, y + uy - vy, z + uz - vz)
        _put(work, FACE + 6, x + ux + vx, y + uy + vy, z + uz + vz)
        _put(work, FACE + 9, x - ux + vx, y - uy + vy, z - uz + vz)
        at, end = FACE, CUT
        if abs(x) + reach_x > 1.0:
            end = _cut(work, at, end, 0, CUT)
            at = CUT
        if abs(y) + reach_y > 1.0:
            end = _cut(work, at, end, 1, CUT_AGAIN)
            at = CUT_AGAIN
        total += side * _under_loop(work, at, end)
    return total


@numba.njit(cache=True, error_model="numpy")
def _put(work: FloatArray, at: int, x: float, y: float, z: float) -> None:
    work[at], work[at + 1], work[at + 2] = x, y, z


@numba.njit(cache=True, error_model="numpy", inline="always")
def _cut(work: FloatArray, at: int, stop: int, axis: int, out: int) -> int:
    """The part of the closed loop of vertices work[at:stop] with -1 <= x (axis 0) or y (axis 1) <= 1, to work[out:];
    its end there.

    Each edge writes its two crossings and its end point and keeps those that exist: three stores cost less than the
    branches that would avoid them. Whether one exists is asked of coordinates alone, never of t, which rounds.
    """
    end = out
    if stop == at:
        return end
    x0, y0, z0 = work[stop - 3], work[stop - 2], work[stop - 1]
    for here in range(at, stop, 3):
        x1, y1, z1 = work[here], work[here + 1], work[here + 2]
        dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
        from_, to = (y0, y1) if axis else (x0, x1)
        per_unit = 1.0 / (to - from_)  # infinite where no crossing exists
        first = -1.0 if from_ < to else 1.0
        t = (first - from_) * per_unit
        _put(work, end, x0 + t * dx, y0 + t * dy, z0 + t * dz)
        end += 3 if (from_ - first) * (to - first) < 0.0 else 0
        t = (-first - from_) * per_unit
        _put(work, end, x0 + t * dx, y0 + t * dy, z0 + t * dz)
        end += 3 if (from_ + first) * (to + first) < 0.0 else 0
        _put(work, end, x1, y1, z1)
        end += 3 if abs(to) <= 1.0 else 0
        x0, y0, z0 = x1, y1, z1
    return end


@numba.njit(cache=True, error_model="numpy")
def _under_loop(work: FloatArray, at: int, stop: int) -> float:
    """Integral of clamp(z, -1, 1) dx dy over the loop of vertices work[at:stop], as a fan of triangles."""
    if stop < at + 9:
        return 0.0
    total = 0.0
    x, y, z = work[at], work[at + 1], work[at + 2]
    px, py, pz = work[at + 3] - x, work[at + 4] - y, work[at + 5]
    for here in range(at + 6, stop, 3):
        qx, qy, qz = work[here] - x, work[here + 1] - y, work[here + 2]
        total += (px * qy - py * qx) * _mean_clamped(z, pz, qz)
        px, py, pz = qx, qy, qz
    return 0.5 * total


@numba.njit(cache=True, error_model="numpy", inline="always")
def _mean_clamped(a: float, b: float, c: float) -> float:
    """Mean of clamp(z, -1, 1) over a triangle with corner heights a, b, c: that of z, less what is beyond 1 or -1."""
    least, most = min(a, b), max(a, b)
    low, middle, high = min(least, c), max(least, min(most, c)), max(most, c)
    above = _mean_positive(low - 1.0, middle - 1.0, high - 1.0)
    below = _mean_positive(-1.0 - high, -1.0 - middle, -1.0 - low)
    return min(1.0, max(-1.0, (a + b + c) / 3.0 - above + below))


@numba.njit(cache=True, error_model="numpy", inline="always")
def _mean_positive(low: float, middle: float, high: float) -> float:
    """Mean of max(0, z) over a triangle with ascending corner heights.

    The corner that lies alone on its side of 0 cuts off a triangle whose mean height times area is p^3 / (3 r).
    """
    mostly = middle > 0.0
    p = min(low, 0.0) if mostly else max(high, 0.0)
    r = (p - (high if mostly else low)) * (p - middle)
    alone = p * p * p / max(r, 1e-200)  # p is 0 or at least 1e-16, so r is 0 only where p is
    return (low + middle + high - alone) / 3.0 if mostly else alone / 3.0
