"""Penetration depths against closed forms and against a linear program over the Minkowski difference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from hsbench.geometry.convex import ConvexSolid, box, cylinder, frustum, regular_outline, span
from hsbench.geometry.separation import (
    joined,
    pack_shapes,
    pack_triangles,
    parting_depth,
    penetrating_pairs,
    penetration_m,
)
from hsbench.geometry.transforms import rigid

SEEDS = st.integers(0, 2**32 - 1)


def reference_depth(a: ConvexSolid, b: ConvexSolid) -> float:
    """Distance from the origin to the boundary of the hull of all corner differences, 0 where it lies outside."""
    hull = ConvexHull((a.vertices[:, None] - b.vertices[None]).reshape(-1, 3))
    return max(0.0, float((-hull.equations[:, 3]).min()))


def drawn(rng: np.random.Generator) -> ConvexSolid:
    kind = rng.integers(3)
    size = rng.uniform(0.05, 1.0, 3)
    if kind == 0:
        solid = box(size)
    elif kind == 1:
        solid = cylinder(size[0], -size[1], size[1], sides=int(rng.integers(5, 13)), top_radius_m=size[2])
    else:
        solid = frustum(regular_outline(size[0], 5), regular_outline(size[1], 5), 0.0, size[2])
    return solid.transformed(rigid(Rotation.random(rng=rng).as_matrix(), tuple(rng.uniform(-0.6, 0.6, 3))))


@given(SEEDS)
@settings(max_examples=150, deadline=None)
def test_depth_is_the_distance_to_the_boundary_of_the_minkowski_difference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = drawn(rng), drawn(rng)
    assert penetration_m(a, b) == pytest.approx(reference_depth(a, b), abs=1e-9)
    assert penetration_m(a, b) == pytest.approx(penetration_m(b, a), abs=1e-12)


@pytest.mark.parametrize(
    ("b", "depth"),
    [
        (span((0.9, 0, 0), (2, 1, 1)), 0.1),
        (span((1.0, 0, 0), (2, 1, 1)), 0.0),
        (span((1.5, 0, 0), (2, 1, 1)), 0.0),
        (span((0.4, 0.4, 0.4), (0.6, 0.6, 0.6)), 0.6),
        (span((0, 0, 0), (1, 1, 1)), 1.0),
        (span((0.98, 0.97, 0.0), (2, 2, 1)), 0.02),
    ],
)
def test_boxes_by_hand(b: ConvexSolid, depth: float) -> None:
    assert penetration_m(span((0, 0, 0), (1, 1, 1)), b) == pytest.approx(depth, abs=1e-12)


def test_crossed_edges_part_along_their_common_perpendicular() -> None:
    roof = frustum(np.array([[-1, -0.5], [1, -0.5], [1, 0.5], [-1, 0.5]]),
                   np.array([[-1, -1e-9], [1, -1e-9], [1, 1e-9], [-1, 1e-9]]), 0.0, 0.5)  # fmt: skip
    turn = rigid(Rotation.from_euler("xz", [180, 90], degrees=True).as_matrix(), (0.0, 0.0, 0.95))
    assert penetration_m(roof, roof.transformed(turn)) == pytest.approx(0.05, abs=1e-6)


@given(SEEDS, st.floats(0.0, 0.3))
@settings(max_examples=40, deadline=None)
def test_pairs_are_those_that_brute_force_finds(seed: int, limit_m: float) -> None:
    rng = np.random.default_rng(seed)
    solids = [drawn(rng) for _ in range(10)]
    owner = rng.integers(0, 5, 10)
    pairs, depth = penetrating_pairs(solids, owner, limit_m)
    found = {(int(i), int(j)): d for (i, j), d in zip(pairs, depth, strict=True)}
    for i in range(10):
        for j in range(i + 1, 10):
            expected = reference_depth(solids[i], solids[j])
            if owner[i] == owner[j] or expected < limit_m - 1e-9:
                assert (i, j) not in found
            elif expected > limit_m + 1e-9:
                assert found[i, j] == pytest.approx(expected, abs=1e-9)


def test_nothing_to_compare() -> None:
    pairs, depth = penetrating_pairs([], np.empty(0, dtype=np.int64), 0.01)
    assert pairs.shape == (0, 2)
    assert depth.shape == (0,)


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_a_triangle_is_a_solid_without_thickness(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid, corners = drawn(rng), rng.uniform(-0.8, 0.8, (1, 3, 3))
    p = joined([pack_shapes([solid]), pack_triangles(corners)])
    hull = ConvexHull((solid.vertices[:, None] - corners[0][None]).reshape(-1, 3))
    expected = max(0.0, float((-hull.equations[:, 3]).min()))
    found = max(0.0, parting_depth(p.planes, p.corners, p.edges, p.start, 0, 1, 0.0))
    assert found == pytest.approx(expected, abs=1e-9)
    assert found == pytest.approx(max(0.0, parting_depth(p.planes, p.corners, p.edges, p.start, 1, 0, 0.0)), abs=1e-12)


def test_packs_are_joined_as_if_packed_at_once() -> None:
    solids = [box((1, 2, 3)), cylinder(0.3, 0.0, 1.0), span((0, 0, 0), (1, 1, 1))]
    once, twice = pack_shapes(solids), joined([pack_shapes(solids[:1]), pack_shapes([]), pack_shapes(solids[1:])])
    for name in ("planes", "corners", "edges", "start", "bounds"):
        assert np.array_equal(getattr(once, name), getattr(twice, name)), name
