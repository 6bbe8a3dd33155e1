"""Convex solids against closed forms, scipy's hulls and exact membership tests."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

from hsbench.errors import SchemaError
from hsbench.geometry.convex import ConvexSolid, box, cylinder, frustum, regular_outline, span
from hsbench.geometry.transforms import apply, rigid

SIDES = st.floats(0.01, 5.0)
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
L_SHAPE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


def hull_solid(points: np.ndarray) -> ConvexSolid:
    """The hull of points as scipy finds it, triangles turned outwards."""
    hull = ConvexHull(points)
    triangles = hull.simplices.copy()
    for row, (a, b, c) in enumerate(triangles):
        if np.cross(points[b] - points[a], points[c] - points[a]) @ hull.equations[row, :3] < 0:
            triangles[row] = a, c, b
    used, inverse = np.unique(triangles, return_inverse=True)
    return ConvexSolid(points[used], inverse.reshape(-1, 3).astype(np.int32))


def random_pose(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rigid(Rotation.random(random_state=seed).as_matrix(), tuple(rng.uniform(-3, 3, 3)))


SOLIDS = {
    "box": box((0.7, 1.3, 0.4), (1.0, -2.0, 0.5)),
    "thin board": box((2.0, 0.6, 0.01), (0.0, 0.0, 0.7)),
    "cylinder": cylinder(0.3, 0.1, 0.9, (0.4, 0.2)),
    "cone": cylinder(0.3, 0.0, 0.5, sides=7, top_radius_m=0.05),
    "flare": cylinder(0.1, 0.0, 0.5, sides=5, top_radius_m=0.4),
    "hull": hull_solid(np.random.default_rng(3).normal(size=(25, 3))),
}
SOLIDS |= {f"turned {name}": solid.transformed(random_pose(k)) for k, (name, solid) in enumerate(SOLIDS.items())}


# ---------------------------------------------------------------- closed forms


@given(st.tuples(SIDES, SIDES, SIDES), st.tuples(*[st.floats(-5, 5)] * 3))
def test_boxes(size: tuple[float, ...], centre: tuple[float, ...]) -> None:
    solid = box(size, centre)
    solid.check()
    assert solid.volume_m3 == pytest.approx(np.prod(size), rel=1e-9)
    assert np.allclose(solid.bounds, [np.subtract(centre, np.divide(size, 2)), np.add(centre, np.divide(size, 2))])
    assert len(solid.vertices) == 8
    assert len(solid.triangles) == 12


def test_a_box_by_hand() -> None:
    solid = box((2.0, 4.0, 6.0), (10.0, 20.0, 30.0))
    corners = {(x, y, z) for x in (9.0, 11.0) for y in (18.0, 22.0) for z in (27.0, 33.0)}
    assert {tuple(v) for v in solid.vertices.tolist()} == corners
    planes = {tuple(p + 0.0) for p in solid.planes}
    assert planes == {
        (1, 0, 0, 11), (-1, 0, 0, -9), (0, 1, 0, 22), (0, -1, 0, -18), (0, 0, 1, 33), (0, 0, -1, -27),
    }  # fmt: skip
    same = span((9.0, 18.0, 27.0), (11.0, 22.0, 33.0))
    assert np.array_equal(same.vertices, solid.vertices)
    assert np.array_equal(same.triangles, solid.triangles)


@given(st.integers(3, 24), SIDES, SIDES, SIDES)
def test_cylinders_and_cones(sides: int, radius: float, top: float, height: float) -> None:
    solid = cylinder(radius, 0.2, 0.2 + height, (1.0, 2.0), sides, top)
    solid.check()
    unit = sides / 2 * np.sin(2 * np.pi / sides)  # area of the regular polygon of radius 1
    volume = unit * height / 3 * (radius**2 + radius * top + top**2)  # frustum
    assert solid.volume_m3 == pytest.approx(volume, rel=1e-7)
    assert solid.bounds[:, 2].tolist() == [0.2, 0.2 + height]


def test_frusta_of_other_shapes() -> None:
    # A roof: a 2 x 2 square that shrinks to 1 x 1 over height 3 (prismatoid, shared side directions).
    roof = frustum(SQUARE, SQUARE / 2, 0.0, 3.0)
    roof.check()
    assert roof.volume_m3 == pytest.approx(3 / 3 * (4 + 2 + 1))
    sheared = frustum(SQUARE, SQUARE + 0.5, 0.0, 3.0)
    sheared.check()
    assert sheared.volume_m3 == pytest.approx(12.0)
    assert len(sheared.planes) == 6


def test_regular_outlines() -> None:
    outline = regular_outline(2.0, 8, (1.0, -1.0))
    assert np.allclose(np.hypot(*(outline - [1.0, -1.0]).T), 2.0, rtol=0, atol=1e-11)
    angle = np.degrees(np.unwrap(np.arctan2(*(outline - [1.0, -1.0]).T[::-1])))
    assert np.allclose(angle, 22.5 + 45 * np.arange(8), rtol=0, atol=1e-9)


# ---------------------------------------------------------------- planes and membership


@pytest.mark.parametrize("name", SOLIDS)
def test_planes_are_those_of_the_hull(name: str) -> None:
    solid = SOLIDS[name]
    hull = ConvexHull(solid.vertices)
    expected = {tuple(e) for e in (hull.equations * [1, 1, 1, -1]).round(6) + 0.0}
    assert {tuple(p) for p in solid.planes.round(6) + 0.0} == expected
    assert len(solid.planes) == len(expected)
    assert np.allclose(np.linalg.norm(solid.planes[:, :3], axis=1), 1.0, rtol=0, atol=1e-14)
    assert solid.volume_m3 == pytest.approx(hull.volume, rel=1e-9)


@pytest.mark.parametrize("name", SOLIDS)
def test_contains_agrees_with_a_triangulation(name: str) -> None:
    solid = SOLIDS[name]
    rng = np.random.default_rng(11)
    low, high = solid.bounds
    points = rng.uniform(low - 0.1, high + 0.1, (4000, 3))
    inside = Delaunay(solid.vertices).find_simplex(points) >= 0
    assert np.array_equal(solid.contains(points), inside)
    assert 0 < inside.sum() < len(points)
    weights = rng.dirichlet(np.ones(len(solid.vertices)), 500)
    assert solid.contains(weights @ solid.vertices, margin_m=-1e-12).all()


def test_a_margin_shrinks_and_a_negative_one_grows() -> None:
    solid = box((2.0, 2.0, 2.0))
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.5, 1.5, (10, 50, 3))
    reach = np.abs(points).max(axis=-1)
    for margin in (0.3, 0.0, -0.25):
        assert np.array_equal(solid.contains(points, margin), reach <= 1.0 - margin)
    assert solid.contains(np.array([1.0, 1.0, 1.0]))  # the border belongs to the solid


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_turning_solid_and_points_together_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid, pose = hull_solid(rng.normal(size=(8, 3))), random_pose(seed)
    moved = solid.transformed(pose)
    moved.check()
    points = rng.normal(size=(200, 3))
    clear = np.abs(points @ solid.planes[:, :3].T - solid.planes[:, 3]).min(axis=1) > 1e-9
    assert np.array_equal(moved.contains(apply(pose, points))[clear], solid.contains(points)[clear])
    assert moved.volume_m3 == pytest.approx(solid.volume_m3, rel=1e-9)


# ---------------------------------------------------------------- what is refused


def flipped(solid: ConvexSolid, rows: slice) -> ConvexSolid:
    triangles = solid.triangles.copy()
    triangles[rows] = triangles[rows][:, ::-1]
    return ConvexSolid(solid.vertices, triangles)


def test_check_passes_what_is_closed_and_convex() -> None:
    for solid in SOLIDS.values():
        solid.check()


def test_check_finds_open_flipped_and_hollow_meshes() -> None:
    for solid in SOLIDS.values():
        for row in range(0, len(solid.triangles), 5):
            with pytest.raises(SchemaError, match="not closed"):
                ConvexSolid(solid.vertices, np.delete(solid.triangles, row, axis=0)).check()
            with pytest.raises(SchemaError, match=r"not closed.*flipped"):
                flipped(solid, slice(row, row + 1)).check()
        with pytest.raises(SchemaError, match="inside out"):
            flipped(solid, slice(None)).check()


def test_check_finds_dents_and_stray_vertices() -> None:
    dented = frustum(L_SHAPE, L_SHAPE, 0.0, 1.0)
    with pytest.raises(SchemaError, match="not convex: a vertex lies 1 m outside"):
        dented.check()
    cube = box((1.0, 1.0, 1.0))
    with pytest.raises(SchemaError, match=r"not convex: a vertex lies 0\.5 m outside"):
        ConvexSolid(np.vstack([cube.vertices, [[1.0, 0.0, 0.0]]]), cube.triangles).check()
    two = np.vstack([cube.vertices, cube.vertices + np.array([3.0, 0.0, 0.0])])
    with pytest.raises(SchemaError, match="not convex"):
        ConvexSolid(two, np.vstack([cube.triangles, cube.triangles + 8])).check()
    ConvexSolid(cube.vertices + np.array([[5e-7, 0, 0]] + [[0, 0, 0]] * 7), cube.triangles).check()


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((3, 3)), np.zeros((4, 3)), r"vertices of shape \(3, 3\); expected \(V >= 4, 3\)"),
        (np.zeros((4, 2)), np.zeros((4, 3)), r"vertices of shape \(4, 2\)"),
        (np.zeros((4, 3)), np.zeros((3, 3)), r"triangles of shape \(3, 3\); expected \(T >= 4, 3\)"),
        (np.zeros((4, 3)), np.zeros((4, 4)), r"triangles of shape \(4, 4\)"),
        (np.full((4, 3), np.nan), np.zeros((4, 3)), "vertex that is not finite"),
        (np.zeros((4, 3)), np.full((4, 3), 4), r"indices outside 0\.\.3"),
        (np.zeros((4, 3)), np.full((4, 3), -1), r"indices outside 0\.\.3"),
    ],
)
def test_impossible_meshes_cannot_be_built(vertices: np.ndarray, triangles: np.ndarray, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        ConvexSolid(vertices, triangles)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((SQUARE, SQUARE[:3], 0.0, 1.0), r"outlines of shape \(4, 2\) and \(3, 2\)"),
        ((SQUARE[:2], SQUARE[:2], 0.0, 1.0), r"expected equal \(n >= 3, 2\)"),
        ((np.eye(3), np.eye(3), 0.0, 1.0), r"outlines of shape \(3, 3\)"),
        ((SQUARE, SQUARE, 1.0, 1.0), "top above the bottom"),
        ((SQUARE, SQUARE, 2.0, 1.0), r"from z = 2\.0 to 1\.0 m"),
    ],
)
def test_impossible_frusta(arguments: tuple, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        frustum(*arguments)


def test_solids_cannot_be_changed() -> None:
    solid = box((1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="read-only"):
        solid.vertices[0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        solid.triangles[0] = 0
