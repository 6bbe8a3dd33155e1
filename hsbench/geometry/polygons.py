"""Plane polygons: (n, 2) vertices in order, metres."""

from __future__ import annotations

import numpy as np

from hsbench.typing import BoolArray, FloatArray


def signed_area(polygon: FloatArray) -> float:
    """Area in square metres, positive for counter-clockwise vertices (shoelace formula)."""
    x, y = np.asarray(polygon, dtype=np.float64).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def contains(polygon: FloatArray, points: FloatArray) -> BoolArray:
    """(n, 2) polygon, (..., 2) points -> (...) bool: inside by the even-odd rule (crossings of a ray towards +x)."""
    x, y = points[..., 0], points[..., 1]
    inside = np.zeros(points.shape[:-1], dtype=bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        crosses = (y0 > y) != (y1 > y)
        inside ^= crosses & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return inside


def outline_distance(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """(n, 2) polygon, (..., 2) points -> (...) metres to the outline, inside and outside alike."""
    nearest = np.full(points.shape[:-1], np.inf)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - share[..., None] * along, axis=-1))
    return nearest


def distance(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """(n, 2) polygon, (..., 2) points -> (...) metres to the polygon, 0 inside."""
    return np.where(contains(polygon, points), 0.0, outline_distance(polygon, points))


def rectangle(centre: FloatArray, half_size: FloatArray, yaw_rad: float) -> FloatArray:
    """(4, 2) counter-clockwise corners of a rectangle with half sizes (2,) along its yawed axes."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half_size
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + centre)
