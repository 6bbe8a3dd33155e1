"""Schedules: peaks at their hour, habits as factors, durations about their median."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.schema.categories import ROLES, category
from hsbench.synth.activities.catalogue import CATALOGUE, Activity
from hsbench.synth.activities.schedule import (
    COMMON_HABITS,
    HABITS,
    NOVEL_HABITS,
    Habits,
    Quota,
    duration_s,
    gain,
    weights,
)
from hsbench.synth.people.gestures import GESTURES

MEAL = Activity("meal", "sit", peaks=((12.0, 2.0, 8.0), (23.5, 2.0, 4.0)))


@pytest.mark.parametrize(
    ("hour", "expected"),
    [(12.0, 8.0), (13.0, 4.5), (10.0, 1.0), (6.0, 1.0), (23.5, 4.0), (0.5, 2.5), (1.5, 1.0), (22.5, 2.5)],
)
def test_gain_is_a_triangle_round_the_clock(hour: float, expected: float) -> None:
    assert gain(MEAL, hour) == pytest.approx(expected)


@given(st.floats(-48, 48), st.sampled_from(CATALOGUE))
def test_gain_has_a_period_of_a_day_and_is_never_below_one(hour: float, activity: Activity) -> None:
    assert gain(activity, hour) >= 1.0
    assert gain(activity, hour + 24) == pytest.approx(gain(activity, hour), abs=1e-6)


def test_habits_shift_and_scale() -> None:
    plain = weights((MEAL,), 12.0, Habits())
    assert weights((MEAL,), 14.0, Habits(shift_h=2.0)) == pytest.approx(plain)
    assert weights((MEAL,), 12.0, Habits(likes=(("meal", 0.5),))) == pytest.approx(0.5 * plain)


def test_durations_have_their_median_and_pace() -> None:
    activity = Activity("x", "stand", median_s=100.0, spread=0.5)
    rng = np.random.default_rng(0)
    drawn = np.array([duration_s(activity, Habits(pace=2.0), rng) for _ in range(4000)])
    assert np.median(drawn) == pytest.approx(200.0, rel=0.05)
    assert np.std(np.log(drawn)) == pytest.approx(0.5, rel=0.05)


def test_the_catalogue_names_what_exists() -> None:
    assert len(CATALOGUE) >= 18
    assert len({a.name for a in CATALOGUE}) == len(CATALOGUE)
    for activity in CATALOGUE:
        for name in (*activity.categories, *activity.near):
            category(name)
        assert set(activity.roles) <= ROLES
        assert not activity.gesture or activity.gesture in GESTURES
        assert activity.how in ("wander", "stand", "talk", "beside", "touch", "fetch", "sit", "lie", "leave")
    assert {name for habits in HABITS.values() for name, _ in habits.likes} <= {a.name for a in CATALOGUE}


def test_families_belong_to_one_side() -> None:
    assert set(COMMON_HABITS) | set(NOVEL_HABITS) == set(HABITS)
    assert not set(COMMON_HABITS) & set(NOVEL_HABITS)


@given(st.floats(0.0, 1.0), st.lists(st.integers(0, 4), max_size=60), st.integers(0, 99))
def test_a_quota_is_held_to_within_one_however_contacts_come(share: float, steps: list[int], seed: int) -> None:
    quota = Quota(share, np.random.default_rng(seed))
    for step in steps:
        quota.contacts += step
        while quota.is_due:
            quota.fill()
        assert -1.0 <= quota.done - share * quota.contacts < 1.0


def test_a_quota_is_right_on_average_and_not_regular() -> None:
    share, contacts = 0.05, 30
    done, places = [], set()
    for seed in range(400):
        quota = Quota(share, np.random.default_rng(seed))
        for k in range(contacts):
            quota.contacts += 1
            if quota.is_due:
                quota.fill()
                places.add(k)
        done.append(quota.done)
    assert np.mean(done) == pytest.approx(share * contacts, abs=0.1)  # four standard errors
    assert len(places) == contacts
