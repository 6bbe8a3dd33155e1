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
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numba
import numpy as np
from scipy.spatial import ConvexHull

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Scene, SceneObject
from hsbench.truth.obstacles import TOUCH_M, Box, Obstacles, Shapes, box_hits, cuts, hit_pairs, moved
from hsbench.truth.walkable import STEP_M, WalkMap, blocked
from hsbench.typing import BoolArray, FloatArray

SEAT_ROLES = ("seat", "mattress")
SEAT_HEIGHT_M = (0.25, 0.75)  # this and the next eight: task affordance-topdown
MAX_TILT_RAD = np.radians(15.0)
PATCH_M = 0.35
HEAD_ROOM_M = 0.85
LEGS_M = 0.35
LEGS_ABOVE_M = 0.1
APPROACH_M = 0.7
SHOULDER_STANDING_M = 1.4
SHOULDER_SEATED_M = 0.55
PULL_M = 0.8  # this and the next three: our defaults
THIGH_M = 0.15  # from back to hollow of the knee .5 m (ISO/TR 7250-2, adults) less the patch
THIGH_HEIGHT_M = 0.15
BEDDING_M = 0.12
BACKLESS = frozenset(("stool", "bar_stool", "bench", "ottoman", "piano"))
FRONT = ((0.0, -1.0),)
SIDES = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
STEP_ALONG_M = 0.01
STEP_BACK_M = 0.05
STEP_AHEAD_M = 0.005
STEP_PULL_M = 0.01
SLACK_M = 1e-6  # lengths that differ by less are equal, so that the last bits of a turn decide nothing

Stops: TypeAlias = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class SeatUse:
    """A part in use as a seat, facing one way. centres_xy: (K, 2) middles of free patches, after the pull.

    front_xy: (2,) unit vector faced. height_m: of the surface. pull_m: how far the object was moved against front_xy.
    """

    object_index: int
    part_index: int
    front_xy: FloatArray
    centres_xy: FloatArray
    height_m: float
    pull_m: float

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
        for use in _part_uses(k, j, item, walk, obstacles)
    )


def upper_outline(solid: ConvexSolid) -> tuple[FloatArray, float] | None:
    """((H, 2) counter-clockwise outline, height in m) of a solid's surface on top; None if it has none.

    The surface is the convex hull, seen from above, of the faces tilted by at most 15 degrees; its height the largest.
    """
    faces = solid.planes[solid.planes[:, 2] >= np.cos(MAX_TILT_RAD) - SLACK_M]
    on_top = (np.abs(solid.vertices @ faces[:, :3].T - faces[:, 3]) < SLACK_M).any(axis=1)
    corners = solid.vertices[on_top]
    if not len(corners):
        return None
    outline = corners[ConvexHull(corners[:, :2]).vertices, :2]
    return np.ascontiguousarray(outline), float(quantise_m(corners[:, 2].max()))


def around(obstacles: Obstacles, object_index: int, margin_m: float, height_m: float) -> tuple[Shapes, Stops]:
    """What may hinder the use of a surface of an object at a height, and where its kinds end.

    First other objects' parts within ``margin_m`` that do not lie flat on the floor, then the object's own parts that
    rise above the surface, then its others.
    """
    bounds = obstacles.shapes.bounds
    own = obstacles.of(object_index)
    low = bounds[own, 0].min(axis=0) - [margin_m, margin_m, 0.0]
    high = bounds[own, 1].max(axis=0) + [margin_m, margin_m, SHOULDER_STANDING_M]
    others = np.setdiff1d(obstacles.near(low, high), own)
    others = others[bounds[others, 1, 2] > STEP_M]
    bedding = bounds[own, 1, 2] <= height_m + BEDDING_M
    order = (others, own[~bedding], own[bedding])
    first, second, third = np.cumsum([len(part) for part in order]).tolist()
    return obstacles.picked(np.concatenate(order)), (first, second, third)


def approached(
    walk: WalkMap, shapes: Shapes, middles: FloatArray, along: FloatArray, size_m: tuple[float, float], height_m: float
) -> BoolArray:
    """(K, 2) middles of rectangles at a height, a unit vector (2,), sizes along and across it -> (K,) bool: the centre
    of a free cell lies within ``APPROACH_M``, and no shape between the shoulders of who stands there and who sits here.
    """
    half = (size_m[0] / 2, size_m[1] / 2)
    return np.asarray(_approached(walk.free, walk.origin_xy, walk.cell_m, shapes, middles, along, half, height_m))


def _part_uses(k: int, j: int, item: SceneObject, walk: WalkMap, obstacles: Obstacles) -> list[SeatUse]:
    surface = upper_outline(item.solids[j])
    if surface is None or not SEAT_HEIGHT_M[0] <= surface[1] <= SEAT_HEIGHT_M[1]:
        return []
    outline, height = surface
    shapes, stops = around(obstacles, k, APPROACH_M + (PULL_M if item.movable else 0.0), height)
    touching = hit_pairs(shapes, stops[0], stops[2])
    last = round(PULL_M / STEP_PULL_M) if item.movable else 0
    uses = []
    for front in _facings(item, item.parts[j].role):
        step = 0
        while step <= last:
            step, middles = _next_use(shapes, stops, touching, outline, height, front, step, last)
            pull = step * STEP_PULL_M
            if len(middles):
                x, y = -pull * front
                beside, around_it = _beside(walk, item, x, y), moved(shapes, stops[0], stops[2], x, y)
                middles = middles[approached(beside, around_it, middles, front, (PATCH_M, PATCH_M), height)]
            if len(middles):
                uses.append(SeatUse(k, j, front, middles, height, pull))
                last = step
                break
            step += 1
    return [use for use in uses if use.pull_m == uses[-1].pull_m]


