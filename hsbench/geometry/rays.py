"""Exact float64 rays against convex solids: depth images, amodal pixel counts, and blocked lines of sight.

Every truth that asks "what could be seen" comes from here, never from a rendered image, so that it is the
same on every machine. A ray enters a convex solid where its last entering face plane lets it in (slab method,
Kay & Kajiya 1986).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.transforms import apply, invert
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

NEAR_M = 1e-3  # a solid reaching closer than this to the camera plane is tested on the whole image
PARALLEL = 1e-12  # a ray whose direction meets a plane's normal at less than this runs along the plane


@dataclass(frozen=True, eq=False)
class PackedSolids:
    """N convex solids as flat arrays: planes (P, 4), first row of each solid (N + 1,), and corners (C, 3) likewise."""

    planes: FloatArray
    plane_start: IntArray
    corners: FloatArray
    corner_start: IntArray

    def __len__(self) -> int:
        return len(self.plane_start) - 1


@dataclass(frozen=True, eq=False)
class RayImage:
    """What a camera sees of owned solids.

    depth_m: (h, w) float64 camera z at pixel centres, +inf where nothing is hit.
    owner: (h, w) int32 owner of the nearest solid, -1 where nothing is hit.
    amodal_px: (n_owners,) int64 pixels an owner would cover if it stood alone.
    """

    depth_m: FloatArray
    owner: Int32Array
    amodal_px: IntArray


def pack_solids(solids: Sequence[ConvexSolid]) -> PackedSolids:
    """Solids (all in one frame) as flat arrays for the compiled tests."""
    planes = [s.planes for s in solids]
    corners = [s.vertices for s in solids]
    return PackedSolids(
        np.concatenate([np.empty((0, 4)), *planes]),
        np.cumsum([0, *map(len, planes)], dtype=np.int64),
        np.concatenate([np.empty((0, 3)), *corners]),
        np.cumsum([0, *map(len, corners)], dtype=np.int64),
    )


def segments_blocked(origin: FloatArray, targets: FloatArray, solids: PackedSolids) -> BoolArray:
    """(3,) origin, (N, 3) targets -> (N,) bool: a solid cuts the open segment between them.

    A target inside a solid, or an origin inside one, counts as blocked; touching a face from outside does not.
    """
    targets = np.ascontiguousarray(targets, dtype=np.float64)
    return np.asarray(
        _segments_blocked(np.asarray(origin, dtype=np.float64), targets, solids.planes, solids.plane_start)
    )


def cast(
    camera: PinholeCamera, world_T_camera: FloatArray, solids: PackedSolids, owner: Int32Array, n_owners: int
) -> RayImage:
    """The exact image of solids (in the world frame) with ``owner`` (N,) int32 in 0..n_owners - 1, ascending."""
    owner = np.asarray(owner, dtype=np.int32)
    if len(owner) != len(solids) or (np.diff(owner) < 0).any():
        raise SchemaError(
            f"owner has {len(owner)} entries for {len(solids)} solids, or descends; expected one a solid, ascending"
        )
    rotation, translation = world_T_camera[:3, :3], world_T_camera[:3, 3]
    planes = np.column_stack(
        [solids.planes[:, :3] @ rotation, solids.planes[:, 3] - solids.planes[:, :3] @ translation]
    )
    windows = _windows(camera, apply(invert(world_T_camera), solids.corners), solids.corner_start)
    depth_m = np.full((camera.height_px, camera.width_px), np.inf)
    seen = np.full(depth_m.shape, -1, dtype=np.int32)
    amodal = np.zeros(n_owners, dtype=np.int64)
    rays = camera.rays()
    _cast(rays[0, :, 0].copy(), rays[:, 0, 1].copy(), planes, solids.plane_start, windows, owner, depth_m, seen, amodal)
    return RayImage(depth_m, seen, amodal)


def _windows(camera: PinholeCamera, corners: FloatArray, start: IntArray) -> IntArray:
    """(N, 4) pixel rectangles u0, v0, u1, v1 (end exclusive) that hold each solid's projection."""
    windows = np.zeros((len(start) - 1, 4), dtype=np.int64)
    size = np.array([camera.width_px, camera.height_px])
    for i in range(len(start) - 1):
        points = corners[start[i] : start[i + 1]]
        if points[:, 2].max() <= 0:
            continue
        if points[:, 2].min() < NEAR_M:
            windows[i] = (0, 0, *size)
            continue
        pixels, _ = camera.project(points)
        low = np.clip(np.floor(pixels.min(axis=0)) - 1, 0, size)
        high = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, size)
        windows[i] = (*low, *high)
    return windows


@numba.njit(cache=True)
def _segments_blocked(origin: FloatArray, targets: FloatArray, planes: FloatArray, start: IntArray) -> BoolArray:
    blocked = np.zeros(len(targets), dtype=np.bool_)
    for t in range(len(targets)):
        dx, dy, dz = targets[t, 0] - origin[0], targets[t, 1] - origin[1], targets[t, 2] - origin[2]
        for s in range(len(start) - 1):
            enter, leave = 0.0, 1.0
            for p in range(start[s], start[s + 1]):
                nx, ny, nz, d = planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
                gap = d - nx * origin[0] - ny * origin[1] - nz * origin[2]
                along = nx * dx + ny * dy + nz * dz
                if abs(along) < PARALLEL:
                    if gap <= 0.0:
                        leave = -1.0
                        break
                elif along > 0.0:
                    leave = min(leave, gap / along)
                else:
                    enter = max(enter, gap / along)
                if leave <= enter:
                    break
            if leave > enter:
                blocked[t] = True
                break
    return blocked


@numba.njit(cache=True)
def _cast(
    ray_x: FloatArray,
    ray_y: FloatArray,
    planes: FloatArray,
    start: IntArray,
    windows: IntArray,
    owner: Int32Array,
    depth: FloatArray,
    seen: Int32Array,
    amodal: IntArray,
) -> None:
    counted = np.full(depth.shape, -1, dtype=np.int32)
    for s in range(len(start) - 1):
        u0, v0, u1, v1 = windows[s]
        for v in range(v0, v1):
            for u in range(u0, u1):
                enter, leave = 0.0, np.inf
                for p in range(start[s], start[s + 1]):
                    along = planes[p, 0] * ray_x[u] + planes[p, 1] * ray_y[v] + planes[p, 2]
                    if abs(along) < PARALLEL:
                        if planes[p, 3] <= 0.0:
                            leave = -1.0
                            break
                    elif along > 0.0:
                        leave = min(leave, planes[p, 3] / along)
                    else:
                        enter = max(enter, planes[p, 3] / along)
                    if leave <= enter:
                        break
                if leave <= enter or enter <= 0.0:
                    continue
                if counted[v, u] != owner[s]:
                    counted[v, u] = owner[s]
                    amodal[owner[s]] += 1
                if enter < depth[v, u]:
                    depth[v, u] = enter
                    seen[v, u] = owner[s]
