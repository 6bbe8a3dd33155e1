"""Shortest walks over a ``WalkMap``: Dijkstra on its free cells, then pulled straight and rounded within them.

Step costs are whole numbers and ties go to the smaller cell index, so that a route is the same on every machine. Every
point of a route lies in a free cell, and so does every place within ``TOUCH_M`` of it.
"""

from __future__ import annotations

import heapq
import itertools

import numba
import numpy as np

from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray, IntArray

STRAIGHT_COST = 10  # of a step to a side neighbour; a diagonal one costs 14: 10 sqrt(2), rounded
DIAGONAL_COST = 14
UNREACHED = np.iinfo(np.int64).max
TOUCH_M = 1e-3  # a route keeps this far inside its free cells
CORNER_CUTS_M = (0.6, 0.35, 0.2, 0.1)  # how early a corner is cut; the first that stays in free cells is taken
CORNER_POINTS = 9  # of a rounded corner


def costs_from(walk: WalkMap, start_xy: FloatArray) -> tuple[IntArray, IntArray]:
    """(2,) start -> ((nx, ny) int64 cost, (nx, ny) int64 flat index of the cell before).

    Cost is in tenths of a cell, ``UNREACHED`` where no way leads; nothing is reached from a start that is not free.
    A diagonal step needs both cells beside it free.
    """
    index, inside = walk.index(np.asarray(start_xy, dtype=np.float64).reshape(1, 2))
    start = int(index[0, 0] * walk.free.shape[1] + index[0, 1]) if inside[0] else -1
    return _dijkstra(np.ascontiguousarray(walk.free), start)


def route(walk: WalkMap, start_xy: FloatArray, goal_xy: FloatArray) -> FloatArray | None:
    """(2,) start and (2,) goal -> (n, 2) points of a smooth walk between them, or None where no way leads.

    The first point is the start; the last is the goal.
    """
    return route_from(walk, costs_from(walk, start_xy), start_xy, goal_xy)


def route_from(
    walk: WalkMap, costs: tuple[IntArray, IntArray], start_xy: FloatArray, goal_xy: FloatArray
) -> FloatArray | None:
    """As ``route``, with the ``costs_from`` of the start at hand."""
    cost, before = costs
    start_xy, goal_xy = np.asarray(start_xy, dtype=np.float64), np.asarray(goal_xy, dtype=np.float64)
    index, inside = walk.index(goal_xy[None])
    if not inside[0] or cost[tuple(index[0])] == UNREACHED:
        return None
    cells = _trace(before, int(index[0, 0] * walk.free.shape[1] + index[0, 1]))
    centres = walk.origin_xy + (np.stack(np.divmod(cells, walk.free.shape[1]), axis=-1) + 0.5) * walk.cell_m
    points = np.concatenate([start_xy[None], centres, goal_xy[None]])
    return round_corners(walk, pull_straight(walk, points))


def clear(walk: WalkMap, a_xy: FloatArray, b_xy: FloatArray) -> bool:
    """Whether all places within ``TOUCH_M`` of the segment from a to b (2,) lie in free cells."""
    low = np.stack([a_xy, b_xy]) - walk.origin_xy
    return bool(_clear(walk.free, low / walk.cell_m, TOUCH_M / walk.cell_m))


def pull_straight(walk: WalkMap, points: FloatArray) -> FloatArray:
    """(n, 2) a way over free cells -> (m, 2) the fewest of its points that still see each other, ends included."""
    scaled = np.ascontiguousarray((points - walk.origin_xy) / walk.cell_m)
    return np.asarray(points[_pull(walk.free, scaled, TOUCH_M / walk.cell_m)])


