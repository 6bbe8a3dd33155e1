"""The algorithms that bake bodies: surgery on meshes, simplification, weights."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

pytest.importorskip("trimesh")

from hsbench.synth.people.bake import Mirroring
from hsbench.synth.people.baking.makehuman import shares, z_up
from hsbench.synth.people.baking.rig import OPPOSITE_BONES, _quantised, _turned
from hsbench.synth.people.baking.simplify import simplify
from hsbench.synth.people.baking.surgery import (
    Piece,
    borders,
    cut,
    filled,
    half_edges,
    hem,
    joined,
    membrane,
    normals,
    sew,
    smoothed,
)
from hsbench.synth.people.bones import BONES


def ball(count: int = 400, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points of a unit sphere, and the triangles of their hull, outward."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.sqrt(np.sum(points**2, axis=1, keepdims=True))
    triangles = ConvexHull(points).simplices
    a, b, c = (points[triangles[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", a, np.cross(b, c)) < 0
    triangles[inward] = triangles[inward, ::-1]
    return points, triangles.astype(np.int64)


def sheet(n: int) -> tuple[np.ndarray, np.ndarray]:
    """A flat square of n x n cells, 0..1, facing up."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a, b, c, d = i * (n + 1) + j, (i + 1) * (n + 1) + j, (i + 1) * (n + 1) + j + 1, i * (n + 1) + j + 1
    return points, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.sqrt(np.sum(np.cross(b - a, c - a) ** 2, axis=1)) / 2


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def is_closed(triangles: np.ndarray) -> bool:
    edges = half_edges(triangles)
    return len(edges) == 3 * len(triangles) and all((b, a) in edges for a, b in edges)


def nowhere(triangles: np.ndarray) -> np.ndarray:
    return np.zeros(int(np.max(triangles)) + 1, dtype=bool)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), level=st.floats(-0.9, 0.9))
def test_a_cut_keeps_the_surface_and_parts_it_at_the_curve(seed: int, level: float) -> None:
    points, triangles = ball(120, seed)
    piece = cut(Piece.of(len(points), triangles, 3), points[:, 2] - level)
    at = piece.at(points)
    assert is_closed(piece.triangles)
    assert (piece.region == 3).all()
    assert areas(at, piece.triangles).sum() == pytest.approx(areas(points, triangles).sum(), rel=1e-9)
    assert volume(at, piece.triangles) == pytest.approx(volume(points, triangles), rel=1e-9)
    np.testing.assert_allclose(at[len(points) :, 2], level, atol=1e-9)
    height = at[piece.triangles, 2] - level
    assert ((height > -1e-9).all(axis=1) | (height < 1e-9).all(axis=1)).all()


def parted(points: np.ndarray, triangles: np.ndarray, level: float) -> Piece:
    piece = cut(Piece.of(len(points), triangles, 0), points[:, 2] - level)
    return piece.painted(1, piece.centres(points)[:, 2] < level)


def test_a_hem_leaves_the_surface_closed_however_far_a_garment_stands_off() -> None:
    points, triangles = ball()
    before = parted(points, triangles, 0.2)
    piece = hem(before, (0,), (1,), 2)
    assert is_closed(piece.triangles)
    at = piece.at(points)
    assert areas(at, piece.triangles)[piece.region == 2].max() == pytest.approx(0.0, abs=1e-12)
    assert volume(at, piece.triangles) == pytest.approx(volume(points, triangles), rel=1e-9)
    outer = np.unique(piece.triangles[piece.region == 0])
    at[outer] *= 1.1
    step = np.unique(piece.triangles[piece.region == 2])
    assert np.isin(step, outer).sum() * 2 == len(step)
    above, below = (piece.triangles[np.isin(piece.region, regions)] for regions in ((0, 2), (1,)))
    assert volume(at, piece.triangles) == pytest.approx(volume(at, above) + volume(at, below))
    assert volume(at, piece.triangles) > 1.05 * volume(points, triangles)


def test_regions_that_do_not_meet_are_not_parted() -> None:
    points, triangles = ball(100)
    piece = parted(points, triangles, 0.0)
    with pytest.raises(ValueError, match="no line"):
        hem(piece, (0,), (7,), 2)


