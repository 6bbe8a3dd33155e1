"""Drift: its correlation exactly, over any times, and that a start does not know its end."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.synth.detectors.drift import drifting
from hsbench.synth.seeds import Seeds


class Impulses:
    """Stands in for a generator: column k of the noise is 1 at the k-th draw and 0 elsewhere."""

    def standard_normal(self, shape: tuple[int, int, int]) -> np.ndarray:
        return np.eye(shape[0] * 2).reshape(shape[0], 2, -1)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(1_000_000, 10_000_000_000), min_size=1, max_size=12), st.floats(0.05, 5.0))
def test_correlation_at_irregular_times(gaps_ns: list[int], time_s: float) -> None:
    """The responses to all impulses, multiplied with each other, are the covariance of the series."""
    times = np.cumsum(np.array(gaps_ns, dtype=np.int64))
    response = drifting(times, 2 * len(times), time_s, Impulses())
    a = np.abs(times[:, None] - times) / 1e9 / time_s
    np.testing.assert_allclose(response @ response.T, (1 + a) * np.exp(-a), atol=1e-5)


def test_a_long_series_stays_normal() -> None:
    times = np.arange(200_000, dtype=np.int64) * 33_333_333
    series = drifting(times, 3, 0.4, Seeds(2).rng("x"))
    assert np.abs(series.mean(axis=0)).max() < 0.05
    assert np.abs(series.std(axis=0) - 1).max() < 0.03
    assert np.abs(np.diff(series, axis=0)).max() < 0.5  # it does not jump


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 50))
def test_a_shorter_series_is_the_start_of_a_longer(seed: int, end: int) -> None:
    times = np.cumsum(np.random.default_rng(seed).integers(1, 10**9, 51))
    long, short = (drifting(t, 7, 0.4, Seeds(seed).rng("x")) for t in (times, times[:end]))
    assert np.array_equal(long[:end], short)


def test_no_times_no_series() -> None:
    assert drifting(np.empty(0, dtype=np.int64), 5, 1.0, Seeds(0).rng("x")).shape == (0, 5)
