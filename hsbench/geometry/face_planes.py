"""The planes of a triangle mesh's faces, each once, compiled."""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import FloatArray, Int32Array

PLANE_SCALE = 1e9  # planes equal to a nanometre (and 1e-9 in direction) are one plane


@numba.njit(cache=True)
def face_planes(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """(P, 4) unit normal and offset of every face once, by its first triangle; triangles without area have none."""
    planes, rounded, count = np.empty((len(triangles), 4)), np.empty((len(triangles), 4)), 0
    for t in range(len(triangles)):
        a = vertices[triangles[t, 0]]
        u, v = vertices[triangles[t, 1]] - a, vertices[triangles[t, 2]] - a
        x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        length = np.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            continue
        planes[count, 0], planes[count, 1], planes[count, 2] = x / length, y / length, z / length
        planes[count, 3] = planes[count, 0] * a[0] + planes[count, 1] * a[1] + planes[count, 2] * a[2]
        is_new = True
        for c in range(4):
            rounded[count, c] = np.rint(planes[count, c] * PLANE_SCALE)
        for k in range(count):
            is_new &= (rounded[k] != rounded[count]).any()
        count += int(is_new)
    return planes[:count].copy()
