"""Polygons against exact arithmetic and winding numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.polygons import contains, rectangle, signed_area

WHOLE = st.integers(-8, 8)
SEEDS = st.integers(0, 2**32 - 1)
L_SHAPE = np.array([[0, 0], [4, 0], [4, 1.5], [2, 1.5], [2, 3], [0, 3.0]])


def star(seed: int) -> np.ndarray:
    """A random simple counter-clockwise polygon: star shaped about a centre, often concave."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 12))
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.4, 0.4, n)) / n
    reach = rng.uniform(0.3, 3.0, n)[:, None]
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1) * reach + rng.normal(size=2)


def winding(polygon: np.ndarray, x: float, y: float) -> int:
    """How often the outline turns about the point, by summing the angles between its corners."""
    offset = polygon - [x, y]
    angle = np.arctan2(offset[:, 1], offset[:, 0])
    step = (np.roll(angle, -1) - angle + np.pi) % (2 * np.pi) - np.pi
    return round(step.sum() / (2 * np.pi))


@given(st.lists(st.tuples(WHOLE, WHOLE), min_size=3, max_size=9))
def test_area_is_the_exact_shoelace_sum(corners: list[tuple[int, int]]) -> None:
    total = Fraction(0)
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        total += Fraction(x0 * y1 - x1 * y0, 2)
    assert signed_area(np.array(corners)) == float(total)
    assert signed_area(np.array(corners)[::-1]) == -float(total)


def test_areas_by_hand() -> None:
    assert signed_area(L_SHAPE) == 4 * 1.5 + 2 * 1.5
    assert signed_area(np.array([[0, 0], [3, 0], [0, 4]])) == 6.0
    assert signed_area(np.array([[0, 0], [2, 2], [2, 0], [0, 2]])) == 0.0  # a bow tie


@given(SEEDS)
def test_contains_agrees_with_winding_numbers(seed: int) -> None:
    polygon = star(seed)
    points = np.random.default_rng(seed + 1).uniform(-4, 4, (40, 2))
    expected = [winding(polygon, x, y) != 0 for x, y in points]
    assert contains(polygon, points).tolist() == expected
    assert contains(polygon[::-1], points).tolist() == expected
    assert contains(np.roll(polygon, 2, axis=0), points).tolist() == expected


def on_a_slope(polygon: np.ndarray, x: float, y: float) -> bool:
    """Whether a point lies exactly on an edge that is not level (whole and quarter numbers: nothing is rounded)."""
    following = np.roll(polygon, -1, axis=0)
    cross = (following[:, 0] - polygon[:, 0]) * (y - polygon[:, 1]) - (following[:, 1] - polygon[:, 1]) * (
        x - polygon[:, 0]
    )
    return bool(((cross == 0) & (polygon[:, 1] != following[:, 1])).any())


@given(SEEDS, st.integers(0, 2))
def test_a_line_through_corners_counts_them_once(seed: int, corner: int) -> None:
    # Points level with a corner are the hard case of crossing counts: they count as points a hair above.
    polygon = np.round(star(seed) * 4)
    level = np.column_stack([np.linspace(-13, 13, 53) + 0.25, np.full(53, polygon[corner, 1])])
    level = np.array([p for p in level if not on_a_slope(polygon, *p)])
    expected = [winding(polygon, x, y + 1e-7) % 2 == 1 for x, y in level]
    assert contains(polygon, level).tolist() == expected


def test_contains_by_hand_and_in_any_shape() -> None:
    grid = np.stack(np.meshgrid([0.5, 2.5, 3.9, 4.1], [0.5, 1.4, 1.6, 2.9], indexing="ij"), axis=-1)
    expected = [[1, 1, 1, 1], [1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0]]
    assert contains(L_SHAPE, grid).astype(int).tolist() == expected
    assert not contains(L_SHAPE, np.empty((0, 2))).size
    assert contains(L_SHAPE, np.array([1.0, 1.0])).shape == ()


@given(st.floats(0.1, 3), st.floats(0.1, 3), st.floats(-7, 7), st.floats(-5, 5), st.floats(-5, 5))
def test_rectangles(a: float, b: float, yaw: float, x: float, y: float) -> None:
    corners = rectangle(np.array([x, y]), np.array([a, b]), yaw)
    assert np.isclose(signed_area(corners), 4 * a * b)
    turned = (corners @ [1, 1j] - (x + 1j * y)) * np.exp(-1j * yaw)  # back along its own axes
    expected = np.array([-a - 1j * b, a - 1j * b, a + 1j * b, -a + 1j * b])
    assert np.allclose(turned, expected, rtol=0, atol=1e-12)
