"""Triangle meshes as surfaces: which pieces are closed, which way they face, how thick they are.

A piece is a set of triangles that hang together by edges. It is *closed* if every edge is run through as often one way
as the other, so that winding numbers about it are whole. Arrays: vertices (V, 3) in metres, triangles (T, 3) vertex
indices, counter-clockwise from outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.typing import BoolArray, FloatArray, Int32Array

FLAT_M = 1e-6
"""A closed piece of less mean thickness (twice its volume over its area) encloses nothing: two sheets on each other."""

CONVEX_M = 1e-5
"""A vertex may lie so far outside a face of what is taken for convex: coordinates are rounded to 1e-6 m."""

MAX_CONVEX_VERTICES = 512
"""Pieces with more are left as meshes: turned shapes of furniture have tens."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The pieces of a mesh: ``of`` (T,) int32 piece of each triangle; per piece ``closed`` (C,) bool,
    ``volume_m3`` (C,) signed (0 unless closed, negative if inside out) and ``area_m2`` (C,).
    """

    of: Int32Array
    closed: BoolArray
    volume_m3: FloatArray
    area_m2: FloatArray


def weld(vertices: FloatArray, triangles: Int32Array) -> tuple[FloatArray, Int32Array]:
    """Vertices of equal coordinates made one, unused ones dropped, triangles with two equal corners left out."""
    used, compact = np.unique(triangles, return_inverse=True)
    unique, index = np.unique(vertices[used], axis=0, return_inverse=True)
    welded = index.reshape(-1)[compact.reshape(-1, 3)].astype(np.int32)
    a, b, c = welded.T
    welded = welded[(a != b) & (b != c) & (c != a)]
    used, compact = np.unique(welded, return_inverse=True)
    return np.ascontiguousarray(unique[used]), compact.reshape(-1, 3).astype(np.int32)


def double_areas(vertices: FloatArray, triangles: Int32Array) -> FloatArray:
    """(T, 3) normals of the triangles, each as long as twice its area."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def pieces(vertices: FloatArray, triangles: Int32Array) -> Pieces:
    """The pieces of a welded mesh."""
    count = len(triangles)
    if not count:
        return Pieces(np.empty(0, np.int32), np.empty(0, bool), np.empty(0), np.empty(0))
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    owner = np.repeat(np.arange(count), 3)
    key = np.minimum(starts, ends).astype(np.int64) * len(vertices) + np.maximum(starts, ends)
    _, edge = np.unique(key, return_inverse=True)
    order = np.argsort(edge, kind="stable")
    same = edge[order[:-1]] == edge[order[1:]]
    first, second = owner[order[:-1][same]], owner[order[1:][same]]
    graph = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(count, count))
    number, of = connected_components(graph, directed=False)
    surplus = np.bincount(edge, weights=np.where(starts < ends, 1, -1))
    closed = np.ones(number, dtype=bool)
    closed[of[owner[surplus[edge] != 0]]] = False
    areas = np.linalg.norm(double_areas(vertices, triangles), axis=1) / 2
    area = np.bincount(of, weights=areas, minlength=number).astype(np.float64)
    corners = vertices[triangles] - vertices[triangles[:1, 0]]
    wedge = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    volume = np.where(closed, np.bincount(of, weights=wedge, minlength=number), 0.0)
    closed &= 2 * np.abs(volume) > FLAT_M * area
    return Pieces(of.astype(np.int32), closed, np.where(closed, volume, 0.0), area)


def outward(triangles: Int32Array, found: Pieces) -> Int32Array:
    """The triangles, those of closed pieces that are inside out turned."""
    turn = (found.closed & (found.volume_m3 < 0))[found.of]
    return np.where(turn[:, None], triangles[:, ::-1], triangles)


def as_convex(vertices: FloatArray, triangles: Int32Array) -> ConvexSolid | None:
    """A welded mesh as a convex solid, None unless it is one closed convex piece that faces outward."""
    if not 4 <= len(vertices) <= MAX_CONVEX_VERTICES:
        return None
    found = pieces(vertices, triangles)
    if len(found.closed) != 1 or not found.volume_m3[0] > 0:
        return None
    solid = ConvexSolid(vertices, triangles)
    try:
        solid.check(CONVEX_M)
    except SchemaError:
        return None
    return solid
