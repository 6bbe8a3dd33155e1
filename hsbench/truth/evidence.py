"""What bodies have swept: for every voxel, when a body first held its centre.

Space that a body has held is free of solids: the evidence that activity gives of what no camera sees. Where chairs are
drawn back and put back, it was free for a while only: truth at t0 may hold a chair there.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.geometry.capsules import point_gap
from hsbench.geometry.grids import VoxelGrid
from hsbench.typing import Float32Array, FloatArray

STEP_SHARE = 0.5  # a pose is swept again once some capsule end has moved by this share of a voxel


def first_swept(capsule_ends: FloatArray, radii: FloatArray, times_s: FloatArray, grid: VoxelGrid) -> Float32Array:
    """(T, C, 2, 3) capsule ends in the grid's frame, (C, 2) radii, (T,) seconds, ascending -> (nx, ny, nz) float32.

    The value is the time at which a capsule first holds the voxel's centre, +inf where none ever does. A pose is left
    out while no capsule end has moved by half a voxel since the last one taken. Rows of several people are swept one
    call each; the least of the answers is the answer.
    """
    swept = np.full(grid.shape, np.inf, dtype=np.float32)
    ends = np.ascontiguousarray(capsule_ends, dtype=np.float64)
    times = np.ascontiguousarray(times_s, dtype=np.float64)
    step_m = STEP_SHARE * grid.voxel_m
    _sweep(ends, np.asarray(radii, dtype=np.float64), times, np.array(grid.origin_m), grid.voxel_m, step_m, swept)
    return swept


@numba.njit(cache=True)
def _sweep(
    ends: FloatArray, radii: FloatArray, times: FloatArray, origin: FloatArray, voxel: float, step: float,
    swept: Float32Array,
) -> None:  # fmt: skip
    shape = swept.shape
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    last = -1
    for t in range(len(times)):
        if last >= 0 and not _moved(ends[last], ends[t], step):
            continue
        last = t
        for c in range(ends.shape[1]):
            a, b = ends[t, c, 0], ends[t, c, 1]
            ra, rb = radii[c, 0], radii[c, 1]
            for axis in range(3):
                least = min(a[axis] - ra, b[axis] - rb)
                most = max(a[axis] + ra, b[axis] + rb)
                low[axis] = max(0, int(np.floor((least - origin[axis]) / voxel - 0.5)))
                high[axis] = min(shape[axis] - 1, int(np.ceil((most - origin[axis]) / voxel - 0.5)))
            for i in range(low[0], high[0] + 1):
                x = origin[0] + (i + 0.5) * voxel
                for j in range(low[1], high[1] + 1):
                    y = origin[1] + (j + 0.5) * voxel
                    for k in range(low[2], high[2] + 1):
                        if swept[i, j, k] < np.inf:
                            continue
                        if point_gap(x, y, origin[2] + (k + 0.5) * voxel, a, b, ra, rb) <= 0.0:
                            swept[i, j, k] = times[t]


@numba.njit(cache=True)
def _moved(before: FloatArray, now: FloatArray, step: float) -> bool:
    for c in range(before.shape[0]):
        for e in range(2):
            square = 0.0
            for axis in range(3):
                difference = now[c, e, axis] - before[c, e, axis]
                square += difference * difference
            if square >= step * step:
                return True
    return False
