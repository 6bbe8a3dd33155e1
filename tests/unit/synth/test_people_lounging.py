"""Leaning back: the pelvis slides as asked, the trunk tilts as asked, feet stay on the floor, nothing breaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hsbench.geometry.capsules import segment_hits
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import SceneObject
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.lounging import GRAZE_M, MOST_RAD, TRUNK, at_ease
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import CAPSULE_JOINTS, Body, J, capsules
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.lounging import shuffle
from hsbench.synth.people.motion import LEGS, SeatPose, gesture, lean_back, sit_down
from tests.unit.synth.living_rooms import bed, part, room

FPS = 30
BODIES = [Body(1.58, 1.1, shape="woman-small"), Body(1.78), Body(1.93, 0.98, shape="man-tall")]
SEAT_M = 0.43


def seated(body: Body, x: float = 0.0) -> Channels:
    """On a seat at x, facing -x, as far from its front edge as people sit down."""
    hip = SEAT_M + body.radius(anatomy.RADIUS_BELLY[0])
    knee = body.of_stature(anatomy.THIGH + anatomy.BALL_FORWARD)
    balls = ((x - knee, -0.09, 0.03), (x - knee, 0.09, 0.03))
    seat = SeatPose((x, 0.0, hip), np.pi, balls)
    return sit_down(standing(body, np.array([x - 0.4, 0.0]), np.pi), seat, 1.3, FPS)


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
@pytest.mark.parametrize("legs", LEGS)
@pytest.mark.parametrize("tilt", [0.0, 0.2, 0.45])
def test_the_trunk_leans_and_the_pelvis_slides_as_asked(body: Body, legs: str, tilt: float) -> None:
    start = seated(body)
    back = lean_back(body, start, 0.12, tilt, legs, 1.4, FPS)
    joints = pose(body, concatenate([start.last(), back, back.last().hold(FPS), back.backwards()]), FPS, None)
    easy = joints[len(back) + FPS // 2]
    assert easy[J["spine_base"]] - joints[0, J["spine_base"]] == pytest.approx([0.12, 0.0, 0.0], abs=2e-3)
    low = easy[J["spine_mid"]] - easy[J["spine_base"]]
    rounded = np.arctan2(low[0], low[2]) - tilt  # half of the bend of the spine, forwards
    assert -0.1 < rounded < 0.01
    low, high = sorted(easy[[J["foot_left"], J["foot_right"]], 2])
    assert low < 0.05
    assert high < (0.16 if legs == "crossed" else 0.05)
    assert limit_violations(joints).max() < 2e-3
    assert (np.linalg.norm(np.diff(joints, axis=0), axis=2) * FPS).max() < 3.0
    assert np.allclose(joints[-1], joints[1], atol=0.02)


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_ankles_cross_without_touching(body: Body) -> None:
    easy = lean_back(body, seated(body), 0.05, 0.3, "crossed", 1.4, FPS).last()
    joints = pose(body, easy, FPS, None)
    left = joints[0, J["foot_left"], 1] - joints[0, J["foot_right"], 1]
    assert left > 0.02  # facing -x, the own left is -y
    ends, radii = capsules(body, joints)
    legs = {side: [k for k, names in enumerate(CAPSULE_JOINTS) if f"ankle_{side}" in names] for side in anatomy.SIDES}
    for a in legs["left"]:
        for b in legs["right"]:
            grown = radii[a].min() - 0.02
            near, far = radii[b, 0] + grown, radii[b, 1] + grown
            assert not segment_hits(ends[0, a, 0], ends[0, a, 1], ends[0, b, 0], ends[0, b, 1], near, far)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_backs_meet_the_backrest_of_a_sofa(body: Body, seed: int) -> None:
    parts = (
        part("base", (-0.9, -0.40, 0.1), (0.9, 0.40, 0.3)),
        part("seat", (-0.9, -0.45, 0.3), (0.9, 0.12, 0.43), "seat"),
        part("back", (-0.9, 0.12, 0.3), (0.9, 0.40, 0.85)),
    )
    # Facing -x: the back begins at x = 3.12, the front of the seat is at 2.55.
    scene = room(5.0, 5.0, SceneObject(10, "sofa", planar(3.0, 2.5, -np.pi / 2), parts))
    obstacles = Obstacles.of(scene)
    start = seated(body, 2.85)
    start = _moved(start, 2.5)
    easy = at_ease(body, start.last(), obstacles, 10, FPS, np.random.default_rng(seed), anywhere)
    assert easy is not None
    tilt = -float(easy.tilt[-1])
    assert 0.0 < tilt <= MOST_RAD
    line = concatenate([easy, gesture(easy, "read", 4.0, FPS, np.random.default_rng(0))])
    depth = body_depth(obstacles, body, pose(body, easy, FPS, None), 10)
    assert depth.max() <= GRAZE_M + 1e-3
    ends, radii = capsules(body, pose(body, easy.last(), FPS, None))
    behind = max(ends[0, k, e, 0] + radii[k, e] for k in TRUNK for e in (0, 1))
    assert behind > 3.12 - 0.03
    assert limit_violations(pose(body, line, FPS, None)).max() < 2e-3


def test_without_a_backrest_one_stays_upright() -> None:
    scene = room(6.0, 5.0, bed(10, 3.3, 2.5, 0.0))
    start = _moved(seated(BODIES[1], 2.8), 2.5)
    assert at_ease(BODIES[1], start.last(), Obstacles.of(scene), 10, FPS, np.random.default_rng(0), anywhere) is None


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_nobody_slides_off_a_seat_to_lean_on_a_wall(body: Body) -> None:
    wall = SceneObject(11, "wardrobe", planar(3.0, 2.5, 0.0), (part("case", (0.3, -1.0, 0.0), (0.5, 1.0, 2.0)),))
    stool = SceneObject(
        10, "stool", planar(2.8, 2.5, 0.0), (part("seat", (-0.25, -0.3, 0.3), (0.2, 0.3, 0.43), "seat"),)
    )
    obstacles = Obstacles.of(room(5.0, 5.0, stool, wall))
    start = _moved(seated(body, 2.85), 2.5)
    for edge_x, leans in ((np.inf, True), (3.0, False)):  # to rest on the wall a pelvis gets beyond 3.0

        def is_on(xy: np.ndarray, edge_x: float = edge_x) -> np.ndarray:
            return xy[:, 0] <= edge_x

        easy = at_ease(body, start.last(), obstacles, 10, FPS, np.random.default_rng(0), is_on)
        assert easy is None or easy.xy[:, 0].max() <= edge_x
        assert (easy is not None and easy.xy[:, 0].max() > 3.0) == leans


def anywhere(xy: np.ndarray) -> np.ndarray:
    return np.ones(len(xy), dtype=bool)


def _moved(line: Channels, y: float) -> Channels:
    """The same along y."""
    ball = line.feet.ball + [0.0, y, 0.0]
    return replace(line, xy=line.xy + [0.0, y], feet=replace(line.feet, ball=ball))


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
@pytest.mark.parametrize(("ground_m", "away"), [(0.0, (0.05, 0.14)), (0.0, (-0.1, -0.1)), (SEAT_M, (0.14, 0.05))])
def test_one_moves_along_a_seat_with_the_pelvis_on_it_and_the_feet_on_the_ground(
    body: Body, ground_m: float, away: tuple[float, float]
) -> None:
    start = seated(body)
    goal = start.last().xy[0] + away
    moved = shuffle(body, start, goal, ground_m, 0.7, FPS)
    joints = pose(body, moved, FPS, None)
    assert joints[-1, J["spine_base"], :2] == pytest.approx(goal, abs=2e-4)
    assert np.abs(joints[:, J["spine_base"], 2] - start.height[-1]).max() < 0.01
    assert moved.feet.ball[-1, :, 2] == pytest.approx(ground_m + body.of_stature(anatomy.BALL_HEIGHT), abs=1e-3)
    assert (moved.yaw == start.yaw[-1]).all()
    assert not limit_violations(joints).any()