def test_sewing_two_caps_makes_the_ball_whole_again() -> None:
    points, triangles = ball()
    high = Piece.of(len(points), triangles, 0)
    high = cut(high, points[:, 2] - 0.3)
    high = high.keep(high.centres(points)[:, 2] > 0.3)
    other, facets = ball(300, seed=1)
    low = cut(Piece.of(len(other), facets, 1), 0.1 - other[:, 2])
    low = low.keep(low.centres(other)[:, 2] < 0.1)
    # Both in one base, so that rows of one piece leave out the vertices of the other.
    base = np.concatenate([points, other])
    both = joined([placed(high, base, 0), placed(low, base, len(points))])
    rims = borders(both.triangles, nowhere(both.triangles))
    assert len(rims) == 2
    whole = sew(both, both.at(base), rims[0], rims[1], 9)
    assert is_closed(whole.triangles)
    euler = whole.rows.shape[0] - 3 * len(whole.triangles) // 2 + len(whole.triangles)
    assert euler == 2
    assert volume(whole.at(base), whole.triangles) == pytest.approx(4 / 3 * np.pi, rel=0.04)
    assert (whole.region == 9).sum() == len(rims[0]) + len(rims[1]) - 2


def placed(piece: Piece, base: np.ndarray, first: int) -> Piece:
    from scipy import sparse

    count, own = piece.rows.shape
    before, after = sparse.csr_matrix((count, first)), sparse.csr_matrix((count, len(base) - first - own))
    return Piece(sparse.hstack([before, piece.rows, after], format="csr"), piece.triangles, piece.region)


def test_holes_are_found_and_filled() -> None:
    points, triangles = ball(200)
    piece = Piece.of(len(points), triangles, 0)
    far = np.argmax(points[:, 0])
    open_piece = piece.keep((piece.triangles != far).all(axis=1))
    rims = borders(open_piece.triangles, nowhere(open_piece.triangles))
    assert len(rims) == 1
    assert rims[0][0] == rims[0][-1]
    assert is_closed(filled(open_piece, rims[0], 4).triangles)


def test_borders_end_at_the_middle_plane() -> None:
    points, triangles = sheet(4)
    chains = borders(triangles, points[:, 0] == 0)
    assert len(chains) == 1
    assert len(chains[0]) == 4 + 4 + 4 + 1
    assert points[chains[0][0], 0] == points[chains[0][-1], 0] == 0


def test_a_pocket_becomes_a_flat_lid() -> None:
    points, triangles = sheet(12)
    inside = (np.abs(points[:, :2] - 0.5) < 0.3).all(axis=1)
    points[inside] += np.random.default_rng(0).normal(size=(inside.sum(), 3))
    piece = membrane(Piece.of(len(points), triangles, 0), inside)
    at = piece.at(points)
    np.testing.assert_allclose(at[:, 2], 0.0, atol=1e-7)
    up = normals(at, piece.triangles, np.zeros(len(at), dtype=bool))
    np.testing.assert_allclose(up[:, 2], 1.0, atol=1e-6)
    assert areas(at, piece.triangles).min() > 0
    assert areas(at, piece.triangles).sum() == pytest.approx(1.0, rel=1e-6)


def test_smoothing_leaves_alone_what_it_is_told_to() -> None:
    points, triangles = ball(200)
    held = points[:, 2] > 0
    piece = smoothed(Piece.of(len(points), triangles, 0), np.where(held, 0.0, 0.5), 5)
    at = piece.at(points)
    np.testing.assert_allclose(at[held], points[held], atol=1e-12)
    assert np.sum(at[~held] ** 2, axis=1).mean() < 0.98


