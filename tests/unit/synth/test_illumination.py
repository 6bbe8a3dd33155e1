"""Light by rays against closed forms and against the exact float64 rays of the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("embreex")

from lit_room import HEIGHT_M, HERE, THERE, scene, table, wardrobe

from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.schema import Room
from hsbench.synth.render import sources as sources_module
from hsbench.synth.render.filtering import LightGrid, read_off, smoothed
from hsbench.synth.render.illumination import Illumination, Points, _hemisphere, _spots
from hsbench.synth.render.shading import lambert
from hsbench.synth.render.sources import ALBEDO, Sources, person_lighting, sources_of
from hsbench.synth.render.surfaces import surfaces_of

SCENE = scene(wardrobe(), table())
LIT = Illumination(surfaces_of(SCENE.objects), sources_of(SCENE))
SOLIDS = pack_solids([s for item in SCENE.objects if item.category.name != "window" for s in item.solids])
UP = np.array([0.0, 0.0, 1.0])


def points_at(position: np.ndarray, normal: np.ndarray = UP, tile: int = 1) -> Points:
    n = len(position)
    normals = np.broadcast_to(normal, (n, 3)).copy()
    return Points(np.asarray(position, float), normals, LIT.sources.room_of(position[:, :2]), np.arange(n) % tile, tile)


def floor_points(count: int) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.column_stack([rng.uniform((0.05, 0.05), (3.95, 3.55), (count, 2)), np.full(count, 1e-4)])


# --- against exact rays


def test_lights_are_seen_where_exact_rays_reach_them() -> None:
    """With one ray to each light a point has light from it exactly if the segment to that spot is free."""
    position = floor_points(1500)
    only_lamp = replace(LIT.sources, windows=(), sun=np.zeros(3))
    lit = Illumination(LIT.surfaces, only_lamp).direct(points_at(position, tile=1500), 0, 1).total[:, 0] > 0
    spots = _spots(LIT.sources.lamps[0]).position
    free = np.array(
        [not segments_blocked(spots[k % len(spots)], p[None] + 0.002 * UP, SOLIDS)[0] for k, p in enumerate(position)]
    )
    assert (lit == free).mean() > 0.998
    assert 0.03 < (~free).mean() < 0.5


def test_the_sun_falls_where_exact_rays_reach_it() -> None:
    sources = replace(LIT.sources, sun=np.ones(3), sun_towards=np.array([0.2, 0.7, 0.6]) / math.sqrt(0.89))
    position = floor_points(3000)
    found = Illumination(LIT.surfaces, sources).sunlit(position, np.tile(UP, (len(position), 1)))
    # The shell is closed but for the window: a free ray leaves through it.
    far = position + 0.002 * UP + 20.0 * sources.sun_towards
    exact = np.array(
        [not segments_blocked(p + 0.002 * UP, q[None], SOLIDS)[0] for p, q in zip(position, far, strict=True)]
    )
    assert (found == exact).mean() > 0.998
    assert exact.sum() > 100


# --- closed forms


def test_a_small_distant_lamp_obeys_the_cosine_laws() -> None:
    lamp = LIT.sources.lamps[0]
    small = lamp._replace(half_u=lamp.half_u * 0.01, half_v=lamp.half_v * 0.01)
    sources = replace(LIT.sources, lamps=(small,), windows=(), sun=np.zeros(3))
    empty = Illumination(surfaces_of(scene().objects), sources)
    position = floor_points(200)
    normal = np.array([0.6, 0.0, 0.8])
    light = empty.direct(points_at(position, normal), 0, 1)
    offset = small.centre - position
    distance = np.linalg.norm(offset, axis=1)
    facing, leaving = np.maximum(offset @ normal, 0.0) / distance, offset[:, 2] / distance
    expected = small.area_m2 * facing * leaving / (np.pi * distance**2)
    assert light.total == pytest.approx(expected[:, None] * small.above, rel=1e-3, abs=1e-9)
    # ``towards`` says what another normal would get.
    other = np.array([0.5, 0.1, math.sqrt(0.74)])
    again = empty.direct(points_at(position, other), 0, 1)
    steep = (facing > 0.25) & (offset @ other / distance > 0.25)
    predicted = light.total @ (0.2126, 0.7152, 0.0722) + light.towards @ (other - normal)
    assert predicted[steep] == pytest.approx((again.total @ (0.2126, 0.7152, 0.0722))[steep], rel=1e-6)


def test_directions_are_unit_and_as_dense_as_the_cosine() -> None:
    for normal in (UP, -UP, np.array([1.0, 0, 0]), np.array([0.6, -0.48, 0.64])):
        directions = _hemisphere(np.tile(normal, (4096, 1)), np.arange(4096)).astype(float)
        assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0, abs=1e-6)
        cosine = directions @ normal
        assert cosine.min() > -1e-6
        assert directions.mean(axis=0) == pytest.approx(normal * 2 / 3, abs=2e-3)
        assert np.quantile(cosine, [0.25, 0.5, 0.75]) == pytest.approx(np.sqrt([0.25, 0.5, 0.75]), abs=0.01)


def test_in_an_even_glow_every_point_gets_the_walls_own_light() -> None:
    """A furnace: no lights but ambient; what is gathered is albedo x ambient, less what is near."""
    grey = LIT.surfaces._replace(colour=np.full_like(LIT.surfaces.colour, 0.5))
    dark = tuple(light._replace(above=np.zeros(3), below=np.zeros(3)) for light in LIT.sources.lamps)
    glow = np.full((2, 3), 0.8)
    furnace = Illumination(grey, replace(LIT.sources, lamps=dark, windows=(), sun=np.zeros(3), ambient=glow))
    light = furnace.gathered(points_at(np.array([[1.0, 2.9, 0.001]])), 512)
    assert 0.5 * 0.8 * 0.6 < light.total[0, 0] < 0.5 * 0.8
    corner = furnace.gathered(points_at(np.array([[0.01, 3.59, 0.001]])), 512)
    assert corner.total[0, 0] < 0.85 * light.total[0, 0]


def test_hidden_light_is_none_at_all() -> None:
    """Under the table, inside its frame, nothing of the lamp above."""
    only_lamp = replace(LIT.sources, windows=(), sun=np.zeros(3))
    lit = Illumination(LIT.surfaces, only_lamp)
    assert (lit.direct(points_at(np.array([[1.9, 2.2, 0.69]])), 0, 64).total == 0).all()


# --- sources


def test_each_room_has_its_lamp_and_the_window_lights_its_own() -> None:
    sources = sources_of(SCENE)
    assert [lamp.room for lamp in sources.lamps] == [0, 1]
    assert [window.room for window in sources.windows] == [0]
    assert np.allclose(sources.windows[0].normal, [0, -1, 0])
    assert sources.windows[0].area_m2 == pytest.approx(1.6 * 1.2)
    for lamp, outline in zip(sources.lamps, (HERE, THERE), strict=True):
        assert lamp.centre[:2] == pytest.approx(outline.mean(axis=0), abs=0.1)
        assert HEIGHT_M - 0.1 < lamp.centre[2] < HEIGHT_M
    assert sources.room_of(np.array([[1.0, 1.0], [5.0, 1.0], [4.04, 1.5], [4.06, 1.5], [9.0, 9.0]])).tolist() == [
        0,
        1,
        0,
        1,
        1,
    ]


def test_a_lamp_hangs_inside_a_bent_room() -> None:
    bent = np.array([[0, 0], [6, 0], [6, 1.5], [1.8, 1.5], [1.8, 5], [0, 5]], dtype=float)
    room = replace(scene(), rooms=(Room("living", bent),))
    lamp = sources_of(room).lamps[0]
    for u in (-1, 1):
        for v in (-1, 1):
            x, y, _ = lamp.centre + u * lamp.half_u + v * lamp.half_v
            assert (0 < x < 6 and 0 < y < 1.5) or (0 < x < 1.8 and 0 < y < 5)


def test_exposure_follows_the_light_of_the_room() -> None:
    def exposed(sources: Sources, at: tuple[float, float]) -> float:
        return sources.exposure(np.array(at))

    sources = sources_of(SCENE)
    brighter = replace(sources, ambient=sources.ambient * [[2.0], [1.0]])
    assert exposed(brighter, (1, 1)) == pytest.approx(exposed(sources, (1, 1)) / 2)
    assert exposed(brighter, (5, 1)) == exposed(sources, (5, 1))


def test_what_the_sun_meets_lights_the_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its flux through the window bounces twice and on and on: once to leave the patch, then as all light does."""
    monkeypatch.setattr(sources_module, "SUNNY_SHARE", 1.0)
    sunny = sources_of(SCENE)
    monkeypatch.setattr(sources_module, "SUNNY_SHARE", 0.0)
    dull = sources_of(SCENE)
    pane = sunny.windows[0]
    flux = 1.6 * 1.2 * -float(pane.normal @ sunny.sun_towards) * sunny.sun
    surface_m2 = 2 * 4.0 * 3.6 + HEIGHT_M * 2 * (4.0 + 3.6)
    assert (flux > 0).all()
    assert sunny.ambient[0] - dull.ambient[0] == pytest.approx(flux / surface_m2 * ALBEDO**2 / (1 - ALBEDO))
    assert np.array_equal(sunny.ambient[1], dull.ambient[1])
    assert sunny.exposure(np.array([1.0, 1.0])) < dull.exposure(np.array([1.0, 1.0]))


