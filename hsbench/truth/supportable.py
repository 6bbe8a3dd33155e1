"""What can carry a small thing: upper sides with a clear square and room above.

Our default: a point of a face tilted by at most 15 degrees and .2-1.6 m high that lies in a square of .1 x .1 m on that
face with .1 m free above. Squares are tried in steps of 2.5 cm about the point, and tested exactly.

On a mesh the square runs along the axes of the object and may span several triangles. It rests on the highest of its
corners and middle, none of which is more than ``RELIEF_M`` beside the plane of the point's triangle; what of the part
itself rises less than that above it is no hindrance.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.geometry.triangle_rays import nearest
from hsbench.schema.scene import Scene
from hsbench.truth.obstacles import Box, Obstacles, Shapes, box_hits, is_within
from hsbench.truth.surfaces import SLACK_M, Patches
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

HEIGHT_M = (0.2, 1.6)
SIDE_M = 0.1
ROOM_M = 0.1
STEP_M = 0.025
OFFSETS = (0, -1, 1, -2, 2)  # of the middle of a square from the point, in steps
REACH = 4  # of its corners, in steps
RELIEF_M = 0.02
DOWN = np.array([0.0, 0.0, -1.0])


def supports(scene: Scene, patches: Patches, obstacles: Obstacles) -> BoolArray:
    """(P,) bool: a small thing can stand on the patch, over its point."""
    z = patches.point[:, 2]
    wanted = patches.faces_up & (z >= HEIGHT_M[0] - SLACK_M) & (z <= HEIGHT_M[1] + SLACK_M)
    shapes = obstacles.picked(np.arange(len(obstacles)))
    index = np.flatnonzero(wanted)
    owner, along = patches.owner[index], patches.half[patches.face[index], 0, :2]
    on_mesh = obstacles.triangle[owner]
    axes = np.array([item.scene_T_object[:2, 0] for item in scene.objects]).reshape(-1, 2)
    along[on_mesh] = axes[obstacles.object_index[owner[on_mesh]]]
    along /= np.sqrt((along**2).sum(axis=1))[:, None]
    relief = _relief(patches, index[on_mesh], along[on_mesh], obstacles)
    clear = np.zeros(len(wanted), dtype=np.bool_)
    clear[index] = _clear_squares(patches, index, along, obstacles.part, relief, shapes)
    return clear


def _relief(patches: Patches, chosen: IntArray, along: FloatArray, obstacles: Obstacles) -> FloatArray:
    """(C, 9, 9) how high the part lies above the plane of a patch's triangle, on a lattice about its point, ``along`` a
    unit vector (C, 2) and its left; NaN where nowhere near. chosen: (C,) patches.
    """
    normal = patches.normal[patches.face[chosen]]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    steps = STEP_M * np.arange(-REACH, REACH + 1)
    beside = steps[:, None, None] * along[:, None, None] + steps[:, None] * across[:, None, None]
    rise = -np.einsum("pijk,pk->pij", beside, normal[:, :2]) / normal[:, 2, None, None]
    start = np.concatenate([beside, rise[..., None] + RELIEF_M], axis=-1) + patches.point[chosen][:, None, None]
    part = np.broadcast_to(obstacles.part[patches.owner[chosen]][:, None, None], rise.shape).reshape(-1)
    depth = nearest(obstacles.tree, start.reshape(-1, 3), np.tile(DOWN, (part.size, 1)), 0.0, part, 2 * RELIEF_M)
    return np.where(np.isfinite(depth), RELIEF_M - depth, np.nan).reshape(rise.shape)


@numba.njit(cache=True)
def _clear_squares(
    patches: Patches, chosen: IntArray, along: FloatArray, part: Int32Array, relief: FloatArray, shapes: Shapes
) -> BoolArray:
    """(C,) bool: a chosen patch's point lies in a square on its face with free room above. part: (S,) of each shape."""
    clear = np.zeros(len(chosen), dtype=np.bool_)
    lists = np.empty((3, len(part)), dtype=np.int64)
    others, own, over = lists[0], lists[1], lists[2]
    n_others, n_own, n_over, listed, on_mesh = 0, 0, 0, -1, 0
    for k in range(len(chosen)):
        f = patches.face[chosen[k]]
        shape = patches.shape[f]
        is_flat = shapes.start[shape + 1, 1] - shapes.start[shape, 1] == 3
        if shape != listed:
            listed, n_others, n_own, n_over = shape, 0, 0, 0
            low, high = shapes.bounds[shape, 0], shapes.bounds[shape, 1]
            margin = REACH * STEP_M if is_flat else 0.0
            for s in range(len(part)):
                apart = shapes.bounds[s, 1, 2] <= low[2]
                for axis in range(2):
                    apart |= shapes.bounds[s, 0, axis] >= high[axis] + margin
                    apart |= shapes.bounds[s, 1, axis] <= low[axis] - margin
                if apart or s == shape:
                    continue
                if shapes.wall[s]:
                    over[n_over] = s
                    n_over += 1
                if shapes.bounds[s, 0, 2] >= high[2] + ROOM_M + margin:
                    continue
                if part[s] == part[shape]:
                    own[n_own] = s
                    n_own += 1
                else:
                    others[n_others] = s
                    n_others += 1
        heights = relief[on_mesh : on_mesh + is_flat]
        on_mesh += is_flat
        clear[k] = _has_clear_square(
            patches.point[chosen[k]],
            patches.normal[f],
            along[k],
            shape,
            heights,
            shapes,
            others[:n_others],
            own[:n_own],
            over[:n_over],
        )
    return clear


