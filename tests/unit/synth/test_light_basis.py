"""A sum over lights is the picture of all of them, at whatever strength, colour, exposure and place of the sun."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import CAMERA, POSE, scene, table, wardrobe

from hsbench.io.changing_light import ChangingLight, encode_light
from hsbench.synth.relit_room import display_table
from hsbench.synth.render import Lighting, open_renderer
from hsbench.synth.render.background import GATHER_RAYS, Drawing, background_rgb, lit_by
from hsbench.synth.render.light_basis import SUN_STEP_RAD, LightStates, decomposed
from hsbench.synth.render.sources import SUN, Sources, relit, sources_of
from hsbench.synth.render.tone import encode_srgb, toned
from hsbench.synth.scene_meshes import scene_meshes
from hsbench.typing import FloatArray, UInt8Array

SCENE = scene(wardrobe(), table())
DAY = sources_of(SCENE)
NO_LAMPS, WHITE, NONE = np.zeros((2, 3)), np.ones(3), np.zeros(3)


def sun_at(azimuth: FloatArray, elevation: float = 0.5) -> FloatArray:
    """Towards a sun before the north window (azimuth 0: straight in), (n, 3)."""
    level = np.cos(elevation)
    return np.stack(
        [level * np.sin(azimuth), level * np.cos(azimuth), np.full(len(azimuth), np.sin(elevation))], axis=1
    )


# Noon, dusk with the lamps on, night, low sun; the sun stands at a place where it is drawn, on its way and at its end.
WAY = sun_at(SUN_STEP_RAD / np.cos(0.5) * np.array([-2.0, -1.0, 0.0, 1.0]))
STATES = LightStates(
    lamps=np.array([0.0, 1.0, 1.0, 0.0])[:, None, None] * np.ones((2, 3)) * [[1.0], [0.7]],
    sky=np.array([[1.0, 1.0, 1.0], [0.045, 0.05, 0.075], [0.001, 0.0008, 0.0005], [0.5, 0.45, 0.37]]),
    sun_towards=WAY,
    sun=np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.37, 0.29, 0.16]]),
)


def picture(lights: list[Sources]) -> list[FloatArray]:
    renderer = open_renderer("raycast")
    ids = renderer.render(scene_meshes(SCENE), CAMERA, POSE, Lighting(1.0)).ids
    return list(
        lit_by(lights, Drawing(DAY.exposure(POSE[:2, 3]), False, GATHER_RAYS), SCENE, ids, renderer, CAMERA, POSE)
    )


@cache
def basis() -> tuple[list[FloatArray], FloatArray]:
    lights, weights = decomposed(SCENE, DAY, STATES)
    return picture(lights), weights


def shown(light: FloatArray) -> UInt8Array:
    return encode_srgb(np.vectorize(toned)(light))


def far_off(a: UInt8Array, b: UInt8Array, levels: int) -> float:
    return float((np.abs(a.astype(int) - b).max(axis=-1) > levels).mean())


@pytest.mark.parametrize("index", range(4))
@pytest.mark.parametrize("gain", [0.3, 1.0, 8.0])
def test_the_sum_is_the_picture_of_the_state(index: int, gain: float) -> None:
    """As bytes, by the very arithmetic of the frame store: at most two levels off, but for one pixel in a thousand."""
    pictures, weights = basis()
    (direct,) = picture([STATES.sources(SCENE, DAY, index)])
    stored = ChangingLight(
        tuple(encode_light(p) for p in pictures),
        weights.astype(np.float32),
        np.full(len(STATES), gain, dtype=np.float32),
        display_table(),
    )
    assert far_off(stored.rgb(index), shown(gain * direct), 2) < 1e-3
    assert far_off(stored.rgb(index), shown(gain * direct), 1) < 5e-3


def test_the_light_of_a_day_is_the_background() -> None:
    """Where one pixel shows one surface: else the background mixes display light, and a sum cannot."""
    (light,) = picture([DAY])
    renderer = open_renderer("raycast")
    ids = renderer.render(scene_meshes(SCENE), CAMERA, POSE, Lighting(1.0)).ids
    background = background_rgb(SCENE, ids, renderer, CAMERA, POSE)
    assert far_off(shown(light), background, 0) < 0.06
    assert far_off(shown(light), background, 3) < 0.02


def test_each_light_is_alone_and_together_they_are_all() -> None:
    lights, weights = decomposed(SCENE, DAY, STATES)
    assert weights.shape == (4, len(lights), 3)
    for index in range(len(STATES)):
        whole = STATES.sources(SCENE, DAY, index)
        parts = sum(w * light.ambient for w, light in zip(weights[index], lights, strict=True))
        assert np.allclose(parts, whole.ambient, rtol=2e-3)  # a sun between two places: their mean
        assert np.allclose(
            sum(w * light.outside for w, light in zip(weights[index], lights, strict=True)), whole.outside
        )
    lamp, other, sky = lights[:3]
    assert lamp.lamps[0].above.any()
    others = (lamp.lamps[1].above, lamp.windows[0].above, lamp.sun, lamp.outside)
    assert not np.concatenate(others).any()
    assert other.lamps[1].above.any()
    assert not other.lamps[0].above.any()
    assert sky.windows[0].above.any()
    assert not np.concatenate((sky.lamps[0].above, sky.sun)).any()
    assert all((light.sun == SUN).all() for light in lights[3:])


def test_places_of_the_sun_lie_on_its_way_a_step_apart() -> None:
    n = 40
    way = sun_at(np.linspace(-1.0, 1.2, n))
    states = LightStates(np.zeros((n, 2, 3)), np.ones((n, 3)), way, np.ones((n, 3)))
    lights, weights = decomposed(SCENE, DAY, states)
    places, shares = np.array([light.sun_towards for light in lights[1:]]), weights[:, 1:, 0]
    apart = np.arccos(np.clip(np.einsum("ij,ij->i", places[:-1], places[1:]), -1, 1))
    assert apart[:-1] == pytest.approx(SUN_STEP_RAD, rel=0.01)
    assert np.allclose(shares.sum(axis=1), 1.0)
    assert ((shares > 0).sum(axis=1) <= 2).all()
    mean = shares @ places
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    assert (np.einsum("ij,ij->i", mean, way)[:-1] > np.cos(SUN_STEP_RAD / 10)).all()


def test_a_sun_that_reaches_no_window_and_lamps_that_never_burn_cost_no_picture() -> None:
    behind = LightStates(np.zeros((2, 2, 3)), np.ones((2, 3)), -WAY[:2] * [1, 1, -1], np.ones((2, 3)))
    lights, weights = decomposed(SCENE, DAY, behind)
    assert weights.shape == (2, 1, 3)
    assert lights[0].windows[0].above.any()


def test_relit_with_the_strengths_of_a_day_changes_nothing() -> None:
    same = relit(SCENE, DAY, np.ones((2, 3)), WHITE, DAY.sun_towards, DAY.sun)
    assert np.array_equal(same.ambient, DAY.ambient)
    assert all(np.array_equal(a.above, b.above) for a, b in zip(same.windows, DAY.windows, strict=True))
    dark = relit(SCENE, DAY, NO_LAMPS, NONE, DAY.sun_towards, NONE)
    assert not dark.ambient.any()
