"""Things to touch: points on functional parts that hands reach from a standing or a seated pose.

Task affordance-topdown: a hand reaches a point if it is within .75 m of the shoulder, 1.4 m above a walkable cell or
.55 m above a seat, with a free straight line. A touch is planned only where that holds and the own arm gets there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.mesh_contact import first_hit
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.motion import reach, reach_both
from hsbench.truth.walkable import WalkMap
from hsbench.typing import FloatArray

FLAT_ROLES = ("top", "shelf")
UPRIGHT_ROLES = ("handle", "door", "drawer", "screen", "front", "switch", "tap", "board")
TOP_HEIGHT_M = (0.4, 1.4)  # this and the next three: task affordance-topdown
REACH_M = 0.75
SHOULDER_STANDING_M = 1.4
SHOULDER_SEATED_M = 0.55
EDGE_INSET_M = 0.06  # a hand rests so far inside the edge of a top
ALONG_SHARES = (-0.35, 0.0, 0.35)  # places along an edge, as shares of its length
UPRIGHT_HEIGHT_M = (0.75, 1.25)  # where a hand takes a tall front
PREFERRED_M = 0.40  # horizontally from the cell to the point
HANDS_APART_M = 0.24  # two hands at work
LEANS_RAD = (0.03, 0.15, 0.30, 0.45, 0.60)
CROUCH_PER_RAD_M = 0.15
PAD_M = 0.015  # from the tip of a finger's bone to what it touches
HIT_M = 0.005  # a planned tip is so close to its point
SIGHT_GAP_M = 0.02  # the line of sight ends so far before the surface
GRAZE_M = 0.02  # by which a body may press into what is about it
WAY_GRAZE_M = 0.03  # and an arm on its way
WAY_FPS = 10.0
STILL_FPS = 1.0  # frames posed one by one: at this rate nothing is smoothed over time
OUTSIDE_M = 5.0  # far outside any part
SIDE_NAMES = ("left", "right")
DOWN = np.array([0.0, 0.0, -1.0])

SurfacePoint = tuple[FloatArray, FloatArray]
"""A point (3,) on a part and the horizontal direction (3,) from which a person comes."""


@dataclass(frozen=True)
class Touch:
    """One or two hands on one part. sides: 0 left, 1 right; points_m: (x, y, z) of each; how far the body bends."""

    object_id: int
    part: str
    sides: tuple[int, ...]
    points_m: tuple[tuple[float, float, float], ...]
    lean_rad: float
    crouch_m: float

    @property
    def contact(self) -> str:
        """The body parts in contact, as events name them."""
        return ",".join(f"hand_{SIDE_NAMES[side]}" for side in self.sides)

    @property
    def tips(self) -> tuple[int, ...]:
        """The joints that touch."""
        return tuple(J[f"hand_tip_{SIDE_NAMES[side]}"] for side in self.sides)


@dataclass(frozen=True)
class StandingTouch:
    """A touch and the free cell (x, y) and heading to stand in for it."""

    touch: Touch
    stand_xy: tuple[float, float]
    yaw_rad: float

    @property
    def line(self) -> FloatArray:
        """(2, 2) what one takes up: from the free cell to the hand."""
        return np.array([self.stand_xy, self.touch.points_m[0][:2]])


def is_touchable(item: SceneObject, part: Part) -> bool:
    """Whether a part is for hands: by its role, and tops and shelves by their height."""
    if part.role in UPRIGHT_ROLES:
        return True
    if part.role not in FLAT_ROLES:
        return False
    if part.solid is None:  # some of it may be of the right height
        return True
    top = apply(item.scene_T_object, part.vertices)[:, 2].max()
    return TOP_HEIGHT_M[0] <= float(quantise_m(top)) <= TOP_HEIGHT_M[1]


def standing_touch(
    item: SceneObject,
    part: Part,
    at: SurfacePoint,
    ways: tuple[tuple[int, ...], ...],
    body: Body,
    walk: WalkMap,
    obstacles: Obstacles,
) -> StandingTouch | None:
    """A touch of one point by someone who stands, in the first of some ways (hands) that works; None if none does."""
    point, outward = at
    cell = _cell_before(walk, point, outward)
    if cell is None:
        return None
    yaw = quantise_angle(float(np.arctan2(point[1] - cell[1], point[0] - cell[0])))
    eye = np.array([*cell, SHOULDER_STANDING_M])
    touch = plan_touch(item, part, point, eye, standing(body, cell, yaw), body, obstacles, ways)
    return None if touch is None else StandingTouch(touch, (float(cell[0]), float(cell[1])), yaw)


def seated_touch(
    item: SceneObject, part: Part, point: FloatArray, seated: Channels, body: Body, obstacles: Obstacles,
    used_id: int, ways: tuple[tuple[int, ...], ...],
) -> Touch | None:  # fmt: skip
    """A touch of a point (3,) by someone who sits on an object, ``seated`` being the frame before it, in the first of
    some ways (hands) that works; or None.
    """
    pelvis = np.array([*seated.xy[-1], seated.height[-1]])
    facing = np.array([np.cos(seated.yaw[-1]), np.sin(seated.yaw[-1]), 0.0])
    eye = pelvis + np.array([0.0, 0.0, SHOULDER_SEATED_M])
    if np.sum((point - eye) ** 2) > REACH_M**2 or np.dot(point - eye, facing) <= 0:
        return None
    return plan_touch(item, part, point, eye, seated, body, obstacles, ways, used_id)


def plan_touch(
    item: SceneObject, part: Part, point: FloatArray, eye: FloatArray, start: Channels, body: Body,
    obstacles: Obstacles, ways: tuple[tuple[int, ...], ...], used_id: int = -1,
) -> Touch | None:  # fmt: skip
    """The first of some ways (hands) and the least bend that bring finger tips to a point (3,) without running into
    anything; or None.
    """
    back = eye - point
    if obstacles.block(eye, point + SIGHT_GAP_M * back / np.sqrt(np.sum(back * back))):
        return None
    seated = float(start.seated[-1]) > 0
    left = np.array([-np.sin(start.yaw[-1]), np.cos(start.yaw[-1]), 0.0]) * HANDS_APART_M / 2
    for sides in ways:
        points = point[None] if len(sides) == 1 else quantise_m(np.stack([point + left, point - left]))
        bends = [(lean, 0.0 if seated else CROUCH_PER_RAD_M * lean) for lean in LEANS_RAD]
        tries = [Touch(item.object_id, part.name, sides, _tuples(points), *bend) for bend in bends]
        joints = pose(body, concatenate([reach_out(start, t, 1.0, STILL_FPS) for t in tries]), STILL_FPS, None)
        gap = np.sqrt(np.sum((joints[:, list(tries[0].tips)] - points) ** 2, axis=-1)).max(axis=1)
        good = (gap <= HIT_M) & (body_depth(obstacles, body, joints, used_id) <= GRAZE_M).all(axis=1)
        for k in np.flatnonzero(good).tolist():
            way = pose(body, reach_out(start, tries[k], 1.0, WAY_FPS), WAY_FPS, None)
            if (body_depth(obstacles, body, way, used_id) <= WAY_GRAZE_M).all():
                return tries[k]
    return None


def reaches(touch: Touch, start: Channels, body: Body, obstacles: Obstacles) -> bool:
    """Whether the hands get to their points from the frame ``start`` without running into anything."""
    joints = pose(body, reach_out(start, touch, 1.0, STILL_FPS), STILL_FPS, None)
    away = np.sum((joints[-1, list(touch.tips)] - touch.points_m) ** 2, axis=-1)
    return bool((away <= HIT_M**2).all() and (body_depth(obstacles, body, joints) <= GRAZE_M).all())


def reach_out(start: Channels, touch: Touch, duration_s: float, fps: float) -> Channels:
    """The motion of the hands to their points."""
    points = np.array(touch.points_m)
    if len(touch.sides) == 2:
        return reach_both(start, points, touch.lean_rad, touch.crouch_m, duration_s, fps)
    return reach(start, touch.sides[0], points[0], touch.lean_rad, touch.crouch_m, duration_s, fps)


def moved_touch(touch: Touch, shift_xy: FloatArray) -> Touch:
    """A touch of an object that has been moved along the floor."""
    return replace(touch, points_m=_tuples(quantise_m(np.array(touch.points_m) + np.append(shift_xy, 0.0))))


def grip_points(item: SceneObject) -> tuple[Part, list[FloatArray]]:
    """The highest part of an object, and points (3,) on it by which a hand draws it."""
    solids = [(float(part.vertices[:, 2].max()), part) for part in item.parts if part.solid is not None]
    part = max(solids, key=lambda s: s[0])[1]
    assert part.solid is not None
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    middle, size = (low + high) / 2, high - low
    axis = int(size[1] > size[0])
    points, solid = [], part.solid.transformed(item.scene_T_object)
    for along in ALONG_SHARES:
        local = middle.copy()
        local[axis] += along * size[axis]
        point = _entry(solid, apply(item.scene_T_object, local), DOWN)
        if point is not None:
            points.append(quantise_m(point - PAD_M * DOWN))
    return part, points


def touch_points(item: SceneObject, part: Part) -> list[SurfacePoint]:
    """Points on a part's surface worth a touch."""
    return list(_points(item, part) if part.solid is not None else _points_on_mesh(item, part))


