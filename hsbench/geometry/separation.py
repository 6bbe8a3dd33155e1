"""How deep convex shapes penetrate each other: the length of the shortest move that parts them.

Shapes are convex solids, and triangles as solids without thickness. For convex polyhedra that move is along a face
normal of either or along the cross product of an edge of each, since those are the face normals of their Minkowski
difference (separating axis theorem; Gottschalk et al., 1996).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.typing import FloatArray, Int32Array, IntArray

PARALLEL = 1e-9  # edges or faces that meet at a smaller sine are parallel


@dataclass(frozen=True, eq=False)
class PackedShapes:
    """N convex shapes as flat arrays: planes (P, 4), corners (C, 3), edge directions (E, 3), where each shape's rows
    start (N + 1, 3) in these, and bounds (N, 2, 3).
    """

    planes: FloatArray
    corners: FloatArray
    edges: FloatArray
    start: IntArray
    bounds: FloatArray


def pack_shapes(solids: Sequence[ConvexSolid]) -> PackedShapes:
    """Solids, all in one frame, for ``penetrating_pairs``."""
    edges = [_edge_directions(s.vertices, s.triangles) for s in solids]
    rows = [(len(s.planes), len(s.vertices), len(e)) for s, e in zip(solids, edges, strict=True)]
    return PackedShapes(
        np.concatenate([np.empty((0, 4)), *(s.planes for s in solids)]),
        np.concatenate([np.empty((0, 3)), *(s.vertices for s in solids)]),
        np.concatenate([np.empty((0, 3)), *edges]),
        np.cumsum([(0, 0, 0), *rows], axis=0, dtype=np.int64),
        np.array([s.bounds for s in solids]).reshape(-1, 2, 3),
    )


def pack_triangles(corners: FloatArray) -> PackedShapes:
    """(T, 3, 3) corners of triangles that have an area, as flat shapes.

    Planes of each, in this order: its own, its own facing back, those through its sides.
    """
    count = len(corners)
    sides = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(sides[:, 0], sides[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    directions = sides / np.linalg.norm(sides, axis=2)[:, :, None]
    outward = np.cross(directions, normal[:, None])
    normals = np.concatenate([normal[:, None], -normal[:, None], outward], axis=1)
    through = np.concatenate([corners[:, :1], corners[:, :1], corners], axis=1)
    offset = np.einsum("tpi,tpi->tp", normals, through)
    return PackedShapes(
        np.concatenate([normals, offset[:, :, None]], axis=2).reshape(-1, 4),
        corners.reshape(-1, 3),
        directions.reshape(-1, 3),
        np.arange(count + 1, dtype=np.int64)[:, None] * np.array([5, 3, 3]),
        np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1).reshape(-1, 2, 3),
    )


def joined(packed: Sequence[PackedShapes]) -> PackedShapes:
    """All shapes of several packs, in order."""
    offsets = np.cumsum([np.zeros(3, np.int64), *(p.start[-1] for p in packed)], axis=0)
    starts = [p.start[:-1] + offset for p, offset in zip(packed, offsets, strict=False)]
    return PackedShapes(
        np.concatenate([np.empty((0, 4)), *(p.planes for p in packed)]),
        np.concatenate([np.empty((0, 3)), *(p.corners for p in packed)]),
        np.concatenate([np.empty((0, 3)), *(p.edges for p in packed)]),
        np.concatenate([*starts, offsets[-1:]]),
        np.concatenate([np.empty((0, 2, 3)), *(p.bounds for p in packed)]),
    )


def penetration_m(a: ConvexSolid, b: ConvexSolid) -> float:
    """Penetration depth of two solids in metres; 0 where they touch or are apart."""
    packed = pack_shapes([a, b])
    return float(max(0.0, parting_depth(packed.planes, packed.corners, packed.edges, packed.start, 0, 1, 0.0)))


def penetrating_pairs(solids: Sequence[ConvexSolid], owner: IntArray, limit_m: float) -> tuple[IntArray, FloatArray]:
    """Pairs of solids of different owners that penetrate deeper than ``limit_m``: (K, 2) indices, (K,) depths in m.

    owner: (N,) int64. Solids of one owner are not compared.
    """
    packed = pack_shapes(solids)
    pairs = _overlapping(packed.bounds, np.asarray(owner, dtype=np.int64), limit_m)
    depth = _depths(packed.planes, packed.corners, packed.edges, packed.start, pairs, limit_m)
    deep = depth > limit_m
    return pairs[deep], depth[deep]


@numba.njit(cache=True)
def _edge_directions(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """(E, 3) unit directions of the edges between faces, without those parallel to another."""
    found = np.empty((3 * len(triangles), 3))
    count = 0
    for t in range(len(triangles)):
        normal = _normal(vertices, triangles[t])
        for e in range(3):
            a, b = triangles[t, e], triangles[t, (e + 1) % 3]
            if a > b:  # each edge has a twin that runs the other way
                continue
            twin = -1
            for u in range(len(triangles)):
                for f in range(3):
                    if triangles[u, f] == b and triangles[u, (f + 1) % 3] == a:
                        twin = u
            if twin >= 0 and _sine(normal, _normal(vertices, triangles[twin])) < PARALLEL:
                continue  # within a face
            direction = vertices[b] - vertices[a]
            direction = direction / np.sqrt((direction**2).sum())
            known = False
            for k in range(count):
                known |= _sine(found[k], direction) < PARALLEL
            if not known:
                found[count] = direction
                count += 1
    return found[:count].copy()


@numba.njit(cache=True)
def _normal(vertices: FloatArray, triangle: Int32Array) -> FloatArray:
    a = vertices[triangle[0]]
    normal = np.cross(vertices[triangle[1]] - a, vertices[triangle[2]] - a)
    return normal / max(np.sqrt((normal**2).sum()), 1e-300)


@numba.njit(cache=True)
def _sine(a: FloatArray, b: FloatArray) -> float:
    return float(np.sqrt((np.cross(a, b) ** 2).sum()))


@numba.njit(cache=True)
def _overlapping(bounds: FloatArray, owner: IntArray, limit: float) -> IntArray:
    """(K, 2) pairs of different owners whose bounds part along no axis by a move within the limit (sweep along x)."""
    order = np.argsort(bounds[:, 0, 0])
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    for position in range(len(order)):
        i = order[position]
        for after in range(position + 1, len(order)):
            j = order[after]
            if bounds[j, 0, 0] >= bounds[i, 1, 0] - limit:
                break
            if owner[i] == owner[j]:
                continue
            near = True
            for axis in range(3):
                near &= bounds[i, 1, axis] - bounds[j, 0, axis] > limit
                near &= bounds[j, 1, axis] - bounds[i, 0, axis] > limit
            if near:
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = min(i, j), max(i, j)
                count += 1
    return found[:count].copy()


@numba.njit(cache=True)
def _depths(
    planes: FloatArray, corners: FloatArray, edges: FloatArray, start: IntArray, pairs: IntArray, limit: float
) -> FloatArray:
    depth = np.empty(len(pairs))
    for k in range(len(pairs)):
        depth[k] = parting_depth(planes, corners, edges, start, pairs[k, 0], pairs[k, 1], limit)
    return depth


@numba.njit(cache=True)
def parting_depth(
    planes: FloatArray, corners: FloatArray, edges: FloatArray, start: IntArray, i: int, j: int, limit: float
) -> float:
    """Shortest parting move of solids i and j; any value <= limit once one direction needs no more than the limit."""
    depth = np.inf
    for own, other in ((i, j), (j, i)):
        for p in range(start[own, 0], start[own + 1, 0]):
            low, _ = _extent(corners, start[other, 1], start[other + 1, 1], planes[p, 0], planes[p, 1], planes[p, 2])
            depth = min(depth, planes[p, 3] - low)
            if depth <= limit:
                return depth
    for e in range(start[i, 2], start[i + 1, 2]):
        for f in range(start[j, 2], start[j + 1, 2]):
            x = edges[e, 1] * edges[f, 2] - edges[e, 2] * edges[f, 1]
            y = edges[e, 2] * edges[f, 0] - edges[e, 0] * edges[f, 2]
            z = edges[e, 0] * edges[f, 1] - edges[e, 1] * edges[f, 0]
            length = np.sqrt(x * x + y * y + z * z)
            if length < PARALLEL:
                continue
            x, y, z = x / length, y / length, z / length
            low_i, high_i = _extent(corners, start[i, 1], start[i + 1, 1], x, y, z)
            low_j, high_j = _extent(corners, start[j, 1], start[j + 1, 1], x, y, z)
            depth = min(depth, high_i - low_j, high_j - low_i)
            if depth <= limit:
                return depth
    return depth


@numba.njit(cache=True)
def _extent(corners: FloatArray, first: int, stop: int, x: float, y: float, z: float) -> tuple[float, float]:
    low, high = np.inf, -np.inf
    for c in range(first, stop):
        along = corners[c, 0] * x + corners[c, 1] * y + corners[c, 2] * z
        low, high = min(low, along), max(high, along)
    return low, high
