"""Footprints: convex hulls of points seen from above, the smallest rectangle around them, outlines of flat surfaces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numba
import numpy as np

from hsbench.geometry.numerics import quantise_angle
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.transforms import rotation_z
from hsbench.typing import FloatArray, Int32Array

ON_EDGE_M = 1e-5
"""A corner this near to an edge lies on it."""

SAME_AREA = 0.005
"""Rectangles whose areas differ by less than this share are alike: for round things any yaw is the smallest."""


def hull(points_xy: FloatArray) -> FloatArray:
    """(N, 2) points -> (H, 2) their convex hull, counter-clockwise; one point or two where they are no more."""
    points = np.unique(np.asarray(points_xy, dtype=np.float64).reshape(-1, 2), axis=0)
    return points if len(points) < 3 else np.asarray(monotone_chain(points))


def smallest_yaw(points_xy: FloatArray, yaw_rad: float) -> float:
    """The yaw of the rectangle of least area around points (N, 2); of its four equal yaws, the nearest to ``yaw_rad``.

    A rectangle at ``yaw_rad`` itself is taken if hardly larger. One side of the smallest lies along a side of the hull
    (Freeman & Shapira, "Determining the minimum-area encasing rectangle", 1975). Rounded to .01 degree.
    """
    corners = hull(points_xy)
    sides = np.roll(corners, -1, axis=0) - corners
    found = {quantise_angle(_turned_to(math.atan2(y, x), yaw_rad)) for x, y in sides if (x, y) != (0.0, 0.0)}
    yaws = sorted({quantise_angle(yaw_rad), *found}, key=lambda yaw: (abs(yaw - yaw_rad), yaw))
    areas = np.array([_area(corners, yaw) for yaw in yaws])
    return yaws[int(np.argmax(areas <= areas.min() * (1 + SAME_AREA)))]


def boundary_loops(vertices: FloatArray, triangles: Int32Array) -> list[FloatArray]:
    """Closed boundaries (n, 2) of a flat welded mesh (V, 3 or 2), (T, 3), seen from above, corners only.

    Counter-clockwise around the mesh, clockwise around its holes, largest first. Sides that lie on each other are no
    boundary, wherever their corners are. None if a boundary touches itself.
    """
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    border = _unpaired(_split(_unpaired(edges.tolist()), vertices[:, :2]))
    after = dict(border)
    loops = []
    if len(after) == len(border):
        left = dict(after)
        for start, _ in border:
            loop = []
            while start in left:
                loop.append(start)
                start = left.pop(start)
            if len(loop) >= 3:
                loops.append(_corners(vertices[loop, :2]))
    return sorted((loop for loop in loops if len(loop) >= 3), key=lambda loop: -abs(signed_area(loop)))


def _unpaired(edges: Iterable[Sequence[int]]) -> list[tuple[int, int]]:
    """The edges that do not also run the other way, in order."""
    every = {(a, b) for a, b in edges}
    return sorted((a, b) for a, b in every if (b, a) not in every)


def _split(edges: list[tuple[int, int]], points: FloatArray) -> list[tuple[int, int]]:
    """Edges cut where the ends of others lie on them."""
    ends = np.unique(np.array(edges, dtype=np.int64).reshape(-1, 2))
    pieces = []
    for a, b in edges:
        along, offset = points[b] - points[a], points[ends] - points[a]
        length = float(np.linalg.norm(along))
        share = offset @ along / length**2
        aside = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / length
        on = (aside < ON_EDGE_M) & (share * length > ON_EDGE_M) & ((1 - share) * length > ON_EDGE_M)
        stops = [a, *ends[on][np.argsort(share[on], kind="stable")].tolist(), b]
        pieces += list(pairwise(stops))
    return pieces


def _turned_to(yaw: float, near: float) -> float:
    """``yaw`` plus the number of quarter turns that brings it nearest to ``near``."""
    return yaw + math.pi / 2 * round((near - yaw) / (math.pi / 2))


def _area(corners: FloatArray, yaw: float) -> float:
    size = np.ptp(corners @ rotation_z(yaw)[:2, :2], axis=0)
    return round(float(size[0] * size[1]), 9)


def _corners(loop: FloatArray) -> FloatArray:
    """A closed line without the points that lie on the straight between their neighbours."""
    before, after = np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0)
    a, b = loop - before, after - loop
    bend = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return loop[np.abs(bend) > 1e-6 * np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)]


@numba.njit(cache=True)
def monotone_chain(points: FloatArray) -> FloatArray:
    """(N, 2) points -> (H, 2) their convex hull, counter-clockwise; one point where all are one. For compiled callers.

    Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
    """
    count = len(points)
    order = np.argsort(points[:, 1], kind="mergesort")
    order = order[np.argsort(points[order, 0], kind="mergesort")]
    chain = np.empty((2 * count + 1, 2))
    size = 0
    for half in range(2):
        base = size
        for step in range(count):
            p = points[order[step if half == 0 else count - 1 - step]]
            while size - base >= 2:
                a, b = chain[size - 2], chain[size - 1]
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0:
                    break
                size -= 1
            chain[size] = p
            size += 1
        size -= 1  # the last point of a half is the first of the other
    return chain[: max(size, 1)]
