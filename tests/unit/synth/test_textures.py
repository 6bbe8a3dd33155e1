"""Textures: exact filtering of lines, patterns of the stated size, no smear on any face, none finer than a pixel."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lit_room import part, thing

from hsbench.schema.scene import TEXTURES
from hsbench.synth.render.materials import DEEPEST_DYE, LUMINANCE, dyed, material
from hsbench.synth.render.noise import cell_value, lines, noise, noise2, visible
from hsbench.synth.render.textures import (
    BRICK_HEIGHT,
    BRICK_LENGTH,
    CHECK,
    CODES,
    HERRINGBONE_RATIO,
    HERRINGBONE_WIDTH,
    STRIPE,
    STRIPE_WIDTH,
    TILE,
    texture,
)
from hsbench.synth.render.tone import CONTRAST, HALF_LIGHT, decode_srgb, encode_srgb, toned

SHARP = np.full(3, 1e-5)
PATTERNED = sorted(TEXTURES - {"", "plaster"})


def field(
    name: str, points: np.ndarray, pixel: np.ndarray = SHARP, normal_axis: int = 2, grain_axis: int = 0
) -> np.ndarray:
    """(N, 3) points -> (N, 3) factor, warmth, share."""
    return np.array([texture(CODES[name], p, pixel, normal_axis, grain_axis) for p in points])


def scattered(count: int, seed: int = 0, reach: float = 5.0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-reach, reach, (count, 3))


# --- noise and lines


@given(st.integers(-(2**40), 2**40), st.integers(-(2**40), 2**40), st.integers(-9, 9), st.integers(0, 99))
def test_cell_values_are_in_the_unit_interval(i: int, j: int, k: int, seed: int) -> None:
    assert 0.0 <= cell_value(i, j, k, seed) < 1.0
    assert cell_value(i, j, k, seed) == cell_value(i, j, k, seed)


def test_cell_values_are_even_and_independent_of_their_neighbours() -> None:
    values = np.array([[cell_value(i, j, 0, 3) for i in range(-100, 100)] for j in range(-100, 100)])
    assert np.histogram(values, 10, (0, 1))[0] == pytest.approx(4000, rel=0.08)
    for a, b in ((values[1:], values[:-1]), (values[:, 1:], values[:, :-1])):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.02


def test_noise_is_bounded_and_continuous() -> None:
    for x, y, z in scattered(500):
        for value, beside in ((noise(x, y, z, 1), noise(x + 1e-5, y, z, 1)), (noise2(x, y, 1), noise2(x, y + 1e-5, 1))):
            assert -1.0 <= value <= 1.0
            assert abs(value - beside) < 1e-4


@given(st.floats(-3, 3), st.floats(0.01, 0.5), st.floats(0.05, 0.95), st.floats(1e-4, 2.0))
def test_lines_are_the_exact_share_of_the_footprint(x: float, period: float, share: float, footprint: float) -> None:
    width = share * period
    places = x + footprint * ((np.arange(4000) + 0.5) / 4000 - 0.5)
    brute = np.mean(places - period * np.floor(places / period) < width)
    assert lines(x, period, width, footprint) == pytest.approx(brute, abs=5e-4 * (1 + footprint / period))


def test_patterns_fade_between_three_pixels_and_one() -> None:
    assert [visible(0.3, f) for f in (0.0, 0.1, 0.15, 0.3, 9.0)] == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0])


# --- every texture


def test_every_texture_of_the_schema_has_a_number() -> None:
    assert set(CODES) == TEXTURES
    assert sorted(CODES.values()) == list(range(len(TEXTURES)))


@pytest.mark.parametrize("name", sorted(TEXTURES))
def test_textures_keep_the_colour_on_the_whole(name: str) -> None:
    for axis in range(3):
        factor, warmth, share = field(name, scattered(2000, axis), normal_axis=axis, grain_axis=(axis + 1) % 3).T
        assert 0.1 < factor.min() <= factor.max() < 1.9
        assert np.abs(warmth).max() < 3.0
        assert 0.0 <= share.min() <= share.max() <= 1.0
        assert factor.mean() == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("name", PATTERNED)
def test_what_is_finer_than_a_pixel_fades_to_its_mean(name: str) -> None:
    points = scattered(2000)
    sharp, coarse = field(name, points), field(name, points, np.full(3, 1.0))
    scale = np.array([1.0, 0.0, 0.5])
    assert (coarse * scale).std(axis=0).sum() < 0.75 * (sharp * scale).std(axis=0).sum()
    assert (coarse * scale).mean(axis=0) == pytest.approx((sharp * scale).mean(axis=0), abs=0.12)


@pytest.mark.parametrize("name", PATTERNED)
@pytest.mark.parametrize("normal_axis", [0, 1, 2])
def test_no_face_is_smeared(name: str, normal_axis: int) -> None:
    """Along either axis of any face the pattern changes within two metres."""
    for axis in {0, 1, 2} - {normal_axis}:
        ranges = []
        for start in scattered(20, 7):
            walk = np.tile(start, (200, 1))
            walk[:, axis] += np.linspace(0, 2.0, 200)
            ranges.append(np.ptp(field(name, walk, normal_axis=normal_axis), axis=0))
        assert np.mean(ranges, axis=0)[[0, 2]].max() > 0.03


# --- patterns of the stated size


def test_tiles_stripes_checks_and_bricks_repeat() -> None:
    points = scattered(800)
    for name, step, axis in (
        ("tiles", (TILE, 0, 0), 2),
        ("tiles", (0, TILE, 0), 2),
        ("stripes", (0, STRIPE, 0), 2),
        ("stripes", (0.123, 0, 0), 2),
        ("checks", (CHECK, CHECK, 0), 2),
        ("brick", (BRICK_LENGTH, 0, 0), 1),
        ("brick", (0, 0, 2 * BRICK_HEIGHT), 1),
        ("brick", (BRICK_LENGTH / 2, 0, BRICK_HEIGHT), 1),
    ):
        a, b = (field(name, p, normal_axis=axis)[:, 2] for p in (points, points + np.array(step)))
        assert (np.abs(a - b) < 1e-6).mean() > 0.99
    assert field("stripes", points)[:, 2].mean() == pytest.approx(STRIPE_WIDTH / STRIPE, abs=0.03)


def test_courses_of_bricks_lie_level_on_every_wall() -> None:
    for axis, along in ((0, 1), (1, 0)):
        points = scattered(300)
        points[:, 2] = BRICK_HEIGHT * 5  # in a bed of mortar
        for grain in (along, 2):
            assert (field("brick", points, normal_axis=axis, grain_axis=grain)[:, 2] > 0.99).all()


def test_herringbone_is_made_of_strips_of_one_size() -> None:
    """Walking over the floor along a strip or across it, joints come at most its length or width apart."""
    half = math.sqrt(0.5)
    for direction in ((half, half, 0.0), (half, -half, 0.0)):
        walk = np.array([0.0137, 0.0071, 0.0]) + np.outer(np.linspace(0, 8, 40_000), direction)
        joint = field("herringbone", walk, np.full(3, 1e-4))[:, 0] < 0.75
        crossings = walk[np.flatnonzero(joint)] @ np.array(direction)
        gaps = np.diff(crossings)
        gaps = gaps[gaps > 0.002]
        assert len(gaps) > 20
        lengths = {1.0: 0, float(HERRINGBONE_RATIO): 0}
        for gap in gaps + 0.0015:
            size = min(lengths, key=lambda n: abs(n - gap / HERRINGBONE_WIDTH))
            assert gap / HERRINGBONE_WIDTH == pytest.approx(size, abs=0.06)
            lengths[size] += 1
        # n squares lie along a strip for one across each of n others
        assert lengths[1.0] == pytest.approx(HERRINGBONE_RATIO * lengths[HERRINGBONE_RATIO], abs=HERRINGBONE_RATIO)


# --- which pattern a part gets


def test_pieces_of_one_name_share_a_pattern_and_others_do_not() -> None:
    def shift(object_id: int, name: str) -> tuple[float, ...]:
        item = thing(object_id, "desk", part(name, (0, 0, 0), (1, 1, 1)))
        return tuple(material(item, item.parts[0]).shift_m)

    assert shift(5, "drawer") == shift(5, "drawer_2") == shift(5, "drawer_13")
    assert len({shift(5, "drawer"), shift(6, "drawer"), shift(5, "top")}) == 3


def test_grain_runs_along_a_part_and_courses_along_a_wall() -> None:
    legs = thing(5, "desk", part("leg", (0, 0, 0), (0.05, 0.05, 0.7)), part("top", (0, 0, 0.7), (0.6, 1.2, 0.74)))
    assert [material(legs, p).grain_axis for p in legs.parts] == [2, 1]
    wall = thing(3, "wall", part("wall", (0, 0, 0), (0.3, 0.1, 2.5)), part("wall", (0.3, 0, 2.0), (4.0, 0.1, 2.5)))
    assert [material(wall, p).grain_axis for p in wall.parts] == [0, 0]


def test_plain_cloth_is_woven_and_plain_metal_is_not() -> None:
    sofa = thing(5, "sofa", part("seat_2", (0, 0, 0), (1, 1, 0.2)), part("leg", (0, 0, -0.1), (0.05, 0.05, 0)))
    seat, leg = (material(sofa, p) for p in sofa.parts)
    assert (seat.texture, leg.texture) == (CODES["weave"], CODES[""])
    assert seat.gloss == 0.0 < leg.gloss


@given(st.tuples(*[st.floats(0.0, 1.0)] * 3))
def test_dye_is_no_deeper_than_its_bound_and_keeps_its_luminance(colour: tuple[float, float, float]) -> None:
    linear = np.array(colour)
    cloth = dyed(linear)
    assert cloth @ LUMINANCE == pytest.approx(linear @ LUMINANCE, abs=1e-12)
    assert cloth.max() - cloth.min() <= DEEPEST_DYE * cloth.max() + 1e-9
    assert (np.sign(np.diff(cloth)) * np.sign(np.diff(linear)) >= 0).all()  # the hue stays
    if linear.max() - linear.min() <= DEEPEST_DYE * linear.max():
        assert np.array_equal(cloth, linear)


# --- tone


def test_srgb_there_and_back() -> None:
    values = np.arange(256)
    assert np.array_equal(encode_srgb(decode_srgb(values)), values)
    assert decode_srgb(np.array(188)) == pytest.approx(0.5, abs=0.005)  # known: half the light is byte 188


@given(st.floats(0, 1e3), st.floats(1e-6, 1.0))
def test_more_light_is_never_darker_and_never_clipped(light: float, more: float) -> None:
    assert 0.0 <= toned(light) <= toned(light + more) < 1.0
    assert toned(light) <= light


def test_tone_has_the_stated_middle_and_contrast() -> None:
    assert toned(HALF_LIGHT) == pytest.approx(0.5)
    step = 1e-4
    rise = (toned(HALF_LIGHT * math.exp(step)) - toned(HALF_LIGHT * math.exp(-step))) / (2 * step)
    assert rise == pytest.approx(CONTRAST / 4, rel=1e-6)


def test_a_pattern_in_bright_light_is_still_seen() -> None:
    """A tenth of contrast at four times the light that half of the range shows: more than one level of the display."""
    bright = 4 * HALF_LIGHT
    dark, light = encode_srgb(np.array([toned(bright), toned(1.1 * bright)])).astype(int)
    assert light - dark >= 2
    assert light < 240
