"""The surfaces of a scene in small patches, to be labelled one by one, and drawn into voxels and into plans.

Each face of a convex shape, and each triangle of a mesh, is divided into equal rectangles of at most ``PATCH_M`` a
side, along its longest edge; a triangle along the second longest, a side of the rectangle that it may be half of. A
patch stands for all of the face within its rectangle and is judged at one point: its middle, or at the face's border
the middle of its share of the face.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.truth.obstacles import Obstacles
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

PATCH_M = 0.05
SUBSAMPLES = 5  # points a side of a patch, voxel or cell that tell what of it a face passes through
SLACK_M = 1e-6  # what lies so close to a face lies on it
FLAT = float(np.cos(np.radians(15.0)))  # a face whose normal has a larger |z| is flat: tilted by at most 15 degrees


class Patches(NamedTuple):
    """P patches on F faces; all in the scene frame, metres.

    point: (P, 3) where a patch is judged. middle: (P, 3) of its rectangle. face: (P,) index. normal: (F, 3) outward.
    half: (F, 2, 3) half sides of the rectangles as vectors. shape: (F,) index of the shape. thickness_m: (F,) of the
    part along the normal.
    """

    point: FloatArray
    middle: FloatArray
    face: Int32Array
    normal: FloatArray
    half: FloatArray
    shape: Int32Array
    thickness_m: FloatArray

    @property
    def owner(self) -> Int32Array:
        """(P,) index of the shape a patch lies on."""
        return np.asarray(self.shape[self.face])

    @property
    def faces_up(self) -> BoolArray:
        """(P,) bool: on top of its shape, tilted by at most 15 degrees."""
        return np.asarray(self.normal[self.face, 2] >= FLAT)


def cut_patches(obstacles: Obstacles, low_z_m: float, high_z_m: float) -> Patches:
    """The patches, between two heights, of the surface of all parts."""
    shapes = obstacles.shapes
    found = Patches(*_cut(shapes.planes, shapes.corners, shapes.start, obstacles.face, low_z_m, high_z_m))
    return found._replace(thickness_m=np.maximum(found.thickness_m, obstacles.behind_m))


def draw_voxels(patches: Patches, labels: UInt8Array, obstacles: Obstacles, grid: VoxelGrid) -> UInt8Array:
    """(P,) bits -> (nx, ny, nz) uint8: a voxel has the bits of all patches that pass through it.

    A face that lies on the border of two voxels belongs to the one that its part fills.
    """
    volume = np.zeros(grid.shape, dtype=np.uint8)
    shapes, origin = obstacles.shapes, np.asarray(grid.origin_m, dtype=np.float64)
    _draw_voxels(patches, labels, shapes.planes, shapes.start, origin, grid.voxel_m, volume)
    return volume


def draw_plan(
    patches: Patches, labels: UInt8Array, obstacles: Obstacles, origin_xy: FloatArray, shape: tuple[int, int],
    cell_m: float,
) -> UInt8Array:  # fmt: skip
    """(P,) bits -> (nx, ny) uint8: a cell has the bits of the patches in its column.

    A flat patch is in the columns of the cells whose centre it covers. An upright one is in that of the cell half a
    cell behind it, at most in the middle of its part: a thick part is neither grown nor shrunk, a thin one not lost.
    """
    plan = np.zeros(shape, dtype=np.uint8)
    shapes, origin = obstacles.shapes, np.asarray(origin_xy, dtype=np.float64)
    _draw_plan(patches, labels, shapes.planes, shapes.start, origin, cell_m, plan)
    return plan


@numba.njit(cache=True)
def _cut(
    planes: FloatArray, corners: FloatArray, start: IntArray, carries: BoolArray, low_z: float, high_z: float
) -> tuple[FloatArray, FloatArray, Int32Array, FloatArray, FloatArray, Int32Array, FloatArray]:
    n_faces = len(planes)
    normal, half = np.zeros((n_faces, 3)), np.zeros((n_faces, 2, 3))
    shape, thickness = np.zeros(n_faces, dtype=np.int32), np.zeros(n_faces)
    point, middle, face = np.empty((1024, 3)), np.empty((1024, 3)), np.empty(1024, dtype=np.int32)
    count = 0
    for s in range(len(start) - 1):
        own = corners[start[s, 1] : start[s + 1, 1]]
        of_mesh = len(own) == 3
        for p in range(start[s, 0], start[s + 1, 0]):
            normal[p], shape[p] = planes[p, :3], s
            if not carries[p]:
                continue
            along = own @ planes[p, :3]
            thickness[p] = planes[p, 3] - along.min()
            polygon, a, b = _polygon(own[np.abs(along - planes[p, 3]) < SLACK_M], planes[p, :3], of_mesh)
            if len(polygon) < 3:
                continue
            u, v = polygon[:, 0], polygon[:, 1]
            low_u, low_v = u.min(), v.min()
            nu = max(1, int(np.ceil((u.max() - low_u - SLACK_M) / PATCH_M)))
            nv = max(1, int(np.ceil((v.max() - low_v - SLACK_M) / PATCH_M)))
            du, dv = (u.max() - low_u) / nu, (v.max() - low_v) / nv
            half[p, 0], half[p, 1] = a * du / 2, b * dv / 2
            for i in range(nu):
                for j in range(nv):
                    x, y = low_u + (i + 0.5) * du, low_v + (j + 0.5) * dv
                    z = planes[p, 3] * planes[p, 2] + x * a[2] + y * b[2]
                    if z < low_z or z > high_z:
                        continue
                    share_x, share_y = _share(u, v, x, y, du, dv)
                    if np.isnan(share_x):
                        continue
                    if count == len(face):
                        point, middle = np.concatenate((point, point)), np.concatenate((middle, middle))
                        face = np.concatenate((face, face))
                    for c in range(3):
                        point[count, c] = planes[p, 3] * planes[p, c] + share_x * a[c] + share_y * b[c]
                        middle[count, c] = planes[p, 3] * planes[p, c] + x * a[c] + y * b[c]
                    face[count] = p
                    count += 1
    return point[:count].copy(), middle[:count].copy(), face[:count].copy(), normal, half, shape, thickness


@numba.njit(cache=True)
def _polygon(points: FloatArray, normal: FloatArray, of_mesh: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Corners (K, 3) of a convex face -> (K, 2) counter-clockwise along two unit vectors, the first an edge."""
    a, b = np.zeros(3), np.zeros(3)
    if len(points) < 3:
        return points[:, :2].copy(), a, b
    centre = np.array([points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean()])
    a = points[0] - centre
    a /= np.sqrt((a**2).sum())
    b = np.cross(normal, a)
    angle = np.arctan2((points - centre) @ b, (points - centre) @ a)
    ring = points[np.argsort(angle, kind="mergesort")]
    longest, limit = 0.0, np.inf
    for _ in range(2 if of_mesh else 1):
        for k in range(len(ring)):
            edge = ring[(k + 1) % len(ring)] - ring[k]
            length = np.sqrt((edge**2).sum())
            if longest + SLACK_M < length < limit:
                longest = length
                a = edge / length
        longest, limit = 0.0, longest - SLACK_M
    b = np.cross(normal, a)
    return np.column_stack((ring @ a, ring @ b)), a, b