def test_simplified_levels_are_nested_closed_and_near() -> None:
    points, triangles = ball(500)
    region = (points[triangles].mean(axis=1)[:, 0] > 0).astype(np.int64)
    levels, order = simplify(points, triangles, region, np.ones(len(points)), (200, 80))
    assert [level.count for level in levels] == [200, 80]
    assert len(order) == len(set(order.tolist())) == 200
    for level, least in zip(levels, (0.97, 0.90), strict=True):
        assert np.array_equal(np.unique(level.triangles), np.arange(level.count))
        assert is_closed(level.triangles)
        assert level.count - 3 * len(level.triangles) // 2 + len(level.triangles) == 2
        kept = points[order]
        assert least * volume(points, triangles) < volume(kept, level.triangles) < volume(points, triangles)
        before, after = areas(points, triangles), areas(kept, level.triangles)
        share = after[level.region == 1].sum() / after.sum()
        assert share == pytest.approx(before[region == 1].sum() / before.sum(), abs=0.04)


def test_what_is_flat_costs_nothing_and_lines_stay() -> None:
    points, triangles = sheet(16)
    region = (points[triangles].mean(axis=1)[:, 0] > 0.5).astype(np.int64)
    levels, order = simplify(points, triangles, region, np.ones(len(points)), (12,))
    kept, level = points[order], levels[0]
    assert areas(kept, level.triangles).sum() == pytest.approx(1.0)
    assert areas(kept, level.triangles)[level.region == 1].sum() == pytest.approx(0.5)
    corners = {(x, y) for x in (0.0, 0.5, 1.0) for y in (0.0, 1.0)}
    assert corners <= {(float(x), float(y)) for x, y, _ in kept}


def test_weight_keeps_vertices() -> None:
    points, triangles = ball(500)
    weight = np.where(points[:, 0] > 0, 50.0, 1.0)
    _, order = simplify(points, triangles, np.zeros(len(triangles), dtype=np.int64), weight, (100,))
    assert (points[order, 0] > 0).mean() > 0.65


def test_half_a_ball_mirrored_is_a_ball() -> None:
    points, triangles = ball(600)
    half = cut(Piece.of(len(points), triangles, 0), points[:, 0])
    half = half.keep(half.centres(points)[:, 0] > 0)
    at = half.at(points)
    middle = np.abs(at[:, 0]) < 1e-9
    at[middle, 0] = 0.0
    levels, order = simplify(at, half.triangles, half.region, np.ones(len(at)), (150, 60))
    whole = Mirroring.of(order, middle)
    places = whole.places(at)
    for level in levels:
        faces, region = whole.triangles(level)
        assert is_closed(faces)
        assert np.array_equal(np.unique(faces), np.arange(whole.count(level.count)))
        assert len(region) == len(faces)
        assert volume(places, faces) == pytest.approx(4 / 3 * np.pi, rel=0.15)
    assert len(places) == 2 * 150 - int(middle[order].sum())


@given(value=st.floats(0, 1), count=st.integers(2, 4))
def test_macro_parameters_are_shared_between_their_neighbours(value: float, count: int) -> None:
    names = tuple("abcd"[:count])
    amounts = shares(value, names)
    assert sum(amounts.values()) == pytest.approx(1.0)
    assert sum(names.index(n) * a for n, a in amounts.items()) == pytest.approx(value * (count - 1))
    assert len(amounts) <= 2


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), middle=st.booleans())
def test_stored_weights_are_whole_shares_of_the_greatest_bones(seed: int, middle: bool) -> None:
    rng = np.random.default_rng(seed)
    table = rng.random((30, len(BONES))) ** 8 + 1e-3 * (np.arange(len(BONES)) == 0)
    bones, weights = _quantised(table, np.full(30, middle))
    assert (weights.sum(axis=1, dtype=int) == 255).all()
    stored = np.zeros((30, len(BONES)))
    np.put_along_axis(stored, bones.astype(int), weights / 255.0, axis=1)
    if middle:
        assert np.array_equal(stored, stored[:, OPPOSITE_BONES])
    else:
        best = np.sort(table, axis=1)[:, -4:]
        exact = best[:, ::-1] / best.sum(axis=1, keepdims=True)
        np.testing.assert_allclose(weights / 255.0, exact, atol=1.01 / 255)


def test_turning_follows_the_right_hand() -> None:
    turned = _turned(np.array([[1.0, 0.0, 0.0]]), np.array([0.0, 0.0, 1.0]), np.pi / 2)
    np.testing.assert_allclose(turned, [[0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(z_up(np.array([[1.0, 2.0, 3.0]])), [[1.0, -3.0, 2.0]])