@pytest.mark.parametrize("scattered", [0.0, 0.5])
def test_scattering_keeps_the_mean_light_on_people(monkeypatch: pytest.MonkeyPatch, scattered: float) -> None:
    """Over all directions of a face, at the hips below the lamp."""
    sources, camera = LIT.sources, np.array([1.0, 1.0])
    exposure = sources.exposure(camera)
    x, y, _ = sources.lamps[0].centre
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    normals = np.concatenate([normals, -normals]) / np.tile(np.linalg.norm(normals, axis=1), 2)[:, None]
    here = np.tile([x, y, 1.0], (len(normals), 1))
    expected = lambert(here, normals, person_lighting(sources, camera, exposure)).mean()
    monkeypatch.setattr(sources_module, "SCATTERED", scattered)
    assert lambert(here, normals, person_lighting(sources, camera, exposure)).mean() == pytest.approx(
        expected, rel=0.01
    )


def test_people_are_lit_like_the_room() -> None:
    """In the middle of the room, a surface that looks up or at the window: within a third of the traced light."""
    sources = replace(LIT.sources, sun=np.zeros(3))
    empty = Illumination(surfaces_of(scene().objects), sources)
    here = np.array([1.0, 1.0])
    lights = person_lighting(sources, here, sources.exposure(here))
    exposure = sources.exposure(np.array([1.0, 1.0]))
    for normal in (UP, np.array([0.0, 1.0, 0.0])):
        there = np.array([[2.0, 1.8, 1.0]])
        traced = (
            empty.direct(points_at(there, normal), 0, 64).total + empty.gathered(points_at(there, normal), 1024).total
        )
        drawn = lambert(there, normal[None], lights)
        assert drawn.mean() == pytest.approx(exposure * traced.mean(), rel=0.35)


