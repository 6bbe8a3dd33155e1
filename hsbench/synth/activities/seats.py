"""Seats: surfaces to sit on, poses on them, and the motions onto a seat and off it.

Ways of sitting are those of ``truth.sittable``. Whether a body finds room there: ``seating``. What else is sat on now
and then: ``odd_seats``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.mesh_contact import tops
from hsbench.synth.activities.sidling import sidle
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, concatenate
from hsbench.synth.people.motion import SeatPose, sit_down, walk
from hsbench.truth.sittable import BACKLESS, FRONT, SEAT_HEIGHT_M, SEAT_ROLES, SIDES
from hsbench.truth.tops import CELL_M, PATCH_M, places
from hsbench.truth.tops import Surface as MeshTop
from hsbench.typing import BoolArray, FloatArray

Point = tuple[float, float]

PLACE_WIDTH_M = 0.60  # a person's width on a bench or sofa
DEEPEST_M = 0.36  # pelvis behind the front edge, at most
DEPTH_SHARE = 0.6  # of the seat's depth, at most
DEPTH_STEPS = (1.0, 0.7, 0.45)
THIGH_DROP = 0.66  # of the thigh's length from hip to knee, at most: higher seats leave the feet hanging
EDGE_SLACK_M = 0.06  # a thigh may sink so far towards a seat's front edge
HARD_SLACK_M = 0.01  # and into the edge of what is no seat
FEET_BACK_M = 0.05  # ankles behind knees
LAP = np.array([[0.18, 0.03, -0.27], [0.18, -0.03, -0.27]])  # folded hands, offsets as in ``Channels``
STEP_IN_M_S = 0.6  # between furniture
CHECK_FPS = 15.0


@dataclass(frozen=True, eq=False)
class Surface:
    """A part to sit on, facing ``front`` (2,), a unit vector in the object frame.

    top_m: height of the surface. top: which surface of a mesh part it is.
    """

    item: SceneObject
    part: Part
    front: FloatArray
    top_m: float
    top: MeshTop | None = None


@dataclass(frozen=True)
class Seat:
    """A place to sit: object, part, the pose in which one sits, and how one gets there.

    approach_xy: the free cell from where one steps to stand_xy, before the seat, and sits down. entry_xy, shift_xy:
    (x, y) moves of the object from its pose at t0 while one sits down, and while one sits; scene frame.
    is_narrow: elbows find no room, hands are folded in the lap. is_sidled: there is no room to turn before the seat.
    """

    object_id: int
    part: str
    pose: SeatPose
    approach_xy: Point
    stand_xy: Point
    sit_down_s: float
    entry_xy: Point = (0.0, 0.0)
    shift_xy: Point = (0.0, 0.0)
    is_narrow: bool = False
    is_sidled: bool = False

    @property
    def line(self) -> FloatArray:
        """(2, 2) what one takes up: from the free cell to the pelvis."""
        return np.array([self.approach_xy, self.entry_pose.pelvis_m[:2]])

    @property
    def entry_pose(self) -> SeatPose:
        """The pose just after sitting down, before the seat is drawn in."""
        return moved_by(self.pose, np.array(self.entry_xy) - self.shift_xy)

    @property
    def feet_xy(self) -> FloatArray:
        """(2,) between the balls of the feet of who sits."""
        return np.asarray(np.mean(self.pose.balls_m, axis=0)[:2])

    @property
    def is_drawn(self) -> bool:
        """Whether the object is moved to be sat on."""
        return self.entry_xy != (0.0, 0.0) or self.shift_xy != (0.0, 0.0)


def seat_surfaces(scene: Scene) -> list[Surface]:
    """All ways of sitting on seats and mattresses by their role and height, whether there is room for it or not."""
    found = []
    for item in scene.objects:
        for part in item.parts:
            if part.role in SEAT_ROLES:
                one_way = part.role == "seat" and item.category_name not in BACKLESS
                found += surfaces_on(scene, item, part, FRONT if one_way else SIDES, SEAT_HEIGHT_M)
    return found


def is_over(surface: Surface, shift_xy: FloatArray, xy: FloatArray) -> BoolArray:
    """(n,) bool: the points (n, 2), scene frame, over a seat that has been moved by (2,); any point for a mesh part."""
    if surface.part.solid is None:
        return np.ones(len(xy), dtype=np.bool_)
    local = apply(invert(surface.item.scene_T_object), np.pad(xy - shift_xy, ((0, 0), (0, 1))))[:, :2]
    vertices = surface.part.vertices[:, :2]
    inset = np.minimum(local - vertices.min(axis=0), vertices.max(axis=0) - local)
    return np.asarray((quantise_m(inset) >= 0.0).all(axis=1))


def surfaces_on(
    scene: Scene, item: SceneObject, part: Part, fronts: tuple[Point, ...], height_m: tuple[float, float]
) -> list[Surface]:
    """The ways of sitting on a part, facing some fronts, if it is neither too low nor too high."""
    found = [Surface(item, part, np.array(f), top_m, top) for top_m, top in _tops(scene, item, part) for f in fronts]
    return [
        side
        for side in found
        if height_m[0] <= side.top_m <= height_m[1] and (side.top is None or len(places(side.top, facing_of(side))) > 0)
    ]


def _tops(scene: Scene, item: SceneObject, part: Part) -> list[tuple[float, MeshTop | None]]:
    """Heights of the surfaces on top of a part; of a mesh part with the surfaces."""
    if part.solid is not None:
        return [(float(quantise_m(apply(item.scene_T_object, part.vertices)[:, 2].max())), None)]
    return [(top.height_m, top) for top in tops(scene, item, item.parts.index(part))]


def step_in(body: Body, start: Channels, seat: Seat, fps: float) -> Channels:
    """From the free cell to before the seat, with the back to it."""
    if seat.is_sidled:
        turned = walk(body, start, start.last().xy, seat.pose.yaw_rad, STEP_IN_M_S, fps)
        return concatenate([turned, sidle(body, turned, np.array(seat.stand_xy), fps)])
    way = np.array([seat.approach_xy, seat.stand_xy])
    return walk(body, start, way, seat.pose.yaw_rad, STEP_IN_M_S, fps)


def step_out(body: Body, start: Channels, seat: Seat, fps: float) -> Channels:
    """From before the seat to the free cell."""
    if seat.is_sidled:
        return sidle(body, start, np.array(seat.approach_xy), fps)
    return walk(body, start, np.array([seat.stand_xy, seat.approach_xy]), None, STEP_IN_M_S, fps)


def sit_on(start: Channels, seat: Seat, fps: float) -> Channels:
    """From standing before the seat onto it."""
    return folded(sit_down(start, seat.entry_pose, seat.sit_down_s, fps), seat.is_narrow)


def folded(down: Channels, is_narrow: bool) -> Channels:
    """Sitting down, with the hands folded in the lap in the end if there is no room for elbows."""
    if not is_narrow:
        return down
    near = np.maximum(down.near, down.seated[:, None])
    return replace(down, near=near, offset=np.tile(LAP, (len(down), 1, 1)), at_head=np.zeros_like(near))


def facing_chair(surface: Surface, seat: Seat) -> float:
    """Heading from where one gets to a seat towards the seat at its place."""
    away = surface.item.box[:2] - np.array(seat.approach_xy)
    return quantise_angle(float(np.arctan2(away[1], away[0])))


def seat_places(surface: Surface, body: Body) -> Iterator[SeatPose]:
    """Seated poses on a surface at t0, without regard to anything else in the room."""
    if surface.top is not None:
        yield from _places_on_mesh(surface, surface.top, body)
        return
    part, front = surface.part, surface.front
    low, high = part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0)
    middle, size = (low + high) / 2, high - low
    axis = int(abs(front[1]) > 0.5)  # the object axis one faces along
    depth, width = size[axis], size[1 - axis]
    count = max(1, int(width / PLACE_WIDTH_M))
    sideways = np.linspace(-1, 1, count) * (width - PLACE_WIDTH_M) / 2 if count > 1 else np.zeros(1)
    behind = min(DEPTH_SHARE * depth, DEEPEST_M, deepest(surface, body))
    for along in sideways:
        for share in DEPTH_STEPS:
            local = middle + front * (depth / 2 - share * behind)
            local[1 - axis] += along
            yield seated_at(surface, local, body)


def _places_on_mesh(surface: Surface, top: MeshTop, body: Body) -> Iterator[SeatPose]:
    """Seated poses beside each other on a surface of a mesh, as high as it is under the pelvis."""
    facing, turn = facing_of(surface), surface.item.scene_T_object
    aside = np.array([-facing[1], facing[0]])
    rows = places(top, facing)  # ahead, left, edge
    width = float(np.ptp(rows[:, 1])) + PATCH_M
    count = max(1, int(width / PLACE_WIDTH_M))
    spread = np.linspace(-1, 1, count) * max(width - PLACE_WIDTH_M, 0.0) / 2 if count > 1 else np.zeros(1)
    for left in (rows[:, 1].min() + rows[:, 1].max()) / 2 + spread:
        line = rows[np.abs(rows[:, 1] - left) == np.abs(rows[:, 1] - left).min()]
        edge, depth = line[0, 2], line[0, 2] - line[:, 0].min() + PATCH_M / 2
        for share in DEPTH_STEPS:
            pelvis = (edge - share * min(DEPTH_SHARE * depth, DEEPEST_M)) * facing + line[0, 1] * aside
            there = replace(surface, top_m=_height_at(top, pelvis))
            behind = share * min(DEPTH_SHARE * depth, DEEPEST_M, deepest(there, body))
            pelvis = (edge - behind) * facing + line[0, 1] * aside
            there = replace(surface, top_m=_height_at(top, pelvis))
            yield seated_at(there, (pelvis - turn[:2, 3]) @ turn[:2, :2], body)


def _height_at(top: MeshTop, point_xy: FloatArray) -> float:
    """How high a surface of a mesh is at a point (2,); at a hole, or if it is flat, its highest."""
    if top.lattice is None:  # a convex piece
        return top.height_m
    i, j = np.floor((top.lattice.axes @ point_xy - top.lattice.low) / CELL_M).astype(np.int64)
    nx, ny = top.lattice.held.shape
    if not (0 <= i < nx and 0 <= j < ny and top.lattice.held[i, j]):
        return top.height_m
    return float(quantise_m(top.lattice.z_m[i, j]))


def _hip_height(surface: Surface, body: Body) -> tuple[float, float]:
    """Height of a seated pelvis, and by how much a knee is lower."""
    hip_z = surface.top_m + body.radius(anatomy.RADIUS_BELLY[0])
    thigh, upright_knee = body.of_stature(anatomy.THIGH), body.of_stature(anatomy.SHANK + anatomy.ANKLE_HEIGHT)
    return hip_z, float(np.clip(hip_z - upright_knee, -THIGH_DROP * thigh, THIGH_DROP * thigh))


def deepest(surface: Surface, body: Body) -> float:
    """How far behind the front edge thighs that slope down to the knees leave a pelvis."""
    _, drop = _hip_height(surface, body)
    ahead = float(np.sqrt(body.of_stature(anatomy.THIGH) ** 2 - drop**2))
    slack_m = EDGE_SLACK_M if surface.part.role in SEAT_ROLES else HARD_SLACK_M
    return max(slack_m * ahead / drop, slack_m) if drop > 0 else np.inf


def seated_at(surface: Surface, local_xy: FloatArray, body: Body) -> SeatPose:
    """The seated pose with its pelvis over a point (2,) of the object frame."""
    hip_z, drop = _hip_height(surface, body)
    ahead_m = float(np.sqrt(body.of_stature(anatomy.THIGH) ** 2 - drop**2)) - FEET_BACK_M
    ankle_z = max(hip_z - drop - body.of_stature(anatomy.SHANK), body.of_stature(anatomy.ANKLE_HEIGHT))
    ball_z = ankle_z - body.of_stature(anatomy.ANKLE_HEIGHT - anatomy.BALL_HEIGHT)
    pelvis = apply(surface.item.scene_T_object, np.array([*local_xy, 0.0]))[:2]
    facing = facing_of(surface)
    yaw = quantise_angle(float(np.arctan2(facing[1], facing[0])))
    left = np.array([-facing[1], facing[0]])
    feet = pelvis + ahead_m * facing
    ball = feet + body.of_stature(anatomy.BALL_FORWARD) * facing
    sides = [quantise_m(ball + sign * body.hip_half_m * left) for sign in (1.0, -1.0)]
    balls = tuple((float(p[0]), float(p[1]), float(quantise_m(ball_z))) for p in sides)
    x, y = quantise_m(pelvis)
    return SeatPose((float(x), float(y), float(quantise_m(hip_z))), yaw, (balls[0], balls[1]))


def facing_of(surface: Surface) -> FloatArray:
    """(2,) where one faces who sits on a surface, scene frame."""
    return np.asarray(surface.item.scene_T_object[:2, :2] @ surface.front)


def moved_by(pose: SeatPose, shift_xy: FloatArray) -> SeatPose:
    """A seated pose elsewhere on the floor."""
    pelvis, *balls = (quantise_m(np.array(p) + np.append(shift_xy, 0.0)) for p in (pose.pelvis_m, *pose.balls_m))
    left, right = ((float(x), float(y), float(z)) for x, y, z in balls)
    return SeatPose((float(pelvis[0]), float(pelvis[1]), float(pelvis[2])), pose.yaw_rad, (left, right))


def point_of(xy: FloatArray) -> Point:
    """(2,) as two numbers."""
    return float(xy[0]), float(xy[1])