@numba.njit(cache=True)
def _share(u: FloatArray, v: FloatArray, x: float, y: float, du: float, dv: float) -> tuple[float, float]:
    """The middle of a rectangle if it lies in a polygon, else that of its sub-samples that do; NaN if none does."""
    if _holds(u, v, x, y):
        return x, y
    total_x, total_y, count = 0.0, 0.0, 0
    for i in range(SUBSAMPLES):
        for j in range(SUBSAMPLES):
            px, py = x + ((i + 0.5) / SUBSAMPLES - 0.5) * du, y + ((j + 0.5) / SUBSAMPLES - 0.5) * dv
            if _holds(u, v, px, py):
                total_x, total_y, count = total_x + px, total_y + py, count + 1
    return (total_x / count, total_y / count) if count else (np.nan, np.nan)


@numba.njit(cache=True)
def _holds(u: FloatArray, v: FloatArray, x: float, y: float) -> bool:
    for k in range(len(u)):
        n = (k + 1) % len(u)
        if (u[n] - u[k]) * (y - v[k]) - (v[n] - v[k]) * (x - u[k]) < 0.0:
            return False
    return True


@numba.njit(cache=True)
def _on_shape(planes: FloatArray, start: IntArray, shape: int, x: float, y: float, z: float) -> bool:
    for p in range(start[shape, 0], start[shape + 1, 0]):
        if planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z > planes[p, 3] + SLACK_M:
            return False
    return True


@numba.njit(cache=True)
def _steps(half: FloatArray, side: float) -> int:
    """Sub-samples along a rectangle's side of half length |half|, ``SUBSAMPLES`` to a cell."""
    return int(np.ceil(2.0 * np.sqrt((half**2).sum()) / side * SUBSAMPLES + SLACK_M))


