"""Daylight: the sun stands where spherical astronomy says, and light falls and rises as it should."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.synth.daylight import (
    LUMINANCE,
    NOON_ELEVATION,
    Day,
    air_mass,
    clouds,
    skylight,
    sun_declination,
    sunlight,
)
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray

HOURS_S = np.arange(0.0, 24 * 3600.0, 300.0)


def elevation(day: Day, seconds: FloatArray = HOURS_S) -> FloatArray:
    return np.arcsin(day.sun_towards(seconds)[:, 2])


@pytest.mark.parametrize(
    ("day", "degrees"), [(172, 23.44), (355, -23.44), (80, 0.0), (266, 0.0), (35, -16.3), (126, 16.5)]
)
def test_declination_of_known_days(day: int, degrees: float) -> None:
    """Solstices, equinoxes, 4 February and 6 May of an almanac."""
    assert math.degrees(float(sun_declination(np.array(float(day))))) == pytest.approx(degrees, abs=0.5)


@given(st.floats(-66, 66), st.integers(1, 365))
def test_noon_and_day_length_are_the_closed_forms(latitude_deg: float, number: int) -> None:
    day = Day(latitude_deg, number, 0.0, 0.0)
    latitude, declination = math.radians(latitude_deg), float(sun_declination(np.array(float(number))))
    found = elevation(day)
    assert found.max() == pytest.approx(math.pi / 2 - abs(latitude - declination), abs=0.004)
    cosine = -math.tan(latitude) * math.tan(declination)
    if abs(cosine) < 0.98:
        assert np.mean(found > 0) == pytest.approx(math.acos(cosine) / math.pi, abs=0.006)


def test_the_sun_rises_in_the_east_and_stands_south_at_noon_whatever_the_frame() -> None:
    for north_rad in (0.0, 1.0, -2.5):
        towards = Day(50.0, 80, 0.0, north_rad).sun_towards(np.array([6.5, 12.0, 17.5]) * 3600.0)
        north = np.array([math.cos(north_rad), math.sin(north_rad)])
        east = np.array([north[1], -north[0]])
        morning, noon, evening = towards[:, :2]
        assert np.allclose(np.linalg.norm(towards, axis=1), 1.0)
        assert morning @ east > 0.9
        assert evening @ east < -0.9
        assert noon @ north < -0.7
        assert abs(noon @ east) < 1e-6


def test_a_later_start_is_a_later_part_of_the_same_day() -> None:
    morning, noon = Day(50.0, 100, 6.0, 0.3), Day(50.0, 100, 12.0, 0.3)
    assert np.allclose(morning.sun_towards(HOURS_S[:50] + 6 * 3600.0), noon.sun_towards(HOURS_S[:50]))


def test_air_mass_is_one_straight_up_and_38_at_the_horizon() -> None:
    assert air_mass(np.array([math.pi / 2]))[0] == pytest.approx(1.0, abs=1e-3)
    assert air_mass(np.radians([30.0]))[0] == pytest.approx(2.0, rel=0.01)
    assert air_mass(np.array([0.0]))[0] == pytest.approx(38.0, rel=0.01)


def test_sunlight_reddens_towards_the_horizon_and_ends_there() -> None:
    light = sunlight(np.radians([-5.0, 0.5, 2.0, 10.0, 35.0, 60.0]))
    assert not light[0].any()
    assert (np.diff(light, axis=0) >= 0).all()
    assert np.allclose(sunlight(np.array([NOON_ELEVATION])), 1.0)
    assert (np.diff(light[1:] @ np.diag([1, 1, 1]) / light[1:, :1], axis=0)[:, 1:] > 0).all()  # ever less red


@given(st.floats(0, 1))
def test_skylight_grows_with_the_sun_through_twilight_and_never_ends(cover: float) -> None:
    degrees = np.array([-40.0, -18, -12, -6, -3, -1e-6, 1e-6, 1, 5, 10, 30, 60])
    level = skylight(np.radians(degrees), np.full(len(degrees), cover)) @ LUMINANCE
    assert (level > 0).all()
    assert (np.diff(level) >= -1e-12).all()
    assert level[6] == pytest.approx(level[5], rel=0.02)  # twilight meets day
    assert level[0] == pytest.approx(level[1], rel=0.01)


def test_civil_twilight_ends_at_some_three_lux() -> None:
    """AMS Glossary: 3.5-2 lx under a clear sky; the street's 10 lx stand beside it."""
    below, night = (skylight(np.radians([d]), np.zeros(1)) @ LUMINANCE for d in (-6.0, -50.0))
    assert 2.0 < (below - night)[0] / night[0] * 10.0 < 3.5


def test_clouds_are_smooth_seeded_and_begin_alike() -> None:
    seconds = np.arange(0.0, 8 * 3600.0, 30.0)
    means = []
    for seed in range(40):
        cover, passing = clouds(seconds, Seeds(seed))
        again, shorter = clouds(seconds, Seeds(seed)), clouds(seconds[:100], Seeds(seed))
        assert np.array_equal(again[0], cover)
        assert np.array_equal(shorter[1], passing[:100])
        assert cover.min() >= 0
        assert cover.max() <= 1
        assert ((passing >= 0) & (passing <= 1)).all()
        assert np.abs(np.diff(cover)).max() < 0.02
        means.append(passing.mean())
    assert min(means) < 0.05  # overcast days
    assert max(means) > 0.95  # clear ones
    assert np.mean((np.array(means) > 0.05) & (np.array(means) < 0.95)) > 0.2  # and others


def test_the_sun_shines_less_the_more_clouds_there_are() -> None:
    pairs = [clouds(np.arange(0.0, 4 * 3600.0, 60.0), Seeds(seed)) for seed in range(60)]
    cover, passing = (np.array([p[k].mean() for p in pairs]) for k in (0, 1))
    assert np.corrcoef(cover, passing)[0, 1] < -0.9
