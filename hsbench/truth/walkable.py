"""Where a person can stand and walk: cells of the floor plan where an upright body hits nothing.

Task affordance-topdown: a body is a cylinder of radius .25 m with 1.8 m head room. A cell is free where that
cylinder, centred on the cell, touches no solid and no wall. What is flatter than ``step_m`` (rugs) is stepped on.
The frame is the scene's; cells are aligned to multiples of ``cell_m`` in it, as the task grids are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from scipy import ndimage

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.polygons import contains, outline_distance
from hsbench.schema.scene import Scene
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

RADIUS_M = 0.25  # task affordance-topdown
HEAD_ROOM_M = 1.8
CELL_M = 0.05
STEP_M = 0.02
LAST_BITS_M = 1e-9  # a distance so near to the radius is the radius: ties are the same on every machine
TOUCH_M = 1e-6  # a slice thinner than this is a touch, not a hit: lengths are quantised to .1 mm
SNAP_M = 0.5  # a start point may lie this far from the free cell it stands for
ENTRY_INSET_M = RADIUS_M + CELL_M  # an entry lies so far inside the room that a body there clears the wall


@dataclass(frozen=True, eq=False)
class WalkMap:
    """A floor plan of cells. origin_xy: (2,) minimum corner in metres. free: (nx, ny) bool, [x, y]."""

    origin_xy: FloatArray
    free: BoolArray
    cell_m: float = CELL_M

    def __post_init__(self) -> None:
        if np.shape(self.origin_xy) != (2,) or not np.isfinite(self.origin_xy).all():
            raise SchemaError(f"walk_map.origin_xy is {self.origin_xy}; expected two finite metres")
        if self.free.ndim != 2 or self.free.dtype != np.bool_:
            raise SchemaError(f"walk_map.free is {self.free.dtype} of shape {self.free.shape}; expected bool (nx, ny)")
        if not self.cell_m > 0:
            raise SchemaError(f"walk_map.cell_m is {self.cell_m}; expected a positive number of metres")

    def centres(self) -> FloatArray:
        """(nx, ny, 2) cell centres in metres."""
        x, y = (self.origin_xy[a] + (np.arange(self.free.shape[a]) + 0.5) * self.cell_m for a in range(2))
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    def index(self, points_xy: FloatArray) -> tuple[IntArray, BoolArray]:
        """(N, 2) points -> ((N, 2) int64 cell indices, (N,) bool: inside the map)."""
        index = np.floor((np.asarray(points_xy, dtype=np.float64) - self.origin_xy) / self.cell_m).astype(np.int64)
        inside = (index >= 0) & (index < np.asarray(self.free.shape))
        return index, np.asarray(inside.all(axis=-1))


def walk_map(
    scene: Scene,
    radius_m: float = RADIUS_M,
    head_room_m: float = HEAD_ROOM_M,
    cell_m: float = CELL_M,
    step_m: float = STEP_M,
) -> WalkMap:
    """Cells of the room where an upright cylinder touches nothing between ``step_m`` and ``head_room_m``.

    The obstacle of a convex part is the shadow on the floor of its slice between the two heights; a cell is free
    where its centre is inside the room and farther than ``radius_m`` from every obstacle and from the outline.
    Raises SchemaError for an object with mesh parts.
    """
    origin_xy, shape = _grid(np.concatenate([room.outline_xy for room in scene.rooms]), cell_m)
    centres = WalkMap(origin_xy, np.zeros(shape, dtype=np.bool_), cell_m).centres()
    free = np.zeros(shape, dtype=np.bool_)
    for room in scene.rooms:
        far = outline_distance(room.outline_xy, centres) > radius_m + LAST_BITS_M
        free |= contains(room.outline_xy, centres) & far
    walk = WalkMap(origin_xy, free, cell_m)
    for item in scene.objects:
        if len(item.solids) != len(item.parts):
            raise SchemaError(f"object {item.object_id} ({item.category_name}) has mesh parts; expected convex solids")
    return blocked(walk, [s for item in scene.objects for s in item.solids], radius_m, head_room_m, step_m)


def blocked(
    walk: WalkMap,
    solids: Sequence[ConvexSolid],
    radius_m: float = RADIUS_M,
    head_room_m: float = HEAD_ROOM_M,
    step_m: float = STEP_M,
) -> WalkMap:
    """The map after more solids (in its frame) have been put into the room; the given one stays as it is."""
    free = walk.free.copy()
    for solid in solids:
        _block(solid.vertices, solid.triangles, step_m, head_room_m, walk.origin_xy, walk.cell_m, radius_m, free)
    return WalkMap(walk.origin_xy, free, walk.cell_m)


def connected(walk: WalkMap, from_xy: FloatArray) -> BoolArray:
    """(nx, ny) bool: the free cells one can walk to from ``from_xy`` (2,), by steps to the four neighbours.

    The walk starts at the free cell nearest to the point; nothing is reached if none lies within ``SNAP_M``.
    """
    labels, _ = ndimage.label(walk.free)
    distance = np.linalg.norm(walk.centres() - np.asarray(from_xy, dtype=np.float64), axis=-1)
    distance[~walk.free] = np.inf
    start = np.unravel_index(int(np.argmin(distance)), distance.shape)
    if not distance[start] <= SNAP_M:
        return np.zeros_like(walk.free)
    return np.asarray(labels == labels[start])


def door_entries(scene: Scene, inset_m: float = ENTRY_INSET_M) -> FloatArray:
    """(D, 2) a point for each door, ``inset_m`` inside the room in front of the middle of the door."""
    outline = scene.rooms[0].outline_xy
    start, end = outline, np.roll(outline, -1, axis=0)
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    inward = np.column_stack([-along[:, 1], along[:, 0]])
    entries = []
    for item in scene.objects:
        if item.category_name == "door":
            middle = item.box[:2]
            foot = _feet(start, end, middle)
            edge = int(np.argmin(np.linalg.norm(foot - middle, axis=1)))
            entries.append(foot[edge] + inset_m * inward[edge])
    return np.array(entries).reshape(-1, 2)


def connected_to_doors(walk: WalkMap, scene: Scene) -> BoolArray:
    """(nx, ny) bool: the free cells one can walk to from any door of the scene."""
    reached = np.zeros_like(walk.free)
    for entry in door_entries(scene):
        reached |= connected(walk, entry)
    return reached


def _grid(room_xy: FloatArray, cell_m: float) -> tuple[FloatArray, tuple[int, int]]:
    """Minimum corner and shape of the cells that cover a room, aligned to multiples of the cell."""
    low = np.floor(room_xy.min(axis=0) / cell_m).astype(np.int64)
    high = np.ceil(room_xy.max(axis=0) / cell_m).astype(np.int64)
    return low * cell_m, (int(high[0] - low[0]), int(high[1] - low[1]))


def _feet(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    """(E, 2) the nearest point of each edge to a point (2,)."""
    along = end - start
    share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
    return np.asarray(start + share[:, None] * along)


@numba.njit(cache=True)
def _slice_points(vertices: FloatArray, triangles: Int32Array, z_low: float, z_high: float) -> FloatArray:
    """(M, 2) points whose hull is the shadow of the solid's slice: its vertices in range, its edges' crossings."""
    points = np.empty((len(vertices) + 6 * len(triangles), 2))
    count = 0
    for v in range(len(vertices)):
        if z_low <= vertices[v, 2] <= z_high:
            points[count, 0], points[count, 1] = vertices[v, 0], vertices[v, 1]
            count += 1
    for t in range(len(triangles)):
        for e in range(3):
            a, b = triangles[t, e], triangles[t, (e + 1) % 3]
            if a > b:  # each edge has a twin that runs the other way
                continue
            for z in (z_low, z_high):
                if (vertices[a, 2] - z) * (vertices[b, 2] - z) < 0.0:
                    share = (z - vertices[a, 2]) / (vertices[b, 2] - vertices[a, 2])
                    for axis in range(2):
                        points[count, axis] = vertices[a, axis] + share * (vertices[b, axis] - vertices[a, axis])
                    count += 1
    return points[:count]


@numba.njit(cache=True)
def _hull(points: FloatArray) -> FloatArray:
    """(H, 2) convex hull, counter-clockwise (Andrew's monotone chain)."""
    count = len(points)
    order = np.argsort(points[:, 1], kind="mergesort")
    order = order[np.argsort(points[order, 0], kind="mergesort")]
    hull = np.empty((2 * count + 1, 2))
    size = 0
    for half in range(2):
        base = size
        for step in range(count):
            p = points[order[step if half == 0 else count - 1 - step]]
            while size - base >= 2:
                a, b = hull[size - 2], hull[size - 1]
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0:
                    break
                size -= 1
            hull[size] = p
            size += 1
        size -= 1  # the last point of a half is the first of the other
    return hull[: max(size, 1)]


@numba.njit(cache=True)
def _block(
    vertices: FloatArray, triangles: Int32Array, z_low: float, z_high: float,
    origin: FloatArray, cell: float, radius: float, free: BoolArray,
) -> None:  # fmt: skip
    """Clear the cells whose centre is within ``radius`` of the shadow of a solid's slice."""
    if vertices[:, 2].max() <= z_low + TOUCH_M or vertices[:, 2].min() >= z_high - TOUCH_M:
        return
    hull = _hull(_slice_points(vertices, triangles, z_low, z_high))
    n = len(hull)
    limit = (radius + LAST_BITS_M) ** 2
    first_x = max(0, int(np.floor((hull[:, 0].min() - radius - origin[0]) / cell - 0.5)))
    last_x = min(free.shape[0] - 1, int(np.ceil((hull[:, 0].max() + radius - origin[0]) / cell - 0.5)))
    first_y = max(0, int(np.floor((hull[:, 1].min() - radius - origin[1]) / cell - 0.5)))
    last_y = min(free.shape[1] - 1, int(np.ceil((hull[:, 1].max() + radius - origin[1]) / cell - 0.5)))
    for i in range(first_x, last_x + 1):
        x = origin[0] + (i + 0.5) * cell
        for j in range(first_y, last_y + 1):
            if not free[i, j]:
                continue
            y = origin[1] + (j + 0.5) * cell
            inside = n > 2
            for e in range(n):
                ax, ay = hull[e, 0], hull[e, 1]
                dx, dy = hull[(e + 1) % n, 0] - ax, hull[(e + 1) % n, 1] - ay
                if dx * (y - ay) - dy * (x - ax) < 0.0:
                    inside = False
                length2 = dx * dx + dy * dy
                share = 0.0 if length2 == 0.0 else min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / length2))
                gap_x, gap_y = x - ax - share * dx, y - ay - share * dy
                if gap_x * gap_x + gap_y * gap_y <= limit:
                    free[i, j] = False
                    break
            if inside:
                free[i, j] = False