@numba.njit(cache=True)
def _samples(patches: Patches, k: int, planes: FloatArray, start: IntArray, side: float) -> FloatArray:
    """(N, 3) points all over a patch, ``SUBSAMPLES`` to a cell along each of its sides."""
    # Scalars: slices and small arrays in the loop would take most of the time.
    f = patches.face[k]
    ax, ay, az = patches.half[f, 0, 0], patches.half[f, 0, 1], patches.half[f, 0, 2]
    bx, by, bz = patches.half[f, 1, 0], patches.half[f, 1, 1], patches.half[f, 1, 2]
    na, nb = _steps(patches.half[f, 0], side), _steps(patches.half[f, 1], side)
    found = np.empty((na * nb, 3))
    count = 0
    for i in range(na):
        along_a = (2 * i + 1) / na - 1.0
        x0, y0 = patches.middle[k, 0] + along_a * ax, patches.middle[k, 1] + along_a * ay
        z0 = patches.middle[k, 2] + along_a * az
        for j in range(nb):
            along_b = (2 * j + 1) / nb - 1.0
            x, y, z = x0 + along_b * bx, y0 + along_b * by, z0 + along_b * bz
            if _on_shape(planes, start, patches.shape[f], x, y, z):
                found[count, 0], found[count, 1], found[count, 2] = x, y, z
                count += 1
    return found[:count]


@numba.njit(cache=True)
def _draw_voxels(
    patches: Patches, labels: UInt8Array, planes: FloatArray, start: IntArray, origin: FloatArray, side: float,
    volume: UInt8Array,
) -> None:  # fmt: skip
    for k in range(len(labels)):
        if labels[k] == 0:
            continue
        inward = SLACK_M * patches.normal[patches.face[k]]
        for p in _samples(patches, k, planes, start, side):
            q = np.floor((p - inward - origin) / side)
            x, y, z = int(q[0]), int(q[1]), int(q[2])
            if 0 <= x < volume.shape[0] and 0 <= y < volume.shape[1] and 0 <= z < volume.shape[2]:
                volume[x, y, z] |= labels[k]


@numba.njit(cache=True)
def _draw_plan(
    patches: Patches, labels: UInt8Array, planes: FloatArray, start: IntArray, origin: FloatArray, side: float,
    plan: UInt8Array,
) -> None:  # fmt: skip
    for k in range(len(labels)):
        if labels[k] == 0:
            continue
        f = patches.face[k]
        if abs(patches.normal[f, 2]) >= FLAT:
            _draw_flat(patches, k, labels[k], planes, start, origin, side, plan)
        else:
            _draw_upright(patches, k, labels[k], planes, start, origin, side, plan)


@numba.njit(cache=True)
def _draw_flat(
    patches: Patches, k: int, label: int, planes: FloatArray, start: IntArray, origin: FloatArray, side: float,
    plan: UInt8Array,
) -> None:  # fmt: skip
    f = patches.face[k]
    middle, normal, a, b = patches.middle[k], patches.normal[f], patches.half[f, 0], patches.half[f, 1]
    aa, bb = (a**2).sum(), (b**2).sum()
    wide, deep = abs(a[0]) + abs(b[0]), abs(a[1]) + abs(b[1])
    first_x, last_x = (middle[0] - wide - origin[0]) / side - 0.5, (middle[0] + wide - origin[0]) / side - 0.5
    first_y, last_y = (middle[1] - deep - origin[1]) / side - 0.5, (middle[1] + deep - origin[1]) / side - 0.5
    far_a, far_b = aa + SLACK_M * np.sqrt(aa), bb + SLACK_M * np.sqrt(bb)
    mx, my, mz = middle[0], middle[1], middle[2]
    nx, ny, nz = normal[0], normal[1], normal[2]
    ax, ay, az, bx, by, bz = a[0], a[1], a[2], b[0], b[1], b[2]
    for i in range(max(0, int(first_x)), min(plan.shape[0] - 1, int(last_x) + 1) + 1):
        for j in range(max(0, int(first_y)), min(plan.shape[1] - 1, int(last_y) + 1) + 1):
            x, y = origin[0] + (i + 0.5) * side - mx, origin[1] + (j + 0.5) * side - my
            z = -(nx * x + ny * y) / nz
            inside = abs(x * ax + y * ay + z * az) <= far_a and abs(x * bx + y * by + z * bz) <= far_b
            if inside and _on_shape(planes, start, patches.shape[f], mx + x, my + y, mz + z):
                plan[i, j] |= label


@numba.njit(cache=True)
def _draw_upright(
    patches: Patches, k: int, label: int, planes: FloatArray, start: IntArray, origin: FloatArray, side: float,
    plan: UInt8Array,
) -> None:  # fmt: skip
    f = patches.face[k]
    nx, ny = patches.normal[f, 0], patches.normal[f, 1]
    behind = min(side, patches.thickness_m[f]) / 2 / np.sqrt(nx**2 + ny**2) - SLACK_M
    points = _samples(patches, k, planes, start, side)
    for n in range(len(points)):
        x = int(np.floor((points[n, 0] - behind * nx - origin[0]) / side))
        y = int(np.floor((points[n, 1] - behind * ny - origin[1]) / side))
        if 0 <= x < plan.shape[0] and 0 <= y < plan.shape[1]:
            plan[x, y] |= label
