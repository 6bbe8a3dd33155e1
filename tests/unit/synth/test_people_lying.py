"""Lying down: on the surface, along it, on the back or a side, and up again."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.mesh import body_meshes
from hsbench.synth.people.motion import LiePose, SeatPose, lie_down, lying_length_m, sit_down, stand

FPS = 30
TOP_M = 0.5
BODIES = [Body(1.58, 1.1, shape="woman-small"), Body(1.78), Body(1.93, 0.98, shape="man-tall")]
ROLLS = [0.0, np.pi / 2, -np.pi / 2]


def on_the_edge(body: Body) -> Channels:
    """Seated on the long side of a bed whose middle line is x = -0.5, facing +x."""
    hip = TOP_M + 0.1
    seat = SeatPose((-0.1, 0.0, hip), 0.0, ((0.4, 0.09, 0.03), (0.4, -0.09, 0.03)))
    return sit_down(standing(body, np.array([0.3, 0.0]), 0.0), seat, 1.3, FPS)


def lying(body: Body, roll: float, head_first: float = 1.0) -> LiePose:
    head = 0.8 * head_first
    return LiePose((-0.5, head, TOP_M), (-0.5, head - head_first * lying_length_m(body), TOP_M), roll)


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
@pytest.mark.parametrize("roll", ROLLS)
@pytest.mark.parametrize("head_first", [1.0, -1.0])
def test_the_whole_body_lies_on_the_surface_along_the_bed(body: Body, roll: float, head_first: float) -> None:
    lie = lying(body, roll, head_first)
    down = lie_down(on_the_edge(body), lie, 3.0, FPS)
    joints = pose(body, concatenate([down, stand(down, 1.0, FPS)]), FPS, None)
    last = joints[-1]
    assert last[:, 2].min() > TOP_M + 0.01
    trunk = [J[n] for n in ("spine_base", "spine_mid", "spine_shoulder", "neck", "head")]
    assert np.ptp(last[trunk, 2]) < 0.09
    assert np.abs(last[trunk, 0] + 0.5).max() < 0.06
    assert np.linalg.norm(last[J["head"], :2] - lie.head_m[:2]) < 0.08
    assert np.abs(last[[J["ankle_left"], J["ankle_right"]], 0] + 0.5).max() < 0.2
    vertices, _, _ = body_meshes(body, last[None])
    assert vertices[..., 2].min() > TOP_M - 0.06  # what a mattress gives way to
    assert vertices[..., 2].max() < TOP_M + 0.60


@pytest.mark.parametrize("roll", ROLLS)
def test_the_face_looks_up_or_to_the_side_one_lies_on(roll: float) -> None:
    body = BODIES[1]
    last = pose(body, lie_down(on_the_edge(body), lying(body, roll), 3.0, FPS).last(), FPS, None)[0]
    left, up = last[J["shoulder_left"]] - last[J["shoulder_right"]], last[J["neck"]] - last[J["spine_mid"]]
    facing = np.cross(left, up) / np.linalg.norm(np.cross(left, up))
    assert facing @ [np.sin(roll), 0.0, np.cos(roll)] > 0.98


@pytest.mark.parametrize("roll", ROLLS)
def test_lying_down_is_smooth_within_all_limits_and_reversible(roll: float) -> None:
    body = BODIES[1]
    start = on_the_edge(body)
    down = lie_down(start, lying(body, roll), 3.0, FPS)
    joints = pose(body, concatenate([start.last(), down, down.backwards()]), FPS, None)
    assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 3.0
    assert limit_violations(joints).max() < 2e-3
    assert np.allclose(joints[1:], joints[:0:-1], atol=1e-3)
    for parent, child in KINECT_V2.bones:
        assert np.ptp(np.linalg.norm(joints[:, parent] - joints[:, child], axis=1)) < 1e-3
    feet = joints[:, [J["foot_left"], J["foot_right"]]]
    over = (feet[..., 0] < 0.0) & (np.abs(feet[..., 1]) < 1.0)  # the edge of the bed is at x = 0
    assert (feet[over][:, 2] > TOP_M).all()


@pytest.mark.parametrize(
    ("head", "feet", "roll", "message"),
    [
        ((0.0, 0.0, 0.5), (0.0, 3.0, 0.5), 0.0, "3.00 m apart"),
        ((0.0, 0.0, 0.5), (0.0, 1.6, 0.6), 0.0, "high; expected one"),
        ((0.0, 0.0, 0.5), (0.0, 1.6, 0.5), 90.0, "is it in degrees"),
    ],
)
def test_impossible_places_are_refused(head: tuple, feet: tuple, roll: float, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        LiePose(head, feet, roll)
