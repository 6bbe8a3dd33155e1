"""What a hand reaches: points within an arm's length of a shoulder in a straight line that nothing cuts.

Task affordance-topdown: a shoulder is 1.4 m above a walkable cell or .55 m above a sittable seat, the hand within .75 m
of it, the line free of all solids but the part itself at its end. Lines run from the centre of every walkable cell and
from seats every ``SEAT_STEP_M``; they are cut exactly, but end ``END_M`` before their point, so that what only touches
the part there does not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from hsbench.geometry.triangle_rays import TriangleTree, is_cut
from hsbench.truth.obstacles import Obstacles, cuts
from hsbench.truth.sittable import SHOULDER_SEATED_M, SHOULDER_STANDING_M, SeatUse
from hsbench.truth.tops import SLACK_M, STEP_ALONG_M
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

REACH_M = 0.75  # task affordance-topdown
SEAT_STEP_M = 0.1  # shoulders along a seat's front edge
END_M = 1e-3
BIN_M = 0.25  # shoulders are looked up by squares of this side
CHUNK = 64  # points that share a list of the solids around them
NOWHERE = np.array([[np.inf] * 3, [-np.inf] * 3])  # bounds that meet nothing


@dataclass(frozen=True, eq=False)
class Shoulders:
    """Where arms reach from while the scene is in one state. points_m: (N, 3).

    moved_object, shift_xy: index of the seat's object that stands elsewhere than at t0, and its move (2,), if any.
    """

    points_m: FloatArray
    moved_object: int | None = None
    shift_xy: FloatArray | None = None


def shoulders(walk: WalkMap, uses: tuple[SeatUse, ...]) -> tuple[Shoulders, ...]:
    """All shoulders of a scene: above walkable cells, above seats that stay in place, above each that is moved."""
    standing = _above(walk.centres()[walk.free], SHOULDER_STANDING_M)
    seated = [(use, _above(_spaced(use), use.height_m + SHOULDER_SEATED_M)) for use in uses]
    still = [np.empty((0, 3)), *(points for use, points in seated if use.pull_m == 0)]
    moved = [Shoulders(points, use.object_index, use.shift_xy) for use, points in seated if use.pull_m > 0]
    return (Shoulders(standing), Shoulders(np.concatenate(still)), *moved)


def reached(
    points_m: FloatArray, normals: FloatArray, shape: Int32Array, obstacles: Obstacles, from_: tuple[Shoulders, ...]
) -> BoolArray:
    """(N, 3) points on faces of shapes, their outward normals (N, 3) and shapes (N,) -> (N,) bool: a hand reaches them.

    A point of a seat that had to be moved is not reached by who sits on it.
    """
    found = np.zeros(len(points_m), dtype=np.bool_)
    for group in from_:
        if not len(group.points_m):
            continue
        low, high = group.points_m.min(axis=0) - REACH_M, group.points_m.max(axis=0) + REACH_M
        open_ = np.flatnonzero(~found & ((points_m >= low) & (points_m <= high)).all(axis=1))
        planes, bounds = obstacles.shapes.planes, obstacles.shapes.bounds
        tree = obstacles.tree if obstacles.bodies else None
        if group.moved_object is not None and group.shift_xy is not None:
            own = obstacles.of(group.moved_object)
            open_ = open_[obstacles.object_index[shape[open_]] != group.moved_object]
            planes, bounds = _shifted(obstacles, own, group.shift_xy)
            tree = obstacles.tree_moved(group.moved_object, group.shift_xy) if obstacles.bodies else None
        if tree is not None:
            bounds = np.where(obstacles.triangle[:, None, None], NOWHERE, bounds)
        order, first, low_xy = _binned(group.points_m)
        found[open_] = _reached(
            points_m[open_], normals[open_], shape[open_], group.points_m[order], first, low_xy, planes,
            np.ascontiguousarray(obstacles.shapes.start[:, 0]), bounds, tree,
        )  # fmt: skip
    return found


def nearest_faces(points_m: FloatArray, part: IntArray, obstacles: Obstacles) -> tuple[Int32Array, FloatArray]:
    """(N, 3) points on the surface of parts, numbered as ``Obstacles.part`` (N,) -> (N,) the shape that each lies on,
    (N, 3) outward normal of the face.
    """
    first, stop = (np.searchsorted(obstacles.part, part, side) for side in ("left", "right"))
    start = np.ascontiguousarray(obstacles.shapes.start[:, 0])
    shape, normals = _nearest_faces(points_m, first, stop, obstacles.shapes.planes, start)
    return shape, normals


def _above(points_xy: FloatArray, z_m: float) -> FloatArray:
    return np.column_stack([points_xy, np.full(len(points_xy), z_m)])


def _spaced(use: SeatUse) -> FloatArray:
    """(K, 2) the patches at every so many places along the front edge, and at the last."""
    left = use.centres_xy @ np.array([-use.front_xy[1], use.front_xy[0]])
    place = np.concatenate([[0], np.cumsum(np.diff(left) > SLACK_M)])
    step = round(SEAT_STEP_M / STEP_ALONG_M)
    return np.asarray(use.centres_xy[(place % step == 0) | (place == place[-1])])


def _shifted(obstacles: Obstacles, own: IntArray, shift_xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Planes and bounds of all parts after those of one object, which follow each other, have moved."""
    planes, bounds = obstacles.shapes.planes.copy(), obstacles.shapes.bounds.copy()
    rows = slice(obstacles.shapes.start[own[0], 0], obstacles.shapes.start[own[-1] + 1, 0])
    planes[rows, 3] += planes[rows, :2] @ shift_xy
    bounds[own, :, :2] += shift_xy
    return planes, bounds


