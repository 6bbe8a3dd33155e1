"""What bodies and hands meet: the parts of a scene as convex shapes, packed once, and whether a box or a line is free.

A convex part is one shape. A mesh part is as many as it has closed convex pieces, and one for each triangle of its
other pieces; a triangle is a shape without thickness. A box and a shape hit each other if they penetrate deeper than
``TOUCH_M``; closeness and contact are free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.separation import PackedShapes, joined, pack_shapes, pack_triangles, parting_depth
from hsbench.geometry.triangle_meshes import as_convex, double_areas, weld
from hsbench.geometry.triangle_rays import TriangleTree, triangle_tree
from hsbench.schema.scene import Scene, SceneObject
from hsbench.truth.meshes import MeshBody, has_mesh, mesh_body
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

TOUCH_M = 1e-3  # positions are quantised to .1 mm and turned: what penetrates less than a millimetre touches
LINE_M = 1e-6  # a line is cut by what it enters deeper than this
SLIVER_M2 = 1e-12  # a triangle of less than twice this area is a line
TRIANGLE_FACES = (True, False, False, False, False)  # of the planes of ``pack_triangles``
SHEET_FACES = (True, True, False, False, False)


class Shapes(NamedTuple):
    """Convex shapes as the compiled tests take them, fields as in ``PackedShapes``; the last shape is a scratch box.

    wall: (N,) bool, whether it is a triangle that bounds a closed piece.
    """

    planes: FloatArray
    corners: FloatArray
    edges: FloatArray
    start: IntArray
    bounds: FloatArray
    wall: BoolArray


class Box(NamedTuple):
    """An upright box: extents in metres along a horizontal unit vector (x, y), along its left, and along z."""

    x: float
    y: float
    ahead: tuple[float, float]
    left: tuple[float, float]
    up: tuple[float, float]


class _Kind(NamedTuple):
    """What more is known of some shapes; see ``Obstacles``."""

    part_index: IntArray
    triangle: BoolArray
    wall: BoolArray
    face: BoolArray
    behind_m: FloatArray


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The S shapes of the N parts of a scene, in its order.

    object_index, part_index: (S,) int32 places in ``scene.objects`` and its parts. triangle: (S,) bool. wall: (S,)
    bool, a triangle that bounds a closed piece. face: (planes,) bool, the plane carries some of the part's surface.
    behind_m: (planes,) thickness of the piece behind the face of a triangle, else 0. solids: each part as one convex
    solid in the scene frame, None if it is not one. bodies: the objects with mesh parts, by their index.
    """

    shapes: PackedShapes
    object_index: Int32Array
    part_index: Int32Array
    triangle: BoolArray
    wall: BoolArray
    face: BoolArray
    behind_m: FloatArray
    solids: tuple[tuple[ConvexSolid | None, ...], ...]
    bodies: dict[int, MeshBody]

    def __len__(self) -> int:
        return len(self.object_index)

    @cached_property
    def part(self) -> Int32Array:
        """(S,) int32 number of the part of a shape among all parts of the scene."""
        first = np.cumsum([0, *map(len, self.solids)])
        return np.asarray(first[self.object_index] + self.part_index, dtype=np.int32)

    def part_number(self, object_index: int, part_index: int) -> int:
        """The number of a part among all parts of the scene."""
        return sum(map(len, self.solids[:object_index])) + part_index

    @property
    def part_count(self) -> int:
        """Number of all parts of the scene."""
        return sum(map(len, self.solids))

    def of(self, object_index: int) -> IntArray:
        """Indices of the shapes of an object."""
        return np.flatnonzero(self.object_index == object_index)

    def near(self, low_m: FloatArray, high_m: FloatArray) -> IntArray:
        """Indices of the shapes whose bounds meet the box between two corners (3,)."""
        bounds = self.shapes.bounds
        return np.flatnonzero((bounds[:, 0] < high_m).all(axis=1) & (bounds[:, 1] > low_m).all(axis=1))

    def picked(self, index: IntArray) -> Shapes:
        """Copies of some shapes, in the order given, and a scratch box."""
        packed = self.shapes
        rows = [_ranges(packed.start[index, k], packed.start[index + 1, k]) for k in range(3)]
        counts = np.diff(packed.start, axis=0)[index]
        return _with_scratch_box(
            packed.planes[rows[0]], packed.corners[rows[1]], packed.edges[rows[2]], counts, packed.bounds[index],
            self.wall[index],
        )  # fmt: skip

    @cached_property
    def tree(self) -> TriangleTree:
        """The triangles for rays, labelled by ``part``."""
        return self._tree(0, np.zeros(2))

    def tree_moved(self, object_index: int, shift_xy: FloatArray) -> TriangleTree:
        """The same after one object has been moved along the floor."""
        if object_index not in self.bodies or not shift_xy.any():
            return self.tree
        return self._tree(object_index, shift_xy)

    def _tree(self, object_index: int, shift_xy: FloatArray) -> TriangleTree:
        index = np.flatnonzero(self.triangle)
        corners = self.shapes.corners[self.shapes.start[index, 1][:, None] + np.arange(3)]
        corners[self.object_index[index] == object_index, :, :2] += shift_xy
        triangles = np.arange(3 * len(index), dtype=np.int32).reshape(-1, 3)
        return triangle_tree(corners.reshape(-1, 3), triangles, self.part[index])


