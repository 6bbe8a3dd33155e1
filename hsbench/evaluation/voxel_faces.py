"""Faces between solid and free voxels of two answers on one grid: how many lie near one of the other.

What ``hsbench.metrics.reconstruction`` counts of such points, on whole numbers: middles of faces lie on a lattice of
half voxels, so that a look at the few places in reach replaces a search for the nearest of millions.
"""

from __future__ import annotations

import math
from itertools import product

import numba
import numpy as np

from hsbench.typing import BoolArray, IntArray

_ROUNDING = 1e-6  # a reach of whole half voxels may miss it by a last bit


def faces(solid: BoolArray) -> BoolArray:
    """(nx, ny, nz) bool -> (3, nx, ny, nz) bool: a face between a voxel and the next one along each axis."""
    found = np.zeros((3, *solid.shape), dtype=np.bool_)
    found[0, :-1] = solid[1:] != solid[:-1]
    found[1, :, :-1] = solid[:, 1:] != solid[:, :-1]
    found[2, :, :, :-1] = solid[:, :, 1:] != solid[:, :, :-1]
    return found


def near(own: BoolArray, other: BoolArray, reach_voxels: float) -> int:
    """How many faces of one side have one of the other side within a reach, the limit included; both from ``faces``."""
    if not other.any():
        return 0
    return int(_near(own, other, *_steps(reach_voxels)))


def _steps(reach_voxels: float) -> tuple[IntArray, IntArray]:
    """(n, 4) axis of the other face and steps i, j, k to it, nearest first; (4,) where those of an own axis begin."""
    limit = math.floor((2 * reach_voxels) ** 2 + _ROUNDING)
    span = range(-math.ceil(reach_voxels) - 1, math.ceil(reach_voxels) + 2)
    rows, start = [], [0]
    for own in range(3):
        within = []
        for other, *step in product(range(3), span, span, span):
            halves = [2 * d + (a == other) - (a == own) for a, d in enumerate(step)]
            squared = sum(h * h for h in halves)
            if squared <= limit:
                within.append((squared, other, *step))
        rows += [row[1:] for row in sorted(within)]
        start.append(len(rows))
    return np.array(rows, dtype=np.int64).reshape(-1, 4), np.array(start, dtype=np.int64)


@numba.njit(cache=True)
def _near(own: BoolArray, other: BoolArray, steps: IntArray, start: IntArray) -> int:
    found = 0
    _, nx, ny, nz = own.shape
    for axis in range(3):
        for i in range(nx):
            for j in range(ny):
                for k in range(nz):
                    if not own[axis, i, j, k]:
                        continue
                    for s in range(start[axis], start[axis + 1]):
                        x, y, z = i + steps[s, 1], j + steps[s, 2], k + steps[s, 3]
                        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and other[steps[s, 0], x, y, z]:
                            found += 1
                            break
    return found
