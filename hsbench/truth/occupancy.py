"""Solid occupancy of a scene by the sub-sample rule, with category and instance of what fills a voxel.

Task scene-completion: a voxel is solid if any of its 5 x 5 x 5 sub-sample points, at (i + 1/2) / 5 of its
side, lies in a solid. The label is the object that holds most of the points; the lower id on a tie.
What mesh parts of imported objects hold is said in ``truth.meshes``.
"""

from __future__ import annotations

import warnings

import numba
import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.rays import PackedSolids, pack_solids
from hsbench.schema.scene import Scene
from hsbench.truth.meshes import count_mesh_subsamples, has_mesh, mesh_body
from hsbench.typing import FloatArray, IntArray, UInt8Array, UInt16Array

SUBSAMPLES = 5  # task scene-completion


def solid_occupancy(scene: Scene, grid: VoxelGrid) -> tuple[UInt8Array, UInt16Array]:
    """(semantic, instance) of a scene in the grid's frame: uint8 category ids and uint16 object ids, 0 = free.

    Warns once, naming the objects with open meshes: of those only the surface is solid.
    """
    semantic = np.zeros(grid.shape, dtype=np.uint8)
    instance = np.zeros(grid.shape, dtype=np.uint16)
    most = np.zeros(grid.shape, dtype=np.uint8)
    opened: list[str] = []
    for item in scene.objects:
        if has_mesh(item):
            body = mesh_body(item)
            held = count_mesh_subsamples(body, grid, SUBSAMPLES)
            if body.open_share > 0:
                opened.append(f"{item.object_id} {item.category_name} {max(body.open_share, 0.01):.0%}")
        else:
            held = count_subsamples(pack_solids(item.solids), grid)
        if held is None:
            continue
        low, counts = held
        window = tuple(slice(a, a + n) for a, n in zip(low, counts.shape, strict=True))
        wins = counts > most[window]
        most[window][wins] = counts[wins]
        semantic[window][wins] = item.category.category_id
        instance[window][wins] = item.object_id
    if opened:
        found = ", ".join(opened)
        warnings.warn(
            f"meshes with open pieces (share of area), of which only the surface is solid: {found}", stacklevel=2
        )
    return semantic, instance


def count_subsamples(solids: PackedSolids, grid: VoxelGrid) -> tuple[IntArray, UInt8Array] | None:
    """Sub-sample points (0..125) of each voxel inside the union of solids: (first voxel (3,), counts of a window).

    None where the solids miss the grid.
    """
    origin, shape = np.asarray(grid.origin_m), np.asarray(grid.shape)
    low = np.clip(np.floor((solids.corners.min(axis=0) - origin) / grid.voxel_m).astype(np.int64), 0, shape)
    high = np.clip(np.ceil((solids.corners.max(axis=0) - origin) / grid.voxel_m).astype(np.int64), 0, shape)
    if (high <= low).any():
        return None
    counts = np.zeros(high - low, dtype=np.uint8)
    bounds = np.array(
        [[corners.min(axis=0), corners.max(axis=0)] for corners in np.split(solids.corners, solids.corner_start[1:-1])]
    )
    _count_columns(solids.planes, solids.plane_start, bounds, origin + low * grid.voxel_m, grid.voxel_m, counts)
    return low, counts


@numba.njit(cache=True)
def _count_columns(
    planes: FloatArray, start: IntArray, bounds: FloatArray, origin: FloatArray, voxel: float, counts: UInt8Array
) -> None:
    """Per vertical line of sub-samples solve each solid's z interval; the union of intervals marks points."""
    step = voxel / SUBSAMPLES
    height = counts.shape[2] * SUBSAMPLES
    line = np.zeros(height, dtype=np.bool_)
    for i in range(counts.shape[0] * SUBSAMPLES):
        x = origin[0] + (i + 0.5) * step
        for j in range(counts.shape[1] * SUBSAMPLES):
            y = origin[1] + (j + 0.5) * step
            hit = False
            for s in range(len(start) - 1):
                if x < bounds[s, 0, 0] or x > bounds[s, 1, 0] or y < bounds[s, 0, 1] or y > bounds[s, 1, 1]:
                    continue
                z_low, z_high = bounds[s, 0, 2], bounds[s, 1, 2]
                for p in range(start[s], start[s + 1]):
                    rest = planes[p, 3] - planes[p, 0] * x - planes[p, 1] * y
                    slope = planes[p, 2]
                    if slope > 1e-12:
                        z_high = min(z_high, rest / slope)
                    elif slope < -1e-12:
                        z_low = max(z_low, rest / slope)
                    elif rest < 0.0:
                        z_high = -np.inf
                    if z_high < z_low:
                        break
                if z_high < z_low:
                    continue
                first = max(0, int(np.ceil((z_low - origin[2]) / step - 0.5)))
                last = min(height - 1, int(np.floor((z_high - origin[2]) / step - 0.5)))
                for k in range(first, last + 1):
                    line[k] = True
                    hit = True
            if hit:
                for k in range(height):
                    if line[k]:
                        counts[i // SUBSAMPLES, j // SUBSAMPLES, k // SUBSAMPLES] += 1
                        line[k] = False
