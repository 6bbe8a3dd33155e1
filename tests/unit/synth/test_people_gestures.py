"""Gestures: hands go where they should, at a person's speed, and come back; no joint goes too far."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.gestures import BASIN_M, ROAM_M
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.motion import GESTURES, SeatPose, gesture, reach_both, sit_down
from hsbench.synth.people.style import Style

FPS = 30
LENGTH_S = 12.0
RIGHT = Body(1.72)
LEFT = Body(1.72, style=Style(hand=0))
SEAT = SeatPose((-0.35, 0.0, 0.55), 0.0, ((0.17, 0.09, 0.0275), (0.17, -0.09, 0.0275)))
TABLE = np.array([[0.08, 0.14, 0.76], [0.08, -0.14, 0.76]])
TIPS = [J["hand_tip_left"], J["hand_tip_right"]]


def seated(body: Body) -> Channels:
    return sit_down(standing(body, np.zeros(2), 0.0), SEAT, 1.3, FPS)


def at_table(body: Body) -> Channels:
    return reach_both(seated(body), TABLE, 0.1, 0.0, 0.8, FPS)


STARTS = {"standing": lambda body: standing(body, np.zeros(2), 0.0), "seated": seated, "at a table": at_table}


@pytest.mark.parametrize("kind", GESTURES)
@pytest.mark.parametrize("start", list(STARTS))
@pytest.mark.parametrize("body", [RIGHT, LEFT], ids=["right", "left"])
def test_hands_return_at_a_natural_speed_within_all_limits(kind: str, start: str, body: Body) -> None:
    before = STARTS[start](body)
    chunk = gesture(before, kind, LENGTH_S, FPS, np.random.default_rng(1))
    assert len(chunk) == LENGTH_S * FPS
    joints = pose(body, concatenate([before.last(), chunk]), FPS, None)
    assert np.abs(joints[-1] - joints[0]).max() < 2e-3
    assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 3.0
    assert limit_violations(joints).max() < 2e-3
    moved = np.linalg.norm(joints[:, TIPS] - joints[0, TIPS], axis=2).max(axis=0)
    assert moved[body.style.hand] > 0.004
    assert np.abs(joints[:, J["spine_base"]] - joints[0, J["spine_base"]]).max() < 1e-3


@pytest.mark.parametrize("kind", list(ROAM_M))
def test_hands_at_work_stay_about_their_targets(kind: str) -> None:
    before = at_table(RIGHT)
    chunk = gesture(before, kind, LENGTH_S, FPS, np.random.default_rng(2))
    assert np.linalg.norm(chunk.target - TABLE, axis=2).max() <= ROAM_M[kind]
    tips = pose(RIGHT, concatenate([before.last(), chunk]), FPS, None)[:, TIPS]
    assert np.linalg.norm(tips - TABLE, axis=2).max() <= ROAM_M[kind] + 0.01


def head_axes(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) forward and left of the chest, level."""
    across = joints[:, J["shoulder_left"]] - joints[:, J["shoulder_right"]]
    left = across * [1, 1, 0] / np.linalg.norm(across[:, :2], axis=1, keepdims=True)
    return np.stack([left[:, 1], -left[:, 0], 0 * left[:, 0]], axis=1), left


@pytest.mark.parametrize("body", [RIGHT, LEFT], ids=["right", "left"])
@pytest.mark.parametrize("start", list(STARTS))
def test_food_and_cup_go_to_the_mouth_and_the_phone_to_the_ear(start: str, body: Body) -> None:
    before = STARTS[start](body)
    for kind in ("eat", "drink", "phone"):
        joints = pose(body, gesture(before, kind, LENGTH_S, FPS, np.random.default_rng(3)), FPS, None)
        ahead, left = head_axes(joints)
        tip = joints[:, TIPS[body.style.hand]] - joints[:, J["head"]]
        own = 1.0 if body.style.hand == 0 else -1.0
        place = np.stack([np.sum(tip * ahead, axis=1), own * np.sum(tip * left, axis=1), tip[:, 2]], axis=1)
        middle = place[np.argmin(np.linalg.norm(tip, axis=1))]
        want = {"phone": (0.01, 0.10, 0.0)}.get(kind, (0.13, 0.0, -0.07))
        assert np.linalg.norm(middle - want) < 0.06, (kind, middle)


def test_a_book_is_held_with_both_hands_before_the_chest_below_the_eyes() -> None:
    joints = pose(RIGHT, gesture(seated(RIGHT), "read", LENGTH_S, FPS, np.random.default_rng(4)), FPS, None)
    middle = joints[60:-60]
    ahead, left = head_axes(middle)
    for side, sign in enumerate((1, -1)):
        away = middle[:, TIPS[side]] - middle[:, J["spine_shoulder"]]
        assert (np.sum(away * ahead, axis=1) > 0.25).all()
        assert (sign * np.sum(away * left, axis=1) > 0.0).all()
        assert (np.abs(away[:, 2]) < 0.3).all()
    face = middle[:, J["head"]] - middle[:, J["neck"]]
    upright = pose(RIGHT, seated(RIGHT).last(), FPS, None)
    assert (np.sum(face * ahead, axis=1) > (upright[0, J["head"], 0] - upright[0, J["neck"], 0]) + 0.02).all()


@pytest.mark.parametrize("body", [RIGHT, LEFT, Body(1.9), Body(1.57)], ids=["right", "left", "tall", "short"])
def test_who_phones_has_the_hand_along_the_cheek_and_the_elbow_low(body: Body) -> None:
    joints = pose(
        body, gesture(standing(body, np.zeros(2), 0.0), "phone", LENGTH_S, FPS, np.random.default_rng(6)), FPS, None
    )
    side = ("left", "right")[body.style.hand]
    tip, palm, wrist, elbow, shoulder, head = (
        joints[180, J[name]]
        for name in (f"hand_tip_{side}", f"hand_{side}", f"wrist_{side}", f"elbow_{side}", f"shoulder_{side}", "head")
    )
    assert wrist[2] < palm[2] < tip[2]
    assert wrist[0] > palm[0] > tip[0]  # back along the cheek, facing +x
    assert np.linalg.norm(palm - head) < 0.2
    assert elbow[2] < shoulder[2] - 0.02


@pytest.mark.parametrize("stature", [1.57, 1.72, 1.93])
def test_hands_wash_at_the_height_of_a_basin_whatever_the_stature(stature: float) -> None:
    body = Body(stature)
    chunk = gesture(standing(body, np.zeros(2), 0.7), "wash", LENGTH_S, FPS, np.random.default_rng(7))
    tips = pose(body, chunk, FPS, None)[60:-60, TIPS]
    assert np.abs(tips[..., 2] - BASIN_M[2]).max() < 0.04
    assert np.abs(tips[..., :2] @ [np.cos(0.7), np.sin(0.7)] - BASIN_M[0]).max() < 0.05


def test_short_gestures_and_any_seed_are_fine() -> None:
    before = at_table(RIGHT)
    for kind in GESTURES:
        for seed in range(5):
            short = gesture(before, kind, 1.2, FPS, np.random.default_rng(seed))
            joints = pose(RIGHT, concatenate([before.last(), short]), FPS, None)
            assert np.abs(joints[-1] - joints[0]).max() < 2e-3
            assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 6.0


def test_an_unknown_gesture_is_refused_with_those_there_are() -> None:
    with pytest.raises(SchemaError, match="gesture is 'juggle'; expected one of type"):
        gesture(seated(RIGHT), "juggle", 1.0, FPS, np.random.default_rng(0))
