"""Seats: where a body fits on a part with the role seat or mattress, and from which free cell one gets there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles, axis_points
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, pose, standing
from hsbench.synth.people.motion import SeatPose, sit_down
from hsbench.synth.people.navigation import nearest_free
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

SEAT_ROLES = ("seat", "mattress")
SEAT_HEIGHT_M = (0.25, 0.75)  # task affordance-topdown
APPROACH_M = 0.7  # TASKS: a walkable cell within this of the front of the seat
PLACE_WIDTH_M = 0.55  # a person's width on a bench or sofa
DEEPEST_M = 0.36  # pelvis behind the front edge, at most
DEPTH_SHARE = 0.6  # of the seat's depth, at most
DEPTH_STEPS = (1.0, 0.8, 0.6, 0.4)
THIGH_DROP = 0.66  # of the thigh's length from hip to knee, at most: higher seats leave the feet hanging
EDGE_SLACK_M = 0.06  # a thigh may sink so far towards the seat's front edge
FEET_AHEAD_M = 0.03  # ankles before knees
FIT_MARGIN_M = 0.02  # air around a seated body's axes, other objects
CROSSING_SHARE = (0.05, 0.30)  # most of the axis points that may touch other things, and the seat, on the way down
SIT_DOWN_S = 1.2
SIT_DOWN_PER_M = 0.6  # slower if the seat is farther from the free cell
CHECK_FPS = 15.0
FRONTS: dict[str, tuple[tuple[float, float], ...]] = {
    "bed": ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0)),
    "stool": ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)),
    "bench": ((0.0, -1.0), (0.0, 1.0)),
}
"""Directions one may face on a seat, in the object frame, where it is not only its front."""
FRONT = ((0.0, -1.0),)
ANY_EDGE = FRONTS["stool"]


@dataclass(frozen=True)
class Seat:
    """A place to sit: object, part, the seated pose, and the free cell (x, y) from where one sits down."""

    object_id: int
    part: str
    pose: SeatPose
    approach_xy: tuple[float, float]
    sit_down_s: float


def seat_parts(scene: Scene) -> list[tuple[SceneObject, Part]]:
    """Parts one may sit on, by role and height."""
    parts = [(item, part) for item in scene.objects for part in item.parts if part.role in SEAT_ROLES]
    return [(item, part) for item, part in parts if SEAT_HEIGHT_M[0] <= _top(item, part) <= SEAT_HEIGHT_M[1]]


def ledge_parts(scene: Scene) -> list[tuple[SceneObject, Part]]:
    """Parts not meant for sitting whose edge one may sit on all the same: tops as low as seats."""
    parts = [(item, part) for item in scene.objects for part in item.parts if part.role == "top"]
    return [(item, part) for item, part in parts if SEAT_HEIGHT_M[0] <= _top(item, part) <= SEAT_HEIGHT_M[1]]


def find_seat(
    item: SceneObject, part: Part, body: Body, walk: WalkMap, reachable: BoolArray, obstacles: Obstacles,
    rng: np.random.Generator,
) -> Seat | None:  # fmt: skip
    """A place on the part where this body fits and that it can get to, the first of all in random order; or None."""
    places = list(_places(item, part, body))
    for index in rng.permutation(len(places)):
        seat_pose, feet_xy = places[index]
        cell = nearest_free(walk, feet_xy, reachable)
        if cell is None or cell[1] > APPROACH_M:
            continue
        duration_s = SIT_DOWN_S + SIT_DOWN_PER_M * cell[1]
        approach = (float(cell[0][0]), float(cell[0][1]))
        seat = Seat(item.object_id, part.name, seat_pose, approach, float(quantise_m(duration_s)))
        if _fits(seat, body, obstacles):
            return seat
    return None


def sit_on(start: Channels, seat: Seat, fps: float) -> Channels:
    """The motion from the seat's free cell onto it."""
    return sit_down(start, seat.pose, seat.sit_down_s, fps)


