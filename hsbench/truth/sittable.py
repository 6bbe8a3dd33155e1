"""Where one can sit: parts with the role seat or mattress whose use is free, by boxes a body fills.

Task affordance-topdown: a seat surface .25-.75 m high and tilted by at most 15 degrees has a clear patch of
.35 x .35 m with .85 m free above it, legs have a free box .35 m wide and deep in front, from .1 m up to the seat, and a
walkable cell lies within .7 m; a movable seat is moved to its use position first. What it leaves open is read so:

- The surface holds a disc .35 m across, so that round seats count; the free space above it is square.
- In front is the object's -y; where there is no back (``BACKLESS``, mattresses), any of its four sides.
- The legs come down at the surface's front edge or up to ``THIGH_M`` ahead of the patch, with room for thighs between.
- Parts of the object itself that rise at most ``BEDDING_M`` above the surface (duvet, pillow) are sat upon.
- The cell is walkable at t0 and with the seat in its use position. ``APPROACH_M`` counts from its centre to the nearest
  point of the patch, and the line between the shoulders of a body there, upright and seated, is free: no wall between.
- A movable seat is pulled straight back, as little as possible; on the way it hits nothing that it did not hit at t0.

Boxes are tested exactly; patches every centimetre along the front edge and at four depths, pulls every centimetre.
Surfaces of mesh parts are those of ``tops``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numba
import numpy as np

from hsbench.geometry.transforms import planar
from hsbench.geometry.triangle_rays import TriangleTree, is_cut
from hsbench.schema.scene import Scene, SceneObject
from hsbench.truth.obstacles import (
    TOUCH_M,
    Box,
    Obstacles,
    Shapes,
    box_hits,
    cuts,
    hit_pairs,
    is_within,
    moved,
    over_each_other,
)
from hsbench.truth.tops import PATCH_M as PATCH_M
from hsbench.truth.tops import SLACK_M, THIGH_M, Surface, places, surfaces
from hsbench.truth.walkable import STEP_M, WalkMap, blocked, blocked_by_body
from hsbench.typing import BoolArray, FloatArray

SEAT_ROLES = ("seat", "mattress")
SEAT_HEIGHT_M = (0.25, 0.75)  # this and the next six: task affordance-topdown
HEAD_ROOM_M = 0.85
LEGS_M = 0.35
LEGS_ABOVE_M = 0.1
APPROACH_M = 0.7
SHOULDER_STANDING_M = 1.4
SHOULDER_SEATED_M = 0.55
PULL_M = 0.8  # this and the next two: our defaults
THIGH_HEIGHT_M = 0.15
BEDDING_M = 0.12
BACKLESS = frozenset(("stool", "bar_stool", "bench", "ottoman", "piano"))
FRONT = ((0.0, -1.0),)
SIDES = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
STEP_AHEAD_M = 0.005
STEP_PULL_M = 0.01

Stops: TypeAlias = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class SeatUse:
    """A part in use as a seat, facing one way. centres_xy: (K, 2) middles of free patches, after the pull.

    surface: where it is at t0. front_xy: (2,) unit vector faced. pull_m: how far the object was moved against front_xy.
    """

    object_index: int
    surface: Surface
    front_xy: FloatArray
    centres_xy: FloatArray
    pull_m: float

    @property
    def part_index(self) -> int:
        """The part sat upon."""
        return self.surface.part_index

    @property
    def height_m(self) -> float:
        """Height of the surface."""
        return self.surface.height_m

    @property
    def shift_xy(self) -> FloatArray:
        """(2,) the move of the object from t0 to its use position."""
        return -self.pull_m * self.front_xy


def seat_uses(scene: Scene, walk: WalkMap, obstacles: Obstacles) -> tuple[SeatUse, ...]:
    """All ways of using every seat of a scene, each after the smallest pull; ``walk.free`` are cells one can get to.

    A part without an entry is not sittable.
    """
    return tuple(
        use
        for k, item in enumerate(scene.objects)
        for j, part in enumerate(item.parts)
        if part.role in SEAT_ROLES
        for surface in surfaces(item, k, j, obstacles)
        if SEAT_HEIGHT_M[0] <= surface.height_m <= SEAT_HEIGHT_M[1]
        for use in _surface_uses(k, surface, item, walk, obstacles)
    )


def around(obstacles: Obstacles, object_index: int, margin_m: float, height_m: float) -> tuple[Shapes, Stops]:
    """What may hinder the use of a surface of an object at a height, and where its kinds end.

    First other objects' parts within ``margin_m`` that do not lie flat on the floor, then the object's own parts that
    rise above the surface, then its others: shapes, so that the seat of a mesh is one thing and its back another.
    """
    bounds = obstacles.shapes.bounds
    own = obstacles.of(object_index)
    low = bounds[own, 0].min(axis=0) - [margin_m, margin_m, 0.0]
    high = bounds[own, 1].max(axis=0) + [margin_m, margin_m, SHOULDER_STANDING_M]
    if obstacles.wall.any():  # a closed piece is known by all that lies above a point
        high[2] = np.inf
    others = np.setdiff1d(obstacles.near(low, high), own)
    others = others[bounds[others, 1, 2] > STEP_M]
    bedding = bounds[own, 1, 2] <= height_m + BEDDING_M
    order = (others, own[~bedding], own[bedding])
    first, second, third = np.cumsum([len(part) for part in order]).tolist()
    return obstacles.picked(np.concatenate(order)), (first, second, third)


def approached(
    walk: WalkMap, shapes: Shapes, tree: TriangleTree, middles: FloatArray, along: FloatArray,
    size_m: tuple[float, float], height_m: float,
) -> BoolArray:  # fmt: skip
    """(K, 2) middles of rectangles at a height, a unit vector (2,), sizes along and across it -> (K,) bool: the centre
    of a free cell lies within ``APPROACH_M``, and no solid shape and no triangle of the tree between the shoulders of
    who stands there and who sits here.
    """
    half = (size_m[0] / 2, size_m[1] / 2)
    return np.asarray(_approached(walk.free, walk.origin_xy, walk.cell_m, shapes, tree, middles, along, half, height_m))


def _surface_uses(k: int, surface: Surface, item: SceneObject, walk: WalkMap, obstacles: Obstacles) -> list[SeatUse]:
    facings = [(front, places(surface, front)) for front in _facings(item, item.parts[surface.part_index].role)]
    if not any(len(on_surface) for _, on_surface in facings):
        return []
    shapes, stops = around(obstacles, k, APPROACH_M + (PULL_M if item.movable else 0.0), surface.height_m)
    touching = hit_pairs(shapes, stops[0], stops[2]) if item.movable else np.empty((0, 0), dtype=np.bool_)
    last = round(PULL_M / STEP_PULL_M) if item.movable else 0
    uses = []
    for front, on_surface in facings:
        step = 0
        while step <= last:
            step, middles = _next_use(shapes, stops, touching, on_surface, surface.height_m, front, step, last)
            pull = step * STEP_PULL_M
            if len(middles):
                shift = -pull * front
                beside, around_it = _beside(walk, k, shift, obstacles), moved(shapes, stops[0], stops[2], *shift)
                tree = obstacles.tree_moved(k, shift)
                near = approached(beside, around_it, tree, middles, front, (PATCH_M, PATCH_M), surface.height_m)
                middles = middles[near]
            if len(middles):
                uses.append(SeatUse(k, surface, front, middles, pull))
                last = step
                break
            step += 1
    return [use for use in uses if use.pull_m == uses[-1].pull_m]


def _facings(item: SceneObject, role: str | None) -> FloatArray:
    """(F, 2) directions in the scene frame that one may face on a seat or mattress of an object."""
    sides = SIDES if role == "mattress" or item.category_name in BACKLESS else FRONT
    facings = np.array(sides) @ item.scene_T_object[:2, :2].T
    return np.asarray(facings / np.sqrt((facings**2).sum(axis=1, keepdims=True)))


def _beside(walk: WalkMap, object_index: int, shift_xy: FloatArray, obstacles: Obstacles) -> WalkMap:
    """The cells that stay free beside an object moved along the floor."""
    if not shift_xy.any():
        return walk
    if object_index in obstacles.bodies:
        return blocked_by_body(walk, obstacles.bodies[object_index].shifted(shift_xy))
    solids = [solid for solid in obstacles.solids[object_index] if solid is not None]
    return blocked(walk, [solid.transformed(planar(shift_xy[0], shift_xy[1], 0.0)) for solid in solids])


@numba.njit(cache=True)
def _approached(
    free: BoolArray, origin: FloatArray, cell: float, shapes: Shapes, tree: TriangleTree, middles: FloatArray,
    along: FloatArray, half: tuple[float, float], height: float,
) -> BoolArray:  # fmt: skip
    near = np.zeros(len(middles), dtype=np.bool_)
    far = APPROACH_M + np.sqrt(half[0] ** 2 + half[1] ** 2)
    upright, seated = np.array([0.0, 0.0, SHOULDER_STANDING_M]), np.array([0.0, 0.0, height + SHOULDER_SEATED_M])
    for k in range(len(middles)):
        first_x, first_y = (middles[k] - far - origin) / cell
        last_x, last_y = (middles[k] + far - origin) / cell
        for i in range(max(0, int(first_x)), min(free.shape[0], int(last_x) + 1)):
            for j in range(max(0, int(first_y)), min(free.shape[1], int(last_y) + 1)):
                if near[k] or not free[i, j]:
                    continue
                upright[0], upright[1] = origin[0] + (i + 0.5) * cell, origin[1] + (j + 0.5) * cell
                x, y = upright[0] - middles[k, 0], upright[1] - middles[k, 1]
                ahead, left = x * along[0] + y * along[1], y * along[0] - x * along[1]
                u, v = min(max(ahead, -half[0]), half[0]), min(max(left, -half[1]), half[1])
                if (ahead - u) ** 2 + (left - v) ** 2 > (APPROACH_M + SLACK_M) ** 2:
                    continue
                seated[0] = middles[k, 0] + u * along[0] - v * along[1]
                seated[1] = middles[k, 1] + u * along[1] + v * along[0]
                near[k] = not _is_blocked(shapes, upright, seated) and not is_cut(tree, upright, seated)
    return near


@numba.njit(cache=True)
def _is_blocked(shapes: Shapes, origin: FloatArray, end: FloatArray) -> bool:
    """Whether any solid but the scratch box meets the segment between two points (3,)."""
    for s in range(len(shapes.start) - 2):
        if cuts(shapes.planes, shapes.start[s, 0], shapes.start[s + 1, 0], origin, end):
            return True
    return False


@numba.njit(cache=True)
def _next_use(
    shapes: Shapes, stops: Stops, touching: BoolArray, on_surface: FloatArray, height: float,
    front: FloatArray, step: int, last: int,
) -> tuple[int, FloatArray]:  # fmt: skip
    """(pull in steps, (K, 2) middles of usable patches) of the first pull of ``step`` .. ``last`` with any; last + 1 if
    there is none or the seat is stuck.
    """
    none = np.empty((0, 2))
    if len(on_surface) == 0:
        return last + 1, none
    for k in range(step, last + 1):
        pull = k * STEP_PULL_M
        pulled = moved(shapes, stops[0], stops[2], -pull * front[0], -pull * front[1])
        if k > 0 and (hit_pairs(pulled, stops[0], stops[2]) & ~touching).any():
            return last + 1, none
        middles = np.empty((len(on_surface), 2))
        count = 0
        for n in range(len(on_surface)):
            ahead, left, edge = on_surface[n, 0] - pull, on_surface[n, 1], on_surface[n, 2] - pull
            if _is_usable(pulled, stops, front, ahead, left, edge, height):
                middles[count] = ahead * front[0] - left * front[1], ahead * front[1] + left * front[0]
                count += 1
        if count:
            return k, middles[:count].copy()
    return last + 1, none


@numba.njit(cache=True)
def _is_usable(
    shapes: Shapes, stops: Stops, front: FloatArray, ahead: float, left: float, edge: float,
    height: float,
) -> bool:  # fmt: skip
    """Whether torso, thighs and legs have room; the legs as near to the surface's front edge as they fit."""
    x, y, half = front[0], front[1], PATCH_M / 2
    across, fore = (left - half, left + half), ahead + half
    knee = max(edge, fore)
    if knee > fore + THIGH_M + SLACK_M:  # no thigh is that long
        return False
    farthest = fore + THIGH_M + SLACK_M + LEGS_M
    everything = over_each_other(shapes, stops[2], Box(x, y, (ahead - half, farthest), across, (0.0, 0.0)))
    above = everything[: np.searchsorted(everything, stops[1])]
    torso = Box(x, y, (ahead - half, fore), across, (height, height + HEAD_ROOM_M))
    if box_hits(shapes, above, torso) or is_within(shapes, everything, torso):
        return False
    while knee <= fore + THIGH_M + SLACK_M:
        thigh = Box(x, y, (fore, knee), across, (height, height + THIGH_HEIGHT_M))
        if knee > fore + TOUCH_M and box_hits(shapes, above, thigh):
            return False
        legs = Box(x, y, (knee, knee + LEGS_M), across, (LEGS_ABOVE_M, height))
        if not box_hits(shapes, everything, legs) and not is_within(shapes, everything, legs):
            return True
        knee += STEP_AHEAD_M
    return False