def _tuples(points: FloatArray) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in points)


def _cell_before(walk: WalkMap, point: FloatArray, outward: FloatArray) -> FloatArray | None:
    """(2,) the free cell from which a point is best reached, or None."""
    across = REACH_M**2 - (SHOULDER_STANDING_M - point[2]) ** 2
    if across <= 0:
        return None
    reach = np.sqrt(across)
    low = np.maximum(np.floor((point[:2] - reach - walk.origin_xy) / walk.cell_m).astype(np.int64), 0)
    high = np.ceil((point[:2] + reach - walk.origin_xy) / walk.cell_m).astype(np.int64) + 1
    free = walk.free[low[0] : max(high[0], 0), low[1] : max(high[1], 0)]
    if not free.any():
        return None
    x, y = (walk.origin_xy[a] + (low[a] + np.arange(free.shape[a]) + 0.5) * walk.cell_m - point[a] for a in range(2))
    away = x[:, None] ** 2 + y[None] ** 2
    wanted = PREFERRED_M * outward[:2]
    liking = np.round((x[:, None] - wanted[0]) ** 2 + (y[None] - wanted[1]) ** 2, 6)
    liking[~free | (away > across)] = np.inf
    i, j = np.unravel_index(int(np.argmin(liking)), liking.shape)
    return np.array([x[i], y[j]]) + point[:2] if np.isfinite(liking[i, j]) else None


