"""The best bins: against every subset, and through samples by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.baselines.best_iou import answer, best_bins, fit_bins


def iou(chosen: np.ndarray, hits: np.ndarray, count: np.ndarray) -> float:
    true_positive = hits[chosen].sum()
    union = count[chosen].sum() + hits.sum() - true_positive
    return true_positive / union if union else 0.0


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=7))
def test_no_other_set_of_bins_is_better(bins: list[tuple[int, int]]) -> None:
    hits = np.array([min(a, b) for a, b in bins])
    count = np.array([max(a, b) for a, b in bins])
    found = best_bins(hits, count)
    every = (np.array(pick) for pick in product([False, True], repeat=len(bins)))
    assert iou(found, hits, count) == pytest.approx(max(iou(pick, hits, count) for pick in every), abs=1e-12)
    assert not found[count == 0].any()
    assert found.any() == hits.any()


def test_bins_are_counted_over_episodes_without_what_is_ignored() -> None:
    places = np.array([[0, 0, 1, 2], [2, 2, 2, 2]])
    truth = np.array([[True, False, True, False], [False, False, True, False]])
    ignored = np.array([False, False, False, True])
    chosen = fit_bins([(places, truth, ignored), (places, truth, ~ignored)], 4)
    # label 0: bin 0 has 1 of 2, bin 1 has 1 of 1, bin 2 (the last place of the second) 0 of 1
    assert chosen.tolist() == [[True, True, False, False], [False, False, True, False]]
    assert answer(chosen, np.array([[3, 1], [2, 0]])).tolist() == [[False, True], [True, False]]
    with pytest.raises(ValueError, match="no training episode"):
        fit_bins([], 4)
