"""Seats: where a body fits on a part, and from which free cell one gets there.

Ways of sitting are those of ``truth.sittable``, with the room that this very body needs: a movable seat is drawn back
first, as little as possible. The edges of low tops are sat on as well, now and then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.mesh_contact import tops
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, concatenate, standing
from hsbench.synth.people.channels import pose as posed
from hsbench.synth.people.motion import SeatPose, sit_down, walk
from hsbench.synth.people.navigation import nearest_free
from hsbench.synth.people.timing import shares_of, smooth
from hsbench.truth.meshes import has_mesh
from hsbench.truth.sittable import APPROACH_M, BACKLESS, FRONT, PULL_M, SEAT_HEIGHT_M, SEAT_ROLES, SIDES
from hsbench.truth.tops import CELL_M, PATCH_M, places
from hsbench.truth.tops import Surface as MeshTop
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

Point = tuple[float, float]

PLACE_WIDTH_M = 0.60  # a person's width on a bench or sofa
DEEPEST_M = 0.36  # pelvis behind the front edge, at most
DEPTH_SHARE = 0.6  # of the seat's depth, at most
DEPTH_STEPS = (1.0, 0.7, 0.45)
THIGH_DROP = 0.66  # of the thigh's length from hip to knee, at most: higher seats leave the feet hanging
EDGE_SLACK_M = 0.06  # a thigh may sink so far towards the seat's front edge
FEET_BACK_M = 0.05  # ankles behind knees
LAP = np.array([[0.18, 0.03, -0.27], [0.18, -0.03, -0.27]])  # folded hands, offsets as in ``Channels``
SEATED_GRAZE_M = 0.01  # by which who sits may press into what is about them: bodies sway
GRAZE_M = 0.02  # by which a body may press into what is about it
SIT_DOWN_S = 1.2
SIT_DOWN_PER_M = 0.6  # slower if the seat is farther from where one stands
STEP_IN_M_S = 0.6  # between furniture
CALF_SHARES_M = (0.0, 0.12)  # how much nearer to the seat than one's feet are later one stands
PULLS_M = (0.0, 0.08, 0.16, 0.24, 0.32, 0.40)  # a movable seat is drawn back to be sat on
ENTRIES_M = (0.0, 0.15, 0.30, 0.45)  # and so much farther to be got to
HIT_M = 0.005  # a seat that reaches so far into another thing hits it
ASIDE_M = 0.5  # from the pelvis to where one gets to a seat from the side
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
    is_narrow: elbows find no room, hands are folded in the lap.
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

    @property
    def line(self) -> FloatArray:
        """(2, 2) what one takes up: from the free cell to the pelvis."""
        return np.array([self.approach_xy, self.entry_pose.pelvis_m[:2]])

    @property
    def entry_pose(self) -> SeatPose:
        """The pose just after sitting down, before the seat is drawn in."""
        return _moved(self.pose, np.array(self.entry_xy) - self.shift_xy)

    @property
    def feet_xy(self) -> FloatArray:
        """(2,) between the balls of the feet of who sits."""
        return np.asarray(np.mean(self.pose.balls_m, axis=0)[:2])

    @property
    def is_drawn(self) -> bool:
        """Whether the object is moved to be sat on."""
        return self.entry_xy != (0.0, 0.0) or self.shift_xy != (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Setting:
    """The cells one can get to beside an object and its way, what one can run into, with the object moved by a shift.

    taken: (nx, ny) bool, cells that the moved object takes away, on its way too.
    """

    floor: WalkMap
    obstacles: Obstacles
    taken: BoolArray


def seat_surfaces(scene: Scene) -> list[Surface]:
    """All ways of sitting on seats and mattresses by their role and height, whether there is room for it or not."""
    return _surfaces(scene, SEAT_ROLES)


def ledge_surfaces(scene: Scene) -> list[Surface]:
    """Edges not meant for sitting that one may sit on all the same: of tops as low as seats."""
    return _surfaces(scene, ("top",))


def _surfaces(scene: Scene, roles: tuple[str, ...]) -> list[Surface]:
    found = []
    for item in scene.objects:
        for part in item.parts:
            if part.role in roles:
                one_way = part.role == "seat" and item.category_name not in BACKLESS
                found += [
                    side
                    for top_m, top in _tops(scene, item, part)
                    for side in (
                        Surface(item, part, np.array(front), top_m, top) for front in (FRONT if one_way else SIDES)
                    )
                    if SEAT_HEIGHT_M[0] <= top_m <= SEAT_HEIGHT_M[1]
                    and (top is None or len(places(top, _facing(side))) > 0)
                ]
    return found


def _tops(scene: Scene, item: SceneObject, part: Part) -> list[tuple[float, MeshTop | None]]:
    """Heights of the surfaces on top of a part; of a mesh part with the surfaces."""
    if part.solid is not None:
        return [(float(quantise_m(apply(item.scene_T_object, part.vertices)[:, 2].max())), None)]
    return [(top.height_m, top) for top in tops(scene, item, item.parts.index(part))]


def seat_at(
    surface: Surface, seat_pose: SeatPose, body: Body, setting: Callable[[FloatArray], Setting], still: Obstacles
) -> Seat | None:
    """The seat at one of ``seat_places``, if the body fits there and can get to it, else None.

    setting: floor and obstacles for a shift (2,) of the object. still: obstacles without the object.
    A movable seat is drawn back as little as possible; those that are meshes stay where they are.
    """
    back = -_facing(surface)
    is_drawn = surface.item.movable and not has_mesh(surface.item)
    pulls, entries = (PULLS_M, ENTRIES_M) if is_drawn else ((0.0,), (0.0,))
    for pull_m in pulls:
        shift = quantise_m(pull_m * back)
        moved = _moved(seat_pose, shift)
        if not _chair_fits(surface.item, shift, still):
            return None
        here = setting(shift).obstacles
        narrow = next((folded for folded in (False, True) if _fits(moved, folded, surface, body, here)), None)
        if narrow is None:
            continue
        for entry_m in entries:
            entry = quantise_m(shift + entry_m * back)
            if pull_m + entry_m > PULL_M or not _chair_fits(surface.item, entry, still):
                break
            there = setting(entry)
            for approach, stand in _ways_in(moved, entry - shift, body, there.floor):
                seat = Seat(
                    surface.item.object_id, surface.part.name, moved, approach, stand, _sit_down_s(moved, stand),
                    _point(entry), _point(shift), narrow,
                )  # fmt: skip
                if _can_sit_down(seat, body, there.obstacles):
                    return seat
    return None


def step_in(body: Body, start: Channels, seat: Seat, fps: float) -> Channels:
    """From the free cell to before the seat, with the back to it."""
    way = np.array([seat.approach_xy, seat.stand_xy])
    return walk(body, start, way, seat.pose.yaw_rad, STEP_IN_M_S, fps)


def step_out(body: Body, start: Channels, seat: Seat, fps: float) -> Channels:
    """From before the seat to the free cell."""
    return walk(body, start, np.array([seat.stand_xy, seat.approach_xy]), None, STEP_IN_M_S, fps)


def sit_on(start: Channels, seat: Seat, fps: float) -> Channels:
    """From standing before the seat onto it."""
    return _folded(sit_down(start, seat.entry_pose, seat.sit_down_s, fps), seat.is_narrow)


def _folded(down: Channels, is_narrow: bool) -> Channels:
    """Sitting down, with the hands folded in the lap in the end if there is no room for elbows."""
    if not is_narrow:
        return down
    near = np.maximum(down.near, down.seated[:, None])
    return replace(down, near=near, offset=np.tile(LAP, (len(down), 1, 1)), at_head=np.zeros_like(near))


def scoot(start: Channels, shift_xy: FloatArray, duration_s: float, fps: float) -> Channels:
    """Someone who sits slides along with the seat."""
    before = start.last()
    way = smooth(shares_of(duration_s, fps))[:, None] * shift_xy
    held = before.hold(len(way))
    ball = held.feet.ball + np.pad(way, ((0, 0), (0, 1)))[:, None]
    return replace(held, xy=held.xy + way, feet=replace(held.feet, ball=ball))


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
    facing, turn = _facing(surface), surface.item.scene_T_object
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
    return max(EDGE_SLACK_M * ahead / drop, EDGE_SLACK_M) if drop > 0 else np.inf


def seated_at(surface: Surface, local_xy: FloatArray, body: Body) -> SeatPose:
    """The seated pose with its pelvis over a point (2,) of the object frame."""
    hip_z, drop = _hip_height(surface, body)
    ahead_m = float(np.sqrt(body.of_stature(anatomy.THIGH) ** 2 - drop**2)) - FEET_BACK_M
    ankle_z = max(hip_z - drop - body.of_stature(anatomy.SHANK), body.of_stature(anatomy.ANKLE_HEIGHT))
    ball_z = ankle_z - body.of_stature(anatomy.ANKLE_HEIGHT - anatomy.BALL_HEIGHT)
    pelvis = apply(surface.item.scene_T_object, np.array([*local_xy, 0.0]))[:2]
    facing = _facing(surface)
    yaw = quantise_angle(float(np.arctan2(facing[1], facing[0])))
    left = np.array([-facing[1], facing[0]])
    feet = pelvis + ahead_m * facing
    ball = feet + body.of_stature(anatomy.BALL_FORWARD) * facing
    sides = [quantise_m(ball + sign * body.hip_half_m * left) for sign in (1.0, -1.0)]
    balls = tuple((float(p[0]), float(p[1]), float(quantise_m(ball_z))) for p in sides)
    x, y = quantise_m(pelvis)
    return SeatPose((float(x), float(y), float(quantise_m(hip_z))), yaw, (balls[0], balls[1]))


def _facing(surface: Surface) -> FloatArray:
    return np.asarray(surface.item.scene_T_object[:2, :2] @ surface.front)


def _moved(pose: SeatPose, shift_xy: FloatArray) -> SeatPose:
    pelvis, *balls = (quantise_m(np.array(p) + np.append(shift_xy, 0.0)) for p in (pose.pelvis_m, *pose.balls_m))
    left, right = ((float(x), float(y), float(z)) for x, y, z in balls)
    return SeatPose((float(pelvis[0]), float(pelvis[1]), float(pelvis[2])), pose.yaw_rad, (left, right))


def _point(xy: FloatArray) -> Point:
    return float(xy[0]), float(xy[1])


def _sit_down_s(pose: SeatPose, stand_xy: Point) -> float:
    away = np.array(pose.pelvis_m[:2]) - stand_xy
    return float(quantise_m(SIT_DOWN_S + SIT_DOWN_PER_M * np.sqrt(np.sum(away**2))))


def _chair_fits(item: SceneObject, shift_xy: FloatArray, still: Obstacles) -> bool:
    """Whether a moved object reaches into nothing: its corners and the middles of its edges."""
    if not shift_xy.any():
        return True
    corners = [c for solid in item.solids for c in (solid.vertices, *_edge_middles(solid))]
    points = np.concatenate(corners) + np.append(shift_xy, 0.0)
    points = points[points[:, 2] > HIT_M]
    return bool((still.depth(points, np.zeros(len(points))) <= HIT_M).all())


def _edge_middles(solid: ConvexSolid) -> list[FloatArray]:
    triangles = solid.vertices[solid.triangles]
    return [(triangles[:, k] + triangles[:, k - 1]) / 2 for k in range(3)]


def _fits(pose: SeatPose, is_narrow: bool, surface: Surface, body: Body, obstacles: Obstacles) -> bool:
    """Whether a body that sits hits nothing but the seat that gives way."""
    start = standing(body, np.array(pose.pelvis_m[:2]), pose.yaw_rad)
    sitting = _folded(sit_down(start, pose, 1.0, CHECK_FPS), is_narrow).last()
    joints = posed(body, sitting, CHECK_FPS, None)
    return bool((body_depth(obstacles, body, joints, surface.item.object_id) <= SEATED_GRAZE_M).all())


def _ways_in(pose: SeatPose, entry_xy: FloatArray, body: Body, floor: WalkMap) -> Iterator[tuple[Point, Point]]:
    """Free cells from where one gets to a seat, and where one stands before it: the cell itself, or nearer.

    The cells are those nearest to the feet, and to places on either side of the seat.
    """
    pelvis, feet = np.array(pose.pelvis_m[:2]) + entry_xy, np.mean(pose.balls_m, axis=0)[:2] + entry_xy
    ahead = np.array([np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)])
    feet = feet - body.of_stature(anatomy.BALL_FORWARD) * ahead
    aside = ASIDE_M * np.array([-ahead[1], ahead[0]])
    cells: list[Point] = []
    for place in (feet, pelvis + aside, pelvis - aside):
        cell = nearest_free(floor, place, APPROACH_M)
        if cell is None or _point(cell[0]) in cells:
            continue
        if np.sum((cell[0] - pelvis) ** 2) > (APPROACH_M + PATCH_M / 2) ** 2 and place is not feet:
            continue
        cells.append(_point(cell[0]))
        yield cells[-1], cells[-1]
        for nearer_m in CALF_SHARES_M:
            stand = quantise_m(feet - nearer_m * ahead)
            if (stand - pelvis) @ ahead > 0:
                yield cells[-1], _point(stand)


def _can_sit_down(seat: Seat, body: Body, obstacles: Obstacles) -> bool:
    """Whether one gets from the free cell onto the seat and back without running into anything."""
    away = np.array(seat.stand_xy) - seat.approach_xy
    direct = not away.any()
    yaw = seat.pose.yaw_rad if direct else quantise_angle(float(np.arctan2(away[1], away[0])))
    start = standing(body, np.array(seat.approach_xy), yaw)
    chunks = [] if direct else [step_in(body, start, seat, CHECK_FPS)]
    chunks.append(sit_on((chunks or [start])[-1], seat, CHECK_FPS))
    if not direct:
        chunks.append(step_out(body, chunks[-1].backwards(), seat, CHECK_FPS))
    joints = posed(body, concatenate(chunks), CHECK_FPS, None)
    if (body_depth(obstacles, body, joints, seat.object_id) > GRAZE_M).any():
        return False
    return direct or bool((body_depth(obstacles, body, joints[: len(chunks[0])]) <= GRAZE_M).all())
