"""Fitted references and the shuffled control, against trying every answer."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.boundary import Boundary
from hsbench.baselines.occlusion.constant import fit_constant
from hsbench.baselines.occlusion.height_prior import DEPTH_EDGES_M, HEIGHT_EDGES_M, HeightPrior, behind_surface, fit
from hsbench.baselines.occlusion.shuffle import shuffled_activity
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Action
from hsbench.tasks.shuffle import TURNS

Sample = tuple[np.ndarray, np.ndarray, np.ndarray]


def iou_of_limits(samples: list[Sample], thickness: float, height: float) -> float:
    tp = fp = fn = 0
    for behind, z, solid in samples:
        predicted = (behind < thickness) & (z < height)
        tp += int((predicted & solid).sum())
        fp += int((predicted & ~solid).sum())
        fn += int((~predicted & solid).sum())
    return tp / max(tp + fp + fn, 1)


@pytest.mark.parametrize("seed", range(6))
def test_the_height_prior_is_the_best_of_all_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    samples = []
    for _ in range(2):
        n = 60
        behind, z = rng.uniform(-0.1, 4.5, n), 0.025 + 0.05 * rng.integers(0, 48, n)
        limit, top = rng.uniform(1.0, 3.5), rng.uniform(0.8, 2.2)
        solid = ((behind < limit) & (z < top)) ^ (rng.random(n) < 0.15)
        samples.append((behind, z, solid))
    found = fit(iter(samples))
    every = [iou_of_limits(samples, d, h) for d, h in itertools.product(DEPTH_EDGES_M[1:], HEIGHT_EDGES_M[1:])]
    assert iou_of_limits(samples, found.thickness_m, found.height_m) == pytest.approx(max(every), abs=1e-12)
    assert max(every) > 0.3


def test_the_height_prior_recovers_a_rule() -> None:
    behind, z = (a.ravel() for a in np.meshgrid(np.arange(0.01, 3, 0.02), np.arange(0.025, 2.4, 0.05)))
    found = fit([(behind, z, (behind < 0.6) & (z < 0.9))])
    assert found == HeightPrior(0.6, 0.9)


def test_a_prior_needs_training() -> None:
    with pytest.raises(ValueError, match="no training voxel"):
        fit([])
    with pytest.raises(ValueError, match="no training episode"):
        fit_constant([])


def test_behind_a_surface_is_depth_less_reading() -> None:
    sensor = Sensor("rgbd", PinholeCamera(64, 48, 40.0, 40.0, 32.0, 24.0), 1.2)
    grid = VoxelGrid((0.0, -1.0, 0.0), (60, 40, 48))
    depth = np.full((48, 64), 1.3)
    depth[:, :20] = 0.0
    behind = behind_surface(sensor, grid, depth)
    x, y = grid.centres()[..., 0], grid.centres()[..., 1]
    known = np.isfinite(behind)
    assert known.sum() > 10000
    assert np.allclose(behind[known], (x - 1.3)[known])
    column = 32 - 40 * y / x  # y is left, columns run right
    edge = np.abs(column - 20) < 1e-6
    assert not known[(column < 20) & ~edge].any()
    solid = HeightPrior(0.4, 0.8).solid(behind, grid)
    assert np.array_equal(solid, known & (np.nan_to_num(behind, nan=9) < 0.4) & (grid.centres()[..., 2] < 0.8))


def pooled_iou(grid: np.ndarray, samples: list[tuple[np.ndarray, np.ndarray]]) -> float:
    tp = sum(int((grid & mask & solid).sum()) for mask, solid in samples)
    union = sum(int((mask & (grid | solid)).sum()) for mask, solid in samples)
    return tp / max(union, 1)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 4), st.floats(0.2, 1.0), st.floats(0.0, 1.0))
def test_the_best_constant_is_the_best_of_all_subsets(seed: int, episodes: int, scored: float, filled: float) -> None:
    rng = np.random.default_rng(seed)
    shape = (2, 2, 2)
    share = rng.random(shape) * filled
    samples = [(rng.random(shape) < scored, rng.random(shape) < share) for _ in range(episodes)]
    found = fit_constant(iter(samples))
    assert found.shape == shape
    assert found.dtype == bool
    every = [np.array(bits, bool).reshape(shape) for bits in itertools.product((0, 1), repeat=8)]
    assert pooled_iou(found, samples) == max(pooled_iou(grid, samples) for grid in every)
    assert not found[~np.any([mask for mask, _ in samples], axis=0)].any()  # never scored, never claimed


# ---------------------------------------------------------------- shuffled activity


def somebody(seed: int, n: int = 200) -> Activity:
    rng = np.random.default_rng(seed)
    action = rng.choice([Action.STAND, Action.SIT], n).astype(np.uint8)
    return Activity(rng.uniform(-2, 2, (n, 2)) * (1.2, 0.5) + (2.5, 0.3), action, 1000.0 + np.arange(n))


HERE = Boundary(0.4, np.array([0.5, -1.0]), np.array([3.0, 1.2]))
THERE = Boundary(-0.2, np.array([0.0, -1.5]), np.array([5.0, 1.5]))


def test_the_same_draw_gives_the_same_activity_and_another_draw_another() -> None:
    shuffled = [shuffled_activity(somebody(0), THERE, HERE, np.random.default_rng(k)) for k in (1, 1, 2)]
    assert np.array_equal(shuffled[0].position, shuffled[1].position)
    assert np.array_equal(shuffled[0].pelvis_m, shuffled[1].pelvis_m)
    assert not np.array_equal(shuffled[0].position[:5], shuffled[2].position[:5])


@pytest.mark.parametrize("seed", range(5))
def test_it_lies_inside_and_is_the_other_activity_turned_and_clipped(seed: int) -> None:
    other = somebody(seed)
    shuffled = shuffled_activity(other, THERE, HERE, np.random.default_rng(seed))
    assert HERE.contains(shuffled.position).all()
    rows = (shuffled.pelvis_m - 1000).astype(int)  # the pelvis tells which pose it was
    assert len(set(rows)) == len(rows) > 20
    assert np.array_equal(shuffled.action, other.action[rows])
    # a turn about the middle: distances to it and between poses stay, and it is no mirror image
    before, after = other.position[rows] - THERE.centre, shuffled.position - HERE.centre
    assert np.allclose(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1))
    a, b = (p[:, 0] + 1j * p[:, 1] for p in (before, after))
    assert np.allclose(b / a, (b / a)[0])


def test_no_other_of_the_turns_keeps_more() -> None:
    other = somebody(3)
    shuffled = shuffled_activity(other, THERE, HERE, np.random.default_rng(9))
    start = np.random.default_rng(9).uniform(0, 2 * np.pi)
    kept = []
    for k in range(TURNS):
        c, s = np.cos(start + 2 * np.pi * k / TURNS), np.sin(start + 2 * np.pi * k / TURNS)
        kept.append(
            int(HERE.contains((other.position - THERE.centre) @ np.array([[c, s], [-s, c]]) + HERE.centre).sum())
        )
    assert len(shuffled.position) == max(kept) > min(kept)


def test_nobody_shuffled_is_nobody() -> None:
    assert len(shuffled_activity(somebody(0, 0), THERE, HERE, np.random.default_rng(0)).position) == 0