def pack_obstacles(scene: Scene) -> Obstacles:
    """All parts of a scene."""
    bodies = {k: mesh_body(item) for k, item in enumerate(scene.objects) if has_mesh(item)}
    packed, kinds = [], []
    solids: list[tuple[ConvexSolid | None, ...]] = []
    convex: list[ConvexSolid] = []  # of objects that follow each other: packed at once, which is faster
    for k, item in enumerate(scene.objects):
        if k not in bodies:
            convex += item.solids
            kinds.append(_kind_of(item.solids))
            solids.append(item.solids)
            continue
        shapes, kind, own = _of_body(item, bodies[k])
        packed += [pack_shapes(convex), shapes]
        convex = []
        kinds.append(kind)
        solids.append(own)
    packed.append(pack_shapes(convex))
    kind = _Kind(*(np.concatenate(column) for column in zip(_kind_of(()), *kinds, strict=True)))
    return Obstacles(
        joined(packed),
        np.repeat(np.arange(len(kinds)), [len(kind.wall) for kind in kinds]).astype(np.int32),
        kind.part_index.astype(np.int32),
        kind.triangle,
        kind.wall,
        kind.face,
        kind.behind_m,
        tuple(solids),
        bodies,
    )


def _kind_of(solids: Sequence[ConvexSolid]) -> _Kind:
    """Convex solids, each a part by itself."""
    none, faces = np.zeros(len(solids), dtype=np.bool_), np.ones(sum(len(s.planes) for s in solids), dtype=np.bool_)
    return _Kind(np.arange(len(solids)), none, none, faces, np.zeros(len(faces)))


def _of_body(item: SceneObject, body: MeshBody) -> tuple[PackedShapes, _Kind, tuple[ConvexSolid | None, ...]]:
    """The shapes of an object with mesh parts, part by part."""
    packed, kinds, whole = [], [], []
    convex = iter(item.solids)
    for j, part in enumerate(item.parts):
        if part.solid is not None:
            solids, left = [next(convex)], np.empty(0, dtype=np.int64)
        else:
            solids, left = _convex_pieces(body, np.flatnonzero(body.part == j))
        whole.append(solids[0] if len(solids) == 1 and not len(left) else None)
        flat, sheet = pack_triangles(body.vertices[body.triangles[left]]), ~body.solid[left]
        kind = _kind_of(solids)
        packed += [pack_shapes(solids), flat]
        own = np.full(len(solids) + len(left), j)
        faces = np.where(sheet[:, None], SHEET_FACES, TRIANGLE_FACES).reshape(-1)
        behind = np.zeros((len(left), len(TRIANGLE_FACES)))
        behind[:, 0] = np.where(np.isfinite(body.thickness_m[left]), body.thickness_m[left], 0.0)
        kinds.append(
            _Kind(
                own,
                np.concatenate([kind.triangle, np.ones(len(left), dtype=np.bool_)]),
                np.concatenate([kind.wall, ~sheet]),
                np.concatenate([kind.face, faces]),
                np.concatenate([kind.behind_m, behind.reshape(-1)]),
            )
        )
    columns = (np.concatenate(column) for column in zip(*kinds, strict=True))
    return joined(packed), _Kind(*columns), tuple(whole)


