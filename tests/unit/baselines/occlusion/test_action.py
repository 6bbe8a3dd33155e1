"""Standing or sitting: hand-made poses, joints that are not tracked, the running majority against plain counting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.schema.states import Action

CONFIG = CarveConfig()
ALONE = CarveConfig(vote_frames=1)
NAMES = KINECT_V2.names
LEG = [NAMES.index(n) for n in ("knee_left", "ankle_left", "foot_left", "knee_right", "ankle_right", "foot_right")]

STANDING = {"hip": (0.0, 0.92), "knee": (0.02, 0.5), "ankle": (0.0, 0.08), "foot": (0.1, 0.03)}
SITTING = {"hip": (0.0, 0.55), "knee": (0.41, 0.52), "ankle": (0.4, 0.1), "foot": (0.5, 0.05)}


def skeleton(legs: dict[str, tuple[float, float]], x: float = 2.0, y: float = 1.0) -> np.ndarray:
    """(25, 3) a person at (x, y) facing +x, legs as (forward, height) of each joint, the trunk above the hips."""
    hip = legs["hip"][1]
    rise = {"spine_base": 0, "spine_mid": 0.25, "spine_shoulder": 0.45, "neck": 0.52, "head": 0.68}
    joints = np.zeros((25, 3))
    for k, name in enumerate(NAMES):
        part = name.removesuffix("_left").removesuffix("_right")
        side = 0.12 * (name.endswith("_left") - name.endswith("_right"))
        forward, height = legs.get(part, (0.0, hip + rise.get(name, 0.3)))
        joints[k] = (x + forward, y + side, height)
    return joints


def table(joints: list[np.ndarray], states: np.ndarray | None = None, tracks: list[int] | None = None) -> PoseTable:
    values = np.array(joints, dtype=np.float32).reshape(-1, 25, 3)
    n = len(values)
    state = np.full((n, 25), JointState.TRACKED, np.uint8) if states is None else np.asarray(states, np.uint8)
    values[state == JointState.MISSING] = np.nan
    track = np.ones(n, np.int32) if tracks is None else np.array(tracks, np.int32)
    return PoseTable(KINECT_V2.name, np.arange(n, dtype=np.int64) * 33_000_000, track, state, values)


def lost(joints: list[int], how: JointState = JointState.INFERRED, n: int = 1) -> np.ndarray:
    state = np.full((n, 25), JointState.TRACKED)
    state[:, joints] = how
    return state


def actions(poses: PoseTable, config: CarveConfig = ALONE) -> list[Action]:
    return [Action(a) for a in recognise(poses, config).action]


def test_standing_and_sitting() -> None:
    found = recognise(table([skeleton(STANDING), skeleton(SITTING, -1.0, 3.0)]), ALONE)
    assert list(found.action) == [Action.STAND, Action.SIT]
    assert np.allclose(found.position, [[2.0, 1.0], [-1.0, 3.0]], atol=1e-6)
    assert np.allclose(found.pelvis_m, [0.92, 0.55], atol=1e-6)
    assert list(found.of(Action.SIT).pelvis_m) == [found.pelvis_m[1]]


def test_a_lifted_knee_is_still_standing() -> None:
    walking = skeleton(STANDING)
    walking[NAMES.index("knee_right")] += (0.4, 0, 0.35)
    assert actions(table([walking])) == [Action.STAND]


@pytest.mark.parametrize(
    ("legs", "expected"),
    [
        ({"hip": (0.0, CONFIG.pelvis_stand_m + 0.01), "knee": (0.0, 0.3)}, [Action.STAND]),
        ({"hip": (0.0, CONFIG.pelvis_stand_m - 0.01), "knee": (0.0, 0.3)}, []),  # straight, but the pelvis is too low
        ({**SITTING, "hip": (0.0, 0.74), "knee": (0.41, 0.7)}, [Action.SIT]),
        ({**SITTING, "hip": (0.0, 0.76), "knee": (0.41, 0.72)}, []),  # bent, but too high for a seat
        ({**SITTING, "hip": (0.0, 0.26), "knee": (0.4, 0.4)}, [Action.SIT]),
        ({**SITTING, "hip": (0.0, 0.24), "knee": (0.4, 0.4)}, []),  # on the floor
        ({"hip": (0.0, 0.8), "knee": (0.33, 0.55)}, []),  # in between: .25 / .414 is neither
    ],
)
def test_limits(legs: dict[str, tuple[float, float]], expected: list[Action]) -> None:
    assert actions(table([skeleton(legs)])) == expected


@pytest.mark.parametrize("how", [JointState.INFERRED, JointState.MISSING])
def test_without_tracked_legs_the_head_decides(how: JointState) -> None:
    poses = [skeleton(STANDING), skeleton(SITTING)]
    assert actions(table(poses, lost(LEG, how, 2))) == [Action.STAND, Action.SIT]
    low = skeleton(SITTING)
    low[:, 2] -= 0.5  # head at .73: lying or crouching
    assert actions(table([low], lost(LEG, how))) == []
    between = skeleton(SITTING)
    between[:, 2] += 0.145  # head at 1.375: between the two ranges
    assert actions(table([between], lost(LEG, how))) == []


def test_without_a_head_the_neck_decides() -> None:
    without = [*LEG, NAMES.index("head")]
    assert actions(table([skeleton(STANDING), skeleton(SITTING)], lost(without, n=2))) == [Action.STAND, Action.SIT]
    without.append(NAMES.index("neck"))
    assert actions(table([skeleton(STANDING)], lost(without))) == []


def test_one_tracked_leg_is_enough_and_outvotes_the_head() -> None:
    right = [NAMES.index(n) for n in ("knee_right", "hip_right")]
    bent = skeleton(SITTING)
    bent[NAMES.index("head"), 2] = 1.6  # would stand by the head
    assert actions(table([bent], lost(right))) == [Action.SIT]


def test_joints_that_are_not_tracked_move_nothing() -> None:
    """Whatever an inferred joint says, the answer is that of a missing one."""
    rng = np.random.default_rng(0)
    poses = [skeleton(STANDING if k % 2 else SITTING, *rng.uniform(-3, 3, 2)) for k in range(40)]
    untracked = rng.random((40, 25)) < 0.4
    wild = np.where(untracked[..., None], rng.uniform(-9, 9, (40, 25, 3)), np.array(poses))
    inferred, missing = (
        np.where(untracked, how, JointState.TRACKED) for how in (JointState.INFERRED, JointState.MISSING)
    )
    a, b = recognise(table(list(wild), inferred), ALONE), recognise(table(poses, missing), ALONE)
    assert len(a.action) > 20
    assert np.array_equal(a.action, b.action)
    assert np.allclose(a.position, b.position, atol=1e-5)
    assert np.allclose(a.pelvis_m, b.pelvis_m, atol=1e-5, equal_nan=True)


def test_nothing_tracked_is_left_out() -> None:
    for how in (JointState.INFERRED, JointState.MISSING):
        assert actions(table([skeleton(STANDING)], lost(list(range(25)), how))) == []
    assert actions(table([])) == []


def test_a_place_needs_the_torso() -> None:
    torso = [k for k, n in enumerate(NAMES) if n.startswith(("spine", "neck", "hip", "shoulder"))]
    assert actions(table([skeleton(STANDING)], lost(torso))) == []  # the head would say: standing


def test_turning_and_shifting_the_world_turns_and_shifts_the_places() -> None:
    rng = np.random.default_rng(1)
    poses = np.array([skeleton(STANDING if k % 3 else SITTING, *rng.uniform(-2, 2, 2)) for k in range(30)])
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    before, after = recognise(table(list(poses)), CONFIG), recognise(table(list(poses @ turn.T + (1, -2, 0))), CONFIG)
    assert np.array_equal(before.action, after.action)
    assert np.allclose(before.position @ turn[:2, :2].T + (1, -2), after.position, atol=1e-5)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from("us-"), st.sampled_from((1, 2))), max_size=40), st.sampled_from((1, 3, 15)))
def test_votes_are_pooled_over_the_poses_of_a_track(votes: list[tuple[str, int]], frames: int) -> None:
    """Against counting the votes in a window around every pose; a tie or no vote is left out."""
    kinds = {"u": skeleton(STANDING), "s": skeleton(SITTING), "-": skeleton({"hip": (0.0, 0.8), "knee": (0.33, 0.55)})}
    poses = [kinds[v] + (k, 0, 0) for k, (v, _) in enumerate(votes)]
    found = recognise(table(poses, tracks=[t for _, t in votes]), CarveConfig(vote_frames=frames))
    expected = []
    for k, (_, track) in enumerate(votes):
        own = [i for i, (_, t) in enumerate(votes) if t == track]
        at, half = own.index(k), frames // 2
        window = [votes[i][0] for i in own[max(0, at - half) : at + half + 1]]
        balance = window.count("u") - window.count("s")
        if balance:
            expected.append((2.0 + k, Action.STAND if balance > 0 else Action.SIT))
    assert list(zip(found.position[:, 0].round(3), found.action, strict=True)) == expected
