"""Image noise: a function of seed and frame whose width is that of electrons counted one by one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.image_noise import (
    CAMERA,
    SRGB_EXPONENT,
    compressed,
    image_preset,
    image_rng,
    noisy,
    photographed,
)


def flat(level: int, shape: tuple[int, int] = (200, 200)) -> np.ndarray:
    return np.full((*shape, 3), level, dtype=np.uint8)


def test_presets_by_name() -> None:
    assert image_preset("camera") == CAMERA
    assert image_preset("none") is None
    with pytest.raises(SchemaError, match=r"'film'; expected one of camera, none"):
        image_preset("film")


def test_no_noise_hands_out_what_it_got() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    assert photographed(picture, None, 40.0, 1, 2) is picture


@pytest.mark.parametrize(("level", "gain"), [*itertools.product((30, 90, 180, 230), (1.0, 16.0))])
def test_spread_is_that_of_counted_electrons(level: int, gain: float) -> None:
    """The reference: Poisson electrons, normal read noise, then the display curve."""
    rng = np.random.default_rng(0)
    white = CAMERA.full_electrons / gain
    electrons = rng.poisson((level / 255) ** SRGB_EXPONENT * white, 100_000) + CAMERA.read_electrons * rng.normal(
        size=100_000
    )
    expected = 255 * np.maximum(electrons / white, 0.0) ** (1 / SRGB_EXPONENT)
    found = noisy(flat(level), CAMERA, gain, image_rng(0, 0)).astype(float)
    rounding = 1 / 12
    assert np.var(found) - rounding == pytest.approx(np.var(expected), rel=0.1 if level > 30 else 0.3, abs=0.02)
    assert found.mean() == pytest.approx(level, abs=0.1)


def test_noise_grows_with_gain_and_gain_begins_where_longer_exposure_ends() -> None:
    spread = [float(np.std(noisy(flat(60), CAMERA, gain, image_rng(0, 0)).astype(float))) for gain in (1, 2, 4, 8, 16)]
    assert (np.diff(spread) > 0).all()
    bright, longest = (photographed(flat(60), CAMERA, e, 0, 0) for e in (0.1, CAMERA.longest))
    assert np.array_equal(bright, longest)
    assert not np.array_equal(photographed(flat(60), CAMERA, 2 * CAMERA.longest, 0, 0), longest)


def test_same_seed_and_frame_same_bytes_and_any_other_differ() -> None:
    images = {key: noisy(flat(90), CAMERA, 4.0, image_rng(*key)) for key in itertools.product((0, 1, 11), (0, 1, 10))}
    for key, image in images.items():
        assert np.array_equal(image, noisy(flat(90), CAMERA, 4.0, image_rng(*key)))
    for a, b in itertools.combinations(images.values(), 2):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.015
    assert not np.array_equal(*(noisy(flat(90), CAMERA, 4.0, image_rng(*key)) for key in ((1, 11), (11, 1))))


def test_compression_keeps_smooth_pictures_and_loses_fine_ones_as_quality_says() -> None:
    ramp = np.broadcast_to(np.arange(256, dtype=np.uint8)[None, :, None], (64, 256, 3)).copy()
    assert np.abs(compressed(ramp, 85).astype(int) - ramp).max() <= 3
    grain = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    lost = [float(np.abs(compressed(grain, q).astype(int) - grain).mean()) for q in (95, 85, 50)]
    assert lost == sorted(lost)
    assert lost[0] > 1
