"""Common volume of oriented boxes in general position, many pairs at once: a sum over edges.

The common part of two boxes is a convex polyhedron. Cones from any point, here the centre of the first box, over its
faces fill it; triangles from any point of a face's plane, here the centre of the box's face, to its edges fill a face.
So with signed heights, of the apex below a face's plane and of the face's centre inside an edge's line,

    volume = 1/6 sum over edges (length * sum over its two faces (height below the face * height inside the edge)).

An edge is the part inside both boxes of one of 60 lines: 12 edges of either box and 36 lines in which a face of one
meets a face of the other. Inside means between three or four pairs of planes: the largest lower bound and the least
upper bound along the line. All of it has a fixed shape without a branch, which compilers turn into vector instructions
over pairs.

Where along a line a plane is met is ill-conditioned if they are nearly parallel, and no vertex may then differ between
the lines that share it. Hence general position: no axis of one box within ``SHALLOW`` of a face of the other. Then the
error of an IoU is some 1e-15 times the longest over the shortest side of the pair, and up to 1e-13 where two faces
nearly coincide. Other pairs are the affair of ``box_faces``.
"""

from __future__ import annotations

import numba

from hsbench.typing import FloatArray

LANES = 32
"""Pairs computed together: enough to fill vector registers, few enough for the first-level cache."""

FIELDS = 18
"""Rows of ``pairs`` (FIELDS, LANES), a column a pair: 0:3 half sizes of the first box, 3:6 of the second, 6:9 centre of
the second in the axes of the first, 9:18 cosines, row k column m: axis k of the first with axis m of the second.
"""

SHALLOW = 0.01
"""Sine of the angle between an axis and a face below which a pair is not in general position: crossings are then
worse than the coordinates they come from by more than its inverse. One random pair in twelve is below.
"""

_Triple = tuple[float, float, float]


@numba.njit(cache=True, error_model="numpy")
def is_general(pairs: FloatArray, n: int) -> bool:
    """Whether no axis of one box of pair n is nearly parallel to a face of the other."""
    least = 1.0
    for field in range(9, FIELDS):
        least = min(least, abs(pairs[field, n]))
    return least >= SHALLOW


