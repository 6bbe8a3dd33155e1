"""Meshes that several tests start from, and a winding number from first principles."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.convex import ConvexSolid

Mesh = tuple[np.ndarray, np.ndarray]


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, nothing welded."""
    start = np.cumsum([0, *(len(v) for v, _ in meshes)])
    triangles = [t + s for (_, t), s in zip(meshes, start[:-1], strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(triangles).astype(np.int32)


def of(solid: ConvexSolid) -> Mesh:
    return np.array(solid.vertices), np.array(solid.triangles)


def torus(radius: float = 0.3, tube: float = 0.1, around: int = 24, across: int = 12) -> Mesh:
    """A closed surface with a hole through it, facing outward."""
    u, v = np.meshgrid(np.arange(around) / around, np.arange(across) / across, indexing="ij")
    u, v = 2 * np.pi * u.ravel(), 2 * np.pi * v.ravel()
    ring = radius + tube * np.cos(v)
    points = np.column_stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)])
    i, j = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.int32)


def turned(mesh: Mesh, rotation: np.ndarray, shift: np.ndarray) -> Mesh:
    return mesh[0] @ rotation.T + shift, mesh[1]


def flipped(mesh: Mesh) -> Mesh:
    return mesh[0], np.ascontiguousarray(mesh[1][:, ::-1])


def winding_numbers(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """(N, 3) points -> (N,) signed solid angles over 4 pi (Van Oosterom & Strackee, 1983)."""
    a, b, c = (mesh[0][mesh[1][:, k]][None] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    above = np.einsum("nti,nti->nt", a, np.cross(b, c))
    below = la * lb * lc
    below += np.einsum("nti,nti->nt", a, b) * lc + np.einsum("nti,nti->nt", b, c) * la
    below += np.einsum("nti,nti->nt", c, a) * lb
    return 2 * np.arctan2(above, below).sum(axis=1) / (4 * np.pi)
