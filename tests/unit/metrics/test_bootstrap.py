"""The bootstrap against plain resampling loops with the same draws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import completion
from hsbench.metrics.bootstrap import Interval, interval, paired_difference, scene_weights

ROWS = np.array([[8, 1, 1, 0], [2, 3, 5, 0], [0, 0, 4, 2], [9, 0, 1, 7], [1, 1, 0, 0]])


def loop_values(rows: np.ndarray, weights: np.ndarray) -> list[float]:
    """IoU of each replicate by adding drawn scenes one at a time."""
    values = []
    for row_weights in weights:
        tp = fp = fn = 0
        for scene, times in enumerate(row_weights):
            for _ in range(times):
                tp, fp, fn = tp + rows[scene][0], fp + rows[scene][1], fn + rows[scene][2]
        values.append(tp / (tp + fp + fn) if tp + fp + fn else None)
    return values


def percentile(values: list[float], share: float) -> float:
    """Linear between order statistics, written out."""
    ordered = sorted(values)
    position = share * (len(ordered) - 1)
    low = int(position)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (position - low) * (ordered[high] - ordered[low])


def test_weights_draw_every_scene_as_often_in_the_mean() -> None:
    weights = scene_weights(7, 20_000, seed=5)
    assert weights.shape == (20_000, 7)
    assert (weights.sum(axis=1) == 7).all()
    # mean 1, variance (1 - 1/7): five standard errors
    assert np.abs(weights.mean(axis=0) - 1).max() < 5 * np.sqrt((6 / 7) / 20_000)
    assert np.abs(weights.var(axis=0) - 6 / 7).max() < 0.05


def test_weights_are_the_same_for_all_times() -> None:
    # Philox bits are fixed by its authors: recomputed here from the raw stream by hand
    raw = np.random.Philox(3).random_raw(12)
    drawn = [[(int(value) >> 32) * 4 >> 32 for value in part] for part in raw.reshape(3, 4)]
    expected = [[part.count(scene) for scene in range(4)] for part in drawn]
    assert scene_weights(4, 3, seed=3).tolist() == expected
    assert not np.array_equal(scene_weights(4, 3, seed=0), scene_weights(4, 3, seed=1))


@pytest.mark.parametrize(("scenes", "share"), [(5, 0.84), (10, 0.90), (30, 0.93)])
def test_intervals_hold_the_truth_as_often_as_the_specification_says(scenes: int, share: float) -> None:
    values = np.random.default_rng(0).normal(size=(1000, scenes))
    held = 0
    for row in values:
        got = interval(np.stack([row, np.ones(scenes)], axis=1), lambda sums: sums[..., 0] / sums[..., 1], seed=1)
        held += got.low <= 0 <= got.high
    # five standard errors, and a percent for the one set of draws
    assert held / 1000 == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / 1000) + 0.01)


@pytest.mark.parametrize("seed", [0, 1, 99])
def test_interval_agrees_with_plain_loops(seed: int) -> None:
    got = interval(ROWS, completion.iou, replicates=200, seed=seed)
    values = loop_values(ROWS, scene_weights(5, 200, seed))
    assert got.estimate == 20 / 36
    assert got.low == pytest.approx(percentile(values, 0.025), abs=1e-12)
    assert got.high == pytest.approx(percentile(values, 0.975), abs=1e-12)
    assert (got.replicates, got.seed, got.scenes, got.undefined_replicates) == (200, seed, 5, 0)


def test_paired_difference_agrees_with_plain_loops() -> None:
    other = ROWS[:, [0, 2, 1, 3]] + [[1, 0, 2, 0]]
    got = paired_difference(ROWS, other, completion.iou, replicates=200, seed=7)
    weights = scene_weights(5, 200, 7)
    values = [a - b for a, b in zip(loop_values(ROWS, weights), loop_values(other, weights), strict=True)]
    assert got.low == pytest.approx(percentile(values, 0.025), abs=1e-12)
    assert got.high == pytest.approx(percentile(values, 0.975), abs=1e-12)


def test_a_method_never_differs_from_itself() -> None:
    got = paired_difference(ROWS, ROWS, completion.iou)
    assert (got.estimate, got.low, got.high) == (0.0, 0.0, 0.0)


def test_pairing_narrows_a_constant_gain() -> None:
    rng = np.random.default_rng(0)
    base = np.column_stack([rng.integers(0, 1000, 30), np.zeros(30, int), rng.integers(0, 1000, 30), np.zeros(30, int)])
    better = base + np.array([20, 0, -20, 0])
    paired = paired_difference(better, base, completion.iou)
    single = interval(base, completion.iou)
    assert paired.low > 0
    assert paired.high - paired.low < (single.high - single.low) / 5


def test_one_scene_and_none() -> None:
    assert interval(ROWS[:1], completion.iou) == Interval(
        0.8, None, None, 1000, 0, 0, 1, 0.95, "one scene: nothing to resample"
    )
    assert interval(np.empty((0, 4), int), completion.iou).reason == "no scene"


def test_undefined_replicates_are_left_out_and_counted() -> None:
    rows = np.array([[1, 0, 1, 0], [0, 0, 0, 5], [0, 0, 0, 5]])
    got = interval(rows, completion.iou, replicates=500)
    never_drawn = int((scene_weights(3, 500, 0)[:, 0] == 0).sum())
    assert got.undefined_replicates == never_drawn > 0
    assert (got.low, got.high) == (0.5, 0.5)
    empty = interval(rows[1:], completion.iou)
    assert (empty.estimate, empty.low, empty.undefined_replicates) == (None, None, 1000)
    assert empty.reason is not None


@given(st.integers(2, 12), st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_scaling_all_counts_changes_nothing(scenes: int, seed: int) -> None:
    rows = np.random.default_rng(seed).integers(1, 50, (scenes, 4))
    small = interval(rows, completion.iou, replicates=50, seed=seed)
    assert interval(rows * 1024, completion.iou, replicates=50, seed=seed) == small
    assert small.low <= small.high


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: interval(ROWS[0], completion.iou), "expected numbers (scenes, statistics)"),
        (lambda: interval(ROWS * np.nan, completion.iou), "NaN or infinity in row 0"),
        (lambda: interval(ROWS, completion.iou, level=95), "a percentage?"),
        (lambda: interval(ROWS, completion.iou, replicates=0), "replicates 0"),
        (lambda: interval(ROWS, completion.iou, seed=-1), "seed -1"),
        (lambda: paired_difference(ROWS, ROWS[:4], completion.iou), "the same scenes?"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
