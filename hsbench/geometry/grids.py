"""Regular grids of voxels and cells: index <-> position, and bit packing.

Voxel arrays are indexed [x, y, z]; ``origin_m`` is the grid's minimum corner, so that voxel (i, j, k) has
its centre at origin + ((i, j, k) + 1/2) voxel_m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray, UInt8Array


@dataclass(frozen=True)
class VoxelGrid:
    """An axis-aligned grid of cubes: minimum corner in metres, number of voxels per axis, side in metres."""

    origin_m: tuple[float, float, float]
    shape: tuple[int, int, int]
    voxel_m: float = 0.05

    def __post_init__(self) -> None:
        if len(self.origin_m) != 3 or not np.isfinite(self.origin_m).all():
            raise SchemaError(f"grid.origin_m is {self.origin_m}; expected three finite metres")
        if len(self.shape) != 3 or min(self.shape) < 1:
            raise SchemaError(f"grid.shape is {self.shape}; expected three positive counts")
        if not (np.isfinite(self.voxel_m) and self.voxel_m > 0):
            raise SchemaError(f"grid.voxel_m is {self.voxel_m}; expected a positive finite number of metres")

    def axis_centres(self, axis: int) -> FloatArray:
        """(n,) coordinates of the voxel centres along one axis, in metres."""
        return np.asarray(self.origin_m[axis] + (np.arange(self.shape[axis]) + 0.5) * self.voxel_m)

    def centres(self) -> FloatArray:
        """(nx, ny, nz, 3) voxel centres in metres."""
        return np.stack(np.meshgrid(*(self.axis_centres(a) for a in range(3)), indexing="ij"), axis=-1)

    def index(self, points: FloatArray) -> tuple[IntArray, BoolArray]:
        """(N, 3) points -> ((N, 3) int64 voxel indices, (N,) bool: inside the grid)."""
        scaled = (np.asarray(points, dtype=np.float64) - np.asarray(self.origin_m)) / self.voxel_m
        index = np.floor(scaled).astype(np.int64)
        return index, ((index >= 0) & (index < np.asarray(self.shape))).all(axis=-1)


def pack_bits(volume: BoolArray) -> UInt8Array:
    """(..., n) bool -> (..., ceil(n / 8)) uint8, little bit order: bit b of byte k is element 8 k + b."""
    return np.packbits(volume, axis=-1, bitorder="little")


def unpack_bits(packed: AnyArray, count: int) -> BoolArray:
    """(..., m) uint8 -> (..., count) bool, the inverse of ``pack_bits``."""
    return np.unpackbits(packed, axis=-1, count=count, bitorder="little").astype(bool)
