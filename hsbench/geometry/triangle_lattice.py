"""Points of a regular lattice against triangle meshes: inside a closed surface, or beside any surface.

**Inside.** A horizontal line of points cuts the mesh in a closed polygon, a vertical line cuts that polygon in ends of
intervals. Which triangle is cut is decided by comparing coordinates, and where an edge is cut is computed once for both
of its triangles, so the ends always pair up: nothing leaks through a seam, whatever the rounding. A point is inside
where the winding number is positive. Points on the surface are inside, as for convex solids: where a coordinate of a
vertex equals that of a line, the line is moved a hair to either side and both answers count.

**Beside.** A point is beside a surface where the cube about it, one step wide, is met by a triangle: the separating
axis test (Akenine-Moeller, "Fast 3D triangle-box overlap testing", 2001). A sheet on the border of two cubes belongs to
the lower one.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

BORDER_M = 1e-6  # moves a sheet off the border of two cubes; coordinates are rounded to 1e-4 m


def count_points(
    vertices: FloatArray, triangles: Int32Array, solid: BoolArray, sheet: BoolArray,
    origin_m: FloatArray, shape: tuple[int, int, int], voxel_m: float, per_side: int,
) -> UInt8Array:  # fmt: skip
    """How many of the ``per_side``^3 points of each voxel, at (i + 1/2) / per_side of its side, are inside or beside.

    vertices: (V, 3), triangles: (T, 3). solid: (T,) those that bound closed pieces. sheet: (T,) those whose surface
    counts; may overlap ``solid``. origin_m: (3,) minimum corner. Returns ``shape`` uint8.
    """
    counts = np.zeros(shape, dtype=np.uint8)
    keep = solid | sheet
    _count(
        np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(triangles[keep]),
        solid[keep], sheet[keep], np.asarray(origin_m, dtype=np.float64), voxel_m / per_side, per_side, counts,
    )  # fmt: skip
    return counts


@numba.njit(cache=True)
def _count(
    vertices: FloatArray, triangles: Int32Array, solid: BoolArray, sheet: BoolArray, origin: FloatArray, step: float,
    per_side: int, counts: UInt8Array,
) -> None:  # fmt: skip
    columns, rows, height = (counts.shape[0] * per_side, counts.shape[1] * per_side, counts.shape[2] * per_side)
    start, listed = _triangles_of_rows(vertices, triangles, origin[1], step, rows)
    winding = np.zeros((columns, height + 1), np.int16)
    marked = np.zeros((columns, height), np.bool_)
    for j in range(rows):
        here = listed[start[j] : start[j + 1]]
        if not len(here):
            continue
        y = origin[1] + (j + 0.5) * step
        ties_y, ties_x = False, False
        for t in here:
            for v in triangles[t]:
                ties_y |= solid[t] and vertices[v, 1] == y
        for upper_y in range(1 + ties_y):
            ties_x |= _wind(vertices, triangles, solid, here, y, origin, step, upper_y == 1, False, winding)
            _mark_wound(winding, marked)
            if ties_x:
                _wind(vertices, triangles, solid, here, y, origin, step, upper_y == 1, True, winding)
                _mark_wound(winding, marked)
        for t in here:
            if sheet[t]:
                _mark_beside(vertices[triangles[t]] - BORDER_M, y, origin, step, marked)
        for i in range(columns):
            for k in range(height):
                if marked[i, k]:
                    counts[i // per_side, j // per_side, k // per_side] += 1
                    marked[i, k] = False


@numba.njit(cache=True)
def _triangles_of_rows(
    vertices: FloatArray, triangles: Int32Array, y0: float, step: float, rows: int
) -> tuple[IntArray, IntArray]:
    """(first place of each row (rows + 1,), triangle numbers): those that may meet a row of points or its cubes."""
    span = np.empty((len(triangles), 2), np.int64)
    start = np.zeros(rows + 1, np.int64)
    for t in range(len(triangles)):
        a, b, c = vertices[triangles[t, 0], 1], vertices[triangles[t, 1], 1], vertices[triangles[t, 2], 1]
        span[t, 0] = max(0, math.floor((min(a, b, c) - y0) / step) - 1)
        span[t, 1] = min(rows, math.ceil((max(a, b, c) - y0) / step) + 1)
        for j in range(span[t, 0], span[t, 1]):
            start[j + 1] += 1
    start = np.cumsum(start)
    free = start.copy()
    listed = np.empty(start[rows], np.int64)
    for t in range(len(triangles)):
        for j in range(span[t, 0], span[t, 1]):
            listed[free[j]] = t
            free[j] += 1
    return start, listed


@numba.njit(cache=True)
def _wind(
    vertices: FloatArray, triangles: Int32Array, solid: BoolArray, here: IntArray, y: float, origin: FloatArray,
    step: float, upper_y: bool, upper_x: bool, winding: IntArray,
) -> bool:  # fmt: skip
    """Enter the ends of intervals of one row; whether some end lies exactly over a point.

    upper_y, upper_x: the row and its points are moved a hair down, so that what equals them counts as above.
    """
    columns, height = winding.shape[0], winding.shape[1] - 1
    tie = False
    for t in here:
        if not solid[t]:
            continue
        x_up, z_up, x_down, z_down, cut = 0.0, 0.0, 0.0, 0.0, False
        for e in range(3):
            p, q = triangles[t, e], triangles[t, (e + 1) % 3]
            p_below = vertices[p, 1] < y or (vertices[p, 1] == y and not upper_y)
            q_below = vertices[q, 1] < y or (vertices[q, 1] == y and not upper_y)
            if p_below == q_below:
                continue
            first, second = min(p, q), max(p, q)
            share = (y - vertices[first, 1]) / (vertices[second, 1] - vertices[first, 1])
            x = vertices[first, 0] + share * (vertices[second, 0] - vertices[first, 0])
            z = vertices[first, 2] + share * (vertices[second, 2] - vertices[first, 2])
            cut = True
            if p_below:
                x_up, z_up = x, z
            else:
                x_down, z_down = x, z
        if not cut:
            continue
        first_i = max(0, math.floor((min(x_up, x_down) - origin[0]) / step) - 1)
        last_i = min(columns, math.ceil((max(x_up, x_down) - origin[0]) / step) + 1)
        for i in range(first_i, last_i):
            x = origin[0] + (i + 0.5) * step
            tie |= x in (x_up, x_down)
            up_below = x_up < x or (x_up == x and not upper_x)
            down_below = x_down < x or (x_down == x and not upper_x)
            if up_below == down_below:
                continue
            z = z_down + (x - x_down) / (x_up - x_down) * (z_up - z_down)
            if down_below:  # the triangle faces up: the way up leaves here
                k = min(max(math.floor((z - origin[2]) / step - 0.5) + 1, 0), height)
                winding[i, k] -= 1
            else:
                k = min(max(math.ceil((z - origin[2]) / step - 0.5), 0), height)
                winding[i, k] += 1
    return tie


@numba.njit(cache=True)
def _mark_wound(winding: IntArray, marked: BoolArray) -> None:
    for i in range(winding.shape[0]):
        number = 0
        for k in range(marked.shape[1]):
            number += winding[i, k]
            winding[i, k] = 0
            if number > 0:
                marked[i, k] = True
        winding[i, marked.shape[1]] = 0


@numba.njit(cache=True)
def _mark_beside(corners: FloatArray, y: float, origin: FloatArray, step: float, marked: BoolArray) -> None:
    half = step / 2
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        low[axis] = min(corners[0, axis], corners[1, axis], corners[2, axis])
        high[axis] = max(corners[0, axis], corners[1, axis], corners[2, axis])
    if low[1] > y + half or high[1] < y - half:
        return
    first_i = max(0, math.floor((low[0] - origin[0]) / step) - 1)
    last_i = min(marked.shape[0], math.ceil((high[0] - origin[0]) / step) + 1)
    first_k = max(0, math.floor((low[2] - origin[2]) / step) - 1)
    last_k = min(marked.shape[1], math.ceil((high[2] - origin[2]) / step) + 1)
    for i in range(first_i, last_i):
        x = origin[0] + (i + 0.5) * step
        if low[0] > x + half or high[0] < x - half:
            continue
        for k in range(first_k, last_k):
            z = origin[2] + (k + 0.5) * step
            if low[2] > z + half or high[2] < z - half or marked[i, k]:
                continue
            marked[i, k] = _meets_cube(corners, x, y, z, half)


@numba.njit(cache=True)
def _meets_cube(corners: FloatArray, x: float, y: float, z: float, half: float) -> bool:
    """Whether a triangle meets a cube, given that their boxes do: no edge's axis and no normal parts them."""
    middle = np.array((x, y, z))
    a, b, c = corners[0] - middle, corners[1] - middle, corners[2] - middle
    normal = np.cross(b - a, c - a)
    reach = half * (abs(normal[0]) + abs(normal[1]) + abs(normal[2]))
    if abs(normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2]) > reach:
        return False
    for e in range(3):
        edge = b - a if e == 0 else (c - b if e == 1 else a - c)
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            pa, pb, pc = (
                edge[i] * a[j] - edge[j] * a[i],
                edge[i] * b[j] - edge[j] * b[i],
                edge[i] * c[j] - edge[j] * c[i],
            )
            reach = half * (abs(edge[i]) + abs(edge[j]))
            if min(pa, pb, pc) > reach or max(pa, pb, pc) < -reach:
                return False
    return True
