"""The ray caster: exact depth from embree hits, plain Lambert RGB. Needs no graphics library.

Embree finds the triangle in float32; the distance is then the float64 intersection of the pixel's ray with that
triangle's plane, so depth is exact. Slower than the GL back end on crops; the reference for its tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsbench.errors import MissingExtraError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.synth.render.base import NEAR_M, Lighting, Mesh, View, Window, check_request
from hsbench.synth.render.shading import corner_normals, lambert, to_bytes, to_linear
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, Int32Array, IntArray, UInt8Array

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ModuleNotFoundError as error:
    raise MissingExtraError("the ray caster", error.name or "embreex", "gen") from error

MAX_SURFACES = 32
"""Surfaces a ray may pass through (seen from behind, or nearer than NEAR_M) before it counts as a miss."""


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
    """The seen triangle (-1: none), its depth and its mesh, of each of N rays."""

    triangle: IntArray
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
        camera: PinholeCamera,
        world_T_camera: FloatArray,
        lights: Lighting,
        window: Window | None = None,
    ) -> View:
        """See Renderer.render."""
        window = check_request(meshes, camera, world_T_camera, window)
        shape = (window.height, window.width)
        if not any(len(mesh.triangles) for mesh in meshes):
            return View(np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.float32), np.zeros(shape, np.uint16))
        if self._built is None or not self._built.serves(meshes, world_T_camera[:3, 3]):
            self._built = _build(meshes, world_T_camera[:3, 3])
        built = self._built
        rays = _rays(camera, world_T_camera, window)
        hits = _cast(built, rays)
        ids = np.where(hits.triangle >= 0, built.mesh_ids[hits.triangle], 0).astype(np.uint16)
        rgb = _shade(built, rays, hits, lights)
        return View(rgb.reshape(*shape, 3), hits.depth.astype(np.float32).reshape(shape), ids.reshape(shape))


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


def _rays(camera: PinholeCamera, world_T_camera: FloatArray, window: Window) -> FloatArray:
    """(N, 3) world directions of camera z = 1 through the centres of the window's pixels, row by row."""
    u = (window.u0 + np.arange(window.width) + 0.5 - camera.cx_px) / camera.fx_px
    v = (window.v0 + np.arange(window.height) + 0.5 - camera.cy_px) / camera.fy_px
    right, down, forward = world_T_camera[:3, :3].T
    # Elementwise products, not matmul: BLAS may sum differently for other sizes, and a crop must equal the full image.
    rays = u[None, :, None] * right + v[:, None, None] * down + forward
    return np.asarray(rays.reshape(-1, 3))


def _cast(built: _Built, rays: FloatArray) -> _Hits:
    """First front-facing surface at NEAR_M or beyond, along each of (N, 3) rays from the camera."""
    triangle = np.full(len(rays), -1, dtype=np.int64)
    depth = np.zeros(len(rays))
    start = np.zeros(len(rays))
    live = np.arange(len(rays))
    for _ in range(MAX_SURFACES):
        origins = start[live, None] * rays[live]
        found = built.scene.run(origins.astype(np.float32), rays[live].astype(np.float32)).astype(np.int64)
        live, found = live[found >= 0], found[found >= 0]
        plane = built.planes[found]
        along = np.einsum("ij,ij->i", plane, rays[live])
        distance = np.einsum("ij,ij->i", plane, built.corners[found, 0])
        distance = np.divide(distance, along, out=np.copy(start[live]), where=along != 0.0)
        front = (along < 0.0) & (distance >= NEAR_M)
        triangle[live[front]], depth[live[front]] = found[front], distance[front]
        live, distance = live[~front], distance[~front]
        if not len(live):
            break
        # Go on just behind the surface; 1e-5 relative clears float32 rounding, and thinner gaps are not geometry.
        start[live] = np.maximum(distance, start[live]) * (1.0 + 1e-5) + 1e-5
    return _Hits(triangle, depth)


def _shade(built: _Built, rays: FloatArray, hits: _Hits, lights: Lighting) -> UInt8Array:
    """(N, 3) sRGB of each ray's hit, black where there is none."""
    rgb = np.zeros((len(rays), 3), dtype=np.uint8)
    seen = np.flatnonzero(hits.triangle >= 0)
    if not len(seen):
        return rgb
    triangle = hits.triangle[seen]
    points = hits.depth[seen, None] * rays[seen]
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
