"""Drawing a few meshes (people) for any camera without a graphics library: every pixel's own ray, in float64.

A triangle is tested against the rays of the pixels in its image box (``image_boxes``), so nothing is bent, stretched or
cut at the seam of a 360 picture, and ids and depth are the ray caster's. The cost follows the pixels covered.

In homogeneous terms all cameras are one: the ray r of a pixel meets a triangle inside its three edges where r . edge
has one sign for all, and r . plane is the nearness there, 1 / depth. An orthographic view from above has the lines
(x, y, 1) for rays and the height for nearness; what reaches above its cut is seen at the cut.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.geometry.cameras import Camera, EquirectangularCamera, TopDownCamera
from hsbench.synth.render.base import CUT_M, NEAR_M, Lighting, Mesh, View, Window, check_request
from hsbench.synth.render.facets import Facets, Lamps, facets_of, lamps_of
from hsbench.synth.render.image_boxes import ray_table
from hsbench.synth.render.shading import to_bytes
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, Int32Array, IntArray, UInt16Array

SUBSAMPLES_PX = np.array([(-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375)])
"""(S, 2) places in an edge pixel off its centre: the rotated grid, no two in a row or column."""
JUMP_M = 0.04  # neighbours farther apart in depth show two limbs: there is an edge between


@dataclass(frozen=True, eq=False)
class Layer:
    """What of a mesh stands before a picture, and where. Depth and id belong to the pixel centre."""

    window: Window
    light: FloatArray
    """(h, w, 3) linear light, the mean of what is shown in a pixel."""
    coverage: FloatArray
    """(h, w) share of the pixel in which it is shown, more than 0 where id is not 0 and a little around."""
    depth_m: Float32Array
    """(h, w) as the camera measures depth, 0 = nothing."""
    ids: UInt16Array
    """(h, w) mesh ids, 0 = nothing."""


def rasterise(
    meshes: Sequence[Mesh],
    camera: Camera,
    world_T_camera: FloatArray,
    lights: Lighting,
    window: Window | None = None,
) -> View:
    """What ``Renderer.render`` gives, by the rules of ``base``: one sample a pixel, at its centre."""
    window = check_request(meshes, camera, world_T_camera, window)
    from_above, rays = isinstance(camera, TopDownCamera), _cut(ray_table(camera), window)
    facets = facets_of(meshes, camera, world_T_camera)
    triangle, near = _nearest(facets, camera, window)
    light = np.zeros((*near.shape, 3))
    _shade(triangle, near, rays, facets, lamps_of(lights, world_T_camera), from_above, light)
    return View(to_bytes(light), *_depth_and_ids(triangle, near, facets.mesh_ids, from_above))


def layer(
    mesh: Mesh,
    camera: Camera,
    world_T_camera: FloatArray,
    lights: Lighting,
    behind_m: AnyArray,
    window: Window,
) -> Layer | None:
    """A mesh before what is ``behind_m`` deep, (h, w) of a window, 0 = nothing there; silhouettes are smooth.

    None where it has no pixel in the window.
    """
    check_request([mesh], camera, world_T_camera, window)
    facets = facets_of([mesh], camera, world_T_camera)
    inner = _around(facets.boxes, camera, window)
    if inner is None:
        return None
    from_above, rays, lamps = isinstance(camera, TopDownCamera), ray_table(camera), lamps_of(lights, world_T_camera)
    at = Window(inner.u0 - window.u0, inner.v0 - window.v0, inner.width, inner.height)
    behind = _nearness(_cut(behind_m, at), from_above)
    triangle, near = _nearest(facets, camera, inner, behind)
    light, coverage = np.zeros((*near.shape, 3)), (triangle >= 0).astype(np.float64)
    _shade(triangle, near, _cut(rays, inner), facets, lamps, from_above, light)
    slots, pixels = _edges(triangle, near, from_above)
    if len(pixels):
        fine_rays = _rays_around(rays, pixels + (inner.v0, inner.u0), SUBSAMPLES_PX)
        fine_near = np.repeat(behind[pixels[:, 0], pixels[:, 1], None], len(SUBSAMPLES_PX), axis=1)
        fine_triangle = np.full(fine_near.shape, -1, dtype=np.int32)
        corner, limit = (inner.u0, inner.v0), _limit(camera)
        _draw_samples(facets, slots, fine_rays, corner, camera.width_px, limit, fine_triangle, fine_near)
        fine_light = np.zeros((*fine_near.shape, 3))
        _shade(fine_triangle, fine_near, fine_rays, facets, lamps, from_above, fine_light)
        _average(pixels, fine_triangle, fine_light, light, coverage)
    return Layer(inner, light, coverage, *_depth_and_ids(triangle, near, facets.mesh_ids, from_above))


def amodal_masks(
    meshes: Sequence[Mesh], camera: Camera, world_T_camera: FloatArray, window: Window | None = None
) -> BoolArray:
    """(n, h, w) the pixels that each of n meshes would cover if nothing else were there."""
    window = check_request(meshes, camera, world_T_camera, window)
    masks = np.empty((len(meshes), window.height, window.width), dtype=np.bool_)
    for mask, mesh in zip(masks, meshes, strict=True):
        triangle, _ = _nearest(facets_of([mesh], camera, world_T_camera), camera, window)
        mask[:] = triangle >= 0
    return masks


def _around(boxes: Int32Array, camera: Camera, window: Window) -> Window | None:
    """The part of a window that holds (T, 4) boxes and the pixels around them; None for none."""
    seen = boxes[(boxes[:, 2:] > boxes[:, :2]).all(axis=1)]
    if not len(seen):
        return None
    (u0, v0), (u1, v1) = seen[:, :2].min(axis=0) - 1, seen[:, 2:].max(axis=0) + 1
    if isinstance(camera, EquirectangularCamera) and (u0 < 0 or u1 > camera.width_px):
        u0, u1 = 0, camera.width_px
    u0, v0 = max(u0, window.u0), max(v0, window.v0)
    u1, v1 = min(u1, window.u0 + window.width), min(v1, window.v0 + window.height)
    return Window(int(u0), int(v0), int(u1 - u0), int(v1 - v0)) if u0 < u1 and v0 < v1 else None


def _nearest(
    facets: Facets, camera: Camera, window: Window, behind: FloatArray | None = None
) -> tuple[Int32Array, FloatArray]:
    """(h, w) number of the triangle at each pixel's centre, -1 for none, and the nearness there.

    behind: (h, w) nearness of what the triangles have to stand before.
    """
    near = np.full((window.height, window.width), -np.inf) if behind is None else behind.copy()
    triangle = np.full(near.shape, -1, dtype=np.int32)
    _draw(facets, ray_table(camera), window.u0, window.v0, _limit(camera), triangle, near)
    return triangle, near


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _rows(matrix: FloatArray) -> tuple[tuple[float, float, float], ...]:
    """The rows of a (3, 3) matrix as floats, which compiled loops keep in registers."""
    return (
        (matrix[0, 0], matrix[0, 1], matrix[0, 2]),
        (matrix[1, 0], matrix[1, 1], matrix[1, 2]),
        (matrix[2, 0], matrix[2, 1], matrix[2, 2]),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _draw(
    facets: Facets, rays: FloatArray, u0: int, v0: int, limit: float, triangle: Int32Array, near: FloatArray
) -> None:
    height, width = triangle.shape
    for t in range(len(facets.plane)):
        left, top, right, bottom = facets.boxes[t]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = _rows(facets.edges[t])
        px, py, pz = facets.plane[t, 0], facets.plane[t, 1], facets.plane[t, 2]
        for turn in (-rays.shape[1], 0, rays.shape[1]):  # a box may reach beyond a 360 image
            if right + turn <= u0 or left + turn >= u0 + width:
                continue
            for v in range(max(top, v0), min(bottom, v0 + height)):
                for u in range(max(left + turn, u0), min(right + turn, u0 + width)):
                    x, y, z = rays[v, u, 0], rays[v, u, 1], rays[v, u, 2]
                    least = min(ax * x + ay * y + az * z, bx * x + by * y + bz * z, cx * x + cy * y + cz * z)
                    found = px * x + py * y + pz * z
                    if (least >= 0.0) & (found > near[v - v0, u - u0]) & (found <= limit):
                        near[v - v0, u - u0], triangle[v - v0, u - u0] = found, t


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _draw_samples(
    facets: Facets, slots: Int32Array, rays: FloatArray, corner: tuple[int, int], image_width: int, limit: float,
    triangle: Int32Array, near: FloatArray,
) -> None:  # fmt: skip
    """As ``_draw``, for (K, S) samples with (K, S, 3) rays in the pixels whose slot (h, w) is not -1 but 0..K-1."""
    (u0, v0), (height, width) = corner, slots.shape
    for t in range(len(facets.plane)):
        left, top, right, bottom = facets.boxes[t]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = _rows(facets.edges[t])
        px, py, pz = facets.plane[t, 0], facets.plane[t, 1], facets.plane[t, 2]
        for turn in (-image_width, 0, image_width):
            if right + 1 + turn <= u0 or left - 1 + turn >= u0 + width:
                continue
            # A sample may lie in a triangle that misses the centre of its pixel.
            for v in range(max(top - 1, v0), min(bottom + 1, v0 + height)):
                for u in range(max(left - 1 + turn, u0), min(right + 1 + turn, u0 + width)):
                    k = slots[v - v0, u - u0]
                    for s in range(triangle.shape[1] if k >= 0 else 0):
                        x, y, z = rays[k, s, 0], rays[k, s, 1], rays[k, s, 2]
                        least = min(ax * x + ay * y + az * z, bx * x + by * y + bz * z, cx * x + cy * y + cz * z)
                        found = px * x + py * y + pz * z
                        if (least >= 0.0) & (found > near[k, s]) & (found <= limit):
                            near[k, s], triangle[k, s] = found, t


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _shade(
    triangle: Int32Array, near: FloatArray, rays: FloatArray, facets: Facets, lamps: Lamps, from_above: bool,
    light: FloatArray,
) -> None:  # fmt: skip
    """Fill the (h, w, 3) linear light where a triangle is seen: Lambert's law with interpolated normals."""
    normal, total = np.empty(3), np.empty(3)
    for i in range(triangle.shape[0]):
        for j in range(triangle.shape[1]):
            t = triangle[i, j]
            if t < 0:
                continue
            x, y, z = rays[i, j, 0], rays[i, j, 1], rays[i, j, 2]
            normal[:] = 0.0
            for k in range(3):
                share = facets.edges[t, k, 0] * x + facets.edges[t, k, 1] * y + facets.edges[t, k, 2] * z
                for c in range(3):
                    normal[c] += share * facets.normals[t, k, c]
            length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
            if from_above:
                z = near[i, j]
            else:
                x, y, z = x / near[i, j], y / near[i, j], z / near[i, j]
            total[:] = lamps.ambient
            for k in range(len(lamps.towards)):
                facing = normal[0] * lamps.towards[k, 0] + normal[1] * lamps.towards[k, 1]
                facing = max(facing + normal[2] * lamps.towards[k, 2], 0.0) / length
                for c in range(3):
                    total[c] += facing * lamps.sun_light[k, c]
            for k in range(len(lamps.places)):
                ox, oy, oz = lamps.places[k, 0] - x, lamps.places[k, 1] - y, lamps.places[k, 2] - z
                square = ox * ox + oy * oy + oz * oz
                facing = max(normal[0] * ox + normal[1] * oy + normal[2] * oz, 0.0) / length
                facing /= square * math.sqrt(square)
                for c in range(3):
                    total[c] += facing * lamps.lamp_light[k, c]
            for c in range(3):
                light[i, j, c] = facets.albedo[t, c] * total[c]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _edges(triangle: Int32Array, near: FloatArray, from_above: bool) -> tuple[Int32Array, IntArray]:
    """(h, w) number of each edge pixel, -1 for others, and their (K, 2) rows and columns.

    Of two neighbours both are edge pixels where one shows nothing, or something JUMP_M nearer or farther.
    """
    slots = np.full(triangle.shape, -1, dtype=np.int32)
    height, width = triangle.shape
    for i in range(height):
        for j in range(width):
            for down, right in ((0, 1), (1, 0)):
                m, n = i + down, j + right
                if m == height or n == width or (triangle[i, j] < 0 and triangle[m, n] < 0):
                    continue
                edge = triangle[i, j] < 0 or triangle[m, n] < 0
                if not edge:
                    a, b = near[i, j], near[m, n]
                    edge = abs(a - b if from_above else 1.0 / a - 1.0 / b) > JUMP_M
                if edge:
                    slots[i, j] = slots[m, n] = 0
    pixels = np.empty((np.count_nonzero(slots + 1), 2), dtype=np.int64)
    k = 0
    for i in range(height):
        for j in range(width):
            if slots[i, j] == 0:
                slots[i, j] = k
                pixels[k] = i, j
                k += 1
    return slots, pixels


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _rays_around(rays: FloatArray, pixels: IntArray, offsets: FloatArray) -> FloatArray:
    """(K, S, 3) rays at (S, 2) offsets (u, v) from the centres of (K, 2) pixels (row, column).

    Exact for a pinhole, else to a small share of a pixel.
    """
    found = np.empty((len(pixels), len(offsets), 3))
    for k in range(len(pixels)):
        row, column = pixels[k]
        left, right = max(column - 1, 0), min(column + 1, rays.shape[1] - 1)
        above, below = max(row - 1, 0), min(row + 1, rays.shape[0] - 1)
        for c in range(3):
            per_column = (rays[row, right, c] - rays[row, left, c]) / (right - left)
            per_row = (rays[below, column, c] - rays[above, column, c]) / (below - above)
            for s in range(len(offsets)):
                found[k, s, c] = rays[row, column, c] + offsets[s, 0] * per_column + offsets[s, 1] * per_row
    return found


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _average(
    pixels: IntArray, triangle: Int32Array, fine_light: FloatArray, light: FloatArray, coverage: FloatArray
) -> None:
    """Fill in the light and coverage of K pixels from their (K, S) samples."""
    for k in range(len(pixels)):
        row, column = pixels[k]
        count = 0
        for s in range(triangle.shape[1]):
            count += triangle[k, s] >= 0
        coverage[row, column] = count / triangle.shape[1]
        for c in range(3):
            light[row, column, c] = fine_light[k, :, c].sum() / max(count, 1)


