"""What both back ends share about light: normals, Lambert's law and the display curve."""

from __future__ import annotations

import numpy as np

from hsbench.synth.render.base import Lighting, Mesh
from hsbench.typing import FloatArray, UInt8Array

GAMMA = 2.2
"""Display curve: byte = 255 * linear ** (1 / GAMMA). A power, since pyrender's shader ends in this very one."""


def corner_normals(mesh: Mesh) -> FloatArray:
    """(T, 3, 3) unit normals at each triangle's corners: the face's, or of a smooth mesh the vertices'.

    A vertex normal is the sum of its triangles' normals weighted by area. Degenerate triangles give zeros.
    """
    corners = mesh.vertices[mesh.triangles]
    normals = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if not mesh.smooth:
        return np.repeat(_unit(normals)[:, None, :], 3, axis=1)
    flat = mesh.triangles.ravel()
    # bincount sums in a fixed order and is many times faster than np.add.at.
    sums: FloatArray = np.stack(
        [np.bincount(flat, weights=np.repeat(normals[:, k], 3), minlength=len(mesh.vertices)) for k in range(3)],
        axis=-1,
    )
    return _unit(sums)[mesh.triangles]


def to_linear(colours: UInt8Array) -> FloatArray:
    """(..., 3) display bytes -> (..., 3) linear 0..1."""
    return np.asarray((colours / 255.0) ** GAMMA, dtype=np.float64)


def to_bytes(linear: FloatArray) -> UInt8Array:
    """(..., 3) linear -> (..., 3) display bytes; what exceeds white is clipped."""
    return np.rint(np.clip(linear, 0.0, 1.0) ** (1.0 / GAMMA) * 255.0).astype(np.uint8)


def lambert(points: FloatArray, normals: FloatArray, lights: Lighting) -> FloatArray:
    """(N, 3) world points and unit normals -> (N, 3) linear light that a white face there sends back."""
    total = np.full(points.shape, lights.ambient, dtype=np.float64)
    for sun in lights.directionals:
        towards = -np.asarray(sun.direction) / np.linalg.norm(sun.direction)
        total += np.maximum(normals @ towards, 0.0)[:, None] * (sun.intensity * np.asarray(sun.colour))
    for lamp in lights.points:
        offset = np.asarray(lamp.position) - points
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
        facing = np.maximum(np.einsum("ij,ij->i", normals, offset), 0.0)
        total += (facing / distance**3)[:, None] * (lamp.intensity * np.asarray(lamp.colour))
    return total


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row-wise cross product; np.cross spends most of its time on generality."""
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=-1,
    )


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))
