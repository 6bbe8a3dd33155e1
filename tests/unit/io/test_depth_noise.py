"""Depth noise: a function of (seed, episode, frame) whose statistics are the formula's."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.depth_noise import KINECT, PRESETS, add_noise, noise_rng, preset

WALL = (480, 640)


def read(depth_m: np.ndarray, frame: int = 0, seed: int = 0) -> np.ndarray:
    return add_noise(depth_m, KINECT, noise_rng(seed, frame))


def test_presets_by_name() -> None:
    assert preset("kinect") == KINECT
    assert preset("none") is None
    with pytest.raises(SchemaError, match=r"'kinetc'; expected one of kinect, none"):
        preset("kinetc")
    assert set(PRESETS) == {"kinect", "none"}


def test_no_noise_hands_out_what_it_got() -> None:
    clean = np.random.default_rng(0).uniform(0, 9, (30, 40)).astype(np.float32)
    assert np.array_equal(add_noise(clean, None, noise_rng(0, 0)), clean)


def test_same_seed_and_frame_same_values_and_any_other_differ() -> None:
    wall = np.full((60, 80), 2.0, dtype=np.float32)
    images = {key: add_noise(wall, KINECT, noise_rng(*key)) for key in itertools.product((0, 1, 11), (0, 1, 10))}
    for key, image in images.items():
        assert np.array_equal(image, add_noise(wall, KINECT, noise_rng(*key)))
    for a, b in itertools.combinations(images.values(), 2):
        assert np.mean(a == b) < 0.3
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.06  # four standard errors
    # the parts of the key do not run into each other
    assert not np.array_equal(*(add_noise(wall, KINECT, noise_rng(*key)) for key in ((1, 11), (11, 1))))


@pytest.mark.parametrize("distance_m", [1.0, 2.0, 4.0])
def test_sigma_on_a_flat_wall_is_the_formula(distance_m: float) -> None:
    error = read(np.full(WALL, distance_m)).astype(np.float64) - distance_m
    sigma = 0.0012 + 0.0019 * (distance_m - 0.4) ** 2  # Nguyen et al. 2012
    assert np.std(error) == pytest.approx(sigma, rel=0.05)
    assert abs(error.mean()) < 4 * sigma / np.sqrt(error.size) + 1e-6
    assert np.mean(np.abs(error) < sigma) == pytest.approx(0.6827, abs=0.11 if sigma < 0.003 else 0.05)  # normal
    columns = error - error.mean()
    assert abs(np.mean(columns[:, 1:] * columns[:, :-1])) < 0.02 * sigma**2  # neighbours are independent


def test_lateral_shift_has_the_standard_deviation_it_names() -> None:
    # on a plane that recedes with the column by more than noise, depth tells the column it was taken from
    step = 0.004
    ramp = np.broadcast_to(2.0 + step * np.arange(640), WALL)
    quiet = type(KINECT)(0.0, 0.0, 0.0, 0.8, 0.5, 8.0, 10.0, 0.0)
    shift = (add_noise(ramp, quiet, noise_rng(0, 0)) - ramp)[:, 20:-20] / step
    assert np.abs(shift - np.rint(shift)).max() < 0.2  # whole pixels
    # a rounded normal gains a twelfth
    assert np.std(np.rint(shift)) == pytest.approx(np.sqrt(0.8**2 + 1 / 12), rel=0.02)


def test_readings_are_whole_millimetres_and_finite() -> None:
    depth = np.random.default_rng(1).uniform(0, 10, WALL).astype(np.float32)
    noisy = read(depth)
    assert noisy.dtype == np.float32
    assert noisy.shape == depth.shape
    assert np.isfinite(noisy).all()
    assert (noisy >= 0).all()
    millimetres = np.rint(noisy.astype(np.float64) * 1000)
    assert np.array_equal(noisy, (millimetres / 1000).astype(np.float32))


@pytest.mark.parametrize(("distance_m", "read_share"), [(0.0, 0), (0.49, 0), (0.51, 1), (7.99, 1), (8.01, 0), (60, 0)])
def test_out_of_range_readings_are_lost(distance_m: float, read_share: float) -> None:
    assert np.mean(read(np.full((120, 160), distance_m)) > 0) == read_share


@pytest.mark.parametrize(("step_m", "lost"), [(0.07, 0.0), (0.09, 0.5), (2.0, 0.5)])
def test_half_the_pixels_along_a_depth_edge_are_lost_and_no_other(step_m: float, lost: float) -> None:
    depth = np.full(WALL, 2.0, dtype=np.float32)
    depth[:, 320:] += step_m
    missing = read(depth) == 0
    share = missing[:, 319:321].mean()  # the two columns with both sides in their 3 x 3
    assert share == pytest.approx(lost, abs=4 * 0.5 / np.sqrt(2 * 480))
    assert not missing[:, :319].any()
    assert not missing[:, 321:].any()


def test_the_input_is_left_alone() -> None:
    depth = np.random.default_rng(1).uniform(0, 10, (20, 30)).astype(np.float32)
    before = depth.copy()
    read(depth)
    assert np.array_equal(depth, before)


def test_noise_of_a_part_needs_no_other_frame() -> None:
    wall = np.full((20, 30), 2.0)
    alone = read(wall, frame=7)
    for frame in range(7):
        read(wall, frame)
    assert np.array_equal(read(wall, frame=7), alone)
