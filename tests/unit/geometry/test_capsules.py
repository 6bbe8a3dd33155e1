"""Tapered capsules against spheres sampled densely along them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.geometry.capsules import point_gap, segment_hits

coordinate = st.floats(-1, 1).map(lambda v: round(v, 3))
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
radius = st.floats(0.02, 0.6).map(lambda v: round(v, 3))
SHARES = np.linspace(0, 1, 501)


def sampled_gap(points: np.ndarray, a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> float:
    """Least distance of points (N, 3) to the surface of any of the sampled spheres, negative inside."""
    centres = a + SHARES[:, None] * (b - a)
    radii = ra + SHARES * (rb - ra)
    return float((np.linalg.norm(points[:, None] - centres, axis=-1) - radii).min())


@settings(max_examples=200, deadline=None)
@given(point, point, point, radius, radius)
def test_point(p: np.ndarray, a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> None:
    expected = sampled_gap(p[None], a, b, ra, rb)
    if abs(expected) > 5e-3:
        assert (point_gap(*p, a, b, ra, rb) <= 0) == (expected <= 0)


@settings(max_examples=200, deadline=None)
@given(point, point, point, point, radius, radius)
def test_segment(p: np.ndarray, q: np.ndarray, a: np.ndarray, b: np.ndarray, ra: float, rb: float) -> None:
    expected = sampled_gap(p + np.linspace(0, 1, 201)[:, None] * (q - p), a, b, ra, rb)
    if abs(expected) > 2e-2:
        assert segment_hits(p, q, a, b, ra, rb) == (expected <= 0)


def test_one_end_within_the_other_is_a_sphere() -> None:
    a, b = np.zeros(3), np.array([0.1, 0.0, 0.0])
    assert point_gap(0.0, 0.49, 0.0, a, b, 0.5, 0.05) <= 0 < point_gap(0.0, 0.51, 0.0, a, b, 0.5, 0.05)
    assert segment_hits(np.array([-1.0, 0.49, 0.0]), np.array([1.0, 0.49, 0.0]), a, b, 0.5, 0.05)
    assert not segment_hits(np.array([-1.0, 0.51, 0.0]), np.array([1.0, 0.51, 0.0]), a, b, 0.5, 0.05)


def test_segment_along_the_axis() -> None:
    a, b = np.zeros(3), np.array([0.0, 0.0, 1.0])
    assert segment_hits(np.array([0.09, 0.0, -1.0]), np.array([0.09, 0.0, 2.0]), a, b, 0.1, 0.1)
    assert not segment_hits(np.array([0.11, 0.0, -1.0]), np.array([0.11, 0.0, 2.0]), a, b, 0.1, 0.1)
