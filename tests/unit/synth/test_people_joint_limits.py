"""Joint limits: angles of known poses in closed form, and that no posture at all is solved beyond them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.joint_limits import LIMITS_RAD, joint_angles, limit_violations
from hsbench.synth.people.kinematics import Posture, solve

BODY = Body(1.72)
AT = {name: column for column, name in enumerate(LIMITS_RAD)}
POSTURES = 200


def any_postures(seed: int, wild: float) -> Posture:
    """Postures of every kind, most of them impossible; ``wild`` scales how far limbs are asked to go."""
    rng = np.random.default_rng(seed)
    pelvis = rng.uniform(-1, 1, (POSTURES, 3))
    angle = rng.uniform(-np.pi, np.pi, (9, POSTURES))
    return Posture(
        pelvis=pelvis,
        yaw=angle[0],
        tilt=angle[1],
        roll=angle[2],
        lean=angle[3],
        side=angle[4],
        twist=angle[5],
        look=angle[6:8].T,
        ball=pelvis[:, None] + wild * rng.normal(size=(POSTURES, 2, 3)),
        foot_yaw=rng.uniform(-np.pi, np.pi, (POSTURES, 2)),
        foot_pitch=rng.uniform(-1.5, 1.5, (POSTURES, 2)),
        tip=pelvis[:, None] + wild * rng.normal(size=(POSTURES, 2, 3)),
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([0.05, 0.4, 1.0, 5.0]))
def test_no_posture_breaks_a_limit_or_a_bone(seed: int, wild: float) -> None:
    joints = solve(BODY, any_postures(seed, wild))
    worst = limit_violations(joints).max(axis=0)
    assert worst.max() < 1e-6, list(LIMITS_RAD)[int(worst.argmax())]
    rest = solve(BODY, any_postures(0, 1.0))[0]
    for parent, child in KINECT_V2.bones:
        length = np.linalg.norm(joints[:, parent] - joints[:, child], axis=1)
        assert np.allclose(length, np.linalg.norm(rest[parent] - rest[child]), atol=1e-9), KINECT_V2.names[child]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32))
def test_no_bent_wrist_breaks_a_limit_or_a_bone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    held = standing(BODY, np.zeros(2), 0.3).hold(POSTURES)
    ways = rng.normal(size=(POSTURES, 2, 3))
    ways *= rng.uniform(0, 1, (POSTURES, 2, 1)) / np.linalg.norm(ways, axis=-1, keepdims=True)
    asked = replace(
        held,
        near=np.ones((POSTURES, 2)),
        offset=rng.normal(size=(POSTURES, 2, 3)) * rng.choice([0.05, 0.2, 0.5]),
        at_head=rng.integers(0, 2, (POSTURES, 2)).astype(float),
        pointing=ways,
    )
    joints = pose(BODY, asked, 1.0, None)
    assert limit_violations(joints).max() < 2e-3
    assert joint_angles(joints)[:, AT["wrist_left"]].max() > 0.1
    rest = pose(BODY, held.last(), 1.0, None)[0]
    for parent, child in KINECT_V2.bones:
        length = np.linalg.norm(joints[:, parent] - joints[:, child], axis=1)
        assert np.allclose(length, np.linalg.norm(rest[parent] - rest[child]), atol=3e-4), KINECT_V2.names[child]


def test_a_hand_that_points_keeps_its_tip_where_it_should_be() -> None:
    held = standing(BODY, np.zeros(2), 0.0).hold(3)
    place = np.tile([[0.20, 0.06, -0.10], [0.20, -0.06, -0.10]], (3, 1, 1))
    ways = np.array([0.0, 0.5, 0.8])[:, None, None] * np.tile([[0.5, -0.5, 0.7], [0.5, 0.5, 0.7]], (3, 1, 1))
    joints = pose(BODY, replace(held, near=np.ones((3, 2)), offset=place, pointing=ways), 1.0, None)
    for side in ("left", "right"):
        tip, wrist = joints[:, J[f"hand_tip_{side}"]], joints[:, J[f"wrist_{side}"]]
        assert np.allclose(tip, tip[0], atol=3e-4)
        along = (tip - wrist) / np.linalg.norm(tip - wrist, axis=1, keepdims=True)
        wanted = ways[1, 0 if side == "left" else 1] / np.linalg.norm(ways[1, 0])
        assert (np.diff(along @ wanted) > 0.02).all()


def limb(joints: np.ndarray, upper: tuple[str, ...], turned_rad: float, axis: np.ndarray) -> np.ndarray:
    """Joints of a limb turned about an axis through the first of them."""
    cross = np.cross(np.eye(3), axis)
    rotation = np.eye(3) + np.sin(turned_rad) * cross + (1 - np.cos(turned_rad)) * cross @ cross
    out, rows = joints.copy(), [J[name] for name in upper]
    out[0, rows[1:]] = joints[0, rows[0]] + (joints[0, rows[1:]] - joints[0, rows[0]]) @ rotation.T
    return out


@pytest.mark.parametrize(
    ("rows", "axis", "column"),
    [
        (("knee_left", "ankle_left"), (0, 1, 0), "knee_left"),
        (("hip_right", "knee_right"), (0, -1, 0), "hip_flexion_right"),
        (("hip_left", "knee_left"), (1, 0, 0), "hip_abduction_left"),
        (("shoulder_left", "elbow_left"), (0, 1, 0), "shoulder_back_left"),
        (("shoulder_right", "elbow_right"), (1, 0, 0), "shoulder_across_right"),
        (("neck", "head"), (0, 1, 0), "neck_bend"),
    ],
)
def test_a_turned_bone_shows_as_its_angle(rows: tuple[str, ...], axis: tuple[float, ...], column: str) -> None:
    upright = pose(BODY, standing(BODY, np.zeros(2), 0.0), 30, None)
    for name in ("knee", "ankle", "elbow"):  # straight limbs below hips and shoulders, hands as they are
        for side in ("left", "right"):
            parent = {"knee": "hip", "ankle": "knee", "elbow": "shoulder"}[name]
            length = np.linalg.norm(upright[0, J[f"{name}_{side}"]] - upright[0, J[f"{parent}_{side}"]])
            upright[0, J[f"{name}_{side}"]] = upright[0, J[f"{parent}_{side}"]] - [0, 0, length]
    before = joint_angles(upright)[0, AT[column]]
    for turn in (0.2, 0.5):
        after = joint_angles(limb(upright, rows, turn, np.array(axis, dtype=float)))[0, AT[column]]
        assert after - before == pytest.approx(turn, abs=1e-3)


@pytest.mark.parametrize("bend", [0.0, 0.4, 1.2, 2.0])
def test_a_wrist_is_bent_by_the_angle_between_forearm_and_hand(bend: float) -> None:
    joints = pose(BODY, standing(BODY, np.zeros(2), 0.0), 30, None)
    wrist, elbow = joints[0, J["wrist_left"]], joints[0, J["elbow_left"]]
    fore = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    across = np.cross(fore, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(fore, [0.0, 1.0, 0.0]))
    joints[0, J["hand_tip_left"]] = wrist + 0.18 * (np.cos(bend) * fore + np.sin(bend) * across)
    assert joint_angles(joints)[0, AT["wrist_left"]] == pytest.approx(bend, abs=1e-9)
    assert limit_violations(joints)[0, AT["wrist_left"]] == pytest.approx(max(bend - np.radians(70), 0.0), abs=1e-9)


def test_violations_are_what_is_beyond_the_range() -> None:
    upright = pose(BODY, standing(BODY, np.zeros(2), 0.0), 30, None)
    assert (limit_violations(upright) == 0).all()
    folded = limb(upright, ("knee_left", "ankle_left"), 2.8, np.array([0.0, 1.0, 0.0]))
    beyond = limit_violations(folded)[0]
    assert np.flatnonzero(beyond).tolist() == [AT["knee_left"]]
    assert beyond[AT["knee_left"]] == pytest.approx(joint_angles(folded)[0, AT["knee_left"]] - np.radians(135))
