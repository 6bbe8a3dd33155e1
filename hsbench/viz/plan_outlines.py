"""Outlines of parts seen from above, and their cuts at a height."""

from __future__ import annotations

import cv2
import numpy as np

from hsbench.geometry.footprints import hull
from hsbench.geometry.polygons import signed_area
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part
from hsbench.typing import FloatArray, Int32Array

CELL_M = 0.005  # meshes are outlined on a raster of this width
MAX_CELLS = 4000
FILLED = 0.98  # share of its hull that a convex silhouette fills on the raster
SMOOTH_M = 0.006  # corners nearer than this to a straight line are left out


def part_outlines(part: Part, scene_T_object: FloatArray) -> list[FloatArray]:
    """(n, 2) outlines of a part seen from above: the hull of a convex one, the silhouette of a mesh."""
    points = apply(scene_T_object, part.vertices)[:, :2]
    if part.solid is not None:
        outline = hull(points)
        return [outline] if len(outline) >= 3 else []
    return _silhouettes(points, part.triangles)


def slice_segments(vertices: FloatArray, triangles: Int32Array, z_m: float) -> FloatArray:
    """(N, 2, 2) where triangles cross a height."""
    corners = vertices[triangles]
    above = corners[:, :, 2] > z_m
    segments = []
    for k in range(3):  # the corner that lies alone on its side of the cut
        one, two, three = corners[:, k], corners[:, k - 2], corners[:, k - 1]
        lone = (above[:, k] != above[:, k - 2]) & (above[:, k - 2] == above[:, k - 1])
        ends = _crossing(one[lone], two[lone], z_m), _crossing(one[lone], three[lone], z_m)
        segments.append(np.stack(ends, axis=1))
    return np.concatenate(segments)


def _crossing(low: FloatArray, high: FloatArray, z_m: float) -> FloatArray:
    share = (z_m - low[:, 2]) / (high[:, 2] - low[:, 2])
    return np.asarray(low[:, :2] + share[:, None] * (high[:, :2] - low[:, :2]))


def _silhouettes(points: FloatArray, triangles: Int32Array) -> list[FloatArray]:
    """The outer borders of the union of triangles, to ``CELL_M``; where that is convex, its hull."""
    low, high = points.min(axis=0), points.max(axis=0)
    cell = max(CELL_M, float((high - low).max()) / MAX_CELLS)
    size = np.ceil((high - low) / cell).astype(int) + 3
    mask = np.zeros((int(size[1]), int(size[0])), dtype=np.uint8)
    pixels = np.round((points - low) / cell + 1).astype(np.int32)
    for triangle in pixels[triangles]:
        cv2.fillConvexPoly(mask, triangle, 1)
    borders, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    if len(borders) == 1 and mask.sum() * cell**2 > FILLED * abs(signed_area(hull(points))):
        return [hull(points)]
    smooth = [cv2.approxPolyDP(border, SMOOTH_M / cell, True)[:, 0].astype(np.float64) for border in borders]
    return [(border - 1) * cell + low for border in smooth if len(border) >= 3]
