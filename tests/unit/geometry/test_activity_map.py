"""Activity maps against a plain loop in exact arithmetic: all numbers are eighths, so nothing is rounded."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.activity_map import rasterise

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
