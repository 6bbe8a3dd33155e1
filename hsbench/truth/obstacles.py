"""What bodies and hands meet: the convex parts of a scene, packed once, and whether a box or a line is free of them.

A box and a part hit each other if they penetrate deeper than ``TOUCH_M``; closeness and contact are free.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.separation import PackedShapes, pack_shapes, parting_depth
from hsbench.schema.scene import Scene
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

TOUCH_M = 1e-3  # positions are quantised to .1 mm and turned: what penetrates less than a millimetre touches
LINE_M = 1e-6  # a line is cut by what it enters deeper than this


class Shapes(NamedTuple):
    """Convex shapes as the compiled tests take them, fields as in ``PackedShapes``; the last shape is a scratch box."""

    planes: FloatArray
    corners: FloatArray
    edges: FloatArray
    start: IntArray
    bounds: FloatArray


class Box(NamedTuple):
    """An upright box: extents in metres along a horizontal unit vector (x, y), along its left, and along z."""

    x: float
    y: float
    ahead: tuple[float, float]
    left: tuple[float, float]
    up: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The N parts of a scene. object_index, part_index: (N,) int32 places in ``scene.objects`` and its parts."""

    shapes: PackedShapes
    object_index: Int32Array
    part_index: Int32Array

    def __len__(self) -> int:
        return len(self.object_index)

    def of(self, object_index: int) -> IntArray:
        """Indices of the parts of an object."""
        return np.flatnonzero(self.object_index == object_index)

    def near(self, low_m: FloatArray, high_m: FloatArray) -> IntArray:
        """Indices of the parts whose bounds meet the box between two corners (3,)."""
        bounds = self.shapes.bounds
        return np.flatnonzero((bounds[:, 0] < high_m).all(axis=1) & (bounds[:, 1] > low_m).all(axis=1))

    def picked(self, index: IntArray) -> Shapes:
        """Copies of some parts, in the order given, and a scratch box."""
        packed = self.shapes
        rows = [_ranges(packed.start[index, k], packed.start[index + 1, k]) for k in range(3)]
        counts = np.diff(packed.start, axis=0)[index]
        return _with_scratch_box(
            packed.planes[rows[0]], packed.corners[rows[1]], packed.edges[rows[2]], counts, packed.bounds[index]
        )


def pack_obstacles(scene: Scene) -> Obstacles:
    """All parts of a scene. Raises SchemaError for mesh parts."""
    for item in scene.objects:
        if len(item.solids) != len(item.parts):
            raise SchemaError(f"object {item.object_id} ({item.category_name}) has mesh parts; expected convex solids")
    counts = [len(item.solids) for item in scene.objects]
    return Obstacles(
        pack_shapes([solid for item in scene.objects for solid in item.solids]),
        np.repeat(np.arange(len(counts)), counts).astype(np.int32),
        np.concatenate([np.empty(0), *map(np.arange, counts)]).astype(np.int32),
    )


def _with_scratch_box(
    planes: FloatArray, corners: FloatArray, edges: FloatArray, counts: IntArray, bounds: FloatArray
) -> Shapes:
    """Shapes whose numbers of planes, corners and edges are ``counts`` (N, 3), and room for one box after them."""
    return Shapes(
        np.concatenate([planes, np.zeros((6, 4))]),
        np.concatenate([corners, np.zeros((8, 3))]),
        np.concatenate([edges, np.zeros((3, 3))]),
        np.cumsum(np.concatenate([np.zeros((1, 3), np.int64), counts, [[6, 8, 3]]]), axis=0),
        np.concatenate([bounds, np.zeros((1, 2, 3))]),
    )


def _ranges(first: IntArray, stop: IntArray) -> IntArray:
    """Concatenated ranges first[k] .. stop[k] - 1."""
    counts = stop - first
    return np.arange(counts.sum()) + np.repeat(first - np.cumsum(counts) + counts, counts)


@numba.njit(cache=True)
def box_hits(shapes: Shapes, which: IntArray, box: Box) -> bool:
    """Whether an upright box hits any of the shapes ``which`` (K,)."""
    slot = len(shapes.start) - 2
    _write_box(shapes, slot, box)
    hit = False
    for k in which:
        hit = hits(shapes, k, slot)
        if hit:
            break
    return hit


