"""Things to touch: points on functional parts that a hand reaches from a standing or a seated pose.

Task affordance-topdown: a hand reaches a point if it is within .75 m of the shoulder, 1.4 m above a walkable cell or
.55 m above a seat, with a free straight line. A touch is planned only where that holds and the own arm gets there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles, axis_points
from hsbench.synth.people.body import CAPSULE_JOINTS, Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.motion import reach
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

FLAT_ROLES = ("top", "shelf")
UPRIGHT_ROLES = ("handle", "door", "drawer", "screen", "front", "switch", "tap", "board")
TOP_HEIGHT_M = (0.4, 1.4)  # TASKS: work or support top
REACH_M = 0.75  # task affordance-topdown
SHOULDER_STANDING_M = 1.4
SHOULDER_SEATED_M = 0.55
EDGE_INSET_M = 0.06  # a hand rests so far inside the edge of a top
ALONG_SHARES = (-0.35, 0.0, 0.35)  # places along an edge, as shares of its length
UPRIGHT_HEIGHT_M = (0.75, 1.25)  # where a hand takes a tall front
PREFERRED_M = 0.40  # horizontally from the cell to the point
LEANS_RAD = (0.03, 0.15, 0.30, 0.45, 0.60)
CROUCH_PER_RAD_M = 0.15
HIT_M = 0.005  # a planned tip is so close to its point
SIGHT_GAP_M = 0.02  # the line of sight ends so far before the surface
FIT_MARGIN_M = 0.01
REACH_S = 0.8
STILL_FPS = 1.0  # frames posed one by one: at this rate nothing is smoothed over time
OUTSIDE_M = 5.0  # far outside any part
SIDE_NAMES = ("left", "right")


@dataclass(frozen=True)
class Touch:
    """One hand on one part: side 0 left, 1 right; the point (x, y, z); how far the body bends."""

    object_id: int
    part: str
    side: int
    point_m: tuple[float, float, float]
    lean_rad: float
    crouch_m: float

    @property
    def contact(self) -> str:
        """The body part in contact, as events name it."""
        return f"hand_{SIDE_NAMES[self.side]}"


@dataclass(frozen=True)
class StandingTouch:
    """A touch and the free cell (x, y) and heading to stand in for it."""

    touch: Touch
    stand_xy: tuple[float, float]
    yaw_rad: float


def touch_parts(scene: Scene) -> list[tuple[SceneObject, Part]]:
    """Parts with a functional role for hands; tops only at working heights."""
    chosen = []
    for item in scene.objects:
        for part in item.parts:
            if part.role in UPRIGHT_ROLES:
                chosen.append((item, part))
            elif part.role in FLAT_ROLES:
                top = apply(item.scene_T_object, part.vertices)[:, 2].max()
                if TOP_HEIGHT_M[0] <= float(quantise_m(top)) <= TOP_HEIGHT_M[1]:
                    chosen.append((item, part))
    return chosen


def find_touch(
    item: SceneObject, part: Part, body: Body, walk: WalkMap, reachable: BoolArray, obstacles: Obstacles,
    rng: np.random.Generator,
) -> StandingTouch | None:  # fmt: skip
    """A standing touch of the part, the first of its points in random order that works; or None."""
    points = list(_points(item, part))
    centres = walk.centres()
    usable = walk.free & reachable
    sides = (int(rng.integers(2)), 1)
    for index in rng.permutation(len(points)):
        point, outward = points[index]
        across = REACH_M**2 - (SHOULDER_STANDING_M - point[2]) ** 2
        away = np.sum((centres - point[:2]) ** 2, axis=-1)
        near = usable & (away <= across)
        if not near.any():
            continue
        liking = np.round(np.sum((centres - point[:2] - PREFERRED_M * outward[:2]) ** 2, axis=-1), 6)
        liking[~near] = np.inf
        cell = centres[np.unravel_index(int(np.argmin(liking)), liking.shape)]
        yaw = quantise_angle(float(np.arctan2(point[1] - cell[1], point[0] - cell[0])))
        start = standing(body, cell, yaw)
        eye = np.array([*cell, SHOULDER_STANDING_M])
        touch = plan_touch(item, part, point, eye, start, body, obstacles, sides)
        if touch is not None:
            return StandingTouch(touch, (float(cell[0]), float(cell[1])), yaw)
    return None


def find_seated_touch(
    item: SceneObject, part: Part, seated: Channels, body: Body, obstacles: Obstacles, rng: np.random.Generator
) -> Touch | None:
    """A touch of the part by someone who sits, ``seated`` being the frame before it; or None."""
    points = list(_points(item, part))
    pelvis = np.array([*seated.xy[-1], seated.height[-1]])
    facing = np.array([np.cos(seated.yaw[-1]), np.sin(seated.yaw[-1]), 0.0])
    eye = pelvis + np.array([0.0, 0.0, SHOULDER_SEATED_M])
    for index in rng.permutation(len(points)):
        point, _ = points[index]
        if np.sum((point - eye) ** 2) > REACH_M**2 or np.dot(point - eye, facing) <= 0:
            continue
        left = np.array([-facing[1], facing[0], 0.0])
        side = 0 if np.dot(point - eye, left) > 0 else 1
        touch = plan_touch(item, part, point, eye, seated, body, obstacles, (side, 1 - side))
        if touch is not None:
            return touch
    return None


def plan_touch(
    item: SceneObject, part: Part, point: FloatArray, eye: FloatArray, start: Channels, body: Body,
    obstacles: Obstacles, sides: tuple[int, ...],
) -> Touch | None:  # fmt: skip
    """The first hand and least bend that bring a finger tip to a point (3,) without touching anything else; or None."""
    back = eye - point
    if obstacles.block(eye, point + SIGHT_GAP_M * back / np.sqrt(np.sum(back * back))):
        return None
    seated = float(start.seated[-1]) > 0
    for side in sides:
        bends = [(lean, 0.0 if seated else CROUCH_PER_RAD_M * lean) for lean in LEANS_RAD]
        held = [reach(start, side, point, lean, crouch, 1.0, STILL_FPS) for lean, crouch in bends]
        joints = pose(body, concatenate(held), STILL_FPS, None)
        tip = joints[:, J[f"hand_tip_{SIDE_NAMES[side]}"]]
        hits = np.sqrt(np.sum((tip - point) ** 2, axis=1)) <= HIT_M
        others = [not any(n == f"hand_{SIDE_NAMES[side]}" for n in names) for names in CAPSULE_JOINTS]
        clear = ~obstacles.hold(axis_points(body, joints)[:, others], FIT_MARGIN_M).any(axis=(1, 2))
        if (hits & clear).any():
            lean, crouch = bends[int(np.argmax(hits & clear))]
            x, y, z = map(float, point)
            return Touch(item.object_id, part.name, side, (x, y, z), lean, crouch)
    return None


def _points(item: SceneObject, part: Part) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Points (3,) on the part's surface worth a touch, with the horizontal direction (3,) from which a person comes."""
    if part.solid is None:
        return
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
                point = _entry(solid, apply(item.scene_T_object, local), np.array([0.0, 0.0, -1.0]))
            else:
                world = apply(item.scene_T_object, local)
                world[2] = np.clip(np.clip(world[2], *UPRIGHT_HEIGHT_M), *solid.bounds[:, 2] + (HIT_M, -HIT_M))
                point = _entry(solid, world, -outward)
            if point is not None:
                yield quantise_m(point), outward


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
