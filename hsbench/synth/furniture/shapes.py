"""Convex shapes furniture is carved from: rounded outlines, solids lofted over them, and bars between two points.

Object frame, metres. Lengths are quantised to .1 mm where they enter, trigonometry is rounded to 12 decimals, so every
machine builds the same vertices. Outlines are (n, 2), counter-clockwise and convex.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import LENGTH_DECIMALS, quantise_m
from hsbench.geometry.transforms import ANGLE_DECIMALS
from hsbench.typing import FloatArray, Int32Array

Rect = tuple[float, float, float, float]  # x0, y0, x1, y1
Point = tuple[float, float, float]
CORNER_STEPS = 2  # straight pieces that make a quarter of a round corner
QUANTA_PER_M = 10**LENGTH_DECIMALS


def quantised(length_m: float) -> float:
    """One length rounded to .1 mm, as ``quantise_m`` does it but without an array."""
    return round(length_m * QUANTA_PER_M) / QUANTA_PER_M + 0.0


def rectangle_outline(rect: Rect) -> FloatArray:
    """(4, 2) corners of x0, y0, x1, y1."""
    x0, y0, x1, y1 = (quantised(v) for v in rect)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def rounded_outline(rect: Rect, radius_m: float, steps: int = CORNER_STEPS) -> FloatArray:
    """(4 (steps + 1), 2) corners of a rectangle whose corners are quarter circles of ``steps`` straight pieces.

    Outlines of one rectangle inset by d and with a radius smaller by d have parallel sides: they can be lofted.
    """
    x0, y0, x1, y1 = (quantised(v) for v in rect)
    radius = min(quantised(radius_m), (x1 - x0) / 2, (y1 - y0) / 2)
    quarter = _unit_circle(4 * steps)[: steps + 1]
    corners = []
    for k, (cx, cy) in enumerate(((x1 - radius, y1 - radius), (x0 + radius, y1 - radius),
                                  (x0 + radius, y0 + radius), (x1 - radius, y0 + radius))):  # fmt: skip
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[k]
        corners.append(quarter @ np.array([[c, s], [-s, c]]) * radius + np.array([cx, cy]))
    outline = np.concatenate(corners)
    apart = np.abs(outline - np.roll(outline, 1, axis=0)).max(axis=1) > 1e-9  # full half circles share a point
    return np.asarray(outline[apart])


def oval_outline(half_x_m: float, half_y_m: float, sides: int = 16) -> FloatArray:
    """(sides, 2) points of an ellipse about the origin, the first on +x: with sides a multiple of 4 it is full size."""
    size = np.array([quantised(half_x_m), quantised(half_y_m)])
    return np.asarray(_unit_circle(sides) * size)


def superellipse_outline(half_x_m: float, half_y_m: float, sides: int = 24) -> FloatArray:
    """(sides, 2) points of |x/a|^4 + |y/b|^4 = 1: between an ellipse and a rectangle, like the tops of boat tables."""
    size = np.array([quantised(half_x_m), quantised(half_y_m)])
    circle = _unit_circle(sides)
    return np.asarray(np.sign(circle) * np.sqrt(np.abs(circle)) * size)


@cache
def _unit_circle(sides: int) -> FloatArray:
    """(sides, 2) read-only points, the first on +x."""
    angle = 2 * np.pi * (np.arange(sides) / sides)
    points = np.stack([np.cos(angle), np.sin(angle)], axis=1).round(ANGLE_DECIMALS)
    points.flags.writeable = False
    return points


def loft(rings: Sequence[FloatArray], heights_m: Sequence[float]) -> ConvexSolid:
    """The solid through outlines of equally many points with parallel sides, one at each ascending height.

    Convex only where the rings widen ever less (and shrink ever more) from below upwards.
    """
    return _stacked(rings, [quantised(z) for z in heights_m])


def _stacked(rings: Sequence[FloatArray], heights: Sequence[float]) -> ConvexSolid:
    n = len(rings[0])
    vertices = np.empty((len(rings) * n, 3))
    vertices[:, :2] = np.concatenate(rings)
    vertices[:, 2] = np.repeat(heights, n)
    return ConvexSolid(vertices, _faces_between(n, len(rings)))


@cache
def _faces_between(n: int, rings: int) -> Int32Array:
    """(T, 3) triangles of a stack of rings of n vertices each."""
    i = np.arange(n)
    j = (i + 1) % n
    fan = np.arange(1, n - 1)
    lid = n * (rings - 1)
    faces = [np.column_stack([np.zeros_like(fan), fan + 1, fan])]
    for base in range(0, lid, n):
        faces.append(base + np.column_stack([i, j, j + n]))
        faces.append(base + np.column_stack([i, j + n, i + n]))
    faces.append(lid + np.column_stack([np.zeros_like(fan), fan, fan + 1]))
    return np.concatenate(faces).astype(np.int32)


def towards_front(solid: ConvexSolid) -> ConvexSolid:
    """A solid built upright, laid so that its z points to the front: (u, v, w) -> (x, y, z) = (u, -w, v)."""
    return ConvexSolid(solid.vertices[:, [0, 2, 1]] * np.array([1.0, -1.0, 1.0]), solid.triangles)


def along_x(solid: ConvexSolid) -> ConvexSolid:
    """A solid built upright, laid so that its z points along x: (u, v, w) -> (x, y, z) = (w, u, v)."""
    return ConvexSolid(solid.vertices[:, [2, 0, 1]], solid.triangles)


def bar(start: Point, end: Point, outline: FloatArray, end_scale: float | FloatArray = 1.0) -> ConvexSolid:
    """A prism (or frustum) whose outline (n, 2) is swept from one point to another.

    The outline's x stays horizontal, at right angles to the bar; upright bars have it along x. end_scale: how much
    larger the outline is at the end, in both directions or (2,) in each.
    """
    dx, dy, dz = (quantised(b - a) for a, b in zip(start, end, strict=True))
    flat, length = math.sqrt(dx * dx + dy * dy), math.sqrt(dx * dx + dy * dy + dz * dz)
    along = np.array([dx, dy, dz]) / length
    across = np.array([-dy, dx, 0.0]) / flat if flat > 0 else np.array([1.0, 0.0, 0.0])
    up = np.array([
        along[1] * across[2] - along[2] * across[1],
        along[2] * across[0] - along[0] * across[2],
        along[0] * across[1] - along[1] * across[0],
    ])  # fmt: skip
    turn = np.stack([across, up, along]).round(ANGLE_DECIMALS)
    local = _stacked([outline, outline * end_scale], [0.0, length])
    x, y, z = local.vertices.T
    points = x[:, None] * turn[0] + y[:, None] * turn[1] + z[:, None] * turn[2]
    return ConvexSolid(points + quantise_m(np.asarray(start)), local.triangles)
