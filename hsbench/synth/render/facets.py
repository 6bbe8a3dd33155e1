"""Meshes and lights as the rasteriser takes them: the triangles whose front is seen, in the camera frame, compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.cameras import Camera, TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.synth.render.base import Lighting, Mesh
from hsbench.synth.render.image_boxes import image_boxes
from hsbench.synth.render.shading import to_linear
from hsbench.typing import FloatArray, Int32Array, UInt8Array, UInt16Array

NO_MESH = Mesh(1, np.empty((0, 3)), np.empty((0, 3), np.int32), np.empty((0, 3), np.uint8))


class Facets(NamedTuple):
    """T triangles whose front faces the camera; camera frame.

    A named tuple of arrays, so that compiled code takes it whole.
    """

    edges: FloatArray
    """(T, 3, 3): r . edges is positive inside, and the share of each corner but for a common factor."""
    plane: FloatArray
    """(T, 3): r . plane is the nearness."""
    normals: FloatArray
    """(T, 3, 3) unit, at the corners."""
    albedo: FloatArray
    """(T, 3) linear."""
    boxes: Int32Array
    """(T, 4) of the pixels it can cover."""
    mesh_ids: UInt16Array
    """(T,)."""


class Lamps(NamedTuple):
    """Lighting in the camera frame: (L, 3) places and light 1 m away, (D, 3) unit vectors to suns and their light."""

    ambient: float
    places: FloatArray
    lamp_light: FloatArray
    towards: FloatArray
    sun_light: FloatArray


def facets_of(meshes: Sequence[Mesh], camera: Camera, world_T_camera: FloatArray) -> Facets:
    """The triangles of meshes whose front a camera sees, in the order of meshes and triangles."""
    camera_T_world, from_above = invert(world_T_camera), isinstance(camera, TopDownCamera)
    linear, parts = to_linear(np.arange(256, dtype=np.uint8)), []
    for mesh in meshes or (NO_MESH,):
        vertices = apply(camera_T_world, mesh.vertices)
        parts.append(_set_up(vertices, mesh.triangles, mesh.colours, linear, mesh.smooth, from_above))
    corners, edges, plane, normals, albedo = map(np.concatenate, zip(*parts, strict=True))
    mesh_ids = np.array([mesh.mesh_id for mesh in meshes], dtype=np.uint16)
    owners = np.repeat(mesh_ids, [len(part[0]) for part in parts])
    return Facets(edges, plane, normals, albedo, image_boxes(camera, corners), owners)


def lamps_of(lights: Lighting, world_T_camera: FloatArray) -> Lamps:
    """The lights, as seen from a camera."""

    def rows(vectors: list[FloatArray]) -> FloatArray:
        return np.array(vectors, dtype=np.float64).reshape(-1, 3)

    directions = rows([np.asarray(sun.direction) / np.linalg.norm(sun.direction) for sun in lights.directionals])
    return Lamps(
        lights.ambient,
        apply(invert(world_T_camera), rows([np.asarray(lamp.position) for lamp in lights.points])),
        rows([lamp.intensity * np.asarray(lamp.colour) for lamp in lights.points]),
        -directions @ world_T_camera[:3, :3],
        rows([sun.intensity * np.asarray(sun.colour) for sun in lights.directionals]),
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _set_up(
    vertices: FloatArray, triangles: Int32Array, colours: UInt8Array, linear: FloatArray, smooth: bool, from_above: bool
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Corners, edges, planes, normals and albedo of those of a mesh's triangles whose front is seen; camera frame."""
    count = len(triangles)
    faces, offsets, front = np.empty((count, 3)), np.empty(count), np.empty(count, dtype=np.bool_)
    sums = np.zeros(vertices.shape)  # at each vertex: of its triangles' normals, weighted by area
    for t in range(count):
        i, j, k = triangles[t]
        a, b, c = vertices[i], vertices[j], vertices[k]
        face = faces[t]
        _cross(b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2], face)
        offsets[t] = face[0] * a[0] + face[1] * a[1] + face[2] * a[2]
        front[t] = face[2] > 0.0 if from_above else offsets[t] < 0.0
        for n in (i, j, k):
            for x in range(3):
                sums[n, x] += face[x]
    seen = np.flatnonzero(front)
    corners, edges, normals = np.empty((len(seen), 3, 3)), np.empty((len(seen), 3, 3)), np.empty((len(seen), 3, 3))
    plane, albedo = np.empty((len(seen), 3)), np.empty((len(seen), 3))
    for row in range(len(seen)):
        t = seen[row]
        face, offset = faces[t], offsets[t]
        for n in range(3):
            p, q = vertices[triangles[t, (n + 2) % 3]], vertices[triangles[t, (n + 1) % 3]]
            # Two triangles that share an edge get its very negative, so no ray slips between them.
            if from_above:
                _cross(q[0], q[1], 1.0, p[0], p[1], 1.0, edges[row, n])
            else:
                _cross(p[0], p[1], p[2], q[0], q[1], q[2], edges[row, n])
            normal = sums[triangles[t, n]] if smooth else face
            length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
            for x in range(3):
                corners[row, n, x] = vertices[triangles[t, n], x]
                normals[row, n, x] = normal[x] / length if length > 0.0 else 0.0
        plane[row] = face
        if from_above:
            plane[row, 0], plane[row, 1], plane[row, 2], offset = -face[0], -face[1], offset, face[2]
        for x in range(3):
            plane[row, x] /= offset
            albedo[row, x] = linear[colours[t, x]]
    return corners, edges, plane, normals, albedo


@numba.njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float, out: FloatArray) -> None:
    out[0], out[1], out[2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
