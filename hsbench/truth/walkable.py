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
from hsbench.geometry.footprints import monotone_chain
from hsbench.geometry.polygons import contains
from hsbench.schema.scene import Scene
from hsbench.truth.doorways import Doorway, doorways
from hsbench.truth.meshes import MeshBody, columns_inside, has_mesh, mesh_body
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

RADIUS_M = 0.25  # task affordance-topdown
HEAD_ROOM_M = 1.8
CELL_M = 0.05
STEP_M = 0.02
LAST_BITS_M = 1e-9  # a distance so near to the radius is the radius: ties are the same on every machine
TOUCH_M = 1e-6  # a slice thinner than this is a touch, not a hit: lengths are quantised to .1 mm
ON_LINE_M = 1e-3  # a doorway so near to an outline is on it: both are quantised to .1 mm
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


@dataclass(frozen=True, eq=False)
class Shadows:
    """Convex outlines on the floor of what a body can hit: points (P, 2), and where each outline starts (S + 1,)."""

    points: FloatArray
    start: IntArray


def walk_map(
    scene: Scene,
    radius_m: float = RADIUS_M,
    head_room_m: float = HEAD_ROOM_M,
    cell_m: float = CELL_M,
    step_m: float = STEP_M,
) -> WalkMap:
    """Cells of rooms and doorways where an upright cylinder touches nothing between ``step_m`` and ``head_room_m``.

    The obstacle of a convex part is the shadow on the floor of its slice between the two heights; a cell is free
    where its centre is in a room or doorway and farther than ``radius_m`` from every obstacle and from the outlines,
    which are open at doorways. What closes a doorway is the leaf of its door.
    Of objects with mesh parts each triangle casts the shadow of its slice; inside their closed pieces nobody stands.
    """
    ways = doorways(scene)
    walk = _floor(scene, ways, cell_m)
    barriers = _barriers(scene, ways)
    start = np.arange(0, 2 * len(barriers) + 1, 2, dtype=np.int64)
    walk = shaded(walk, Shadows(np.ascontiguousarray(barriers.reshape(-1, 2)), start), radius_m)
    solids = [s for item in scene.objects if not has_mesh(item) for s in item.solids]
    walk = blocked(walk, solids, radius_m, head_room_m, step_m)
    for body in (mesh_body(item) for item in scene.objects if has_mesh(item)):
        walk = blocked_by_body(walk, body, radius_m, head_room_m, step_m)
    return walk


def blocked(
    walk: WalkMap,
    solids: Sequence[ConvexSolid],
    radius_m: float = RADIUS_M,
    head_room_m: float = HEAD_ROOM_M,
    step_m: float = STEP_M,
) -> WalkMap:
    """The map after more solids (in its frame) have been put into the room; the given one stays as it is."""
    return shaded(walk, shadows(solids, head_room_m, step_m), radius_m)


def blocked_by_body(
    walk: WalkMap,
    body: MeshBody,
    radius_m: float = RADIUS_M,
    head_room_m: float = HEAD_ROOM_M,
    step_m: float = STEP_M,
) -> WalkMap:
    """The map after an object with mesh parts has been put into the room."""
    walk = shaded(walk, _mesh_shadows(body, head_room_m, step_m), radius_m)
    inside = columns_inside(body, walk.origin_xy, walk.free.shape, walk.cell_m, (step_m + head_room_m) / 2)
    return WalkMap(walk.origin_xy, walk.free & ~inside, walk.cell_m)


def shadows(solids: Sequence[ConvexSolid], head_room_m: float = HEAD_ROOM_M, step_m: float = STEP_M) -> Shadows:
    """The shadows of slices between the two heights; solids that only touch the slice have none."""
    if not solids:
        return Shadows(np.empty((0, 2)), np.zeros(1, dtype=np.int64))
    vertices, triangles = [s.vertices for s in solids], [s.triangles for s in solids]
    rows = [(len(v), len(t)) for v, t in zip(vertices, triangles, strict=True)]
    first = np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(rows, axis=0)])
    return Shadows(*_shadows(np.concatenate(vertices), np.concatenate(triangles), first, step_m, head_room_m))


