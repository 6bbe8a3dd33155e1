"""Motions: rigid bones, planted feet, bounded speeds, limbs that bend the right way."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.footfalls import soles, stance_slides
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.motion import (
    SeatPose,
    carry,
    look,
    reach,
    reach_both,
    scoot,
    shift,
    sit_down,
    stand,
    walk,
)
from hsbench.synth.people.style import Style

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


CIRCLE = np.stack([np.cos(np.linspace(0, 6, 60)), np.sin(np.linspace(0, 6, 60))], axis=1)
ROUTES = {
    "straight": np.array([[0.0, 0.0], [4.0, 0.0]]),
    "bend": BEND,
    "hairpin": np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.4], [0.0, 0.4]]),
    "circle": CIRCLE,
}
STRIDES = [Style(), Style(cadence=0.9, step_width=1.2), Style(cadence=1.1, step_width=0.75)]


@pytest.mark.parametrize("speed", [0.4, 0.8, 1.2, 1.6])
@pytest.mark.parametrize("route", list(ROUTES))
def test_at_any_speed_and_on_curves_feet_stand_still_and_no_joint_goes_too_far(route: str, speed: float) -> None:
    for stature, style in zip((1.55, 1.75, 1.95), STRIDES, strict=True):
        body = Body(stature, style=style)
        start = standing(body, ROUTES[route][0], 0.0)
        joints = posed(start, walk(body, start, ROUTES[route], 0.5, speed, FPS), body=body)
        slides = stance_slides(body, joints)
        assert len(slides) > 12
        assert np.median(slides) < 0.003
        assert slides.max() < 0.01
        assert soles(body, joints)[..., 2].min() > -2e-3
        assert limit_violations(joints).max() < 2e-3
        trunk = np.linalg.norm(np.diff(joints[:, J["spine_base"]], axis=0), axis=1) * FPS
        hands = np.diff(joints[:, [J["hand_tip_left"], J["hand_tip_right"]]] - joints[:, [J["spine_base"]]], axis=0)
        assert trunk.max() < speed + 0.15
        assert (np.linalg.norm(hands, axis=2) * FPS).max() < 3.4


def test_a_dragged_foot_is_seen_to_slide() -> None:
    body = Body(1.75)
    still = pose(body, stand(standing(body, np.zeros(2), 0.0), 1.0, FPS), FPS, None)
    dragged = still.copy()
    dragged[:, :, 0] += np.linspace(0, 0.2, len(still))[:, None]
    assert stance_slides(body, still) == pytest.approx(np.zeros(4), abs=1e-9)
    assert stance_slides(body, dragged) == pytest.approx(np.full(4, 0.2), abs=1e-6)


def test_faster_walkers_take_longer_and_quicker_steps() -> None:
    body, route = Body(1.75), np.array([[0.0, 0.0], [12.0, 0.0]])
    steps, seconds = [], []
    for speed in (0.6, 0.9, 1.2, 1.5):
        chunk = walk(body, standing(body, route[0], 0.0), route, None, speed, FPS)
        middle = slice(len(chunk) // 3, 2 * len(chunk) // 3)
        rate = np.diff(chunk.phase[middle]).mean() * FPS
        steps.append(speed / rate)
        seconds.append(1 / rate)
    assert (np.diff(steps) > 0.03).all()
    assert (np.diff(seconds) < -0.03).all()
    ratio = np.array(steps) * np.array(seconds) / 60 / body.stature_m  # Sekiya & Nagasaki: the same at every speed
    assert ratio == pytest.approx(0.0037, rel=0.1)


def test_a_style_shows_in_steps_swing_and_glances() -> None:
    calm, lively = (
        Body(1.75, style=Style(cadence=c, arm_swing=a, step_width=w, gaze=g))
        for c, a, w, g in ((0.9, 0.6, 0.75, 0.4), (1.1, 1.3, 1.2, 1.4))
    )
    measures = []
    for body in (calm, lively):
        start = standing(body, np.zeros(2), 0.0)
        way = walk(body, start, np.array([[0.0, 0.0], [4.0, 0.0]]), None, 1.0, FPS)
        joints = posed(start, way, body=body)
        hand = joints[:, J["hand_left"], 0] - joints[:, J["spine_base"], 0]
        rest = posed(stand(start, 20.0, FPS), body=body)
        glances = rest[:, J["head"], 1] - rest[:, J["neck"], 1]
        width = np.ptp(joints[0, [J["ankle_left"], J["ankle_right"]], 1])
        measures.append([way.phase[-1], np.ptp(hand), width, np.ptp(glances)])
    assert (np.array(measures[1]) > 1.15 * np.array(measures[0])).all()


@pytest.mark.parametrize("wrong", [{"cadence": 3.0}, {"lean_rad": 5.0}, {"hand": 2}, {"gaze": float("nan")}])
def test_impossible_styles_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(SchemaError, match=f"style.{next(iter(wrong))} is"):
        Style(**wrong)


def test_both_hands_arrive_and_return() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    targets = np.array([[0.42, 0.2, 0.95], [0.42, -0.2, 1.05]])
    out = reach_both(start, targets, 0.1, 0.0, 0.8, FPS)
    joints = posed(start, out, stand(out, 1.0, FPS), out.backwards(), start)
    tips = joints[len(out) + 1 : len(out) + FPS, [J["hand_tip_left"], J["hand_tip_right"]]]
    assert np.linalg.norm(tips - targets, axis=2).max() < 5e-3
    assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 3.0
    assert np.linalg.norm(joints[-1] - joints[0], axis=1).max() < 0.05


def test_a_second_reach_goes_on_from_the_first() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    first, second = np.array([0.42, -0.1, 1.0]), np.array([0.40, -0.35, 1.1])
    out = reach(start, 1, first, 0.1, 0.0, 0.8, FPS)
    on = reach(out, 1, second, 0.1, 0.0, 0.8, FPS)
    tip = pose(BODY, concatenate([start, out, on]), FPS, None)[:, J["hand_tip_right"]]
    assert np.linalg.norm(tip[len(out)] - first) < 5e-3
    assert np.linalg.norm(tip[-1] - second) < 5e-3
    assert (np.linalg.norm(np.diff(tip, axis=0), axis=1) * FPS).max() < 3.0


def test_a_hand_forgets_what_it_touched_elsewhere() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    out = reach(start, 1, np.array([0.42, -0.1, 1.0]), 0.1, 0.0, 0.8, FPS)
    way = walk(BODY, out.backwards(), np.array([[0.0, 0.0], [4.0, 0.0]]), 0.0, 1.1, FPS)
    on = reach(way, 1, np.array([4.42, -0.1, 1.0]), 0.1, 0.0, 0.8, FPS)
    tip = posed(way.last(), on, seed=1)[:, J["hand_tip_right"]]
    assert (np.linalg.norm(np.diff(tip, axis=0), axis=1) * FPS).max() < 2.5
    assert np.linalg.norm(tip[-1] - [4.42, -0.1, 1.0]) < 5e-3


@pytest.mark.parametrize("shift_m", [(0.35, 0.0), (-0.3, 0.05)])
def test_who_scoots_on_a_seat_steps_along(shift_m: tuple[float, float]) -> None:
    down = sit_down(standing(BODY, np.zeros(2), 0.0), SEAT, 1.3, FPS)
    chunk = scoot(down, np.array(shift_m), 1.2, FPS)
    joints = pose(BODY, concatenate([down.last(), chunk]), FPS, None)
    assert np.abs(joints[-1] - joints[0] - [*shift_m, 0.0]).max() < 1e-3
    assert np.median(stance_slides(BODY, joints)) < 0.01
    assert limit_violations(joints).max() < 2e-3
    assert np.ptp(joints[:, J["spine_base"], 2]) < 1e-3


def test_feet_step_onto_their_places_before_a_seat() -> None:
    start = standing(BODY, np.array([-0.05, 0.02]), 0.3)
    down = sit_down(start, SEAT, 1.3, FPS)
    joints = pose(BODY, concatenate([start, down, stand(down, 1.0, FPS)]), FPS, None)
    assert np.median(stance_slides(BODY, joints)) < 0.01
    assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 3.0
    assert limit_violations(joints).max() < 2e-3


def test_a_load_is_carried_before_the_belly_and_put_down() -> None:
    start, way = walking(np.array([[0.0, 0.0], [4.0, 0.0]]))
    load = carry(way, 1.0)
    assert np.array_equal(load.xy, way.xy)
    joints, free = posed(start, load), posed(start, way)
    hands = joints[:, [J["hand_left"], J["hand_right"]]] - joints[:, [J["spine_base"]]]
    middle = hands[len(hands) // 3 : -len(hands) // 3]
    assert (middle[..., 0] > 0.2).all()
    assert (np.abs(np.diff(middle, axis=0)) * FPS).max() < 0.6  # nothing is spilt
    assert np.abs(joints[-1] - free[-1]).max() < 1e-3
    assert (np.linalg.norm(np.diff(hands, axis=0), axis=2) * FPS).max() < 3.0


def test_a_look_turns_the_head_and_nothing_else() -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    gaze = look(start, 0.8, -0.3, 0.6, FPS)
    before, after = (pose(BODY, c, FPS, None)[0] for c in (start, gaze.last()))
    assert np.array_equal(np.delete(before, J["head"], axis=0), np.delete(after, J["head"], axis=0))
    assert after[J["head"], 1] > before[J["head"], 1] + 0.01
    assert gaze.look[-1].tolist() == [0.8, -0.3]


@pytest.mark.parametrize("seated", [False, True])
def test_a_shift_of_weight_ends_where_it_began_with_feet_and_seat_in_place(seated: bool) -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    before = sit_down(start, SEAT, 1.3, FPS) if seated else start
    chunk = shift(before, 4.0, FPS, np.random.default_rng(1))
    joints = pose(BODY, concatenate([before.last(), chunk]), FPS, None)
    assert np.abs(joints[-1] - joints[0]).max() < 1e-3
    feet = joints[:, [J["foot_left"], J["foot_right"]]]
    assert np.abs(feet - feet[0]).max() < 1e-3
    moved = np.linalg.norm(joints[:, J["spine_base"]] - joints[0, J["spine_base"]], axis=1).max()
    assert 0.003 < moved < (0.01 if seated else 0.05)
    assert np.linalg.norm(joints[:, J["head"]] - joints[0, J["head"]], axis=1).max() > 0.01


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
