"""Track ids: a model of the rules that goes look by look, and rates within binomial bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from detector_people import STEP_NS, crowd, detect, person
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.synth.detectors import DetectorConfig
from hsbench.synth.detectors.tracks import Seen, track_ids
from hsbench.synth.seeds import Seeds

STEADY = DetectorConfig(lost_s=0.5)
LOOKS = 60
TIMES = np.arange(LOOKS, dtype=np.int64) * STEP_NS


def seen(present: np.ndarray, place: np.ndarray) -> Seen:
    look = np.flatnonzero(present)
    return Seen(look, place[look])


def walks(rng: np.random.Generator, people: int) -> dict[int, Seen]:
    bodies = {}
    for body in range(1, people + 1):
        place = np.cumsum(rng.normal(0.0, 0.15, (LOOKS, 3)), axis=0) + (0, 0, 4)
        bodies[body] = seen(rng.random(LOOKS) < 0.8, place)
    bodies[-1] = seen((np.arange(LOOKS) > 20) & (np.arange(LOOKS) < 30), np.zeros((LOOKS, 3)))
    return bodies


def by_hand(bodies: dict[int, Seen], always_relabel: bool, always_swap: bool, config: DetectorConfig) -> dict:
    """The same with chances of 0 or 1, look by look, with no shortcuts."""
    current: dict[int, int] = {}
    last: dict[int, int] = {}
    met: dict[tuple[int, int], int] = {}
    ids: dict[int, list[int]] = {body: [] for body in bodies}
    count = 0
    for look in range(LOOKS):
        here = sorted(b for b in bodies if look in bodies[b].look)
        for body in here:
            lost = TIMES[look] - TIMES[last[body]] if body in last else None
            if lost is None or lost > 5 * STEP_NS or (always_relabel and lost > STEP_NS):
                count += 1
                current[body] = count
            last[body] = look
        for a in here:
            for b in here:
                if 0 < a < b:
                    at = [bodies[k].place[list(bodies[k].look).index(look)] for k in (a, b)]
                    if round(float(np.linalg.norm(at[0] - at[1])), 4) < config.near_m:
                        fresh = (a, b) not in met or TIMES[look] - met[a, b] > 5 * STEP_NS
                        met[a, b] = int(TIMES[look])
                        if fresh and always_swap:
                            current[a], current[b] = current[b], current[a]
        for body in here:
            ids[body].append(current[body])
    return ids


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.booleans(), st.booleans())
def test_ids_follow_the_rules(seed: int, people: int, relabel: bool, swap: bool) -> None:
    bodies = walks(np.random.default_rng(seed), people)
    config = replace(STEADY, relabel_share=float(relabel), swap_share=float(swap))
    found = track_ids(TIMES, bodies, config, Seeds(0))
    expected = by_hand(bodies, relabel, swap, config)
    assert {body: ids.tolist() for body, ids in found.items()} == expected


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, LOOKS - 1))
def test_a_shorter_take_has_the_same_ids(seed: int, end: int) -> None:
    bodies = walks(np.random.default_rng(seed), 3)
    config = replace(STEADY, relabel_share=0.5, swap_share=0.5)
    full = track_ids(TIMES, bodies, config, Seeds(seed))
    cut = {body: Seen(s.look[s.look < end], s.place[s.look < end]) for body, s in bodies.items()}
    short = track_ids(TIMES[:end], cut, config, Seeds(seed))
    for body in bodies:
        assert np.array_equal(full[body][: len(short[body])], short[body])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nobody_shares_an_id_at_one_time(seed: int) -> None:
    bodies = walks(np.random.default_rng(seed), 4)
    config = replace(STEADY, relabel_share=0.3, swap_share=0.7)
    ids = track_ids(TIMES, bodies, config, Seeds(seed))
    for look in range(LOOKS):
        here = [int(ids[b][bodies[b].look == look][0]) for b in bodies if (bodies[b].look == look).any()]
        assert len(set(here)) == len(here)


@pytest.mark.parametrize("share", [0.2, 0.7])
def test_rates_of_new_and_exchanged_ids(share: float) -> None:
    looks = 12_000
    times = np.arange(looks, dtype=np.int64) * STEP_NS
    place = np.zeros((looks, 3))
    gaps = np.arange(looks) % 4 != 3  # lost for one look in four
    ids = track_ids(times, {1: seen(gaps, place)}, replace(STEADY, relabel_share=share), Seeds(3))[1]
    assert within(int((np.diff(ids) > 0).sum()), looks // 4 - 1, share)
    apart = place + np.array([3.0, 0.0, 0.0]) * (np.arange(looks)[:, None] % 20 < 10)  # a meeting every two seconds
    both = {1: seen(np.ones(looks, bool), place), 2: seen(np.ones(looks, bool), apart)}
    ids = track_ids(times, both, replace(STEADY, swap_share=share), Seeds(4))[1]
    assert within(int((np.diff(ids) != 0).sum()), looks // 20, share)


def within(hits: int, trials: int, share: float) -> bool:
    """Whether a count lies within four standard deviations of a binomial."""
    return abs(hits - trials * share) < 4 * np.sqrt(trials * share * (1 - share)) + 1


def test_who_passes_behind_another_may_take_their_id_in_pixels_only() -> None:
    """Two metres apart along the line of sight: near in an image, not in metres."""
    still = np.repeat(person(2.0, 0.0, np.pi), 41, axis=0)
    passing = np.concatenate([person(4.0, y, np.pi) for y in np.linspace(-2.0, 2.0, 41)])
    poses = crowd(still, passing)
    swapping = DetectorConfig(swap_share=1.0, least_tracked=1)
    for skeleton, swaps in (("kinect-v2-25", 0), ("coco-18", 1)):
        observed, match = detect(poses, replace(swapping, skeleton=skeleton))
        ids = observed.track_id[poses.track_id[match] == 1]
        assert (np.diff(ids) != 0).sum() == swaps
        assert set(observed.track_id) == {1, 2}
