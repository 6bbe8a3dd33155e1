"""Motions: rigid bones, planted feet, bounded speeds, limbs that bend the right way."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import BALL_HEIGHT, Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.motion import SeatPose, reach, sit_down, stand, walk

FPS = 30
BODY = Body(1.72, 1.05)
BEND = np.array([[0.0, 0.0], [2.5, 0.0], [2.8, 0.3], [2.8, 2.2]])
SEAT = SeatPose((-0.35, 0.0, 0.55), 0.0, ((0.17, 0.09, 0.0275), (0.17, -0.09, 0.0275)))


def posed(*chunks: Channels, body: Body = BODY, seed: int = 0) -> np.ndarray:
    return pose(body, concatenate(chunks), FPS, np.random.default_rng(seed))


def walking(route: np.ndarray = BEND, yaw: float | None = None, body: Body = BODY) -> tuple[Channels, Channels]:
    start = standing(body, route[0], 0.0)
    return start, walk(body, start, route, yaw, 1.1, FPS)


def everything() -> np.ndarray:
    start, way = walking(yaw=-1.0)
    home = walk(BODY, way, np.array([[2.8, 2.2], [0.0, 0.0]]), 0.0, 1.0, FPS)
    down = sit_down(home, SEAT, 1.3, FPS)
    rest = stand(down, 2.0, FPS)
    out = reach(rest, 0, np.array([0.2, 0.3, 0.9]), 0.1, 0.0, 0.8, FPS)
    up = down.backwards()
    low = reach(up, 1, np.array([0.45, -0.2, 0.6]), 0.5, 0.08, 0.8, FPS)
    return posed(start, way, stand(way, 1.0, FPS), home, down, rest, out, out.backwards(), up, low, low.backwards())


def test_bones_keep_their_length() -> None:
    joints = everything()
    for parent, child in KINECT_V2.bones:
        length = np.linalg.norm(joints[:, parent] - joints[:, child], axis=1)
        assert np.ptp(length) < 1e-3, (KINECT_V2.names[parent], KINECT_V2.names[child])


def test_no_joint_jumps_or_sinks() -> None:
    joints = everything()
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS
    assert speed[:, J["spine_base"]].max() < 1.6
    assert speed.max() < 6.5  # a swinging foot; Winter: about 4 m/s on average over its swing
    assert joints[..., 2].min() > 0.01


def test_the_pelvis_follows_the_route_at_a_walkers_pace() -> None:
    start, way = walking()
    xy = np.concatenate([start.xy, way.xy])
    dense = np.concatenate([a + np.linspace(0, 1, 5001)[:, None] * (b - a) for a, b in itertools.pairwise(BEND)])
    away = np.sqrt(((xy[:, None] - dense[None, ::5]) ** 2).sum(-1)).min(axis=1)
    assert away.max() < 2e-3
    assert np.allclose(xy[-1], BEND[-1], atol=1e-4)
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) * FPS
    assert speed.max() < 1.15
    assert np.abs(np.diff(speed)).max() * FPS < 3.0


def test_planted_feet_do_not_slide() -> None:
    joints = posed(*walking())
    floor = BODY.of_stature(BALL_HEIGHT)
    for foot in ("foot_left", "foot_right"):
        ball = joints[:, J[foot]]
        planted = np.abs(ball[:, 2] - floor) < 5e-4
        both = planted[1:] & planted[:-1]
        slide = np.linalg.norm(np.diff(ball[:, :2], axis=0), axis=1)[both]
        assert both.mean() > 0.3
        assert slide.max() < 2e-3


def test_knees_bend_forward_and_arms_swing_against_legs() -> None:
    joints = posed(*walking(np.array([[0.0, 0.0], [4.0, 0.0]])))[20:-40]
    for side in ("left", "right"):
        hip, knee, ankle = (joints[:, J[f"{n}_{side}"]] for n in ("hip", "knee", "ankle"))
        assert (knee[:, 0] >= (hip[:, 0] + ankle[:, 0]) / 2 - 0.01).all()
    step = joints[:, J["ankle_left"], 0] - joints[:, J["ankle_right"], 0]
    swing = joints[:, J["wrist_left"], 0] - joints[:, J["wrist_right"], 0]
    assert np.corrcoef(step, swing)[0, 1] < -0.8
    assert np.ptp(step) > 0.8  # two steps of .5 m and more


def test_legs_do_not_cross() -> None:
    joints = posed(*walking(np.array([[0.0, 0.0], [4.0, 0.0]])))
    for name in ("hip", "knee", "ankle"):
        assert (joints[:, J[f"{name}_left"], 1] - joints[:, J[f"{name}_right"], 1] > 0.05).all()


@pytest.mark.parametrize("turn", [-3.0, -1.0, 0.4, 2.0])
def test_turning_on_the_spot_ends_at_the_asked_heading(turn: float) -> None:
    start = standing(BODY, np.zeros(2), 0.5)
    chunk = walk(BODY, start, np.zeros((1, 2)), 0.5 + turn, 1.0, FPS)
    assert np.allclose(chunk.xy, 0)
    assert chunk.yaw[-1] == pytest.approx(0.5 + turn, abs=1e-6)
    assert np.abs(np.diff(chunk.yaw)).max() * FPS < 4.5


def test_sitting_ends_at_the_seat_with_feet_before_it() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    joints = posed(start, sit_down(start, SEAT, 1.3, FPS))[-1]
    assert np.allclose(joints[J["spine_base"]], SEAT.pelvis_m, atol=0.01)
    assert np.allclose(joints[[J["foot_left"], J["foot_right"]]], SEAT.balls_m, atol=0.002)
    for side in ("left", "right"):
        hip, knee, ankle, wrist = (joints[J[f"{n}_{side}"]] for n in ("hip", "knee", "ankle", "wrist"))
        assert knee[0] > hip[0] + 0.25
        assert abs(knee[0] - ankle[0]) < 0.15
        assert knee[2] - 0.05 < wrist[2] < hip[2] + 0.25


def test_getting_up_is_sitting_down_backwards() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    down = sit_down(start, SEAT, 1.3, FPS)
    joints = pose(BODY, concatenate([down, down.backwards()]), FPS, None)
    assert np.allclose(joints, joints[::-1], atol=1e-3)


@pytest.mark.parametrize("side", [0, 1])
def test_a_reaching_hand_arrives(side: int) -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    target = np.array([0.45, 0.2 if side == 0 else -0.2, 1.0])
    out = reach(start, side, target, 0.1, 0.0, 0.8, FPS)
    joints = posed(start, out, stand(out, 2.0, FPS))
    tip = joints[len(out) + 1 :, J["hand_tip_left" if side == 0 else "hand_tip_right"]]
    assert np.linalg.norm(tip - target, axis=1).max() < 5e-3
    other = joints[:, J["hand_tip_right" if side == 0 else "hand_tip_left"]]
    assert np.linalg.norm(other - other[0], axis=1).max() < 0.25


def test_two_minutes_are_posed_within_a_second() -> None:
    start, way = walking()
    chunks = [start, *([way] * (3600 // len(way) + 1))]
    begin = time.perf_counter()
    posed(*chunks)
    assert time.perf_counter() - begin < 1.0