def shaded(walk: WalkMap, obstacles: Shadows, radius_m: float = RADIUS_M) -> WalkMap:
    """The map without the cells whose centre is within ``radius_m`` of a shadow (in its frame)."""
    free = walk.free.copy()
    _block(obstacles.points, obstacles.start, walk.origin_xy, walk.cell_m, radius_m, free)
    return WalkMap(walk.origin_xy, free, walk.cell_m)


def connected(walk: WalkMap, from_xy: FloatArray) -> BoolArray:
    """(nx, ny) bool: the free cells one can walk to from ``from_xy`` (2,), by steps to the four neighbours.

    The walk starts at the free cell nearest to the point; nothing is reached if none lies within ``SNAP_M``.
    """
    return _connected(walk, np.asarray(from_xy, dtype=np.float64).reshape(1, 2))


def door_entries(scene: Scene, inset_m: float = ENTRY_INSET_M) -> FloatArray:
    """(D, 2) a point in front of each side of every door that lies at a room, ``inset_m`` inside it.

    A passage without a leaf is no door: it is walked through or it leads nowhere.
    """
    doors = {item.object_id for item in scene.objects if item.category_name == "door"}
    entries = [way.feet + inset_m * way.inward for way in doorways(scene) if way.object_id in doors]
    return np.concatenate([np.empty((0, 2)), *entries])


def connected_to_doors(walk: WalkMap, scene: Scene) -> BoolArray:
    """(nx, ny) bool: the free cells one can walk to from any door of the scene."""
    return _connected(walk, door_entries(scene))


def nearest_free_cell(walk: WalkMap, xy: FloatArray) -> tuple[int, int] | None:
    """The free cell whose centre is nearest to a point (2,), the first of equals; None if none is within ``SNAP_M``."""
    index, _ = walk.index(np.asarray(xy).reshape(1, 2))
    reach = int(np.ceil(SNAP_M / walk.cell_m)) + 1
    low = np.maximum(index[0] - reach, 0)
    high = np.minimum(index[0] + reach + 1, walk.free.shape)
    if (low >= high).any():
        return None
    x, y = (walk.origin_xy[a] + (np.arange(low[a], high[a]) + 0.5) * walk.cell_m - xy[a] for a in range(2))
    away = np.hypot(x[:, None], y[None, :]).round(9)  # ties are the same on every machine
    away[~walk.free[low[0] : high[0], low[1] : high[1]]] = np.inf
    i, j = np.unravel_index(int(np.argmin(away)), away.shape)
    return (int(i + low[0]), int(j + low[1])) if away[i, j] <= SNAP_M else None


def _connected(walk: WalkMap, points: FloatArray) -> BoolArray:
    labels, _ = ndimage.label(walk.free)
    cells = [cell for cell in (nearest_free_cell(walk, point) for point in points) if cell is not None]
    return np.asarray(np.isin(labels, [labels[cell] for cell in cells]) & walk.free)


def _floor(scene: Scene, ways: Sequence[Doorway], cell_m: float) -> WalkMap:
    """The cells whose centre is in a room or doorway, on a grid aligned to multiples of the cell."""
    regions = [room.outline_xy for room in scene.rooms]
    regions += [np.concatenate([way.corners(0), way.corners(1)[::-1]]) for way in ways if len(way.rooms) == 2]
    corners = np.concatenate(regions)
    low = np.floor(corners.min(axis=0) / cell_m).astype(np.int64)
    high = np.ceil(corners.max(axis=0) / cell_m).astype(np.int64)
    walk = WalkMap(low * cell_m, np.zeros((int(high[0] - low[0]), int(high[1] - low[1])), dtype=np.bool_), cell_m)
    centres = walk.centres()
    for region in regions:
        (i, j), _ = walk.index(np.stack([region.min(axis=0), region.max(axis=0)]))
        window = np.s_[max(i[0], 0) : j[0] + 1, max(i[1], 0) : j[1] + 1]
        walk.free[window] |= contains(region, centres[window])
    return walk


