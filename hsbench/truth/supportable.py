"""What can carry a small thing: upper sides with a clear square and room above.

Our default: a point of a face tilted by at most 15 degrees and .2-1.6 m high that lies in a square of .1 x .1 m on that
face with .1 m free above. Squares are tried in steps of 2.5 cm about the point, and tested exactly.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.truth.obstacles import Box, Obstacles, Shapes, box_hits
from hsbench.truth.surfaces import SLACK_M, Patches
from hsbench.typing import BoolArray, FloatArray, IntArray

HEIGHT_M = (0.2, 1.6)
SIDE_M = 0.1
ROOM_M = 0.1
OFFSETS_M = (0.0, -0.025, 0.025, -0.05, 0.05)


def supports(patches: Patches, obstacles: Obstacles) -> BoolArray:
    """(P,) bool: a small thing can stand on the patch, over its point."""
    z = patches.point[:, 2]
    wanted = patches.faces_up & (z >= HEIGHT_M[0] - SLACK_M) & (z <= HEIGHT_M[1] + SLACK_M)
    shapes = obstacles.picked(np.arange(len(obstacles)))
    return np.asarray(_clear_squares(patches, wanted, shapes))


@numba.njit(cache=True)
def _clear_squares(patches: Patches, wanted: BoolArray, shapes: Shapes) -> BoolArray:
    """(P,) bool: a wanted patch's point lies in a square on its face with free room above."""
    clear = np.zeros(len(wanted), dtype=np.bool_)
    above = np.empty(len(shapes.bounds), dtype=np.int64)
    count, listed = 0, -1
    for k in range(len(wanted)):
        if not wanted[k]:
            continue
        f = patches.face[k]
        part = patches.part[f]
        if part != listed:
            listed, count = part, 0
            low, high = shapes.bounds[part, 0], shapes.bounds[part, 1]
            for s in range(len(shapes.bounds) - 1):
                apart = shapes.bounds[s, 0, 2] >= high[2] + ROOM_M or shapes.bounds[s, 1, 2] <= low[2]
                for axis in range(2):
                    apart |= shapes.bounds[s, 0, axis] >= high[axis] or shapes.bounds[s, 1, axis] <= low[axis]
                if not apart and s != part:
                    above[count] = s
                    count += 1
        along = patches.half[f, 0]
        clear[k] = _has_clear_square(patches.point[k], patches.normal[f], along, part, shapes, above[:count])
    return clear


@numba.njit(cache=True)
def _has_clear_square(
    point: FloatArray, normal: FloatArray, along: FloatArray, part: int, shapes: Shapes, above: IntArray
) -> bool:
    length = np.sqrt(along[0] ** 2 + along[1] ** 2)
    x, y = along[0] / length, along[1] / length
    ahead, left = point[0] * x + point[1] * y, point[1] * x - point[0] * y
    half = SIDE_M / 2
    pole = Box(x, y, (ahead, ahead), (left, left), (point[2], point[2] + ROOM_M))
    if box_hits(shapes, above, pole):  # then so does every square about the point
        return False
    for i in OFFSETS_M:
        for j in OFFSETS_M:
            a, b = (ahead + i - half, ahead + i + half), (left + j - half, left + j + half)
            highest = _highest_on_part(point, normal, x, y, a, b, part, shapes)
            if np.isnan(highest):
                continue
            if not box_hits(shapes, above, Box(x, y, a, b, (highest, highest + ROOM_M))):
                return True
    return False


@numba.njit(cache=True)
def _highest_on_part(
    point: FloatArray, normal: FloatArray, x: float, y: float, ahead: tuple[float, float], left: tuple[float, float],
    part: int, shapes: Shapes,
) -> float:  # fmt: skip
    """Largest z of a rectangle's corners laid on a face; NaN if one lies beside the part."""
    highest = -np.inf
    for a in ahead:
        for b in left:
            dx, dy = a * x - b * y - point[0], a * y + b * x - point[1]
            z = point[2] - (normal[0] * dx + normal[1] * dy) / normal[2]
            for p in range(shapes.start[part, 0], shapes.start[part + 1, 0]):
                plane = shapes.planes[p]
                if plane[0] * (point[0] + dx) + plane[1] * (point[1] + dy) + plane[2] * z > plane[3] + SLACK_M:
                    return np.nan
            highest = max(highest, z)
    return highest
