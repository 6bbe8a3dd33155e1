"""Convex solids: the only shape furniture, walls and bodies are made of, so that truth is exact geometry.

A solid is a closed triangle mesh with outward normals (counter-clockwise seen from outside); its interior
is where every face plane says inside. Builders make boxes, prisms, frusta and turned shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import apply
from hsbench.typing import BoolArray, FloatArray, Int32Array


@dataclass(frozen=True, eq=False)
class ConvexSolid:
    """A convex polyhedron: vertices (V, 3) in metres and triangles (T, 3) with outward orientation.

    Raises SchemaError for wrong shapes, non-finite vertices, indices out of range, or (``check()``) a mesh
    that is not closed and convex.
    """

    vertices: FloatArray
    triangles: Int32Array

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        triangles = np.ascontiguousarray(self.triangles, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or len(vertices) < 4:
            raise SchemaError(f"solid has vertices of shape {vertices.shape}; expected (V >= 4, 3)")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) < 4:
            raise SchemaError(f"solid has triangles of shape {triangles.shape}; expected (T >= 4, 3)")
        if not np.isfinite(vertices).all():
            raise SchemaError("solid has a vertex that is not finite")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise SchemaError(f"solid has triangle indices outside 0..{len(vertices) - 1}")
        vertices.flags.writeable = False
        triangles.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    @cached_property
    def planes(self) -> FloatArray:
        """(P, 4) distinct face planes (nx, ny, nz, d), unit normals; a point p is inside where n . p <= d for all."""
        from hsbench.geometry.face_planes import face_planes  # numba, which who scores does not need

        return face_planes(self.vertices, self.triangles)

    @cached_property
    def bounds(self) -> FloatArray:
        """(2, 3) smallest and largest vertex coordinates in metres."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def volume_m3(self) -> float:
        """Volume in cubic metres (divergence theorem)."""
        a, b, c = (self.vertices[self.triangles[:, i]] - self.vertices[0] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    def contains(self, points: FloatArray, margin_m: float = 0.0) -> BoolArray:
        """(..., 3) points -> (...) bool: at least ``margin_m`` inside every face plane."""
        return np.asarray((points @ self.planes[:, :3].T <= self.planes[:, 3] - margin_m).all(axis=-1))

    def transformed(self, a_T_b: FloatArray) -> ConvexSolid:
        """The same solid in frame a, given a rigid transform."""
        return ConvexSolid(apply(a_T_b, self.vertices), self.triangles)

    def check(self, tolerance_m: float = 1e-6) -> None:
        """Raise SchemaError unless the mesh is closed, outward and convex within ``tolerance_m``."""
        edges = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        directed = {(int(a), int(b)) for a, b in edges}
        if len(directed) != len(edges) or any((b, a) not in directed for a, b in directed):
            raise SchemaError(
                "solid is not closed: some edge has no opposite partner (are triangles missing or flipped?)"
            )
        if self.volume_m3 <= 0:
            raise SchemaError(f"solid has volume {self.volume_m3:.3g} m3; expected > 0 (are the triangles inside out?)")
        excess = (self.vertices @ self.planes[:, :3].T - self.planes[:, 3]).max()
        if excess > tolerance_m:
            raise SchemaError(f"solid is not convex: a vertex lies {excess:.3g} m outside a face plane")


def box(size_m: Sequence[float], centre_m: Sequence[float] = (0.0, 0.0, 0.0)) -> ConvexSolid:
    """An axis-aligned box of full size (x, y, z) about a centre, in metres."""
    x, y, z = (s / 2 for s in size_m)
    cx, cy, cz = centre_m
    outline = np.array([[-x, -y], [x, -y], [x, y], [-x, y]]) + np.array([cx, cy])
    return frustum(outline, outline, cz - z, cz + z)


def span(low_m: Sequence[float], high_m: Sequence[float]) -> ConvexSolid:
    """An axis-aligned box between two corners (x, y, z) in metres."""
    low, high = np.asarray(low_m, dtype=np.float64), np.asarray(high_m, dtype=np.float64)
    return box(tuple(high - low), tuple((low + high) / 2))


def frustum(bottom_xy: FloatArray, top_xy: FloatArray, z0_m: float, z1_m: float) -> ConvexSolid:
    """A prism or frustum between two convex outlines (n, 2), counter-clockwise, with parallel sides, at two heights.

    With equal outlines it is a prism; a shrunken top gives tapered legs, shades and pots.
    """
    bottom_xy, top_xy = np.asarray(bottom_xy, dtype=np.float64), np.asarray(top_xy, dtype=np.float64)
    n = len(bottom_xy)
    if bottom_xy.shape != top_xy.shape or bottom_xy.shape[1:] != (2,) or n < 3:
        raise SchemaError(
            f"frustum has outlines of shape {bottom_xy.shape} and {top_xy.shape}; expected equal (n >= 3, 2)"
        )
    if z1_m <= z0_m:
        raise SchemaError(f"frustum reaches from z = {z0_m} to {z1_m} m; expected the top above the bottom")
    vertices = np.vstack([np.column_stack([bottom_xy, np.full(n, z0_m)]), np.column_stack([top_xy, np.full(n, z1_m)])])
    i = np.arange(n)
    j = (i + 1) % n
    sides = np.concatenate([np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])])
    fan = np.arange(1, n - 1)
    floor = np.column_stack([np.zeros_like(fan), fan + 1, fan])
    lid = np.column_stack([np.full_like(fan, n), fan + n, fan + 1 + n])
    return ConvexSolid(vertices, np.concatenate([sides, floor, lid]).astype(np.int32))


def regular_outline(radius_m: float, sides: int, centre_xy: Sequence[float] = (0.0, 0.0)) -> FloatArray:
    """(sides, 2) counter-clockwise regular polygon, first vertex half a side off +x (coordinates rounded to 1e-12)."""
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.asarray(np.column_stack([np.cos(angle), np.sin(angle)]).round(12) * radius_m + np.asarray(centre_xy))


def cylinder(
    radius_m: float,
    z0_m: float,
    z1_m: float,
    centre_xy: Sequence[float] = (0.0, 0.0),
    sides: int = 16,
    top_radius_m: float | None = None,
) -> ConvexSolid:
    """An upright cylinder (or cone frustum, with ``top_radius_m``) as a prism of ``sides`` faces."""
    top = radius_m if top_radius_m is None else top_radius_m
    return frustum(regular_outline(radius_m, sides, centre_xy), regular_outline(top, sides, centre_xy), z0_m, z1_m)