# --- smoothing


def test_smoothing_keeps_to_the_surface_and_removes_a_tile() -> None:
    """A pattern of period 2 reach vanishes; two walls that meet keep their own light."""
    h, w, reach = 24, 32, 4
    position, normal = np.zeros((h, w, 3)), np.zeros((h, w, 3))
    columns, rows = np.meshgrid(np.arange(w), np.arange(h))
    left = columns < w // 2
    position[..., 0], position[..., 1] = np.where(left, columns, w // 2), rows
    position[..., 2] = np.where(left, 0, columns - w // 2)
    position *= 0.05
    normal[left], normal[~left] = (0, 0, 1), (-1, 0, 0)
    pattern = np.random.default_rng(0).normal(size=(8, 8))[rows % 8, columns % 8]
    light = np.where(left, 5.0, 1.0)[..., None] + pattern[..., None]
    valid = np.ones((h, w), bool)
    valid[:3, :3] = False
    result = smoothed(LightGrid(valid, position, normal, light, False), reach).light[..., 0]
    mean = pattern[:8, :8].mean()
    assert result[8:-8, 8 : w // 2 - 5] == pytest.approx(5.0 + mean, abs=1e-9)
    assert result[8:-8, w // 2 + 5 : -8] == pytest.approx(1.0 + mean, abs=1e-9)
    assert (result[:3, :3] == 0).all()
    assert np.abs(result[8:-8, w // 2 - 3 : w // 2] - 5.0 - mean).max() < 1.0


def test_light_of_a_picture_that_goes_round_knows_no_first_column() -> None:
    """Turned by some columns, all that is smoothed and read off is the same, turned."""
    rng = np.random.default_rng(1)
    h, w, turn = 9, 24, 7
    flat = np.zeros((h, w, 3))
    grid = LightGrid(rng.random((h, w)) < 0.9, flat, flat + (0.0, 0.0, 1.0), rng.random((h, w, 2)), True)
    turned = grid._replace(valid=np.roll(grid.valid, turn, 1), light=np.roll(grid.light, turn, 1))
    assert np.allclose(smoothed(turned, 4).light, np.roll(smoothed(grid, 4).light, turn, 1), rtol=0, atol=1e-14)
    here, there = np.empty(2), np.empty(2)
    for column in np.arange(-0.5, w - 0.5, 0.25):
        read_off(grid, 4.3, column, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, here)
        read_off(turned, 4.3, (column + turn + 0.5) % w - 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, there)
        assert here == pytest.approx(there, abs=1e-14)
