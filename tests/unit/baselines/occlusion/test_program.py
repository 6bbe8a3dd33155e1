"""The choice of cuboids against trying every subset."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.candidates import shared, volumes
from hsbench.baselines.occlusion.config import CuboidConfig
from hsbench.baselines.occlusion.program import choose, coverage, exclusive

CONFIG = CuboidConfig(gap=0.0)
SHAPE = (7, 6, 5)


def instance(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random cuboids, their costs, and the weight of each voxel."""
    rng = np.random.default_rng(seed)
    low = rng.integers(0, np.array(SHAPE) - 1, (count, 3))
    high = low + 1 + rng.integers(0, np.array(SHAPE) - low)
    weight = rng.integers(0, 3, SHAPE) / 2.0
    return np.stack([low, high], axis=2), rng.uniform(0.0, 12.0, count), weight


def objective(rows: tuple[int, ...], cuboids: np.ndarray, cost: np.ndarray, weight: np.ndarray) -> float:
    """What a subset costs, in plain loops; infinite where two exclude each other."""
    covered, total = np.zeros(SHAPE, dtype=bool), 0.0
    for i in rows:
        (x0, x1), (y0, y1), (z0, z1) = cuboids[i]
        covered[x0:x1, y0:y1, z0:z1] = True
        total += cost[i]
    both, size = shared(cuboids), volumes(cuboids)
    for i, j in itertools.combinations(rows, 2):
        share = both[i, j] / min(size[i], size[j])
        if share > CONFIG.exclusion:
            return np.inf
        if share > CONFIG.least_overlap:
            total += CONFIG.overlap_cost * both[i, j]
    return total - float(weight[covered].sum())


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_no_subset_is_better(seed: int, count: int) -> None:
    cuboids, cost, weight = instance(seed, count)
    found = choose(cuboids, cost, weight, CONFIG)
    mine = objective(tuple(np.flatnonzero(found.chosen)), cuboids, cost, weight)
    subsets = (rows for n in range(count + 1) for rows in itertools.combinations(range(count), n))
    assert mine == pytest.approx(min(objective(rows, cuboids, cost, weight) for rows in subsets), abs=1e-6)
    assert found.gap == pytest.approx(0.0, abs=1e-9)


def test_no_candidates_no_choice() -> None:
    found = choose(np.zeros((0, 3, 2), np.int64), np.zeros(0), np.ones(SHAPE), CONFIG)
    assert (found.chosen.shape, found.gap) == ((0,), 0.0)


@given(st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_each_set_of_voxels_weighs_what_its_voxels_do(seed: int, count: int) -> None:
    cuboids, _, weight = instance(seed, count)
    covers, gain = coverage(cuboids, weight)
    for k, ((x0, x1), (y0, y1), (z0, z1)) in enumerate(cuboids):
        column = covers.toarray()[:, k] > 0
        assert gain[column].sum() == pytest.approx(weight[x0:x1, y0:y1, z0:z1].sum())
    assert len(np.unique(covers.toarray(), axis=0)) == len(gain)


@given(st.integers(0, 2**32 - 1), st.integers(1, 15), st.floats(0.0, 1.0))
def test_cliques_hold_every_pair_and_no_other(seed: int, count: int, density: float) -> None:
    conflict = np.triu(np.random.default_rng(seed).random((count, count)) < density, 1)
    conflict |= conflict.T
    held = np.zeros_like(conflict)
    for clique in exclusive(conflict):
        held[np.ix_(clique, clique)] = True
    np.fill_diagonal(held, False)
    assert np.array_equal(held, conflict)


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_greedy_takes_the_best_that_is_left_and_no_other(seed: int, count: int) -> None:
    cuboids, cost, weight = instance(seed, count)
    chosen = choose(cuboids, cost, weight, replace(CONFIG, greedy=True)).chosen
    worth = np.array([-objective((k,), cuboids, cost, weight) for k in range(count)])
    for k in range(count):
        rivals = [j for j in np.flatnonzero(chosen) if j != k and objective((j, k), cuboids, cost, weight) == np.inf]
        assert chosen[k] == (worth[k] > 0 and not any(worth[j] >= worth[k] for j in rivals))
