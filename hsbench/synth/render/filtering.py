"""Light at the points of a coarse grid: smoothed over neighbours on one surface, and read off between them.

Two points share light as far as their normals agree and each lies in the other's tangent plane.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from hsbench.typing import BoolArray, FloatArray

PLANE_M = 0.015  # points this far from each other's plane share half
REACHES = (0, 1, 3)  # points around the four nearest that are asked, one circle after the other
SCARCE = 0.02  # while those found weigh less than this


class LightGrid(NamedTuple):
    """Light at (h, w) points. A named tuple of arrays, so that compiled code takes it whole."""

    valid: BoolArray
    """(h, w) whether there is a surface."""
    position: FloatArray
    """(h, w, 3) metres, world frame."""
    normal: FloatArray
    """(h, w, 3) unit."""
    light: FloatArray
    """(h, w, c) channels of light of any meaning."""
    goes_round: bool
    """Whether the first column follows the last."""


def smoothed(grid: LightGrid, reach: int) -> LightGrid:
    """The grid with its light averaged over neighbours on the same surface, up to ``reach`` points away.

    The mean runs along rows, then along columns. The outermost neighbours count half: each residue of 2 reach then has
    the same weight, and a pattern of samples that repeats after so many points leaves no trace.
    """
    along_rows = grid._replace(light=_averaged(grid, 0, 1, reach))
    return grid._replace(light=_averaged(along_rows, 1, 0, reach))


@numba.njit(cache=True, error_model="numpy")
def _averaged(grid: LightGrid, down: int, right: int, reach: int) -> FloatArray:
    h, w, channels = grid.light.shape
    result = np.zeros_like(grid.light)
    for i in range(h):
        for j in range(w):
            if not grid.valid[i, j]:
                continue
            weights = 0.0
            for step in range(-reach, reach + 1):
                y, x = i + step * down, j + step * right
                if grid.goes_round:
                    x %= w
                if 0 <= y < h and 0 <= x < w and grid.valid[y, x]:
                    weight = 0.5 if abs(step) == reach else 1.0
                    weight *= _kinship(
                        grid.position[i, j, 0], grid.position[i, j, 1], grid.position[i, j, 2],
                        grid.normal[i, j, 0], grid.normal[i, j, 1], grid.normal[i, j, 2], grid, y, x,
                    )  # fmt: skip
                    weights += weight
                    for c in range(channels):
                        result[i, j, c] += weight * grid.light[y, x, c]
            for c in range(channels):
                result[i, j, c] /= weights
    return result


@numba.njit(cache=True, error_model="numpy")
def _kinship(
    px: float, py: float, pz: float, nx: float, ny: float, nz: float, grid: LightGrid, i: int, j: int
) -> float:
    """1 for a point p with normal n in one plane with point (i, j), towards 0 as normals or planes differ."""
    mx, my, mz = grid.normal[i, j, 0], grid.normal[i, j, 1], grid.normal[i, j, 2]
    cosine = nx * mx + ny * my + nz * mz
    if cosine <= 0.0:
        return 0.0
    dx, dy, dz = grid.position[i, j, 0] - px, grid.position[i, j, 1] - py, grid.position[i, j, 2] - pz
    gap = max(abs(dx * nx + dy * ny + dz * nz), abs(dx * mx + dy * my + dz * mz)) / PLANE_M
    square = cosine * cosine
    gap *= gap
    return square * square * square / (1.0 + gap * gap)


@numba.njit(cache=True, error_model="numpy")
def read_off(
    grid: LightGrid, row: float, column: float,
    px: float, py: float, pz: float, nx: float, ny: float, nz: float, light: FloatArray,
) -> None:  # fmt: skip
    """Set light (c,) to that of a point p with normal n whose place between the grid's points is (row, column)."""
    h, w, channels = grid.light.shape
    i0, j0 = math.floor(row), math.floor(column)
    weights = 0.0
    light[:] = 0.0
    for reach in REACHES:
        for i in range(max(i0 - reach, 0), min(i0 + 2 + reach, h)):
            for place in range(j0 - reach, j0 + 2 + reach):
                j = place % w if grid.goes_round else place
                if 0 <= j < w and grid.valid[i, j]:
                    weight = max(1.0 + reach - abs(row - i), 0.0) * max(1.0 + reach - abs(column - place), 0.0)
                    weight = weight * _kinship(px, py, pz, nx, ny, nz, grid, i, j) + 1e-9
                    weights += weight
                    for c in range(channels):
                        light[c] += weight * grid.light[i, j, c]
        if weights > SCARCE:
            break
    for c in range(channels):
        light[c] /= max(weights, 1e-12)
