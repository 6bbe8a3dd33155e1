"""Polygons that a person drew: checked before anything is computed from them, and which points they hold."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.typing import BoolArray, FloatArray

MAX_POINTS = 4096
"""Of one polygon; an outline traced pixel by pixel has fewer, and every edge is compared with every other."""

MAX_POLYGONS = 1000
"""Of one region."""

BANDS = 256  # of a polygon, from top to bottom
TINY = 1e-300


def checked(points: Any, where: str, low: tuple[float, float], high: tuple[float, float], unit: str) -> FloatArray:
    """A list of (x, y) pairs out of JSON -> (n, 2) float64.

    Raises DataError, starting with ``where``, unless it is a simple polygon within low..high: at least three corners,
    finite, no edge that crosses or touches another, some area. A corner given twice in a row is one corner.
    """
    rows = pose_json.items(points, where, MAX_POINTS)
    largest = max(map(abs, (*low, *high)))
    corners = [pose_json.numbers(row, f"{where}[{i}]", 2, 1e3 * largest) for i, row in enumerate(rows)]
    if len(corners) < 3:
        raise DataError(f"{where} has {len(corners)} corners; expected at least 3")
    polygon = np.array(corners)
    outside = ((polygon < low) | (polygon > high)).any(axis=1)
    if outside.any():
        corner = int(np.argmax(outside))
        u, v = polygon[corner]
        raise DataError(
            f"{where}[{corner}] is ({u:g}, {v:g}); expected {unit} from ({low[0]:g}, {low[1]:g}) to"
            f" ({high[0]:g}, {high[1]:g})"
        )
    distinct = polygon[(polygon != np.roll(polygon, 1, axis=0)).any(axis=1)]
    if len(distinct) < 3:
        raise DataError(f"{where} encloses no area; expected a polygon")
    crossing = first_crossing(distinct)
    if crossing is not None:
        a, b = (distinct[k].tolist() for k in crossing)
        raise DataError(f"{where}: the edges from {a} and from {b} cross or touch; expected a simple polygon")
    return polygon


def first_crossing(polygon: FloatArray) -> tuple[int, int] | None:
    """(n, 2) distinct corners -> the first two edges, by their first corners, that cross, touch or fold back.

    None where the polygon is simple. Edge k goes from corner k to corner k + 1.
    """
    start, end = polygon, np.roll(polygon, -1, axis=0)
    n = len(polygon)
    for k in range(n):
        others = np.arange(k + 1, n)
        neighbours = (others == k + 1) | ((k == 0) & (others == n - 1))
        far = others[~neighbours]
        hit = _meet(start[k], end[k], start[far], end[far])
        if hit.any():
            return k, int(far[np.argmax(hit)])
        following = (k + 1) % n
        along, onwards = end[k] - start[k], end[following] - start[following]
        if along[0] * onwards[1] == along[1] * onwards[0] and along @ onwards < 0:
            return k, following
    return None


def holds(polygon: FloatArray, points: FloatArray) -> BoolArray:
    """(n, 2) polygon, (..., 2) points -> (...) bool: inside by the even-odd rule; NaN is outside."""
    inside = np.empty(points.shape[:-1], dtype=np.bool_)
    _holds(np.ascontiguousarray(polygon), np.ascontiguousarray(points).reshape(-1, 2), inside.reshape(-1))
    return inside


@numba.njit(cache=True)
def _holds(polygon: FloatArray, points: FloatArray, inside: BoolArray) -> None:
    """As ``geometry.polygons.contains``, for millions of points: of each only the edges in its band of v are asked."""
    n = len(polygon)
    u0, u1 = polygon[:, 0].min(), polygon[:, 0].max()
    v0, v1 = polygon[:, 1].min(), polygon[:, 1].max()
    per_v = BANDS / max(v1 - v0, TINY)
    first, last = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    start = np.zeros(BANDS + 2, dtype=np.int64)
    for k in range(n):
        low, high = min(polygon[k - 1, 1], polygon[k, 1]), max(polygon[k - 1, 1], polygon[k, 1])
        first[k], last[k] = int((low - v0) * per_v), int((high - v0) * per_v)
        for band in range(first[k], last[k] + 1):
            start[band + 1] += 1
    start = np.cumsum(start)
    filled = start[:-1].copy()
    edges = np.empty(start[-1], dtype=np.int64)
    for k in range(n):
        for band in range(first[k], last[k] + 1):
            edges[filled[band]] = k
            filled[band] += 1
    for i in range(len(points)):
        u, v = points[i, 0], points[i, 1]
        odd = False
        if u0 <= u <= u1 and v0 <= v <= v1:
            band = int((v - v0) * per_v)
            for e in range(start[band], start[band + 1]):
                au, av = polygon[edges[e] - 1, 0], polygon[edges[e] - 1, 1]
                bu, bv = polygon[edges[e], 0], polygon[edges[e], 1]
                if (av > v) != (bv > v) and u < (bu - au) * (v - av) / (bv - av) + au:
                    odd = not odd
        inside[i] = odd


def _meet(a: FloatArray, b: FloatArray, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """(m,) bool: whether the segment a b (2,) and each of m segments share a point."""
    starts_at, ends_at = _side(a, b, starts), _side(a, b, ends)
    a_at, b_at = _side(starts, ends, a), _side(starts, ends, b)
    apart = (starts_at * ends_at > 0) | (a_at * b_at > 0)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    boxes = ((low <= np.maximum(a, b)) & (high >= np.minimum(a, b))).all(axis=1)  # what lies on one line
    return np.asarray(~apart & boxes)


def _side(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    """-1, 0 or 1: on which side of the line from a to b the points p lie; (..., 2) each."""
    along, to = b - a, p - a
    return np.asarray(np.sign(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]))
