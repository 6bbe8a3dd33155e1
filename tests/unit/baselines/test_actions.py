"""Action recognition: speeds of known motion, votes by plain loops, a table by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lived_rooms import figure

from hsbench.baselines.controls.actions import (
    AROUND_S,
    KINDS_ALONE,
    KINDS_IN_CONTEXT,
    alone,
    fit_table,
    in_context,
    pooled,
    speed,
)
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import COCO_18
from hsbench.schema.states import Action


def table(joints: np.ndarray, seconds: np.ndarray, tracks: np.ndarray) -> PoseTable:
    state = np.where(np.isnan(joints).any(axis=-1), 0, 2).astype(np.uint8)
    stamps = np.round(seconds * 1e9).astype(np.int64)
    return PoseTable(COCO_18.name, stamps, tracks.astype(np.int32), state, joints.astype(np.float32))


def test_speed_is_that_of_the_motion_and_tracks_are_apart() -> None:
    seconds = np.repeat(np.arange(30) * 0.1, 2)
    tracks = np.tile([1, 2], 30)
    places = np.stack([np.where(tracks == 1, 1.0 + 1.2 * seconds, -2.0), np.full(60, 1.0)], axis=-1)
    joints = np.stack([figure((1.0, 1.0)) + np.append(p - 1.0, 0.0) for p in places])
    found = speed(table(joints, seconds, tracks))
    assert found[tracks == 1] == pytest.approx(1.2, abs=1e-4)
    assert found[tracks == 2] == pytest.approx(0.0, abs=1e-4)
    once = speed(table(joints[:2], seconds[:2], tracks[:2]))
    assert np.isnan(once).all()


@given(st.integers(0, 99))
def test_votes_by_plain_loops(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 40))
    seconds, tracks = np.arange(n) // 2 * 0.2, np.arange(n) % 2
    poses = table(np.zeros((n, 18, 3)), seconds, tracks)
    action = rng.integers(1, 4, n).astype(np.uint8)
    for row, found in enumerate(pooled(action, poses)):
        near = [
            action[k]
            for k in range(n)
            if tracks[k] == tracks[row] and abs(poses.timestamp_ns[k] - poses.timestamp_ns[row]) <= AROUND_S / 2 * 1e9
        ]
        assert found == max(Action.STAND, Action.SIT, Action.INTERACT, key=lambda a: (near.count(a), -a))


def test_a_table_takes_the_action_under_which_a_kind_is_most_probable() -> None:
    kinds = np.array([0, 0, 0, 0, 1, 1, 0, 2])
    action = np.array([1, 1, 1, 1, 1, 2, 2, 0], dtype=np.uint8)
    # kind 0: 4 of 5 stand, 1 of 2 sit; kind 1: 1 of 5 and 1 of 2; kind 2 is ignored, 3 never seen: most often stand
    assert fit_table([(kinds[:3], action[:3]), (kinds[3:], action[3:])], 4).tolist() == [1, 2, 1, 1]


def test_every_pose_has_a_kind() -> None:
    rng = np.random.default_rng(0)
    joints = rng.uniform(-3, 3, (300, 18, 3))
    joints[rng.random((300, 18)) < 0.4] = np.nan
    poses = table(joints, np.arange(300) * 0.1, rng.integers(0, 3, 300))
    for kinds, most in ((alone(poses), KINDS_ALONE), (in_context(poses), KINDS_IN_CONTEXT)):
        assert kinds.shape == (300,)
        assert kinds.min() >= 0
        assert kinds.max() < most
