"""Vectors as tuples of three floats, for compiled loops: no array is made for them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numba

from hsbench.typing import FloatArray

Vector: TypeAlias = tuple[float, float, float]
Axes: TypeAlias = tuple[Vector, Vector, Vector]
"""Forward, left and up of a part of the body, in the scene."""


@numba.njit(cache=True)
def vector(row: FloatArray) -> Vector:
    """The first three numbers of a row."""
    return row[0], row[1], row[2]


@numba.njit(cache=True)
def put(row: FloatArray, v: Vector) -> None:
    """Write a vector into a row."""
    row[0], row[1], row[2] = v


@numba.njit(cache=True)
def add(a: Vector, b: Vector, share: float) -> Vector:
    """The sum a + share * b."""
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


@numba.njit(cache=True)
def mix(a: Vector, b: Vector, share: float) -> Vector:
    """From a by a share of the way to b."""
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])


@numba.njit(cache=True)
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True)
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=True)
def unit(a: Vector) -> Vector:
    """The same direction at length 1 (zero stays zero)."""
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 0.0 else a


@numba.njit(cache=True)
def at(axes: Axes, offset: Vector) -> Vector:
    """An offset forward, left, up -> the same in the scene's axes."""
    forward, left, up = axes
    return add(add(add((0.0, 0.0, 0.0), forward, offset[0]), left, offset[1]), up, offset[2])


@numba.njit(cache=True)
def inside(axes: Axes, v: Vector) -> Vector:
    """A vector of the scene -> its parts forward, left, up."""
    return dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)


@numba.njit(cache=True)
def bent(axes: Axes, yaw: float, lean: float, side: float) -> Axes:
    """Axes turned to the left, then bent forward, then to their left."""
    cy, sy, cl, sl, cs, ss = (
        math.cos(yaw), math.sin(yaw), math.cos(lean), math.sin(lean), math.cos(side), math.sin(side),
    )  # fmt: skip
    return (
        at(axes, (cy * cl, sy * cl, -sl)),
        at(axes, (-cy * sl * ss - sy * cs, -sy * sl * ss + cy * cs, -cl * ss)),
        at(axes, (cy * sl * cs - sy * ss, sy * sl * cs + cy * ss, cl * cs)),
    )


@numba.njit(cache=True)
def carried(v: Vector, start: Vector, end: Vector) -> Vector:
    """A vector, turned by the least rotation that takes unit ``start`` to unit ``end`` (not its opposite)."""
    both = add(start, end, 1.0)
    turned = add(v, both, -dot(both, v) / (1.0 + dot(start, end)))
    return add(turned, end, 2.0 * dot(start, v))
