"""Misses, bursts, joints that come and go: rates within binomial bounds, and what a start fixes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from detector_people import STEP_NS, detect, still
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.schema import JointState
from hsbench.synth.detectors import PRESETS, DetectorConfig
from hsbench.synth.detectors.losses import missed, reported_states, spells
from hsbench.synth.seeds import Seeds

LOOKS = 20_000
TIMES = np.arange(LOOKS, dtype=np.int64) * STEP_NS
CLEAN = PRESETS["clean"]


def bound(share: float, trials: float) -> float:
    """Four standard deviations of a share found in independent trials."""
    return 4 * np.sqrt(share * (1 - share) / trials)


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_single_misses_have_their_rate_and_no_memory(share: float) -> None:
    lost = missed(TIMES, DetectorConfig(miss_share=share), Seeds(1))
    assert abs(lost.mean() - share) < bound(share, LOOKS)
    assert abs(lost[1:][lost[:-1]].mean() - share) < bound(share, LOOKS * share)


def test_bursts_have_their_rate_and_length() -> None:
    """A renewal process: exponential gaps of 15 s and even lengths of .5 to 2 s."""
    per_min, low, high = 4.0, 0.5, 2.0
    end_ns = int(TIMES[-1])
    found = np.array(spells(0, end_ns, per_min, (low, high), Seeds(2).rng("bursts")))
    seconds = np.diff(found, axis=1)[:, 0] / 1e9
    assert seconds.min() >= low
    assert seconds.max() <= high
    cycle_s, mean_s = 60 / per_min + (low + high) / 2, (low + high) / 2
    expected = end_ns / 1e9 / cycle_s
    assert abs(len(found) - expected) < 4 * np.sqrt(expected)
    lost = missed(TIMES, DetectorConfig(bursts_per_min=per_min, burst_s=(low, high)), Seeds(2))
    assert np.array_equal(lost, ((TIMES[:, None] >= found[:, 0]) & (TIMES[:, None] < found[:, 1])).any(axis=1))
    assert lost.mean() == pytest.approx(mean_s / cycle_s, rel=0.25)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 10**12), st.integers(0, 10**12))
def test_spells_of_a_longer_time_begin_with_those_of_a_shorter(seed: int, start: int, length: int) -> None:
    rng = [Seeds(seed).rng("spells") for _ in range(2)]
    long = spells(start, start + length, 6.0, (0.2, 3.0), rng[0])
    short = spells(start, start + length // 2, 6.0, (0.2, 3.0), rng[1])
    assert short == long[: len(short)]
    assert all(first > start + length // 2 for first, _ in long[len(short) :])
    assert all(a[1] <= b[0] for a, b in pairwise(long))


@pytest.mark.parametrize("guessed", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_joints_are_reported_by_their_shares(guessed: float, lost: float) -> None:
    true = np.full((LOOKS, 18), JointState.TRACKED, dtype=np.uint8)
    true[:, :9] = JointState.INFERRED
    true[:, 0] = JointState.MISSING
    config = DetectorConfig(guessed_share=guessed, joint_loss_share=lost, drift_s=0.1)
    found = reported_states(true, TIMES, config, Seeds(6))
    assert (found[:, 0] == JointState.MISSING).all()
    assert np.isin(found[:, 1:9], (JointState.INFERRED, JointState.MISSING)).all()
    free = LOOKS / 5  # at .1 s and a correlation time of .2 s, looks that are worth one that stands alone
    assert abs((found[:, 1:9] == JointState.INFERRED).mean() - guessed) <= bound(guessed, 8 * free)
    assert abs((found[:, 9:] == JointState.MISSING).mean() - lost) <= bound(lost, 9 * free)


def test_a_body_without_enough_tracked_joints_is_not_found() -> None:
    for least, found in ((25, 5), (26, 0)):
        observed, _ = detect(still(5), replace(CLEAN, least_tracked=least - 13))  # 12 are in the upper body
        assert len(observed) == found
    whole = replace(CLEAN, skeleton="body-25")
    assert len(detect(still(5), replace(whole, least_tracked=18))[0]) == 5
    assert len(detect(still(5), replace(whole, least_tracked=26))[0]) == 0