def _convex_pieces(body: MeshBody, index: IntArray) -> tuple[list[ConvexSolid], IntArray]:
    """The closed convex pieces of some triangles of a body, and the other triangles that are more than lines."""
    solids, left = [], []
    order = index[np.argsort(body.piece[index], kind="stable")]
    for piece in np.split(order, np.flatnonzero(np.diff(body.piece[order])) + 1):
        closed = len(piece) > 0 and body.solid[piece[0]]
        solid = as_convex(*weld(body.vertices, body.triangles[piece])) if closed else None
        if solid is None:
            left.append(piece)
        else:
            solids.append(solid)
    rest = np.sort(np.concatenate([np.empty(0, dtype=np.int64), *left]))
    wide = np.linalg.norm(double_areas(body.vertices, body.triangles[rest]), axis=1) > 2 * SLIVER_M2
    return solids, rest[wide]


def _with_scratch_box(
    planes: FloatArray, corners: FloatArray, edges: FloatArray, counts: IntArray, bounds: FloatArray, wall: BoolArray
) -> Shapes:
    """Shapes whose numbers of planes, corners and edges are ``counts`` (N, 3), and room for one box after them."""
    return Shapes(
        np.concatenate([planes, np.zeros((6, 4))]),
        np.concatenate([corners, np.zeros((8, 3))]),
        np.concatenate([edges, np.zeros((3, 3))]),
        np.cumsum(np.concatenate([np.zeros((1, 3), np.int64), counts, [[6, 8, 3]]]), axis=0),
        np.concatenate([bounds, np.zeros((1, 2, 3))]),
        np.append(wall, False),
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
def over_each_other(shapes: Shapes, stop: int, box: Box) -> IntArray:
    """Those of the first shapes whose bounds, seen from above, meet those of an upright box: no other can hit it."""
    x = np.array([a * box.x - b * box.y for a in box.ahead for b in box.left])
    y = np.array([a * box.y + b * box.x for a in box.ahead for b in box.left])
    low_x, high_x, low_y, high_y = x.min(), x.max(), y.min(), y.max()
    found, count = np.empty(stop, dtype=np.int64), 0
    for k in range(stop):
        low, high = shapes.bounds[k, 0], shapes.bounds[k, 1]
        if low[0] <= high_x and high[0] >= low_x and low[1] <= high_y and high[1] >= low_y:
            found[count] = k
            count += 1
    return found[:count]


@numba.njit(cache=True)
def is_within(shapes: Shapes, which: IntArray, box: Box) -> bool:
    """Whether the middle of an upright box lies in the closed pieces whose triangles are among the shapes ``which``.

    Then none of these may touch the box. Winding number: triangles above the middle, up less down; their shadows share
    no point, since each has what lies on the left of its sides (Haines, "Point in polygon strategies", 1994).
    """
    a, b, z = sum(box.ahead) / 2, sum(box.left) / 2, sum(box.up) / 2
    x, y = a * box.x - b * box.y, a * box.y + b * box.x
    number = 0
    for k in which:
        if not shapes.wall[k] or shapes.bounds[k, 1, 2] < z or shapes.bounds[k, 0, 0] > x or shapes.bounds[k, 1, 0] < x:
            continue
        corner, inside = shapes.start[k, 1], False
        for e in range(3):
            p, q = corner + e, corner + (e + 1) % 3
            if shapes.corners[p, 1] > shapes.corners[q, 1]:  # from the lower end, so that neighbours agree
                p, q = q, p
            px, py, qx, qy = shapes.corners[p, 0], shapes.corners[p, 1], shapes.corners[q, 0], shapes.corners[q, 1]
            if py <= y < qy and x < px + (y - py) / (qy - py) * (qx - px):
                inside = not inside
        plane = shapes.planes[shapes.start[k, 0]]
        if inside and plane[0] * x + plane[1] * y + plane[2] * z < plane[3] and plane[2] > 0.0:
            number += 1
        elif inside and plane[0] * x + plane[1] * y + plane[2] * z > plane[3] and plane[2] < 0.0:
            number -= 1
    return number > 0


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
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for j in range(middle, stop):
        low, high = np.minimum(low, shapes.bounds[j, 0]), np.maximum(high, shapes.bounds[j, 1])
    for i in range(middle):
        if (shapes.bounds[i, 0] >= high).any() or (shapes.bounds[i, 1] <= low).any():
            continue
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
    return Shapes(planes, corners, shapes.edges, shapes.start, bounds, shapes.wall)


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