def _limit(camera: Camera) -> float:
    """The greatest nearness that is drawn."""
    return math.inf if isinstance(camera, TopDownCamera) else 1.0 / NEAR_M


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _nearness(depth_m: AnyArray, from_above: bool) -> FloatArray:
    """(h, w) nearness of depths, least where nothing is."""
    near: FloatArray = np.empty(depth_m.shape)
    for i in range(near.shape[0]):
        for j in range(near.shape[1]):
            depth = float(depth_m[i, j])
            near[i, j] = depth if from_above else 1.0 / depth if depth > 0.0 else -math.inf
    return near


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _depth_and_ids(
    triangle: Int32Array, near: FloatArray, mesh_ids: UInt16Array, from_above: bool
) -> tuple[Float32Array, UInt16Array]:
    """(h, w) depth and mesh ids of what is seen, 0 elsewhere."""
    depth, ids = np.zeros(triangle.shape, dtype=np.float32), np.zeros(triangle.shape, dtype=np.uint16)
    for i in range(triangle.shape[0]):
        for j in range(triangle.shape[1]):
            if triangle[i, j] >= 0:
                depth[i, j] = min(near[i, j], CUT_M) if from_above else 1.0 / near[i, j]
                ids[i, j] = mesh_ids[triangle[i, j]]
    return depth, ids


def _cut(picture: AnyArray, window: Window) -> AnyArray:
    return picture[window.v0 : window.v0 + window.height, window.u0 : window.u0 + window.width]
