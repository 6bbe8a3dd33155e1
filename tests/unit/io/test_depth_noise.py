"""Depth noise: a function of (seed, episode, frame) whose statistics are the formula's."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.io.depth_kernels import SHADE_SLACK_PX, shaded, viewing_angle
from hsbench.io.depth_noise import HARSH, KINECT, PRESETS, add_noise, noise_rng, preset

WALL = (480, 640)


def read(depth_m: np.ndarray, frame: int = 0, seed: int = 0) -> np.ndarray:
    return add_noise(depth_m, KINECT, noise_rng(seed, frame))


def test_presets_by_name() -> None:
    assert preset("kinect") == KINECT
    assert preset("none") is None
    with pytest.raises(SchemaError, match=r"'kinetc'; expected one of kinect, mild, harsh, none"):
        preset("kinetc")
    assert set(PRESETS) == {"kinect", "mild", "harsh", "none"}


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


def line_of_sight(shape: tuple[int, int] = WALL, focal_px: float = 452.0) -> np.ndarray:
    """(h, w, 3) directions of pixels, z = 1."""
    v, u = np.indices(shape) + 0.5
    return np.stack([(u - shape[1] / 2) / focal_px, (v - shape[0] / 2) / focal_px, np.ones(shape)], axis=-1)


def plane(normal: tuple[float, float, float], at_m: float) -> tuple[np.ndarray, np.ndarray]:
    """((h, w) depth, (h, w) angle to the line of sight) of a plane that meets the optical axis at a distance."""
    n, rays = np.array(normal) / np.linalg.norm(normal), line_of_sight()
    facing = np.maximum(rays @ n, 1e-3)  # beyond the plane's horizon: far off
    return at_m * n[2] / facing, np.arccos(np.abs(facing) / np.linalg.norm(rays, axis=-1))


@pytest.mark.parametrize("distance_m", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("normal", [(0, 0, 1), (1.0, 0, 1), (0.3, -1.5, 1)])
def test_sigma_on_a_wall_is_the_formula(distance_m: float, normal: tuple[float, float, float]) -> None:
    """Nguyen et al. 2012, at the angle of each pixel, up to 60 degrees; whole millimetres add a twelfth."""
    depth, theta = plane(normal, distance_m)
    near = (depth > 0.6) & (depth < 5.0) & (theta < np.radians(65.0))
    sigma = (
        0.0012
        + 0.0019 * (depth - 0.4) ** 2
        + 0.0001 / np.sqrt(depth) * np.minimum(theta / (np.pi / 2 - theta), 2.0) ** 2
    )
    quiet = replace(KINECT, lateral_px=0.0, lateral_angle_px=0.0, baseline_m=0.0)
    error = (add_noise(depth, quiet, noise_rng(0, 0)) - depth)[near] / np.sqrt(sigma**2 + 0.001**2 / 12)[near]
    assert near.sum() > 20_000
    assert np.std(error) == pytest.approx(1.0, rel=0.03)
    assert abs(error.mean()) < 0.03
    assert np.mean(np.abs(error) < 2.0) == pytest.approx(0.9545, abs=0.03)


@pytest.mark.parametrize("normal", [(0, 0, 1), (1.0, 0, 1), (-2.0, 0.5, 1), (0, -3.0, 1), (0.3, 0.3, 1)])
def test_angles_of_planes_are_the_closed_form(normal: tuple[float, float, float]) -> None:
    depth, theta = plane(normal, 2.0)
    seen = (depth > 0.3) & (depth < 6.0) & (theta < np.radians(80.0))
    found = viewing_angle(depth.astype(np.float32), 452.0)
    assert np.abs(found - theta)[seen].max() < np.radians(3.0)
    assert np.abs(found - theta)[seen].mean() < np.radians(0.7)


def test_an_edge_between_two_walls_is_not_glancing() -> None:
    depth = np.full(WALL, 2.0, dtype=np.float32)
    depth[:, 300:340] = 1.0
    rays = line_of_sight()
    assert np.allclose(viewing_angle(depth, 452.0), np.arccos(1 / np.linalg.norm(rays, axis=-1)), atol=2e-3)


@pytest.mark.parametrize(("near_m", "far_m"), [(1.0, 3.0), (2.0, 2.5), (0.8, 6.0)])
def test_the_shade_of_a_post_lies_to_its_left_as_wide_as_the_baseline_says(near_m: float, far_m: float) -> None:
    depth = np.full(WALL, far_m, dtype=np.float32)
    depth[:, 300:340] = near_m
    width_px = 452.0 * 0.075 * (1 / near_m - 1 / far_m)
    columns = shaded(depth, 452.0 * 0.075).any(axis=0)
    assert shaded(depth, 452.0 * 0.075).all(axis=0)[columns].all()
    found = np.flatnonzero(columns)
    assert abs(len(found) - min(width_px, 300)) <= 1.5
    assert found.max() == 299
    lost = add_noise(depth, replace(KINECT, edge_loss=0.0, lateral_px=0.0), noise_rng(0, 0)) == 0
    assert np.array_equal(lost.all(axis=0), columns)


@given(st.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_shade_is_that_of_every_point_against_every_other(seed: int) -> None:
    """From the light, a nearer pixel of the same row hides all that lies to its left in the picture and not there."""
    rng = np.random.default_rng(seed)
    depth = np.repeat(rng.uniform(0.8, 4.0, (2, 8)), 5, axis=1).astype(np.float32)
    depth[rng.random(depth.shape) < 0.1] = 0.0
    found = shaded(depth, 20.0)
    for i, j in np.ndindex(depth.shape):
        own = j - 20.0 / depth[i, j] if depth[i, j] else np.nan
        others = [k - 20.0 / depth[i, k] for k in range(j + 1, depth.shape[1]) if depth[i, k]]
        gap = own - min(others, default=np.inf) - SHADE_SLACK_PX
        if not abs(gap) < 1e-4:  # float32
            assert found[i, j] == (gap > 0)


def test_a_plane_that_the_light_can_see_is_in_no_shade() -> None:
    for normal in ((0, 0, 1), (1.5, 0.0, 1), (-1.0, 0.2, 1)):
        depth, _ = plane(normal, 2.0)
        assert not shaded(np.clip(depth, 0.4, 8.0).astype(np.float32), 452.0 * 0.075)[:, 40:].any()


@pytest.mark.parametrize(("degrees", "share"), [(70.0, 0.0), (80.0, 0.5), (86.0, 1.0)])
def test_glancing_surfaces_are_lost_by_the_share_of_their_angle(degrees: float, share: float) -> None:
    tangent = np.tan(np.radians(degrees))
    depth, theta = plane((0.0, -tangent, 1.0), 2.0)
    middle = (np.abs(theta - np.radians(degrees)) < np.radians(0.5)) & (depth > 1.0) & (depth < 4.0)
    wide = replace(HARSH, edge_step_m=9.0, baseline_m=0.0, lateral_px=0.0, lateral_angle_px=0.0, far_m=8.0)
    lost = add_noise(depth, wide, noise_rng(0, 0)) == 0
    assert middle.sum() > 300
    assert lost[middle].mean() == pytest.approx(share, abs=0.1)


def test_dark_surfaces_are_lost_far_off_and_bright_ones_are_not() -> None:
    noise = replace(HARSH, baseline_m=0.0)
    shares = {
        (level, distance): float(
            np.mean(
                add_noise(np.full(WALL, distance), noise, noise_rng(0, 0), np.full((*WALL, 3), level, dtype=np.uint8))
                == 0
            )
        )
        for level in (5, 40, 200)
        for distance in (1.0, 4.0)
    }
    assert shares[200, 4.0] < 1e-3
    assert shares[40, 1.0] < 1e-3
    assert shares[5, 1.0] < shares[5, 4.0]
    assert shares[40, 4.0] < shares[5, 4.0]
    assert shares[5, 4.0] > 0.9
    assert np.mean(add_noise(np.full(WALL, 4.0), noise, noise_rng(0, 0)) == 0) == 0.0  # without a picture: none


def test_presets_go_from_mild_to_harsh() -> None:
    depth = np.full(WALL, 3.0, dtype=np.float32)
    depth[:, 300:340] = 1.5
    grey = np.full((*WALL, 3), 60, dtype=np.uint8)
    images = [add_noise(depth, preset(name), noise_rng(0, 0), grey) for name in ("mild", "kinect", "harsh")]
    errors = [np.std((image - depth)[:, :250][image[:, :250] > 0]) for image in images]
    losses = [np.mean(image == 0) for image in images]
    assert errors == sorted(errors)
    assert losses == sorted(losses)


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
