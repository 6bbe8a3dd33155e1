"""Rank probabilities: by hand, against plain loops, and by properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.metrics import completion
from hsbench.metrics.bootstrap import paired_difference, scene_weights
from hsbench.metrics.ranking import rank_probabilities


def made(methods: int, scenes: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(1, 9, (methods, scenes, 4))


@given(seed=st.integers(0, 2**32), methods=st.integers(1, 4), scenes=st.integers(2, 6))
@settings(max_examples=30)
def test_agrees_with_plain_loops(seed: int, methods: int, scenes: int) -> None:
    stats = made(methods, scenes, seed)
    got = rank_probabilities(stats, completion.iou, replicates=40, seed=3)
    shares, better = np.zeros((methods, methods)), np.zeros((methods, methods))
    for weights in scene_weights(scenes, 40, 3):
        values = []
        for method in stats.tolist():
            tp, fp, fn, _ = (sum(w * row[k] for w, row in zip(weights.tolist(), method, strict=True)) for k in range(4))
            values.append(tp / (tp + fp + fn))
        for a in range(methods):
            before, equal = sum(v > values[a] for v in values), values.count(values[a])
            for rank in range(before, before + equal):
                shares[a, rank] += 1 / equal / 40
            for b in range(methods):
                better[a, b] += ((values[a] > values[b]) + (values[a] == values[b]) / 2) / 40
    np.testing.assert_allclose(got.probabilities, shares, rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.better, better, rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.probabilities.sum(axis=0), 1, atol=1e-12)
    np.testing.assert_allclose(got.probabilities.sum(axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(got.better + got.better.T, 1, atol=1e-12)


def test_better_in_every_scene_is_first_for_sure_and_twins_share() -> None:
    base = made(1, 10, 0)[0]
    best = base + [5, 0, 0, 0]
    got = rank_probabilities(np.stack([base, best, base]), completion.iou)
    assert got.probabilities.tolist() == [[0, 0.5, 0.5], [1, 0, 0], [0, 0.5, 0.5]]
    assert got.better[1].tolist() == [1, 0.5, 1]
    assert got.better[0, 2] == 0.5
    worst = rank_probabilities(np.stack([base, best, base]), completion.iou, higher_is_better=False)
    assert worst.probabilities[1].tolist() == [0, 0, 1]


def test_paired_share_agrees_with_the_paired_interval() -> None:
    base = made(1, 30, 4)[0]
    stats = np.stack([base + [1, 0, -1, 0], base])
    got = rank_probabilities(stats, completion.iou, seed=9)
    assert got.better[0, 1] > 0.975
    assert paired_difference(stats[0], stats[1], completion.iou, seed=9).low > 0


def test_order_of_methods_only_moves_rows() -> None:
    stats = made(3, 8, 5)
    got = rank_probabilities(stats, completion.iou, seed=1)
    turned = rank_probabilities(stats[::-1], completion.iou, seed=1)
    assert np.array_equal(turned.probabilities, got.probabilities[::-1])
    assert turned.estimates == got.estimates[::-1]


def test_undefined_replicates_are_left_out_and_counted() -> None:
    stats = np.zeros((2, 3, 4), int)
    stats[:, 0] = [[2, 1, 0, 0], [1, 1, 0, 0]]
    got = rank_probabilities(stats, completion.iou, replicates=300)
    assert got.undefined_replicates == int((scene_weights(3, 300, 0)[:, 0] == 0).sum()) > 0
    assert got.probabilities.tolist() == [[1, 0], [0, 1]]
    nothing = rank_probabilities(np.zeros((2, 3, 4), int), completion.iou, replicates=10)
    assert (nothing.probabilities, nothing.undefined_replicates) == (None, 10)
    assert nothing.estimates == (None, None)
    assert nothing.reason == "undefined: no denominator"


def test_one_scene_and_none() -> None:
    one = rank_probabilities(made(2, 1, 0), completion.iou)
    assert (one.probabilities, one.better, one.reason) == (None, None, "one scene: nothing to resample")
    assert None not in one.estimates
    none = rank_probabilities(np.zeros((2, 0, 4), int), completion.iou)
    assert (none.estimates, none.reason) == ((None, None), "no scene")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rank_probabilities(np.zeros((2, 4), int), completion.iou), "expected numbers (methods, scenes, stat"),
        (lambda: rank_probabilities(made(2, 3, 0) * np.nan, completion.iou), "NaN or infinity at method 0, scene 0"),
        (lambda: rank_probabilities(made(2, 3, 0), completion.iou, seed=-1), "seed -1"),
    ],
)
def test_bad_input(call, message: str) -> None:
    with pytest.raises(SchemaError) as error:
        call()
    assert message in str(error.value)
