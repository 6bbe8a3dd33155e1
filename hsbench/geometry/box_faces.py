"""Common volume of any two oriented boxes, without any tolerance: a sum over faces.

One box of a pair, the smaller, is the frame: scaled to the cube [-1, 1]^3 at the origin, with the other box, then a
parallelepiped, around it. Over the cube, d/dz clamp(z, -1, 1) = 1 inside and 0 above and below, so by the
divergence theorem the common volume is the sum over the faces of the other box of

    integral of clamp(z, -1, 1) dx dy over the face's projection to xy, cut to |x| <= 1 and |y| <= 1,

signed by which way the face looks. Each face is cut on its own and nothing needs to be linked or closed. The sum is a
continuous function of the corners: a face that grazes z = 1 meets clamp where it is continuous, and one that grazes
x = 1 has no projected area to lose there. So rounding of a corner by 1e-16 moves a volume by about 1e-16, also where
faces coincide.
"""

from __future__ import annotations

import numba

from hsbench.typing import FloatArray

# where scratch holds a face (4 vertices) and its cuts: 3 vertices an edge at most, 4 -> 12 -> 36, and one to overwrite
FACE = 12
CUT = FACE + 3 * 4
CUT_AGAIN = CUT + 3 * 13
SCRATCH = CUT_AGAIN + 3 * 37


@numba.njit(cache=True, error_model="numpy")
def common_volume(pairs: FloatArray, n: int, work: FloatArray) -> float:
    """Common volume in cubic metres of pair n of ``pairs`` (see ``box_edges.FIELDS``). ``work`` (``SCRATCH``,) is
    scratch.
    """
    _scale(pairs, n, work)
    if _edges_part(work):
        return 0.0
    total = 0.0
    for k in range(3):
        total += _under_faces(work, 3 + 3 * k, 3 + 3 * ((k + 1) % 3), 3 + 3 * ((k + 2) % 3))
    return max(0.0, total) * pairs[0, n] * pairs[1, n] * pairs[2, n]


@numba.njit(cache=True, error_model="numpy")
def _scale(pairs: FloatArray, n: int, work: FloatArray) -> None:
    """The second box where the first is the cube [-1, 1]^3: centre into work[0:3], half axes into work[3:12]."""
    for k in range(3):
        scale = 1.0 / pairs[k, n]
        work[k] = pairs[6 + k, n] * scale
        for m in range(3):
            work[3 + 3 * m + k] = pairs[9 + 3 * k + m, n] * pairs[3 + m, n] * scale


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