def _barriers(scene: Scene, ways: Sequence[Doorway]) -> FloatArray:
    """(B, 2, 2) segments that stop a body: the outlines, open at doorways between two rooms, and the sides of these."""
    found: list[FloatArray] = []
    open_at: list[list[FloatArray]] = [[] for _ in scene.rooms]
    for way in (w for w in ways if len(w.rooms) == 2):
        for side, number in enumerate(way.rooms):
            open_at[number].append(way.corners(side))
        found += list(np.stack([way.corners(0), way.corners(1)], axis=1))
    for room, gaps in zip(scene.rooms, open_at, strict=True):
        for start, end in zip(room.outline_xy, np.roll(room.outline_xy, -1, axis=0), strict=True):
            found += _without(start, end, gaps)
    return np.array(found).reshape(-1, 2, 2)


def _without(start: FloatArray, end: FloatArray, gaps: Sequence[FloatArray]) -> list[FloatArray]:
    """What is left, as (2, 2) segments, of a side of an outline without the doorways (2, 2) that lie on it."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    normal = np.array([-along[1], along[0]])
    on_it = [g for g in gaps if (np.abs((g - start) @ normal) < ON_LINE_M).all()]
    spans = sorted(tuple(np.clip(np.sort((g - start) @ along), 0.0, length).tolist()) for g in on_it)
    left, at = [], 0.0
    for low, high in [*spans, (length, length)]:
        if low > at:
            left.append(start + np.array([[at], [low]]) * along)
        at = max(at, high)
    return left


def _mesh_shadows(body: MeshBody, head_room_m: float, step_m: float) -> Shadows:
    """The shadows of the slices of triangles, each a flat solid with two sides."""
    count = len(body.triangles)
    sides = np.tile(np.array([[0, 1, 2], [0, 2, 1]], dtype=np.int32), (count, 1))
    first = np.arange(count + 1)[:, None] * np.array([3, 2])
    corners = np.ascontiguousarray(body.vertices[body.triangles].reshape(-1, 3))
    return Shadows(*_shadows(corners, sides, first, step_m, head_room_m))


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
def _shadows(
    vertices: FloatArray, triangles: Int32Array, first: IntArray, z_low: float, z_high: float
) -> tuple[FloatArray, IntArray]:
    """Points and starts of the shadows of packed solids; rows of ``first`` (S + 1, 2): their vertices, triangles."""
    points = np.empty((len(vertices) + 6 * len(triangles), 2))
    start = np.zeros(len(first), dtype=np.int64)
    count = used = 0
    for s in range(len(first) - 1):
        own = vertices[first[s, 0] : first[s + 1, 0]]
        if own[:, 2].max() <= z_low + TOUCH_M or own[:, 2].min() >= z_high - TOUCH_M:
            continue
        hull = monotone_chain(_slice_points(own, triangles[first[s, 1] : first[s + 1, 1]], z_low, z_high))
        points[used : used + len(hull)] = hull
        used += len(hull)
        count += 1
        start[count] = used
    return points[:used].copy(), start[: count + 1].copy()


@numba.njit(cache=True)
def _block(
    points: FloatArray, start: IntArray, origin: FloatArray, cell: float, radius: float, free: BoolArray
) -> None:
    """Clear the cells whose centre is within ``radius`` of any of the packed convex outlines."""
    limit = (radius + LAST_BITS_M) ** 2
    for s in range(len(start) - 1):
        hull = points[start[s] : start[s + 1]]
        n = len(hull)
        first_x = max(0, int(np.floor((hull[:, 0].min() - radius - origin[0]) / cell - 0.5)))
        last_x = min(free.shape[0] - 1, int(np.ceil((hull[:, 0].max() + radius - origin[0]) / cell - 0.5)))
        first_y = max(0, int(np.floor((hull[:, 1].min() - radius - origin[1]) / cell - 0.5)))
        last_y = min(free.shape[1] - 1, int(np.ceil((hull[:, 1].max() + radius - origin[1]) / cell - 0.5)))
        for i in range(first_x, last_x + 1):
            x = origin[0] + (i + 0.5) * cell
            for j in range(first_y, last_y + 1):
                if free[i, j] and _near(hull, n, x, origin[1] + (j + 0.5) * cell, limit):
                    free[i, j] = False


@numba.njit(cache=True)
def _near(hull: FloatArray, n: int, x: float, y: float, limit: float) -> bool:
    """Whether a point is in a convex outline or its squared distance from it is at most ``limit``."""
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
            return True
    return inside
