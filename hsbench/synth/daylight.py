"""The light outside over a day: where the sun stands, how bright and of what colour sun and sky are, and clouds.

Everything is a function of a place, a day and named random streams. Strengths are relative to a clear day with the sun
at ``NOON_ELEVATION``, for which the light of ``render.sources`` is made; colours are factors of linear RGB.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray

DAYS = 365.0
NOON_ELEVATION = math.radians(35.0)
# Illuminance of the sky on the ground, klx: A + B sin(elevation)^C under a clear, a partly cloudy and a cloudy sky
# (Recommended practice for the calculation of daylight availability, J. Illuminating Engineering Society 13, 1984).
SKIES_KLX = ((0.8, 15.5, 0.5), (0.3, 45.0, 1.0), (0.3, 21.0, 1.0))
# After sunset: elevation in degrees, and log10 of the light of a clear sky on the ground in lx (American Meteorological
# Society, Glossary of Meteorology, "civil", "nautical" and "astronomical twilight", middle of the ranges).
TWILIGHT_DEG = (-18.0, -12.0, -6.0, 0.0)
TWILIGHT_LOG_LX = (-3.22, -2.1, 0.43, 2.9)
STREET_LX = 10.0  # lamps outside: EN 13201-2 asks 2-15 lx of residential streets, classes P1 to P6
STREET_COLOUR = np.array([1.25, 0.97, 0.62])  # ours
# Optical depth of air that scatters (Leckner 1978, Solar Energy 20) and of haze (Angstrom 1929, beta = 0.1 of clear
# air and exponent 1.3), at wavelengths in micrometres for the primaries of sRGB.
PRIMARIES_UM = np.array([0.61, 0.55, 0.465])
AIR_DEPTH = 0.008735 * PRIMARIES_UM**-4.08 + 0.1 * PRIMARIES_UM**-1.3
# Colour of the sky that comes in by windows, by elevation of the sun in degrees: warm near the horizon, blue after
# sunset. Chosen to look right: the spectrum of twilight depends on ozone and dust.
TINT_DEG = (-8.0, -4.0, -0.5, 4.0, 15.0)
TINTS = np.array([[0.55, 0.82, 1.6], [0.7, 0.88, 1.4], [1.1, 0.97, 0.98], [1.1, 1.0, 0.86], [1.0, 1.0, 1.0]])
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709
# Clouds, ours: how long fields of clouds and single clouds take to go by, and how soft their borders are.
FIELD_S, CLOUD_S = 5400.0, 420.0
CLOUD_EDGE = 0.15


@dataclass(frozen=True)
class Day:
    """A day at a place. latitude_deg: north. day: of the year, 1 January = 1.

    start_hour: local solar time at t0. north_rad: azimuth of north in the scene's frame, counter-clockwise from x.
    """

    latitude_deg: float
    day: int
    start_hour: float
    north_rad: float

    def sun_towards(self, seconds: FloatArray) -> FloatArray:
        """(n,) seconds after t0 -> (n, 3) unit vectors towards the sun, scene frame; z < 0 at night."""
        east, north, up = self._east_north_up(seconds)
        c, s = math.cos(self.north_rad), math.sin(self.north_rad)
        return np.stack([c * north + s * east, s * north - c * east, up], axis=1)

    def _east_north_up(self, seconds: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        hours = self.start_hour + np.asarray(seconds) / 3600.0
        declination = sun_declination(self.day + (hours - 12.0) / 24.0)
        turn = np.radians(15.0 * (hours - 12.0))
        latitude = math.radians(self.latitude_deg)
        south = np.cos(declination) * np.cos(turn) * math.sin(latitude) - np.sin(declination) * math.cos(latitude)
        up = np.sin(declination) * math.sin(latitude) + np.cos(declination) * np.cos(turn) * math.cos(latitude)
        return -np.cos(declination) * np.sin(turn), -south, up


def sun_declination(day: FloatArray) -> FloatArray:
    """(n,) day of the year, fractions allowed -> (n,) declination in radians, to .0006 (Spencer 1971, Search 2)."""
    g = 2.0 * np.pi * (np.asarray(day) - 1.0) / DAYS
    return np.asarray(
        0.006918 - 0.399912 * np.cos(g) + 0.070257 * np.sin(g) - 0.006758 * np.cos(2 * g) + 0.000907 * np.sin(2 * g)
        - 0.002697 * np.cos(3 * g) + 0.00148 * np.sin(3 * g)
    )  # fmt: skip


def air_mass(elevation: FloatArray) -> FloatArray:
    """(n,) elevations in radians >= 0 -> (n,) air passed, that straight up being 1 (Kasten and Young 1989)."""
    return np.asarray(1.0 / (np.sin(elevation) + 0.50572 * (np.degrees(elevation) + 6.07995) ** -1.6364))


def sunlight(elevation: FloatArray) -> FloatArray:
    """(n,) elevations in radians -> (n, 3) light of a sun without clouds on a surface that faces it; 0 at night."""
    passed = np.exp(-air_mass(np.maximum(elevation, 0.0))[:, None] * AIR_DEPTH)
    return np.where(elevation[:, None] > 0.0, passed / np.exp(-air_mass(np.array(NOON_ELEVATION)) * AIR_DEPTH), 0.0)


def skylight(elevation: FloatArray, cover: FloatArray) -> FloatArray:
    """(n,) elevations in radians, (n,) cloud cover 0..1 -> (n, 3) light of the sky, street lamps included."""
    level = _sky_lx(elevation, cover)
    tint = np.stack([np.interp(np.degrees(elevation), TINT_DEG, TINTS[:, c]) for c in range(3)], axis=1)
    tint /= (tint @ LUMINANCE)[:, None]
    tint += (1.0 - tint) * cover[:, None]
    light = level[:, None] * tint + STREET_LX * STREET_COLOUR
    return np.asarray(light / _sky_lx(np.array([NOON_ELEVATION]), np.zeros(1)))


def _sky_lx(elevation: FloatArray, cover: FloatArray) -> FloatArray:
    """(n,) illuminance of the ground by the sky alone."""
    risen = np.maximum(np.sin(elevation), 0.0)
    skies = np.stack([1000.0 * (a + b * risen**c) for a, b, c in SKIES_KLX])
    clear, partly, cloudy = skies
    day = np.where(cover < 0.5, clear + 2 * cover * (partly - clear), partly + (2 * cover - 1) * (cloudy - partly))
    night = 10.0 ** (np.interp(np.degrees(elevation), TWILIGHT_DEG, TWILIGHT_LOG_LX) - TWILIGHT_LOG_LX[-1])
    return np.asarray(day * np.where(elevation < 0.0, night, 1.0))


def clouds(seconds: FloatArray, seeds: Seeds) -> tuple[FloatArray, FloatArray]:
    """(n,) ascending seconds after t0 -> ((n,) cloud cover 0..1, (n,) share of the sun that passes, 0..1).

    Some days are clear and some overcast; on others clouds go by. A longer time begins as a shorter one does.
    """
    mood = 1.6 * seeds.rng("weather").random() - 0.3
    cover = np.clip(mood + 0.5 * (_drifting(seconds, FIELD_S, seeds.rng("fields")) - 0.5), 0.0, 1.0)
    open_sky = _drifting(seconds, CLOUD_S, seeds.rng("clouds"))
    passing = np.clip((open_sky - cover) / CLOUD_EDGE + 0.5, 0.0, 1.0)
    return cover, np.where(cover >= 1.0, 0.0, np.where(cover <= 0.0, 1.0, passing))


def _drifting(seconds: FloatArray, step_s: float, rng: np.random.Generator) -> FloatArray:
    """(n,) values 0..1 that go smoothly from one uniform draw to the next, ``step_s`` apart."""
    at = np.asarray(seconds) / step_s
    before = np.floor(at).astype(np.int64)
    draws = rng.random(int(before.max()) + 2)
    part = at - before
    return np.asarray(draws[before] + (draws[before + 1] - draws[before]) * part * part * (3.0 - 2.0 * part))