@numba.njit(cache=True)
def _has_clear_square(
    point: FloatArray, normal: FloatArray, along: FloatArray, shape: int, heights: FloatArray, shapes: Shapes,
    others: IntArray, own: IntArray, over: IntArray,
) -> bool:  # fmt: skip
    """heights: (1, 9, 9) relief of a mesh part about the point, (0, 9, 9) on a solid."""
    x, y = along[0], along[1]
    ahead, left = point[0] * x + point[1] * y, point[1] * x - point[0] * y
    half = SIDE_M / 2
    pole = Box(x, y, (ahead, ahead), (left, left), (point[2], point[2] + ROOM_M))
    if box_hits(shapes, others, pole):  # then so does every square about the point
        return False
    for i in OFFSETS:
        for j in OFFSETS:
            u, v = ahead + i * STEP_M, left + j * STEP_M
            a, b = (u - half, u + half), (v - half, v + half)
            if len(heights):
                highest = _highest_on_mesh(point, normal, x, y, i, j, heights[0])
            else:
                highest = _highest_on_solid(point, normal, x, y, a, b, shape, shapes)
            if np.isnan(highest):
                continue
            room, upper = (highest, highest + ROOM_M), (highest + RELIEF_M, highest + ROOM_M)
            if box_hits(shapes, others, Box(x, y, a, b, room)) or box_hits(shapes, own, Box(x, y, a, b, upper)):
                continue
            if not is_within(shapes, over, Box(x, y, a, b, room)):
                return True
    return False


@numba.njit(cache=True)
def _highest_on_mesh(
    point: FloatArray, normal: FloatArray, x: float, y: float, i: int, j: int, heights: FloatArray
) -> float:
    """Largest z of a mesh under the corners and the middle of a square; NaN if one lies beside it."""
    highest = -np.inf
    for di, dj in ((0, 0), (-2, -2), (-2, 2), (2, -2), (2, 2)):
        p, q = i + di, j + dj
        dx, dy = (p * x - q * y) * STEP_M, (p * y + q * x) * STEP_M
        rise = heights[REACH + p, REACH + q]
        if np.isnan(rise):
            return np.nan
        highest = max(highest, point[2] - (normal[0] * dx + normal[1] * dy) / normal[2] + rise)
    return highest


@numba.njit(cache=True)
def _highest_on_solid(
    point: FloatArray, normal: FloatArray, x: float, y: float, ahead: tuple[float, float], left: tuple[float, float],
    shape: int, shapes: Shapes,
) -> float:  # fmt: skip
    """Largest z of a rectangle's corners laid on a face; NaN if one lies beside the solid."""
    highest = -np.inf
    for a in ahead:
        for b in left:
            dx, dy = a * x - b * y - point[0], a * y + b * x - point[1]
            z = point[2] - (normal[0] * dx + normal[1] * dy) / normal[2]
            for p in range(shapes.start[shape, 0], shapes.start[shape + 1, 0]):
                plane = shapes.planes[p]
                if plane[0] * (point[0] + dx) + plane[1] * (point[1] + dy) + plane[2] * z > plane[3] + SLACK_M:
                    return np.nan
            highest = max(highest, z)
    return highest