@numba.njit(cache=True)
def hits(shapes: Shapes, i: int, j: int) -> bool:
    """Whether shapes i and j penetrate deeper than ``TOUCH_M``."""
    for axis in range(3):
        if shapes.bounds[i, 1, axis] - shapes.bounds[j, 0, axis] <= TOUCH_M:
            return False
        if shapes.bounds[j, 1, axis] - shapes.bounds[i, 0, axis] <= TOUCH_M:
            return False
    return bool(parting_depth(shapes.planes, shapes.corners, shapes.edges, shapes.start, i, j, TOUCH_M) > TOUCH_M)


@numba.njit(cache=True)
def hit_pairs(shapes: Shapes, middle: int, stop: int) -> BoolArray:
    """(middle, stop - middle) bool: which of the first shapes hit which of the shapes middle .. stop - 1."""
    pairs = np.zeros((middle, stop - middle), dtype=np.bool_)
    for i in range(middle):
        for j in range(middle, stop):
            pairs[i, j - middle] = hits(shapes, i, j)
    return pairs


@numba.njit(cache=True)
def moved(shapes: Shapes, first: int, stop: int, x: float, y: float) -> Shapes:
    """Copies of all shapes, those of first .. stop - 1 moved along the floor."""
    planes, corners, bounds = shapes.planes.copy(), shapes.corners.copy(), shapes.bounds.copy()
    rows = shapes.start[first], shapes.start[stop]
    for p in range(rows[0][0], rows[1][0]):
        planes[p, 3] += planes[p, 0] * x + planes[p, 1] * y
    corners[rows[0][1] : rows[1][1], :2] += np.array([x, y])
    bounds[first:stop, :, :2] += np.array([x, y])
    return Shapes(planes, corners, shapes.edges, shapes.start, bounds)


@numba.njit(cache=True)
def cuts(planes: FloatArray, first: int, stop: int, origin: FloatArray, end: FloatArray) -> bool:
    """Whether the solid of the planes first .. stop - 1 meets the segment between two points (slab method).

    Deeper than ``LINE_M``: a line along a face is free, whatever the last bits of either.
    """
    enter, leave = 0.0, 1.0
    for p in range(first, stop):
        nx, ny, nz = planes[p, 0], planes[p, 1], planes[p, 2]
        at_origin = nx * origin[0] + ny * origin[1] + nz * origin[2] - planes[p, 3] + LINE_M
        at_end = nx * end[0] + ny * end[1] + nz * end[2] - planes[p, 3] + LINE_M
        if at_origin > 0.0 and at_end > 0.0:
            return False
        if at_origin > 0.0:
            enter = max(enter, at_origin / (at_origin - at_end))
        elif at_end > 0.0:
            leave = min(leave, at_origin / (at_origin - at_end))
        if leave < enter:
            return False
    return True


@numba.njit(cache=True)
def _write_box(shapes: Shapes, slot: int, box: Box) -> None:
    plane, corner, edge = shapes.start[slot, 0], shapes.start[slot, 1], shapes.start[slot, 2]
    x, y = box.x, box.y
    shapes.edges[edge, 0], shapes.edges[edge, 1] = x, y
    shapes.edges[edge + 1, 0], shapes.edges[edge + 1, 1] = -y, x
    shapes.edges[edge + 2, 2] = 1.0
    for side in range(2):
        sign = 2.0 * side - 1.0
        for axis in range(3):
            for k in range(3):
                shapes.planes[plane + 2 * axis + side, k] = sign * shapes.edges[edge + axis, k]
        shapes.planes[plane + side, 3] = sign * box.ahead[side]
        shapes.planes[plane + 2 + side, 3] = sign * box.left[side]
        shapes.planes[plane + 4 + side, 3] = sign * box.up[side]
    for k in range(8):
        a, b, c = box.ahead[k & 1], box.left[(k >> 1) & 1], box.up[k >> 2]
        shapes.corners[corner + k, 0] = a * x - b * y
        shapes.corners[corner + k, 1] = a * y + b * x
        shapes.corners[corner + k, 2] = c
    for axis in range(3):
        shapes.bounds[slot, 0, axis] = shapes.corners[corner : corner + 8, axis].min()
        shapes.bounds[slot, 1, axis] = shapes.corners[corner : corner + 8, axis].max()