def round_corners(walk: WalkMap, points: FloatArray) -> FloatArray:
    """(m, 2) corners -> (n, 2) the same way with each corner replaced by a parabola where that stays in free cells."""
    if len(points) < 3:
        return points
    share = np.linspace(0.0, 1.0, CORNER_POINTS)[:, None]
    parts = [points[:1]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        to_before, to_after = before - corner, after - corner
        room = min(float(np.hypot(*to_before)), float(np.hypot(*to_after))) / 2
        rounded = corner[None]
        for cut_m in CORNER_CUTS_M:
            cut = min(cut_m, room)
            enter, leave = (corner + cut * v / max(float(np.hypot(*v)), TOUCH_M) for v in (to_before, to_after))
            curve = (1 - share) ** 2 * enter + 2 * share * (1 - share) * corner + share**2 * leave
            if all(clear(walk, a, b) for a, b in itertools.pairwise(curve)):
                rounded = curve
                break
        parts.append(rounded)
    return np.concatenate([*parts, points[-1:]])


def nearest_free(walk: WalkMap, xy: FloatArray, within_m: float = np.inf) -> tuple[FloatArray, float] | None:
    """(2,) point -> ((2,) centre of the nearest free cell, metres to it), or None if there is none so near."""
    xy = np.asarray(xy, dtype=np.float64)
    low, high = np.zeros(2, dtype=np.int64), np.array(walk.free.shape)
    if np.isfinite(within_m):
        low = np.maximum(np.floor((xy - within_m - walk.origin_xy) / walk.cell_m).astype(np.int64), 0)
        high = np.clip(np.ceil((xy + within_m - walk.origin_xy) / walk.cell_m).astype(np.int64), 0, high)
    free = walk.free[low[0] : high[0], low[1] : high[1]]
    if not free.any():
        return None
    x, y = (walk.origin_xy[a] + (low[a] + np.arange(free.shape[a]) + 0.5) * walk.cell_m for a in range(2))
    away = np.round(np.sqrt((x[:, None] - xy[0]) ** 2 + (y[None] - xy[1]) ** 2), 6)
    away[~free] = np.inf
    i, j = np.unravel_index(int(np.argmin(away)), away.shape)
    return (np.array([x[i], y[j]]), float(away[i, j])) if away[i, j] <= within_m else None


@numba.njit(cache=True)
def _dijkstra(free: BoolArray, start: int) -> tuple[IntArray, IntArray]:
    nx, ny = free.shape
    cost = np.full((nx, ny), UNREACHED, dtype=np.int64)
    before = np.full((nx, ny), -1, dtype=np.int64)
    if start < 0 or not free[start // ny, start % ny]:
        return cost, before
    cost[start // ny, start % ny] = 0
    heap = [(np.int64(0), np.int64(start))]
    while len(heap) > 0:
        so_far, cell = heapq.heappop(heap)
        i, j = cell // ny, cell % ny
        if so_far > cost[i, j]:
            continue
        for di in range(-1, 2):
            for dj in range(-1, 2):
                k, m = i + di, j + dj
                if (di == 0 and dj == 0) or k < 0 or m < 0 or k >= nx or m >= ny or not free[k, m]:
                    continue
                step = STRAIGHT_COST
                if di != 0 and dj != 0:
                    if not (free[i, m] and free[k, j]):
                        continue
                    step = DIAGONAL_COST
                if so_far + step < cost[k, m]:
                    cost[k, m] = so_far + step
                    before[k, m] = cell
                    heapq.heappush(heap, (np.int64(so_far + step), np.int64(k * ny + m)))
    return cost, before


def _trace(before: IntArray, goal: int) -> IntArray:
    """(n,) flat cells from the start to the goal."""
    cells = [goal]
    flat = before.ravel()
    while flat[cells[-1]] >= 0:
        cells.append(int(flat[cells[-1]]))
    return np.array(cells[::-1], dtype=np.int64)


@numba.njit(cache=True)
def _pull(free: BoolArray, points: FloatArray, margin: float) -> IntArray:
    kept = np.empty(len(points), dtype=np.int64)
    kept[0] = 0
    count, at = 1, 0
    pair = np.empty((2, 2))
    while at < len(points) - 1:
        following = at + 1
        for ahead in range(len(points) - 1, at + 1, -1):
            pair[0], pair[1] = points[at], points[ahead]
            if _clear(free, pair, margin):
                following = ahead
                break
        kept[count] = following
        count += 1
        at = following
    return kept[:count]


@numba.njit(cache=True)
def _clear(free: BoolArray, pair: FloatArray, margin: float) -> bool:
    """Whether a segment (2, 2), in cells, moved by +-margin along both axes, meets free cells only."""
    for sx in (-margin, margin):
        for sy in (-margin, margin):
            if not _line_clear(free, pair[0, 0] + sx, pair[0, 1] + sy, pair[1, 0] + sx, pair[1, 1] + sy):
                return False
    return True


@numba.njit(cache=True)
def _line_clear(free: BoolArray, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Grid traversal after Amanatides & Woo (1987): every cell the segment passes is free."""
    nx, ny = free.shape
    i, j = int(np.floor(x0)), int(np.floor(y0))
    i_end, j_end = int(np.floor(x1)), int(np.floor(y1))
    dx, dy = x1 - x0, y1 - y0
    step_i = 1 if dx > 0 else -1
    step_j = 1 if dy > 0 else -1
    next_x = np.inf if dx == 0 else ((i + (1 if dx > 0 else 0)) - x0) / dx
    next_y = np.inf if dy == 0 else ((j + (1 if dy > 0 else 0)) - y0) / dy
    per_x = np.inf if dx == 0 else abs(1.0 / dx)
    per_y = np.inf if dy == 0 else abs(1.0 / dy)
    for _ in range(abs(i_end - i) + abs(j_end - j) + 1):
        if i < 0 or j < 0 or i >= nx or j >= ny or not free[i, j]:
            return False
        if next_x < next_y:
            next_x += per_x
            i += step_i
        else:
            next_y += per_y
            j += step_j
    return True
