"""The light in a room over hours: daylight through its windows, lamps that people switch, and the camera's exposure."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Scene
from hsbench.synth.daylight import Day, clouds, skylight, sunlight
from hsbench.synth.render.light_basis import LightStates
from hsbench.synth.render.sources import SUN, Sources, relit
from hsbench.synth.seeds import Seeds
from hsbench.typing import BoolArray, FloatArray

DECIMALS = 6  # of strengths and directions, so that they are the same on every machine
# People switch a lamp on where there is less daylight than this share of its own light, and off when there is more than
# that; it burns on for a while when nobody is left. Ours.
DARK, BRIGHT = 0.25, 0.5
LINGER_S = 600.0
# A camera does not follow the light to the full: what is dark looks darker. Range about a day's exposure: from 4 stops
# less to 6 more, as 1/1600 s to 1/25 s with a gain of 32 would give about 1/100 s. It takes a while. Ours.
FOLLOWED = 0.85
LEAST_EXPOSURE, MOST_EXPOSURE = 1 / 16, 64.0
ADAPTS_S = 20.0


def light_states(
    scene: Scene, daylight: Sources, day: Day, seconds: FloatArray, awake: BoolArray, seeds: Seeds
) -> LightStates:
    """The light of a scene at (n,) ascending seconds after t0.

    daylight: ``sources_of(scene)``. day: its north is that of the scene's frame. awake: (n, R) whether somebody who is
    awake is in a room.
    """
    towards = np.round(day.sun_towards(seconds), DECIMALS)
    towards /= np.sqrt((towards * towards).sum(axis=1, keepdims=True))
    elevation = np.arcsin(np.clip(towards[:, 2], -1.0, 1.0))
    cover, passing = clouds(seconds, seeds)
    sky = np.round(skylight(elevation, cover), DECIMALS)
    sun = np.round(sunlight(elevation) * passing[:, None], DECIMALS)
    dark, rooms = np.zeros((len(scene.rooms), 3)), len(scene.rooms)
    by_lamp = relit(scene, daylight, np.ones((rooms, 3)), np.zeros(3), towards[0], np.zeros(3)).ambient.mean(axis=1)
    by_day = np.array(
        [
            relit(scene, daylight, dark, sky[i], towards[i], SUN * sun[i]).ambient.mean(axis=1)
            for i in range(len(seconds))
        ]
    )
    on = lamps_on(np.round(by_day / by_lamp, DECIMALS), awake, seconds)
    return LightStates(np.repeat(on[..., None] * 1.0, 3, axis=2), sky, towards, sun)


def lamps_on(by_day: FloatArray, awake: BoolArray, seconds: FloatArray) -> BoolArray:
    """(n, R) whether the lamp of a room is on. by_day: (n, R) daylight, in multiples of the lamp's."""
    on = np.zeros(by_day.shape, dtype=np.bool_)
    burning, left_s = np.zeros(by_day.shape[1], dtype=np.bool_), np.full(by_day.shape[1], -np.inf)
    for i, now_s in enumerate(seconds):
        left_s[awake[i]] = now_s
        burning |= awake[i] & (by_day[i] < DARK)
        burning &= (by_day[i] < BRIGHT) & (now_s - left_s <= LINGER_S)
        on[i] = burning
    return on


def exposures(wanted: FloatArray, seconds: FloatArray) -> FloatArray:
    """(n,) exposures that would show the light as by day -> (n,) those of a camera that starts settled and adapts."""
    aims = np.clip(np.log(wanted) * FOLLOWED, np.log(LEAST_EXPOSURE), np.log(MOST_EXPOSURE))
    settled = aims.copy()
    for i in range(1, len(aims)):
        kept = np.exp(-(seconds[i] - seconds[i - 1]) / ADAPTS_S)
        settled[i] = aims[i] + (settled[i - 1] - aims[i]) * kept
    return np.asarray(np.round(np.exp(settled), DECIMALS), dtype=np.float64)