def _binned(points: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Points sorted by square bins: (order (N,), first (nx, ny + 1) into it along y, minimum corner (2,))."""
    low = points[:, :2].min(axis=0)
    bins = ((points[:, :2] - low) / BIN_M).astype(np.int64)
    nx, ny = bins.max(axis=0) + 1
    flat = bins[:, 0] * ny + bins[:, 1]
    first = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=nx * ny))])
    return np.argsort(flat, kind="stable"), first[np.arange(nx)[:, None] * ny + np.arange(ny + 1)], low


@numba.njit(cache=True)
def _nearest_faces(
    points: FloatArray, first: IntArray, stop: IntArray, planes: FloatArray, start: IntArray
) -> tuple[Int32Array, FloatArray]:
    shape, normals = np.empty(len(points), dtype=np.int32), np.empty_like(points)
    for k in range(len(points)):
        least = np.inf
        for s in range(first[k], stop[k]):
            outermost, plane = -np.inf, start[s]
            for p in range(start[s], start[s + 1]):
                away = (planes[p, :3] * points[k]).sum() - planes[p, 3]
                if away > outermost:
                    outermost, plane = away, p
            if abs(outermost) < least:
                least = abs(outermost)
                shape[k], normals[k] = s, planes[plane, :3]
    return shape, normals


@numba.njit(cache=True)
def _reached(
    points: FloatArray, normals: FloatArray, shape: Int32Array, shoulders: FloatArray, first: IntArray,
    low_xy: FloatArray, planes: FloatArray, start: IntArray, bounds: FloatArray, tree: TriangleTree | None,
) -> BoolArray:  # fmt: skip
    found = np.zeros(len(points), dtype=np.bool_)
    none = np.empty(0, dtype=np.int64)
    within = np.empty(len(points), dtype=np.int64)
    count = 0
    for k in range(len(points)):
        if _is_reached(points[k], normals[k], shoulders, first, low_xy, planes, start, none, None):
            within[count] = k
            count += 1
    around, close = np.empty(len(bounds), dtype=np.int64), np.empty(len(bounds), dtype=np.int64)
    for chunk in range(0, count, CHUNK):
        block = points[within[chunk : min(chunk + CHUNK, count)]]
        n_around = 0
        low, high = np.empty(3), np.empty(3)
        for axis in range(3):
            low[axis], high[axis] = block[:, axis].min() - REACH_M, block[:, axis].max() + REACH_M
        for s in range(len(bounds)):
            if _meets(bounds[s], low, high):
                around[n_around] = s
                n_around += 1
        for k in within[chunk : min(chunk + CHUNK, count)]:
            n_close = 0
            low, high = points[k] - REACH_M, points[k] + REACH_M
            for s in around[:n_around]:
                if s != shape[k] and _meets(bounds[s], low, high):
                    close[n_close] = s
                    n_close += 1
            found[k] = _is_reached(
                points[k], normals[k], shoulders, first, low_xy, planes, start, close[:n_close], tree
            )  # fmt: skip
    return found


@numba.njit(cache=True)
def _meets(bounds: FloatArray, low: FloatArray, high: FloatArray) -> bool:
    apart = False
    for axis in range(3):
        apart |= bounds[0, axis] >= high[axis] or bounds[1, axis] <= low[axis]
    return not apart


@numba.njit(cache=True)
def _is_reached(
    point: FloatArray, normal: FloatArray, shoulders: FloatArray, first: IntArray, low_xy: FloatArray,
    planes: FloatArray, start: IntArray, close: IntArray, tree: TriangleTree | None,
) -> bool:  # fmt: skip
    """Whether a shoulder sees the point from before its face within reach, past the solids ``close`` to it and the
    triangles of the tree.
    """
    origin, end = np.empty(3), point + END_M * normal
    last = 0  # the solid that cut the last line, likely to cut the next
    for s in close:
        if cuts(planes, start[s], start[s + 1], end, end):
            return False
    i0, i1 = _window(point[0] - low_xy[0], first.shape[0])
    j0, j1 = _window(point[1] - low_xy[1], first.shape[1] - 1)
    for i in range(i0, i1):
        for s in range(first[i, j0], first[i, j1]):
            x, y, z = shoulders[s, 0] - point[0], shoulders[s, 1] - point[1], shoulders[s, 2] - point[2]
            square = x * x + y * y + z * z
            if square > (REACH_M + SLACK_M) ** 2 or x * normal[0] + y * normal[1] + z * normal[2] <= SLACK_M:
                continue
            share = END_M / np.sqrt(square)
            origin[0], origin[1], origin[2] = shoulders[s, 0], shoulders[s, 1], shoulders[s, 2]
            end[0], end[1], end[2] = point[0] + share * x, point[1] + share * y, point[2] + share * z
            if len(close) and cuts(planes, start[close[last]], start[close[last] + 1], origin, end):
                continue
            free = True
            for n in range(len(close)):
                if cuts(planes, start[close[n]], start[close[n] + 1], origin, end):
                    free, last = False, n
                    break
            if free and tree is not None:
                free = not is_cut(tree, origin, end)
            if free:
                return True
    return False


@numba.njit(cache=True)
def _window(at: float, count: int) -> tuple[int, int]:
    """Bins first .. stop - 1 that hold what lies within reach along one axis."""
    first = int(np.floor((at - REACH_M) / BIN_M))
    stop = int(np.floor((at + REACH_M) / BIN_M)) + 1
    return min(max(first, 0), count), min(max(stop, 0), count)
