"""Exact float64 rays against convex solids: depth images, amodal pixel counts, and blocked lines of sight.

Every truth that asks "what could be seen" comes from here, never from a rendered image, so that it is the
same on every machine. A ray enters a convex solid where its last entering face plane lets it in (slab method,
Kay & Kajiya 1986).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import BrownCamera, CentralCamera, EquirectangularCamera, PinholeCamera
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.transforms import apply, invert
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

NEAR_M = 1e-3  # a solid closer than this to the camera plane, or to a sphere's axis, is tested on the whole image
RIM_STEPS = 16  # along each side of a box that a lens bends: the bend between them stays below a pixel
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

    depth_m: (h, w) float64 depth at pixel centres as the camera counts it, +inf where nothing is hit.
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
    camera: CentralCamera, world_T_camera: FloatArray, solids: PackedSolids, owner: Int32Array, n_owners: int
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
    _cast(camera.rays(), planes, solids.plane_start, windows, owner, depth_m, seen, amodal)
    return RayImage(depth_m, seen, amodal)


def _windows(camera: CentralCamera, corners: FloatArray, start: IntArray) -> IntArray:
    """(N, 4) pixel rectangles u0, v0, u1, v1 (end exclusive) that hold each solid's projection.

    On a sphere u1 may lie beyond the last column: the first one follows it.
    """
    windows = [
        _window_on_sphere(camera, corners[first:last])
        if isinstance(camera, EquirectangularCamera)
        else _window_on_plane(camera, corners[first:last])
        for first, last in pairwise(start)
    ]
    return np.array(windows, dtype=np.int64).reshape(-1, 4)


def _window_on_plane(camera: PinholeCamera | BrownCamera, points: FloatArray) -> tuple[float, ...]:
    size = np.array([camera.width_px, camera.height_px])
    if points[:, 2].max() <= 0:
        return 0, 0, 0, 0
    if points[:, 2].min() < NEAR_M:
        return 0, 0, camera.width_px, camera.height_px
    pixels, _ = camera.project(_rim(points, camera.reach) if isinstance(camera, BrownCamera) else points)
    low = np.clip(np.floor(pixels.min(axis=0)) - 1, 0, size)
    high = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, size)
    return *low, *high


def _rim(points: FloatArray, reach: float) -> FloatArray:
    """(N, 3) points along the rim of the box about what (C, 3) points cover within ``reach`` at depth 1."""
    flat = np.clip(points[:, :2] / points[:, 2:], -reach, reach)
    (x0, y0), (x1, y1) = flat.min(axis=0), flat.max(axis=0)
    along = np.linspace(0.0, 1.0, RIM_STEPS + 1)
    x, y = x0 + along * (x1 - x0), y0 + along * (y1 - y0)
    sides = [(x, np.full_like(x, y0)), (x, np.full_like(x, y1)), (np.full_like(y, x0), y), (np.full_like(y, x1), y)]
    return np.concatenate([np.stack([a, b, np.ones_like(a)], axis=-1) for a, b in sides])


def _window_on_sphere(camera: EquirectangularCamera, points: FloatArray) -> tuple[float, ...]:
    """The columns are those of the corners; rows are bounded by height over the least and greatest level distance."""
    width, height = camera.width_px, camera.height_px
    level, up = points[:, [2, 0]], -points[:, 1]
    middle = level.mean(axis=0)
    middle = middle / max(float(np.hypot(*middle)), NEAR_M)
    ahead, aside = level @ middle, level @ [-middle[1], middle[0]]
    nearest = float(ahead.min())  # no point of the solid is nearer to the upright axis
    if nearest < NEAR_M:
        return 0, 0, width, height
    farthest = float(np.hypot(level[:, 0], level[:, 1]).max())
    high, low = float(up.max()), float(up.min())
    top = math.atan2(high, nearest if high > 0 else farthest)
    bottom = math.atan2(low, farthest if low > 0 else nearest)
    azimuth = math.atan2(middle[1], middle[0]) + np.arctan2(aside, ahead)
    u0, u1 = ((a / (2 * math.pi) + 0.5) * width for a in (float(azimuth.min()), float(azimuth.max())))
    v0, v1 = ((0.5 - a / math.pi) * height for a in (top, bottom))
    if u1 - u0 + 4 >= width:
        return 0, max(math.floor(v0) - 1, 0), width, min(math.ceil(v1) + 1, height)
    first = math.floor(u0) - 1
    turned = first % width
    return turned, max(math.floor(v0) - 1, 0), turned + math.ceil(u1) + 1 - first, min(math.ceil(v1) + 1, height)


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
    rays: FloatArray,
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
            for column in range(u0, u1):
                u = column if column < depth.shape[1] else column - depth.shape[1]
                enter, leave = 0.0, np.inf
                for p in range(start[s], start[s + 1]):
                    along = planes[p, 0] * rays[v, u, 0] + planes[p, 1] * rays[v, u, 1] + planes[p, 2] * rays[v, u, 2]
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
