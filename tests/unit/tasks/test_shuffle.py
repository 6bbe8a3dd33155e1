"""Shuffled activity: a turn about the camera, clipped, the best of all turns, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.polygons import contains
from hsbench.schema.poses import PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.tasks.shuffle import TURNS, shuffled_poses, turn_inside, turned

L_ROOM = np.array([[-2.0, -1.5], [2.5, -1.5], [2.5, 0.5], [0.5, 0.5], [0.5, 2.0], [-2.0, 2.0]])


def somewhere(seed: int, n: int = 120) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.4, 1.3, (n, 2))


def poses(seed: int, n: int = 40) -> PoseTable:
    rng = np.random.default_rng(seed)
    joints = rng.normal(0, 0.3, (n, 25, 3)) + np.append(rng.normal(0, 1.5, 2), 1.0)
    joints[..., :2] += rng.normal(0, 1, (n, 1, 2))
    state = rng.integers(0, 3, (n, 25)).astype(np.uint8)
    state[3] = 0
    joints[state == 0] = np.nan
    stamps = np.arange(n, dtype=np.int64) * 10
    return PoseTable(KINECT_V2.name, stamps, np.ones(n, np.int32), state, joints.astype(np.float32))


@given(st.integers(0, 99), st.integers(0, 99))
def test_it_is_the_best_of_even_turns_about_a_point(points_seed: int, seed: int) -> None:
    points, about, onto = somewhere(points_seed), np.array([0.3, -0.2]), np.array([-0.1, 0.4])
    angle, kept = turn_inside(points, L_ROOM, np.random.default_rng(seed), about, onto)
    start = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    step = (angle - start) / (2 * np.pi / TURNS)
    assert abs(step - round(step)) < 1e-9
    counts = []
    for k in range(TURNS):
        z = (points - about) @ [1, 1j] * np.exp(1j * (start + 2 * np.pi * k / TURNS)) + onto @ [1, 1j]
        counts.append(int(contains(L_ROOM, np.stack([z.real, z.imag], axis=-1)).sum()))
    assert kept.sum() == max(counts)
    assert np.array_equal(kept, contains(L_ROOM, turned(points, angle, about, onto)))


def test_a_quarter_turn_by_hand() -> None:
    found = turned(np.array([[2.0, 0.0, 0.7], [1.0, 3.0, 1.2]]), np.pi / 2, (1.0, 0.0), (5.0, 5.0))
    assert np.allclose(found, [[5.0, 6.0, 0.7], [2.0, 5.0, 1.2]])


def test_points_without_a_place_are_dropped() -> None:
    points = somewhere(1)
    points[::3, 1] = np.nan
    _, kept = turn_inside(points, L_ROOM * 100, np.random.default_rng(0))
    assert kept.tolist() == np.isfinite(points).all(axis=1).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_poses_keep_all_but_their_place(seed: int) -> None:
    other = poses(seed)
    found = shuffled_poses(other, L_ROOM, np.random.default_rng(seed))
    rows = found.timestamp_ns // 10  # the stamp tells which pose it was
    assert 0 < len(found) < len(other)
    assert np.array_equal(found.joint_state, other.joint_state[rows])
    before, after = other.joints_m[rows].astype(float), found.joints_m.astype(float)
    assert np.array_equal(before[..., 2], after[..., 2], equal_nan=True)
    known = before[np.isfinite(before[..., 0])], after[np.isfinite(before[..., 0])]
    a, b = (p[..., 0] + 1j * p[..., 1] for p in known)
    turn = (b @ a.conj()) / abs(b @ a.conj())
    assert np.allclose(a * turn, b, atol=1e-5)  # one turn about the camera, joints rounded to float32
    assert contains(L_ROOM, np.nanmean(after[..., :2], axis=1)).all()
    assert 3 not in rows  # a pose without a known joint is nowhere


def test_the_draw_decides_and_nothing_else() -> None:
    first, again, another = (shuffled_poses(poses(0), L_ROOM, np.random.default_rng(k)) for k in (5, 5, 6))
    assert np.array_equal(first.joints_m, again.joints_m, equal_nan=True)
    assert len(first) != len(another) or not np.array_equal(first.joints_m, another.joints_m, equal_nan=True)


def test_nobody_stays_nobody_and_pixels_are_refused() -> None:
    nobody = poses(0).select(np.zeros(40, dtype=bool))
    assert len(shuffled_poses(nobody, L_ROOM, np.random.default_rng(0))) == 0
    flat = PoseTable(
        "coco-18", np.zeros(1, np.int64), np.ones(1, np.int32), np.full((1, 18), 2, np.uint8), None,
        np.ones((1, 18, 2), np.float32),
    )  # fmt: skip
    with pytest.raises(SchemaError, match=r"no joints in metres.*estimate their depth"):
        shuffled_poses(flat, L_ROOM, np.random.default_rng(0))
