"""The ray caster: every camera, exact depth from embree hits, plain Lambert RGB. Needs no graphics library.

Embree finds the triangle in float32; the distance is then the float64 intersection of the pixel's ray with that
triangle's plane, so depth is exact. Slower than the GL back end on crops; the reference for its tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numba
import numpy as np

from hsbench.errors import MissingExtraError
from hsbench.geometry.cameras import Camera, TopDownCamera, pixel_centres
from hsbench.synth.render.base import CUT_M, NEAR_M, Lighting, Mesh, Only, View, Window, check_request
from hsbench.synth.render.shading import corner_normals, lambert, to_bytes, to_linear
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, Int32Array, IntArray, UInt8Array

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ModuleNotFoundError as error:
    raise MissingExtraError("the ray caster", error.name or "embreex", "gen") from error

MAX_SURFACES = 32
"""Surfaces a ray may pass through (seen from behind, or nearer than NEAR_M) before it counts as a miss."""

BLOCK_RAYS = 2**17
"""Rays cast at a time, so that memory does not grow with the picture."""


@dataclass(frozen=True, eq=False)
class _Built:
    """Meshes joined into one embree scene, as seen from one camera position (the origin of its coordinates)."""

    meshes: tuple[Mesh, ...]
    position: FloatArray
    scene: Any
    corners: FloatArray  # (T, 3, 3) metres from the camera position, world axes
    planes: FloatArray  # (T, 3) outward normals, not unit
    normals: FloatArray  # (T, 3, 3) shading normals at the corners
    albedo: FloatArray  # (T, 3) linear
    mesh_ids: AnyArray  # (T,) uint16

    def serves(self, meshes: Sequence[Mesh], position: FloatArray) -> bool:
        return (
            len(meshes) == len(self.meshes)
            and all(a is b for a, b in zip(meshes, self.meshes, strict=True))
            and np.array_equal(position, self.position)
        )


@dataclass(frozen=True, eq=False)
class _Hits:
    """The seen triangle (-1: none) of each of N rays, and where along the ray (0: none)."""

    triangle: Int32Array
    depth: FloatArray


class Occluders:
    """Triangles to ask about any rays: for light, whatever back end draws. Both sides of a triangle stop a ray."""

    def __init__(self, corners: FloatArray, stops: BoolArray) -> None:
        """corners: (T, 3, 3) metres. stops: (T,) whether a triangle stops rays."""
        self._numbers = np.append(np.flatnonzero(stops), -1).astype(np.int32)  # the last is what -1 stands for
        self._scene = EmbreeScene(robust=True)
        if stops.any():
            TriangleMesh(self._scene, corners[stops].astype(np.float32))

    def first(self, origins: Float32Array, directions: Float32Array) -> Int32Array:
        """(N, 3) origins and directions -> (N,) int32 number of the first triangle hit, -1 for none."""
        return np.asarray(self._numbers[self._scene.run(origins, directions)])

    def blocked(self, origins: Float32Array, vectors: Float32Array) -> BoolArray:
        """(N, 3) origins and vectors -> (N,) bool: a triangle lies between an origin and the end of its vector."""
        hit = self._scene.run(origins, vectors, np.ones(len(origins), dtype=np.float32), query="OCCLUDED")
        return np.asarray(hit == 0)


class RaycastRenderer:
    """Renderer by ray casting. Keeps the last scene, so that windows of the same meshes are built once."""

    name = "raycast"

    def __init__(self) -> None:
        self._built: _Built | None = None

    def render(
        self,
        meshes: Sequence[Mesh],
        camera: Camera,
        world_T_camera: FloatArray,
        lights: Lighting,
        window: Window | None = None,
        only: Only = None,
    ) -> View:
        """See Renderer.render."""
        window = check_request(meshes, camera, world_T_camera, window)
        if isinstance(camera, TopDownCamera):
            meshes = [mesh for mesh in meshes if _is_below_cut(mesh, world_T_camera)]
        if not any(len(mesh.triangles) for mesh in meshes):
            return View.blank(window)
        if self._built is None or not self._built.serves(meshes, world_T_camera[:3, 3]):
            self._built = _build(meshes, world_T_camera[:3, 3])
        built = self._built
        rows = max(BLOCK_RAYS // window.width, 1)
        tops = range(window.v0, window.v0 + window.height, rows)
        blocks = [Window(window.u0, v0, window.width, min(rows, window.v0 + window.height - v0)) for v0 in tops]
        drawn = [_draw(built, camera, world_T_camera, lights, block, only) for block in blocks]
        return View(*(np.concatenate([getattr(view, f.name) for view in drawn]) for f in fields(View)))


def _draw(
    built: _Built, camera: Camera, world_T_camera: FloatArray, lights: Lighting, window: Window, only: Only
) -> View:
    shape = (window.height, window.width)
    origins, rays = _rays(camera, world_T_camera, window)
    if isinstance(camera, TopDownCamera):
        hits = _cast_down(built, origins, rays)
        depth = np.where(hits.triangle >= 0, CUT_M - hits.depth, 0.0)
    else:
        hits = _cast(built, origins, rays, NEAR_M)
        depth = hits.depth
    view = View.blank(window)
    if only != "rgb":
        ids = np.where(hits.triangle >= 0, built.mesh_ids[hits.triangle], 0).astype(np.uint16)
        view = replace(view, depth_m=depth.astype(np.float32).reshape(shape), ids=ids.reshape(shape))
    if only != "shape":
        view = replace(view, rgb=_shade(built, origins, rays, hits, lights).reshape(*shape, 3))
    return view


def _is_below_cut(mesh: Mesh, world_T_camera: FloatArray) -> bool:
    """Whether a part of a mesh lies below the cut of a camera from above."""
    heights_m = (mesh.vertices - world_T_camera[:3, 3]) @ world_T_camera[:3, 2]
    return bool(len(heights_m)) and float(heights_m.min()) < CUT_M


def _build(meshes: Sequence[Mesh], position: FloatArray) -> _Built:
    corners = np.concatenate([mesh.vertices[mesh.triangles] for mesh in meshes]) - position
    scene = EmbreeScene(robust=True)  # robust: no ray slips between two triangles that share an edge
    TriangleMesh(scene, corners.astype(np.float32))
    return _Built(
        meshes=tuple(meshes),
        position=np.array(position, dtype=np.float64),
        scene=scene,
        corners=corners,
        planes=np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
        normals=np.concatenate([corner_normals(mesh) for mesh in meshes]),
        albedo=np.concatenate([to_linear(mesh.colours) for mesh in meshes]),
        mesh_ids=np.repeat(
            np.array([mesh.mesh_id for mesh in meshes], dtype=np.uint16), [len(mesh.triangles) for mesh in meshes]
        ),
    )


def _rays(camera: Camera, world_T_camera: FloatArray, window: Window) -> tuple[FloatArray, FloatArray]:
    """(N, 3) origins from the camera position, (N, 3) directions, world axes, of the window's pixels, row by row.

    Those of a camera from above start at the cut and look down; the others' are as long as one unit of depth.
    """
    pixels = pixel_centres(window.width, window.height) + (window.u0, window.v0)
    if isinstance(camera, TopDownCamera):
        origins = camera.origins_at(pixels).reshape(-1, 3) + (0.0, 0.0, CUT_M)
        return _turned(world_T_camera, origins), _turned(world_T_camera, -camera.rays_at(pixels).reshape(-1, 3))
    rays = _turned(world_T_camera, camera.rays_at(pixels).reshape(-1, 3))
    return np.broadcast_to(0.0, rays.shape), rays


def _turned(world_T_camera: FloatArray, vectors: FloatArray) -> FloatArray:
    """(N, 3) vectors along the camera's axes -> along the world's."""
    # Elementwise products, not matmul: BLAS may sum differently for other sizes, and a crop must equal the full image.
    x, y, z = world_T_camera[:3, :3].T
    return np.asarray(vectors[:, :1] * x + vectors[:, 1:2] * y + vectors[:, 2:] * z)


def _cast(built: _Built, origins: FloatArray, rays: FloatArray, near: float) -> _Hits:
    """First front-facing surface at ``near`` or beyond, along each of (N, 3) rays from (N, 3) origins."""
    triangle = np.full(len(rays), -1, dtype=np.int32)
    depth = np.zeros(len(rays))
    live, begin = np.arange(len(rays)), origins.astype(np.float32)
    for _ in range(MAX_SURFACES):
        found = built.scene.run(begin, rays[live].astype(np.float32))
        live, begin = _settle(found, live, origins, rays, built.planes, built.corners, near, triangle, depth)
        if not len(live):
            break
    triangle[live], depth[live] = -1, 0.0
    return _Hits(triangle, depth)


@numba.njit(cache=True, error_model="numpy")
def _settle(
    found: Int32Array, live: IntArray, origins: FloatArray, rays: FloatArray, planes: FloatArray, corners: FloatArray,
    near: float, triangle: Int32Array, depth: FloatArray,
) -> tuple[IntArray, Float32Array]:  # fmt: skip
    """Set triangle and depth (N,) of the live rays whose found triangle is seen.

    Returns the rays that pass theirs, and where they go on; depth holds how far they have come.
    """
    left, begin, m = np.empty_like(live), np.empty((len(live), 3), np.float32), 0
    for k in range(len(live)):
        ray, t = live[k], found[k]
        if t < 0:
            depth[ray] = 0.0
            continue
        along, distance = 0.0, 0.0
        for c in range(3):
            along += planes[t, c] * rays[ray, c]
            distance += planes[t, c] * (corners[t, 0, c] - origins[ray, c])
        distance = distance / along if along != 0.0 else depth[ray]
        if along < 0.0 and distance >= near:
            triangle[ray], depth[ray] = t, distance
            continue
        # Go on just behind the surface; 1e-5 relative clears float32 rounding, and thinner gaps are not geometry.
        depth[ray] = max(distance, depth[ray]) * (1.0 + 1e-5) + 1e-5
        for c in range(3):
            begin[m, c] = origins[ray, c] + depth[ray] * rays[ray, c]
        left[m] = ray
        m += 1
    return left[:m], begin[:m]


def _cast_down(built: _Built, origins: FloatArray, rays: FloatArray) -> _Hits:
    """As ``_cast`` from the cut. A ray that starts inside a solid sees the face by which the solid ends above it."""
    hits = _cast(built, origins, rays, 0.0)
    above = built.scene.run(origins.astype(np.float32), (-rays).astype(np.float32))
    inside = (above >= 0) & (np.einsum("ij,ij->i", built.planes[above], rays) < 0.0)
    return _Hits(np.where(inside, above, hits.triangle), np.where(inside, 0.0, hits.depth))


def _shade(built: _Built, origins: FloatArray, rays: FloatArray, hits: _Hits, lights: Lighting) -> UInt8Array:
    """(N, 3) sRGB of each ray's hit, black where there is none."""
    rgb = np.zeros((len(rays), 3), dtype=np.uint8)
    seen = np.flatnonzero(hits.triangle >= 0)
    if not len(seen):
        return rgb
    triangle = hits.triangle[seen]
    if not (lights.points or lights.directionals):
        rgb[seen] = to_bytes(built.albedo * lights.ambient)[triangle]
        return rgb
    points = origins[seen] + hits.depth[seen, None] * rays[seen]
    normals = np.einsum("ij,ijk->ik", _barycentric(points, built.corners[triangle]), built.normals[triangle])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rgb[seen] = to_bytes(built.albedo[triangle] * lambert(points + built.position, normals, lights))
    return rgb


def _barycentric(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(N, 3) weights of the (N, 3, 3) corners at (N, 3) points in their planes."""
    a, b, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    aa, ab, bb = (np.einsum("ij,ij->i", x, y) for x, y in ((a, a), (a, b), (b, b)))
    pa, pb = np.einsum("ij,ij->i", p, a), np.einsum("ij,ij->i", p, b)
    area = np.maximum(aa * bb - ab * ab, 1e-300)
    second, third = (bb * pa - ab * pb) / area, (aa * pb - ab * pa) / area
    return np.stack([1.0 - second - third, second, third], axis=-1)
