"""Which points lie inside the solids of a scene, by half-space tests; slow and plain on purpose.

The half-spaces are those of scipy's convex hull (Qhull) of each part's vertices: neither the triangles nor the planes
of ``ConvexSolid`` are looked at. Mesh parts of imported scenes have no inside and are left out. Scene frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

PLANE_DECIMALS = 12  # Qhull cuts flat faces into triangles: their equal planes are kept once


@dataclass(frozen=True, eq=False)
class Hull:
    """A part in the scene frame: vertices (V, 3), triangles (T, 3, 3), half-spaces (F, 4): n . p + d <= 0 is inside."""

    object_id: int
    part_index: int
    role: str | None
    vertices: np.ndarray
    triangles: np.ndarray
    half_spaces: np.ndarray

    @cached_property
    def low(self):
        return self.vertices.min(axis=0)

    @cached_property
    def high(self):
        return self.vertices.max(axis=0)

    @cached_property
    def edges(self):
        """(E, 3) distinct unit directions of the triangles' sides."""
        sides = np.diff(self.triangles[:, [0, 1, 2, 0]], axis=1).reshape(-1, 3)
        return np.unique((sides / np.linalg.norm(sides, axis=1)[:, None]).round(9), axis=0)


def hull_of(vertices, object_id=0, part_index=0, role=None) -> Hull:
    """The hull of (V, 3) points; triangles are turned so that their normals point outwards."""
    found = ConvexHull(vertices)
    triangles = vertices[found.simplices]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.einsum("ij,ij->i", normals, found.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    half_spaces = np.unique(found.equations.round(PLANE_DECIMALS), axis=0)
    return Hull(object_id, part_index, role, vertices, triangles, half_spaces)


def object_hulls(item, scene_T_object=None) -> list[Hull]:
    """The convex parts of an object, at its own pose or at another one."""
    pose = item.scene_T_object if scene_T_object is None else scene_T_object
    return [
        hull_of(part.solid.vertices @ pose[:3, :3].T + pose[:3, 3], item.object_id, index, part.role)
        for index, part in enumerate(item.parts)
        if part.solid is not None
    ]


def scene_hulls(scene) -> list[Hull]:
    """The convex parts of all objects."""
    return [hull for item in scene.objects for hull in object_hulls(item)]


def hull_depth(hull, points):
    """(N, 3) points -> (N,) distance to the nearest face plane, positive inside, negative outside."""
    return -(hull.half_spaces[:, :3] @ points.T + hull.half_spaces[:, 3:]).max(axis=0)


def depth(hulls, points):
    """(N, 3) points -> (N,) depth in the part that holds them deepest; not positive outside of all, down to -inf."""
    deepest = np.full(len(points), -np.inf)
    for hull in hulls:
        here = np.flatnonzero(((points >= hull.low) & (points <= hull.high)).all(axis=1))
        if len(here):
            deepest[here] = np.maximum(deepest[here], hull_depth(hull, points[here]))
    return deepest


def deepest_object(hulls, points):
    """(N, 3) points -> (N,) id of the object that holds them deepest, 0 where none does."""
    deepest, owner = np.zeros(len(points)), np.zeros(len(points), dtype=np.int64)
    for hull in hulls:
        here = np.flatnonzero(((points >= hull.low) & (points <= hull.high)).all(axis=1))
        if len(here):
            found = hull_depth(hull, points[here])
            deeper = found > deepest[here]
            deepest[here[deeper]], owner[here[deeper]] = found[deeper], hull.object_id
    return owner


def points_inside(hulls, count, rng):
    """(count, 3) random points in solids: a part at random, however small, then a point of its volume."""
    share = rng.multinomial(count, np.full(len(hulls), 1 / len(hulls)))
    chosen = []
    for hull, wanted in zip(hulls, share, strict=True):
        kept = np.empty((0, 3))
        while len(kept) < wanted:
            points = rng.uniform(hull.low, hull.high, (4 * wanted, 3))
            kept = np.concatenate([kept, points[hull_depth(hull, points) > 0]])
        chosen.append(kept[:wanted])
    return np.concatenate(chosen)