def _facings(item: SceneObject, role: str | None) -> FloatArray:
    """(F, 2) directions in the scene frame that one may face on a seat or mattress of an object."""
    sides = SIDES if role == "mattress" or item.category_name in BACKLESS else FRONT
    facings = np.array(sides) @ item.scene_T_object[:2, :2].T
    return np.asarray(facings / np.sqrt((facings**2).sum(axis=1, keepdims=True)))


def _beside(walk: WalkMap, item: SceneObject, x: float, y: float) -> WalkMap:
    """The cells that stay free beside an object moved along the floor."""
    if x == y == 0.0:
        return walk
    return blocked(walk, [solid.transformed(planar(x, y, 0.0)) for solid in item.solids])


@numba.njit(cache=True)
def _approached(
    free: BoolArray, origin: FloatArray, cell: float, shapes: Shapes, middles: FloatArray, along: FloatArray,
    half: tuple[float, float], height: float,
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
                near[k] = not _is_cut(shapes, upright, seated)
    return near


@numba.njit(cache=True)
def _is_cut(shapes: Shapes, origin: FloatArray, end: FloatArray) -> bool:
    """Whether any shape but the scratch box meets the segment between two points (3,)."""
    for s in range(len(shapes.start) - 2):
        if cuts(shapes.planes, shapes.start[s, 0], shapes.start[s + 1, 0], origin, end):
            return True
    return False


@numba.njit(cache=True)
def _next_use(
    shapes: Shapes, stops: Stops, touching: BoolArray, outline: FloatArray, height: float,
    front: FloatArray, step: int, last: int,
) -> tuple[int, FloatArray]:  # fmt: skip
    """(pull in steps, (K, 2) middles of usable patches) of the first pull of ``step`` .. ``last`` with any; last + 1 if
    there is none or the seat is stuck.
    """
    none = np.empty((0, 2))
    for k in range(step, last + 1):
        x, y = -k * STEP_PULL_M * front
        pulled = moved(shapes, stops[0], stops[2], x, y)
        if k > 0 and (hit_pairs(pulled, stops[0], stops[2]) & ~touching).any():
            return last + 1, none
        middles = _usable_patches(pulled, stops, outline + np.array([x, y]), height, front)
        if len(middles):
            return k, middles
    return last + 1, none


@numba.njit(cache=True)
def _usable_patches(shapes: Shapes, stops: Stops, outline: FloatArray, height: float, front: FloatArray) -> FloatArray:
    """(K, 2) middles of the patches on a surface whose use is free facing ``front``, along the front edge."""
    half = PATCH_M / 2
    ahead, left = outline @ front, outline[:, 1] * front[0] - outline[:, 0] * front[1]
    edge, low, high = ahead.max(), left.min() + half, left.max() - half
    found = np.empty((0, 2))
    if high < low - SLACK_M:
        return found
    steps = 2 * max(1, int(np.ceil((high - low - SLACK_M) / (2 * STEP_ALONG_M))))  # even: the middle is one of them
    found = np.empty(((steps + 1) * (int(THIGH_M / STEP_BACK_M) + 2), 2))
    count = 0
    for k in range(steps + 1):
        across = low + (high - low) * k / steps
        rear, fore = _chord(ahead, left, across, half - SLACK_M)
        while fore >= rear and edge - fore - half <= THIGH_M + SLACK_M:
            if _is_usable(shapes, stops, front, fore, across, edge, height):
                found[count] = fore * front[0] - across * front[1], fore * front[1] + across * front[0]
                count += 1
            fore -= STEP_BACK_M
    return found[:count].copy()


@numba.njit(cache=True)
def _chord(ahead: FloatArray, left: FloatArray, across: float, inset: float) -> tuple[float, float]:
    """Extent along ``ahead``, at one value of ``left``, of what lies ``inset`` inside a counter-clockwise outline."""
    rear, fore = -np.inf, np.inf
    for k in range(len(ahead)):
        n = (k + 1) % len(ahead)
        x, y = left[n] - left[k], ahead[k] - ahead[n]  # outward normal
        length = np.sqrt(x * x + y * y)
        rest = x * ahead[k] + y * left[k] - inset * length - y * across
        if x > SLACK_M * length:
            fore = min(fore, rest / x)
        elif x < -SLACK_M * length:
            rear = max(rear, rest / x)
        elif rest < 0.0:
            fore = -np.inf
    return rear, fore


@numba.njit(cache=True)
def _is_usable(
    shapes: Shapes, stops: Stops, front: FloatArray, ahead: float, left: float, edge: float,
    height: float,
) -> bool:  # fmt: skip
    """Whether torso, thighs and legs have room; the legs as near to the surface's front edge as they fit."""
    x, y, half = front[0], front[1], PATCH_M / 2
    everything = np.arange(stops[2])
    above, across, fore = everything[: stops[1]], (left - half, left + half), ahead + half
    if box_hits(shapes, above, Box(x, y, (ahead - half, fore), across, (height, height + HEAD_ROOM_M))):
        return False
    knee = max(edge, fore)
    while knee <= fore + THIGH_M + SLACK_M:
        thigh = Box(x, y, (fore, knee), across, (height, height + THIGH_HEIGHT_M))
        if knee > fore + TOUCH_M and box_hits(shapes, above, thigh):
            return False
        if not box_hits(shapes, everything, Box(x, y, (knee, knee + LEGS_M), across, (LEGS_ABOVE_M, height))):
            return True
        knee += STEP_AHEAD_M
    return False
