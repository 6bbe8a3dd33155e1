"""Swept volume against spheres sampled along each capsule, voxel by voxel and pose by pose."""

from __future__ import annotations

import time

import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.truth.evidence import first_swept

GRID = VoxelGrid((-0.5, -0.4, 0.0), (30, 24, 20), 0.05)


def wandering(seed: int, frames: int, capsules: int = 2) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    ends = rng.uniform((-0.6, -0.5, -0.1), (1.1, 0.9, 1.1), (1, capsules, 2, 3))
    steps = rng.normal(0, 0.05, (frames, capsules, 2, 3)).cumsum(axis=0)
    return ends + steps, rng.uniform(0.04, 0.2, (capsules, 2))


def brute_force(ends: np.ndarray, radii: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First times, and where sampling cannot tell."""
    centres, share = GRID.centres(), np.linspace(0, 1, 121)
    first, unsure = np.full(GRID.shape, np.inf), np.zeros(GRID.shape, dtype=bool)
    for t, capsules in enumerate(ends):
        for (a, b), (ra, rb) in zip(capsules, radii, strict=True):
            spheres = a + share[:, None] * (b - a)
            away = np.linalg.norm(centres[..., None, :] - spheres, axis=-1) - (ra + share * (rb - ra))
            gap = away.min(axis=-1)
            first = np.where((gap <= 0) & np.isinf(first), times[t], first)
            unsure |= np.abs(gap) < 1e-3
    return first, unsure


def test_brute_force() -> None:
    for seed in range(3):
        ends, radii = wandering(seed, 6)
        ends[1:] += 0.05  # every pose moves on by more than half a voxel
        times = np.arange(6) * 0.5
        expected, unsure = brute_force(ends, radii, times)
        found = first_swept(ends, radii, times, GRID)
        assert found.dtype == np.float32
        assert np.isfinite(expected).any()
        assert np.array_equal(found[~unsure], expected[~unsure].astype(np.float32))


def test_poses_within_half_a_voxel_are_left_out() -> None:
    ends = np.zeros((3, 1, 2, 3))
    ends[:, 0, 1, 2] = 0.3
    ends[1, ..., 0], ends[2, ..., 0] = 0.02, 0.03
    radii = np.full((1, 2), 0.1)
    every = first_swept(ends, radii, np.array([0.0, 1.0, 2.0]), GRID)
    assert np.array_equal(every, first_swept(ends[[0, 2]], radii, np.array([0.0, 2.0]), GRID))


def test_a_shorter_watch_sees_the_same_so_far() -> None:
    ends, radii = wandering(9, 40)
    times = np.arange(40) / 30
    short, full = (first_swept(ends[:n], radii, times[:n], GRID) for n in (15, 40))
    assert np.array_equal(short, np.where(full <= np.float32(times[14]), full, np.inf))


def test_nothing_moves_nothing_swept() -> None:
    assert np.isinf(first_swept(np.empty((0, 3, 2, 3)), np.ones((3, 2)), np.empty(0), GRID)).all()
    outside = np.full((5, 1, 2, 3), 9.0)
    assert np.isinf(first_swept(outside, np.full((1, 2), 0.2), np.arange(5.0), GRID)).all()


def test_two_minutes_of_a_body_take_less_than_a_second() -> None:
    rng = np.random.default_rng(3)
    start_m, radii = rng.uniform((0.0, -0.3, 0.2), (0.5, 0.3, 1.6), (20, 1, 3)), rng.uniform(0.04, 0.1, (20, 2))
    limbs = np.concatenate([start_m, start_m + rng.normal(0, 0.2, (20, 1, 3))], axis=1)
    angle = np.arange(3600) / 30 / 2  # a metre a second on a circle of 2 m
    path = np.column_stack([3 + 2 * np.cos(angle), 2 * np.sin(angle), np.zeros(3600)])
    ends = limbs + path[:, None, None]
    first_swept(ends[:2], radii, np.arange(2.0), GRID)
    start = time.perf_counter()
    first_swept(ends, radii, np.arange(3600) / 30, VoxelGrid((0.0, -3.2, 0.0), (128, 128, 48)))
    assert time.perf_counter() - start < 1.0
