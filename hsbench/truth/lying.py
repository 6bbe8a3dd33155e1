"""Where one can lie: mattresses, and seats of one object side by side, with room for a body.

Our default, in the manner of task affordance-topdown's rule for seats: the surface holds a rectangle of 1.6 x .5 m
along the object's length or width with .5 m free above, and a walkable cell lies within .7 m of it. Gaps of up to
``GAP_M`` between seats do not count, nor do parts of the object that rise at most ``BEDDING_M`` above the surface.
Rectangles are tried every 5 cm and tested exactly.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy.spatial import ConvexHull

from hsbench.schema.scene import Scene, SceneObject
from hsbench.truth.obstacles import Box, Obstacles, Shapes, box_hits, is_within
from hsbench.truth.sittable import APPROACH_M, BEDDING_M, SEAT_ROLES, approached, around
from hsbench.truth.tops import SLACK_M, Surface, surfaces
from hsbench.truth.walkable import WalkMap
from hsbench.typing import FloatArray, IntArray

LENGTH_M, WIDTH_M = 1.6, 0.5  # our defaults, all
HEAD_ROOM_M = 0.5
GAP_M = 0.06
STEP_M = 0.05
SAME_HEIGHT_M = 0.03


def lying_surfaces(scene: Scene, walk: WalkMap, obstacles: Obstacles) -> tuple[tuple[int, Surface], ...]:
    """(object index, surface) of all that one can lie on; ``walk.free`` are cells one can get to."""
    return tuple(
        (k, surface)
        for k, item in enumerate(scene.objects)
        if any(part.role in SEAT_ROLES for part in item.parts)
        for served, together in _groups(item, k, obstacles)
        if _holds_body(k, item, together, walk, obstacles)
        for surface in served
    )


def _groups(item: SceneObject, k: int, obstacles: Obstacles) -> list[tuple[list[Surface], list[Surface]]]:
    """Surfaces of an object that serve as one, and those they offer together: a mattress with what lies beside it
    at about its height (its bare end, pillows), and seats of one height.
    """
    found = [surface for j in range(len(item.parts)) for surface in surfaces(item, k, j, obstacles)]
    groups: list[tuple[list[Surface], list[Surface]]] = []
    for surface in found:
        role, height = item.parts[surface.part_index].role, surface.height_m
        if role == "mattress":
            beside = [other for other in found if other is not surface and abs(other.height_m - height) <= BEDDING_M]
            groups.append(([surface], [surface, *beside]))
        elif role == "seat" and not any(surface in served for served, _ in groups):
            level = [other for other in found if abs(other.height_m - height) <= SAME_HEIGHT_M]
            seats = [other for other in level if item.parts[other.part_index].role == "seat"]
            groups.append((seats, seats))
    return groups


def _holds_body(k: int, item: SceneObject, together: list[Surface], walk: WalkMap, obstacles: Obstacles) -> bool:
    outlines = [outline for surface in together for outline in surface.outlines]
    height = together[0].height_m
    corners = np.concatenate(outlines)
    start = np.cumsum([0, *map(len, outlines)])
    whole = np.ascontiguousarray(corners[ConvexHull(corners).vertices])
    shapes, stops = around(obstacles, k, APPROACH_M, height)
    for axis in range(2):
        along = item.scene_T_object[:2, axis] / np.linalg.norm(item.scene_T_object[:2, axis])
        middles = _free_rectangles(shapes, stops[1], corners, start, whole, height, along)
        if approached(walk, shapes, obstacles.tree, middles, along, (LENGTH_M, WIDTH_M), height).any():
            return True
    return False


@numba.njit(cache=True)
def _free_rectangles(
    shapes: Shapes, stop: int, corners: FloatArray, start: IntArray, whole: FloatArray, height: float, along: FloatArray
) -> FloatArray:
    """(K, 2) middles of the rectangles along a unit vector that the surfaces hold and the first shapes leave free.

    corners, start: outlines of the surfaces. whole: (H, 2) outline of all, counter-clockwise.
    """
    above = np.arange(stop)
    across = np.array([-along[1], along[0]])
    a, b = whole @ along, whole @ across
    spare_a, spare_b = a.max() - a.min() - LENGTH_M + SLACK_M, b.max() - b.min() - WIDTH_M + SLACK_M
    if spare_a < 0.0 or spare_b < 0.0:
        return np.empty((0, 2))
    na, nb = int(spare_a / STEP_M), int(spare_b / STEP_M)
    found = np.empty(((na + 1) * (nb + 1), 2))
    count = 0
    for i in range(na + 1):
        for j in range(nb + 1):
            u = (a.max() + a.min()) / 2 + (i - na / 2) * STEP_M
            v = (b.max() + b.min()) / 2 + (j - nb / 2) * STEP_M
            box = Box(
                along[0], along[1], (u - LENGTH_M / 2, u + LENGTH_M / 2), (v - WIDTH_M / 2, v + WIDTH_M / 2),
                (height, height + HEAD_ROOM_M),
            )  # fmt: skip
            held = _supported(box, corners, start, whole)
            if held and not box_hits(shapes, above, box) and not is_within(shapes, above, box):
                found[count] = u * along + v * across
                count += 1
    return found[:count].copy()


@numba.njit(cache=True)
def _supported(box: Box, corners: FloatArray, start: IntArray, whole: FloatArray) -> bool:
    """Whether a rectangle lies in the outline of all surfaces, and each of its points on one of them or in a gap."""
    for a in box.ahead:
        for b in box.left:
            if not _within(whole, a * box.x - b * box.y, a * box.y + b * box.x, SLACK_M):
                return False
    for i in range(int(LENGTH_M / STEP_M) + 1):
        for j in range(int(WIDTH_M / STEP_M) + 1):
            a, b = box.ahead[0] + i * STEP_M, box.left[0] + j * STEP_M
            held = False
            for k in range(len(start) - 1):
                outline = corners[start[k] : start[k + 1]]
                held |= _within(outline, a * box.x - b * box.y, a * box.y + b * box.x, GAP_M / 2)
            if not held:
                return False
    return True


@numba.njit(cache=True)
def _within(outline: FloatArray, x: float, y: float, margin: float) -> bool:
    """Whether a point lies in a convex counter-clockwise outline, or beyond its edges by no more than a margin."""
    for k in range(len(outline)):
        n = (k + 1) % len(outline)
        dx, dy = outline[n, 0] - outline[k, 0], outline[n, 1] - outline[k, 1]
        if dx * (y - outline[k, 1]) - dy * (x - outline[k, 0]) < -margin * np.sqrt(dx * dx + dy * dy):
            return False
    return True
