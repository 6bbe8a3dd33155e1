"""Activity maps against a plain loop in exact arithmetic: all numbers are eighths, so nothing is rounded."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.activity_map import BLUR_REACH, rasterise, rasterise_blurred

EIGHTHS = st.integers(-24, 40).map(lambda k: k / 8)
CELLS = st.sampled_from([0.25, 0.5, 1.0])
RADII = st.sampled_from([0.0, 0.25, 0.625, 1.0, 2.5])


def by_loop(positions, origin, shape, cell_m, radius_m, delta) -> np.ndarray:
    """M = min(1, delta * number of discs over the cell centre), from the definition."""
    result = np.zeros(shape, dtype=np.float32)
    for i in range(shape[0]):
        for j in range(shape[1]):
            cx = Fraction(origin[0]) + (Fraction(2 * i + 1, 2)) * Fraction(cell_m)
            cy = Fraction(origin[1]) + (Fraction(2 * j + 1, 2)) * Fraction(cell_m)
            count = sum(
                (Fraction(x) - cx) ** 2 + (Fraction(y) - cy) ** 2 <= Fraction(radius_m) ** 2 for x, y in positions
            )
            result[i, j] = min(1.0, delta * count)
    return result


@given(
    st.lists(st.tuples(EIGHTHS, EIGHTHS), max_size=12),
    st.tuples(EIGHTHS, EIGHTHS),
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
    CELLS,
    RADII,
    st.sampled_from([0.1, 0.25, 1.0]),
)
def test_maps_are_the_plain_loops(positions, origin, shape, cell_m, radius_m, delta) -> None:
    array = np.array(positions, dtype=np.float64).reshape(-1, 2)
    result = rasterise(array, origin, shape, cell_m, radius_m, delta)
    assert result.dtype == np.float32
    assert np.array_equal(result, by_loop(positions, origin, shape, cell_m, radius_m, delta))


def test_a_disc_by_hand() -> None:
    result = rasterise(np.array([[1.5, 2.5]]), (0.0, 0.0), (4, 5), 1.0, 1.0, 0.25)
    expected = np.zeros((4, 5))
    expected[1, 1:4] = expected[0:3, 2] = 0.25  # a cross: the diagonal centres are sqrt(2) away
    assert np.array_equal(result, expected)


def test_stays_add_up_to_one_and_no_further() -> None:
    for count, value in ((1, 0.3), (2, 0.6), (3, 0.9), (4, 1.0), (50, 1.0)):
        result = rasterise(np.zeros((count, 2)), (-0.5, -0.5), (1, 1), 1.0, 0.2, 0.3)
        assert result[0, 0] == pytest.approx(value, abs=1e-7)
        assert result.max() <= 1.0


def test_positions_outside_add_the_part_of_their_disc_inside() -> None:
    near = rasterise(np.array([[-0.5, 0.5]]), (0.0, 0.0), (3, 3), 1.0, 1.0, 1.0)
    assert near.tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 0]]
    far = rasterise(np.array([[-9.0, 0.5], [1e6, -1e6]]), (0.0, 0.0), (3, 3), 1.0, 1.0, 1.0)
    assert not far.any()


@given(st.lists(st.tuples(EIGHTHS, EIGHTHS), max_size=8), EIGHTHS, EIGHTHS)
def test_moving_map_and_people_together_changes_nothing(positions, dx, dy) -> None:
    array = np.array(positions, dtype=np.float64).reshape(-1, 2)
    still = rasterise(array, (0.0, 0.0), (8, 7), 0.5, 0.75, 0.125)
    moved = rasterise(array + np.array([dx, dy]), (dx, dy), (8, 7), 0.5, 0.75, 0.125)
    assert np.array_equal(still, moved)
    swapped = rasterise(array[:, ::-1], (0.0, 0.0), (7, 8), 0.5, 0.75, 0.125)
    assert np.array_equal(still, swapped.T)


def test_nobody_leaves_no_trace() -> None:
    assert not rasterise(np.empty((0, 2)), (0.0, 0.0), (3, 2), 0.05, 0.3, 0.1).any()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_positions_that_are_no_numbers_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match=r"NaN or infinity.*drop missing poses"):
        rasterise(np.array([[0.0, 0.0], [0.0, value]]), (0.0, 0.0), (3, 3), 1.0, 1.0, 1.0)


# ---------------------------------------------------------------- Gaussian kernel, channels

POINTS = st.lists(st.tuples(st.floats(-1, 3), st.floats(-1, 3), st.integers(0, 2)), max_size=8)


def blurred_by_definition(points, origin, shape, cell_m, sigma_m, delta) -> np.ndarray:
    x, y = (origin[a] + (np.arange(shape[a]) + 0.5) * cell_m for a in range(2))
    sums = np.zeros((3, *shape))
    for px, py, channel in points:
        dx, dy = np.abs(x - px)[:, None], np.abs(y - py)[None, :]
        near = (dx <= BLUR_REACH * sigma_m) & (dy <= BLUR_REACH * sigma_m)
        sums[channel] += near * np.exp(-(dx**2 + dy**2) / (2 * sigma_m**2))
    return np.minimum(1.0, delta * sums)


@given(POINTS, st.sampled_from([0.09, 0.21]), st.sampled_from([0.07, 0.3]), st.sampled_from([0.1, 1.0]))
def test_blurred_maps_are_sums_of_gaussians(points, cell_m, sigma_m, delta) -> None:
    array = np.array([p[:2] for p in points]).reshape(-1, 2)
    channel = np.array([p[2] for p in points], dtype=np.int64)
    found = rasterise_blurred(array, channel, 3, (-0.31, 0.17), (9, 7), cell_m, sigma_m, delta)
    assert found.dtype == np.float32
    edge = delta * len(points) * np.exp(-(BLUR_REACH**2) / 2)  # a cell at the very end of a kernel may fall either way
    assert np.abs(found - blurred_by_definition(points, (-0.31, 0.17), (9, 7), cell_m, sigma_m, delta)).max() <= (
        1e-6 + edge
    )


def test_a_kernel_has_the_mass_of_a_gaussian() -> None:
    for at in ((0.0, 0.0), (0.013, -0.021)):
        found = rasterise_blurred(np.array([at]), np.zeros(1, int), 1, (-1.0, -1.0), (40, 40), 0.05, 0.1, 1.0)
        assert found.sum() == pytest.approx(2 * np.pi * (0.1 / 0.05) ** 2, rel=1e-3)
        centres = -1.0 + 0.05 * (np.arange(40) + 0.5)
        assert (found[0].sum(axis=1) @ centres) / found.sum() == pytest.approx(at[0], abs=1e-4)


def test_channels_do_not_mix_and_end_at_one() -> None:
    points = np.zeros((50, 2))
    found = rasterise_blurred(points, np.full(50, 1), 3, (-0.5, -0.5), (10, 10), 0.1, 0.1, 0.2)
    assert found[1].max() == 1.0
    assert not found[[0, 2]].any()


def test_a_kernel_outside_the_map_leaves_no_trace() -> None:
    for at in ((-1.0, 0.3), (0.3, -1.0), (9.0, 0.3), (0.3, 9.0), (1e6, -1e6)):
        assert not rasterise_blurred(np.array([at]), np.zeros(1, int), 1, (0.0, 0.0), (6, 6), 0.1, 0.1, 1.0).any()


@pytest.mark.parametrize("channel", [np.array([0]), np.array([0, 3]), np.array([-1, 0])])
def test_channels_that_are_none_are_refused(channel: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"channel has .*expected 2 within 0\.\.2"):
        rasterise_blurred(np.zeros((2, 2)), channel, 3, (0.0, 0.0), (3, 3), 1.0, 1.0, 1.0)