def _points(item: SceneObject, part: Part) -> Iterator[SurfacePoint]:
    assert part.solid is not None
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    middle, size = (low + high) / 2, high - low
    solid = part.solid.transformed(item.scene_T_object)
    fronts = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)) if part.role == "top" else ((0.0, -1.0),)
    for front in fronts:
        axis = int(abs(front[1]) > 0.5)
        outward = item.scene_T_object[:3, :3] @ np.array([*front, 0.0])
        for along in ALONG_SHARES:
            local = middle.copy()
            local[1 - axis] += along * size[1 - axis]
            if part.role in FLAT_ROLES:
                local[axis] += front[axis] * max(0.0, size[axis] / 2 - EDGE_INSET_M)
                way = DOWN
                point = _entry(solid, apply(item.scene_T_object, local), way)
            else:
                world = apply(item.scene_T_object, local)
                world[2] = np.clip(np.clip(world[2], *UPRIGHT_HEIGHT_M), *solid.bounds[:, 2] + (HIT_M, -HIT_M))
                way = -outward
                point = _entry(solid, world, way)
            if point is not None:
                yield quantise_m(point - PAD_M * way), outward


def _points_on_mesh(item: SceneObject, part: Part) -> Iterator[SurfacePoint]:
    """From above onto tops, at a hand's height from in front onto everything else."""
    low, high = part.vertices.min(axis=0), part.vertices.max(axis=0)
    middle, size = (low + high) / 2, high - low
    bottom, top = (
        apply(item.scene_T_object, part.vertices)[:, 2].min(),
        apply(item.scene_T_object, part.vertices)[:, 2].max(),
    )
    for front in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)) if part.role == "top" else ((0.0, -1.0),):
        axis = int(abs(front[1]) > 0.5)
        outward = item.scene_T_object[:3, :3] @ np.array([*front, 0.0])
        for along in ALONG_SHARES:
            local = middle.copy()
            local[1 - axis] += along * size[1 - axis]
            if part.role == "top":
                local[axis] += front[axis] * max(0.0, size[axis] / 2 - EDGE_INSET_M)
                way = DOWN
                through = apply(item.scene_T_object, local)
            else:
                through, way = apply(item.scene_T_object, local), -outward
                through[2] = np.clip(np.clip(through[2], *UPRIGHT_HEIGHT_M), bottom + HIT_M, top - HIT_M)
            point = first_hit(item, part, through - OUTSIDE_M * way, way)
            if point is not None and (part.role != "top" or TOP_HEIGHT_M[0] <= point[2] <= TOP_HEIGHT_M[1]):
                yield quantise_m(point - PAD_M * way), outward


def _entry(solid: ConvexSolid, through: FloatArray, direction: FloatArray) -> FloatArray | None:
    """Where a ray through a point (3,) along a unit direction enters a solid, or None."""
    origin = through - OUTSIDE_M * direction
    along = solid.planes[:, :3] @ direction
    gap = solid.planes[:, 3] - solid.planes[:, :3] @ origin
    facing, leaving = along < -1e-9, along > 1e-9
    if (gap[~facing & ~leaving] < 0).any():
        return None
    enter, leave = np.max(gap[facing] / along[facing]), np.min(gap[leaving] / along[leaving])
    return np.asarray(origin + enter * direction) if enter < leave else None
