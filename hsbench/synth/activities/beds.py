"""Where a body lies on a bed or sofa, after it has sat down on its edge."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.activities.contact import BEDDING_M, Obstacles, body_depth
from hsbench.synth.activities.seats import CHECK_FPS, DEEPEST_M, DEPTH_SHARE, Seat, Surface, deepest, seated_at, sit_on
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.lying import LiePose, lie_down, lying_length_m
from hsbench.synth.people.motion import SeatPose
from hsbench.typing import FloatArray

GRAZE_M = 0.05  # by which someone who lies may press into what is about them
WIDTH_M = 0.55  # of a surface to lie on, at least
DOUBLE_M = 1.4  # a mattress so wide is for two
LEVEL_M = 0.03  # parts of one surface differ in height by less
HEAD_ROOM_M = (0.15, 0.22)  # from the middle of the head to the end of the bed: at least, and in the middle of a pillow
SIT_SHARES = (1.0, 0.6)  # of the depth at which one sits down
LONGER = 1.1  # what is so much wider than long is lain on along its width


def lie_places(surface: Surface, body: Body) -> Iterator[tuple[SeatPose, LiePose]]:
    """Places to lie, reached by sitting on a long side of a surface: the seated and the lying pose.

    On a bed the head is at its back, where the pillows are; on a sofa at either armrest. One lies on the back or on a
    side, on a sofa facing away from its back.
    """
    item, front = surface.item, surface.front
    (low, high), place = _extents(surface)
    own = place if surface.top is not None else _corners(surface.part.vertices)
    size, length = high - low, lying_length_m(body)
    along = int(size[0] <= LONGER * size[1])
    across = 1 - along
    room = size[along] - length
    if front[across] == 0 or size[across] < WIDTH_M or room < HEAD_ROOM_M[0]:
        return
    edge = (high if front[across] > 0 else low)[across]
    width = place[1, across] - place[0, across]
    lane = edge - front[across] * width / (4 if width >= DOUBLE_M else 2)
    has_back = surface.part.role == "mattress" and along == 1
    for end, share in product((1.0,) if has_back else (1.0, -1.0), SIT_SHARES):
        head, feet = np.full(2, lane), np.full(2, lane)
        head[along] = (high if end > 0 else low)[along] - end * min(room, HEAD_ROOM_M[1])
        feet[along] = head[along] - end * length
        sit = (head + feet) / 2
        deep = min(DEEPEST_M, deepest(surface, body), DEPTH_SHARE * size[across])
        sit[across] = edge - front[across] * share * deep
        if not ((own[0] <= sit) & (sit <= own[1])).all():  # another part is sat on
            continue
        (a, b), (c, d) = (quantise_m(apply(item.scene_T_object, np.array([*p, 0.0]))[:2]) for p in (head, feet))
        # Lying on the left side one faces to the left of the way from head to feet.
        outwards = float(end * front[across] * (1.0 if along else -1.0)) * np.pi / 2
        for roll_rad in (0.0, outwards, -outwards) if has_back else (0.0, outwards):
            lie = LiePose((float(a), float(b), surface.top_m), (float(c), float(d), surface.top_m), roll_rad)
            yield seated_at(surface, sit, body), lie


def lies_free(seat: Seat, lie: LiePose, body: Body, obstacles: Obstacles) -> bool:
    """Whether the body that lies hits nothing but what it lies on."""
    sitting = sit_on(standing(body, np.array(seat.stand_xy), seat.pose.yaw_rad), seat, CHECK_FPS)
    joints = pose(body, lie_down(sitting, lie, 1.0, CHECK_FPS).last(), CHECK_FPS, None)
    return bool((body_depth(obstacles, body, joints, seat.object_id) <= GRAZE_M).all())


def _extents(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Minimum and maximum corners (2, 2), in the object's frame, of all there is to lie on, a mattress' bare end and
    pillows among it, and of the part of it that is nearest to the side one comes from.
    """
    item = surface.item
    if surface.top is not None:
        outline = np.concatenate(surface.top.outlines)
        whole = _corners((outline - item.scene_T_object[:2, 3]) @ item.scene_T_object[:2, :2])
        return whole, whole
    parts = [(p, _top(item, p) - surface.top_m) for p in item.parts if p.solid is not None]
    level = [_corners(p.vertices) for p, rise in parts if p.role == surface.part.role and abs(rise) < LEVEL_M]
    nearest = max(level, key=lambda corners: float((corners @ surface.front).max()))
    if surface.part.role == "mattress":
        level += [_corners(p.vertices) for p, rise in parts if p.role is None and abs(rise) <= BEDDING_M]
    return np.stack([np.min(level, axis=0)[0], np.max(level, axis=0)[1]]), nearest


def _corners(points: FloatArray) -> FloatArray:
    return np.stack([points[:, :2].min(axis=0), points[:, :2].max(axis=0)])


def _top(item: SceneObject, part: Part) -> float:
    return float(apply(item.scene_T_object, part.vertices)[:, 2].max())
