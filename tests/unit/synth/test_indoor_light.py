"""Lamps follow darkness and people, exposure follows light, and all of it is one function of its seeds."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lit_room import scene

from hsbench.synth.daylight import Day
from hsbench.synth.indoor_light import (
    ADAPTS_S,
    BRIGHT,
    DARK,
    FOLLOWED,
    LEAST_EXPOSURE,
    LINGER_S,
    MOST_EXPOSURE,
    exposures,
    lamps_on,
    light_states,
)
from hsbench.synth.render.light_basis import LightStates
from hsbench.synth.render.sources import sources_of
from hsbench.synth.seeds import Seeds

ROOM = scene()
DAYLIGHT = sources_of(ROOM)
SECONDS = np.arange(0.0, 24 * 3600.0, 300.0)


@cache
def states(seed: int = 0, hours: int = 24) -> LightStates:
    seconds = SECONDS[: hours * 12]
    awake = np.ones((len(seconds), 2), dtype=bool)
    return light_states(ROOM, DAYLIGHT, Day(50.0, 120, 0.0, 0.4), seconds, awake, Seeds(seed))


def test_a_day_has_a_dark_night_and_a_bright_noon() -> None:
    made = states()
    night, noon = 0, len(made) // 2
    assert made.sky[night].max() < 0.01 < 0.5 < made.sky[noon].min()
    assert not made.sun[night].any()
    assert made.lamps[night].min() == 1.0
    assert np.allclose(np.linalg.norm(made.sun_towards, axis=1), 1.0)
    # the first room has a window, the second none: its lamp burns all day
    assert made.lamps[noon, 0].max() == 0.0
    assert (made.lamps[:, 1] == 1.0).all()


def test_light_is_a_function_of_the_seed_and_begins_alike() -> None:
    again = light_states(
        ROOM, DAYLIGHT, Day(50.0, 120, 0.0, 0.4), SECONDS, np.ones((len(SECONDS), 2), dtype=bool), Seeds(0)
    )
    for name in ("lamps", "sky", "sun", "sun_towards"):
        assert np.array_equal(getattr(again, name), getattr(states(), name))
        assert np.array_equal(getattr(states(0, 6), name), getattr(states(), name)[:72])
    assert not np.array_equal(states(1).sky, states().sky)


def test_nobody_switches_a_lamp_on_in_an_empty_room() -> None:
    dark, nobody = np.zeros((10, 1)), np.zeros((10, 1), dtype=bool)
    assert not lamps_on(dark, nobody, np.arange(10) * 60.0).any()


def test_a_lamp_burns_on_for_a_while_when_all_have_gone() -> None:
    seconds = np.arange(60) * 60.0
    awake = (seconds < 600.0)[:, None]
    on = lamps_on(np.zeros((60, 1)), awake, seconds)[:, 0]
    assert np.array_equal(on, seconds <= 540.0 + LINGER_S)


@given(st.lists(st.floats(0, 2), min_size=2, max_size=40))
def test_a_lamp_is_on_in_the_dark_off_in_the_light_and_else_stays_as_it_is(levels: list[float]) -> None:
    by_day = np.array(levels)[:, None]
    on = lamps_on(by_day, np.ones(by_day.shape, dtype=bool), np.arange(len(levels)) * 30.0)[:, 0]
    before = False
    for level, now in zip(levels, on, strict=True):
        expected = True if level < DARK else False if level >= BRIGHT else before
        assert now == expected
        before = bool(now)


@given(st.floats(0.001, 1000.0), st.integers(1, 30))
def test_steady_light_has_a_steady_exposure_within_the_camera_s_range(wanted: float, count: int) -> None:
    found = exposures(np.full(count, wanted), np.arange(count) * 30.0)
    assert np.ptp(found) == 0.0
    assert LEAST_EXPOSURE - 1e-6 <= found[0] <= MOST_EXPOSURE + 1e-6
    assert found[0] == pytest.approx(np.clip(wanted**FOLLOWED, LEAST_EXPOSURE, MOST_EXPOSURE), rel=1e-4)


def test_exposure_follows_a_step_by_the_time_constant() -> None:
    seconds = np.arange(0.0, 300.0)
    found = np.log(exposures(np.where(seconds < 1.0, 1.0, 10.0), seconds))
    left = 1.0 - found / (FOLLOWED * np.log(10.0))
    assert left[1:] == pytest.approx(np.exp(-seconds[1:] / ADAPTS_S), abs=1e-5)