def _top(item: SceneObject, part: Part) -> float:
    return float(quantise_m(apply(item.scene_T_object, part.vertices)[:, 2].max()))


def _places(item: SceneObject, part: Part, body: Body) -> Iterator[tuple[SeatPose, FloatArray]]:
    """Seated poses on a part, and where their feet are (2,), without regard to anything else in the room."""
    low, high = part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0)
    middle, size = (low + high) / 2, high - low
    hip_z = _top(item, part) + body.radius(anatomy.RADIUS_BELLY[0])
    thigh, shank = body.of_stature(anatomy.THIGH), body.of_stature(anatomy.SHANK)
    upright_knee = body.of_stature(anatomy.SHANK + anatomy.ANKLE_HEIGHT)
    drop = float(np.clip(hip_z - upright_knee, -THIGH_DROP * thigh, THIGH_DROP * thigh))
    ahead = float(np.sqrt(thigh**2 - drop**2))
    ankle_z = max(hip_z - drop - shank, body.of_stature(anatomy.ANKLE_HEIGHT))
    ball_z = ankle_z - body.of_stature(anatomy.ANKLE_HEIGHT - anatomy.BALL_HEIGHT)
    fronts = FRONTS.get(item.category_name, FRONT) if part.role in SEAT_ROLES else ANY_EDGE
    for front in fronts:
        axis = int(abs(front[1]) > 0.5)  # the object axis one faces along
        depth, width = size[axis], size[1 - axis]
        count = max(1, int((width - PLACE_WIDTH_M) / PLACE_WIDTH_M) + 1)
        sideways = np.linspace(-1, 1, count) * (width - PLACE_WIDTH_M) / 2 if count > 1 else np.zeros(1)
        deepest = min(DEPTH_SHARE * depth, DEEPEST_M)
        if drop > 0:
            deepest = min(deepest, max(EDGE_SLACK_M * ahead / drop, EDGE_SLACK_M))
        for along in sideways:
            for share in DEPTH_STEPS:
                local = middle + np.array(front) * (depth / 2 - share * deepest)
                local[1 - axis] += along
                yield _seated(item, local, np.array(front), hip_z, ahead + FEET_AHEAD_M, ball_z, body)


def _seated(
    item: SceneObject, local_xy: FloatArray, front: FloatArray, hip_z: float, ahead_m: float, ball_z: float, body: Body
) -> tuple[SeatPose, FloatArray]:
    scene_T_object = item.scene_T_object
    pelvis = apply(scene_T_object, np.array([*local_xy, 0.0]))
    facing = scene_T_object[:2, :2] @ front
    yaw = quantise_angle(float(np.arctan2(facing[1], facing[0])))
    left = np.array([-facing[1], facing[0]])
    feet = pelvis[:2] + ahead_m * facing
    ball = feet + body.of_stature(anatomy.BALL_FORWARD) * facing
    sides = [quantise_m(ball + sign * body.hip_half_m * left) for sign in (1.0, -1.0)]
    balls = tuple((float(p[0]), float(p[1]), float(quantise_m(ball_z))) for p in sides)
    x, y = quantise_m(pelvis[:2])
    return SeatPose((float(x), float(y), float(quantise_m(hip_z))), yaw, (balls[0], balls[1])), feet


def _fits(seat: Seat, body: Body, obstacles: Obstacles) -> bool:
    """The seated body touches nothing but may graze its surroundings a little on the way down."""
    start = standing(body, np.array(seat.approach_xy), seat.pose.yaw_rad)
    points = axis_points(body, pose(body, sit_on(start, seat, CHECK_FPS), CHECK_FPS, None))
    seated = points[-1]
    if obstacles.hold(seated).any() or obstacles.hold(seated, FIT_MARGIN_M, seat.object_id).any():
        return False
    others = obstacles.hold(points, ignored_id=seat.object_id).mean()
    return bool(others <= CROSSING_SHARE[0] and obstacles.hold(points).mean() <= CROSSING_SHARE[1])