@numba.njit(cache=True, error_model="numpy")
def common_volumes(pairs: FloatArray, out: FloatArray) -> None:
    """pairs: (FIELDS, LANES) in general position -> out (LANES,) cubic metres. Rounding may make them negative."""
    for n in range(LANES):
        a = (pairs[0, n], pairs[1, n], pairs[2, n])
        b = (pairs[3, n], pairs[4, n], pairs[5, n])
        c = (pairs[6, n], pairs[7, n], pairs[8, n])
        rx = (pairs[9, n], pairs[10, n], pairs[11, n])
        ry = (pairs[12, n], pairs[13, n], pairs[14, n])
        rz = (pairs[15, n], pairs[16, n], pairs[17, n])
        ix, iy, iz = _inverse(rx), _inverse(ry), _inverse(rz)
        # the same seen from the second box: its centre from the first's in its own axes, cosines by its axes
        d = (
            rx[0] * c[0] + ry[0] * c[1] + rz[0] * c[2],
            rx[1] * c[0] + ry[1] * c[1] + rz[1] * c[2],
            rx[2] * c[0] + ry[2] * c[1] + rz[2] * c[2],
        )
        (ru, rv, rw), (iu, iv, iw) = _transposed(rx, ry, rz), _transposed(ix, iy, iz)
        back, at_apex = (-d[0], -d[1], -d[2]), (0.0, 0.0, 0.0)
        out[n] = (
            _meetings(a, c, b, d, rx, ry, rz, ix, iy, iz)
            + _meetings(_turn(a), _turn(c), b, d, ry, rz, rx, iy, iz, ix)
            + _meetings(_turn(_turn(a)), _turn(_turn(c)), b, d, rz, rx, ry, iz, ix, iy)
            + _own_edges(a, at_apex, b, back, ry, rz, ix)
            + _own_edges(_turn(a), at_apex, b, back, rz, rx, iy)
            + _own_edges(_turn(_turn(a)), at_apex, b, back, rx, ry, iz)
            + _own_edges(b, d, a, c, rv, rw, iu)
            + _own_edges(_turn(b), _turn(d), a, c, rw, ru, iv)
            + _own_edges(_turn(_turn(b)), _turn(_turn(d)), a, c, ru, rv, iw)
        ) / 6.0


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _own_edges(
    half: _Triple, above: _Triple, other_half: _Triple, shift: _Triple, rp: _Triple, rq: _Triple, inverse: _Triple
) -> float:
    """The four edges of a box along its axis k; ``half`` and ``above`` begin with k, then p and q.

    above: the box's centre from the apex. shift: the box's centre from the other's, in the other's axes; rp, rq: axes
    p and q there; inverse: one over axis k there.
    """
    reach_x, reach_y, reach_z = _reaches(other_half, inverse)
    total = 0.0
    for side_p in (-1.0, 1.0):
        for side_q in (-1.0, 1.0):
            p, q = side_p * half[1], side_q * half[2]
            x = -(shift[0] + p * rp[0] + q * rq[0]) * inverse[0]
            y = -(shift[1] + p * rp[1] + q * rq[1]) * inverse[1]
            z = -(shift[2] + p * rp[2] + q * rq[2]) * inverse[2]
            start = max(max(x - reach_x, y - reach_y), max(z - reach_z, -half[0]))
            stop = min(min(x + reach_x, y + reach_y), min(z + reach_z, half[0]))
            height_p, height_q = half[1] + side_p * above[1], half[2] + side_q * above[2]
            total += max(0.0, stop - start) * (height_p * half[2] + height_q * half[1])
    return total


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _reaches(half: _Triple, inverse: _Triple) -> _Triple:
    """How far along a line it is from the middle of a box's pairs of faces to the faces."""
    return half[0] * abs(inverse[0]), half[1] * abs(inverse[1]), half[2] * abs(inverse[2])


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _meetings(
    a: _Triple,
    c: _Triple,
    b: _Triple,
    d: _Triple,
    rk: _Triple,
    rp: _Triple,
    rq: _Triple,
    ik: _Triple,
    ip: _Triple,
    iq: _Triple,
) -> float:
    """The twelve lines in which the faces across axis k of the first box meet faces of the second.

    a, c: half sizes of the first, centre of the second, beginning with k, then p and q; b, d: half sizes and centre of
    the second in its own axes; rk, rp, rq: cosines of k, p, q with those; ik, ip, iq: their inverses.
    """
    return (
        _meeting(a, c[0], b, d, rk, rp[0], rq[0], ik, ip[0], iq[0])
        + _meeting(a, c[0], _turn(b), _turn(d), _turn(rk), rp[1], rq[1], _turn(ik), ip[1], iq[1])
        + _meeting(
            a, c[0], _turn(_turn(b)), _turn(_turn(d)), _turn(_turn(rk)), rp[2], rq[2], _turn(_turn(ik)), ip[2], iq[2]
        )
    )


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _meeting(
    a: _Triple,
    ck: float,
    b: _Triple,
    d: _Triple,
    rk: _Triple,
    rpm: float,
    rqm: float,
    ik: _Triple,
    ipm: float,
    iqm: float,
) -> float:
    """The four lines in which faces across axis k of the first box meet faces across axis m of the second.

    Triples of the second begin with m, then i and j. The line runs along k x m, which is (0, -rqm, rpm) along k, p, q
    and (0, rkj, -rki) along m, i, j, from its point nearest the centre of the first box's face.
    """
    scale = 1.0 / (rpm * rpm + rqm * rqm)  # one over the square of |k x m|
    slope_p, slope_q, slope_i, slope_j = rpm * iqm, -rqm * ipm, -rk[1] * ik[2], rk[2] * ik[1]
    reach_p, reach_q = a[1] * abs(iqm), a[2] * abs(ipm)
    reach_i, reach_j = b[1] * abs(ik[2]), b[2] * abs(ik[1])
    at_i, at_j = d[1] * ik[2], -d[2] * ik[1]
    total = 0.0
    for side_k in (-1.0, 1.0):
        for side_m in (-1.0, 1.0):
            height_m = b[0] + side_m * d[0]
            cosine = side_k * side_m * rk[0]
            inside_k = height_m - cosine * a[0]  # from the centre of the first box's face to the line, times |k x m|
            inside_m = a[0] - side_k * ck - cosine * b[0]
            u = side_m * inside_k * scale
            v = side_k * a[0] - rk[0] * u
            p, q, i, j = slope_p * u, slope_q * u, at_i + slope_i * v, at_j + slope_j * v
            start = max(max(p - reach_p, q - reach_q), max(i - reach_i, j - reach_j))
            stop = min(min(p + reach_p, q + reach_q), min(i + reach_i, j + reach_j))
            total += max(0.0, stop - start) * (a[0] * inside_k + height_m * inside_m)
    return total


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _turn(triple: _Triple) -> _Triple:
    return triple[1], triple[2], triple[0]


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _inverse(triple: _Triple) -> _Triple:
    return 1.0 / triple[0], 1.0 / triple[1], 1.0 / triple[2]


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _transposed(x: _Triple, y: _Triple, z: _Triple) -> tuple[_Triple, _Triple, _Triple]:
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])
