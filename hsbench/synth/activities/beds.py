"""Where a body lies on a bed or sofa, after it has sat down on its edge."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.seats import CHECK_FPS, DEEPEST_M, DEPTH_SHARE, Seat, Surface, deepest, seated_at, sit_on
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.lying import LiePose, lie_down, lying_length_m
from hsbench.synth.people.motion import SeatPose
from hsbench.typing import FloatArray

GRAZE_M = 0.05  # by which someone who lies may press into what is about them
WIDTH_M = 0.55  # of a surface to lie on, at least
LANE_M = 0.42  # a sleeper lies so far from the edge of a wide bed
LEVEL_M = 0.03  # parts of one surface differ in height by less
HEAD_ROOM_M = 0.20  # from the middle of the head to the end of the surface


def lie_places(surface: Surface, body: Body) -> Iterator[tuple[SeatPose, LiePose]]:
    """Places to lie, reached by sitting on a side of a surface: the seated and the lying pose."""
    item, front = surface.item, surface.front
    low, high = _extent(surface)
    across = int(abs(front[1]) > 0.5)
    size, length = high - low, lying_length_m(body)
    spare = size[1 - across] - length - HEAD_ROOM_M
    if size[across] < WIDTH_M or spare < 0:
        return
    edge = (high if front[across] > 0 else low)[across]
    lane = edge - front[across] * min(LANE_M, size[across] / 2)
    ends = (1.0,) if surface.part.role == "mattress" else (1.0, -1.0)  # the head of a bed is towards its back
    for end in ends:
        head, feet = np.empty(2), np.empty(2)
        head[across] = feet[across] = lane
        head[1 - across] = (high if end > 0 else low)[1 - across] - end * (HEAD_ROOM_M + min(spare, HEAD_ROOM_M) / 2)
        feet[1 - across] = head[1 - across] - end * length
        sit = (head + feet) / 2
        sit[across] = edge - front[across] * min(DEEPEST_M, deepest(surface, body), DEPTH_SHARE * size[across])
        (a, b), (c, d) = (quantise_m(apply(item.scene_T_object, np.array([*p, 0.0]))[:2]) for p in (head, feet))
        lie = LiePose((float(a), float(b), surface.top_m), (float(c), float(d), surface.top_m))
        yield seated_at(surface, sit, body), lie


def lies_free(seat: Seat, lie: LiePose, body: Body, obstacles: Obstacles) -> bool:
    """Whether the body that lies hits nothing but what it lies on."""
    sitting = sit_on(standing(body, np.array(seat.stand_xy), seat.pose.yaw_rad), seat, CHECK_FPS)
    joints = pose(body, lie_down(sitting, lie, 1.0, CHECK_FPS).last(), CHECK_FPS, None)
    return bool((body_depth(obstacles, body, joints, seat.object_id) <= GRAZE_M).all())


def _extent(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Minimum and maximum corners (2,) of what there is to lie on, in the object's frame."""
    item = surface.item
    if surface.top is not None:
        outline = np.concatenate(surface.top.outlines)
        local = (outline - item.scene_T_object[:2, 3]) @ item.scene_T_object[:2, :2]
        return local.min(axis=0), local.max(axis=0)
    level = [p for p in item.parts if p.role == surface.part.role and p.solid is not None]
    level = [p for p in level if abs(_top(item, p) - surface.top_m) < LEVEL_M]
    corners = np.concatenate([p.vertices[:, :2] for p in level])
    return corners.min(axis=0), corners.max(axis=0)


def _top(item: SceneObject, part: Part) -> float:
    return float(apply(item.scene_T_object, part.vertices)[:, 2].max())
