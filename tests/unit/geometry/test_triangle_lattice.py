"""Points in and beside meshes, against convex solids, solid angles and polygon clipping."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hsbench.geometry.convex import ConvexSolid, box, cylinder, span
from hsbench.geometry.transforms import rigid
from hsbench.geometry.triangle_lattice import count_points
from hsbench.geometry.triangle_meshes import weld
from tests.unit.geometry.meshes import Mesh, flipped, joined, of, torus, turned, winding_numbers

VOXEL_M, SIDE = 0.05, 5
SHAPE = (12, 11, 9)


def lattice(origin: np.ndarray, shape: tuple[int, int, int] = SHAPE) -> np.ndarray:
    """(nx, 5, ny, 5, nz, 5, 3) the points, from the definition."""
    axes = [origin[a] + (np.arange(shape[a] * SIDE) + 0.5) * (VOXEL_M / SIDE) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return points.reshape(shape[0], SIDE, shape[1], SIDE, shape[2], SIDE, 3)


def voxel_counts(inside: np.ndarray) -> np.ndarray:
    return inside.sum(axis=(1, 3, 5))


def counted(mesh: Mesh, origin: np.ndarray, solid: bool = True, shape: tuple[int, int, int] = SHAPE) -> np.ndarray:
    vertices, triangles = weld(*mesh)
    yes, no = np.ones(len(triangles), bool), np.zeros(len(triangles), bool)
    return count_points(vertices, triangles, yes if solid else no, no if solid else yes, origin, shape, VOXEL_M, SIDE)


def contained(solid: ConvexSolid, origin: np.ndarray) -> np.ndarray:
    points = lattice(origin)
    return voxel_counts(solid.contains(points))


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.integers(-50, 600)] * 3), st.tuples(*[st.integers(10, 300)] * 3))
def test_an_upright_box_counts_as_the_solid(low: tuple, size: tuple) -> None:
    # Millimetres, and .3 mm off the lattice of points.
    corner = np.array(low) / 1000 + 0.0003
    solid = span(corner, corner + np.array(size) / 1000)
    assert np.array_equal(counted(of(solid), np.zeros(3)), contained(solid, np.zeros(3)))


@pytest.mark.parametrize("seed", range(30))
def test_a_turned_solid_counts_as_its_mesh(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid = box(rng.uniform(0.01, 0.4, 3)) if seed % 2 else cylinder(0.15, -0.1, 0.1, sides=9, top_radius_m=0.02)
    solid = solid.transformed(rigid(Rotation.random(random_state=seed).as_matrix(), tuple(rng.uniform(0, 0.5, 3))))
    origin = rng.uniform(-0.1, 0.1, 3)
    assert np.array_equal(counted(of(solid), origin), contained(solid, origin))


@pytest.mark.parametrize("seed", range(4))
def test_inside_is_where_the_solid_angles_add_up(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=seed).as_matrix()
    shape = (5, 5, 4)
    ring = turned(torus(0.09, 0.04, 14, 8), rotation, np.array([0.13, 0.12, 0.1]) + rng.normal(0, 0.01, 3))
    overlapping = turned(of(box((0.1, 0.07, 0.16))), rotation.T, np.array([0.16, 0.15, 0.1]))
    mesh = joined(ring, overlapping)
    points = lattice(np.zeros(3), shape)
    winding = winding_numbers(mesh, points.reshape(-1, 3)).reshape(points.shape[:-1])
    assert np.abs(winding - winding.round()).max() < 1e-6  # no point lies on the surface
    assert winding.max() > 1.5  # they do overlap
    assert np.array_equal(counted(mesh, np.zeros(3), shape=shape), voxel_counts(winding.round() > 0))


def test_a_cavity_that_faces_inward_is_free() -> None:
    shell = joined(of(span((0, 0, 0), (0.5, 0.5, 0.4))), flipped(of(span((0.1, 0.1, 0.1), (0.4, 0.4, 0.3)))))
    counts = counted(shell, np.zeros(3))
    assert (counts[:10, :10, :8] == 125).sum() == 10 * 10 * 8 - 6 * 6 * 4
    assert (counts[2:8, 2:8, 2:6] == 0).all()
    assert not counted(flipped(shell), np.zeros(3))[:2].any()  # inside out, the wall is not inside


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_triangles_and_vertices_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = turned(torus(0.15, 0.06), np.eye(3), np.full(3, 0.25))
    order = rng.permutation(len(vertices))
    shuffled = np.argsort(order)[triangles][rng.permutation(len(triangles))]
    rolled = np.stack([np.roll(t, rng.integers(3)) for t in shuffled]).astype(np.int32)
    assert np.array_equal(counted((vertices, triangles), np.zeros(3)), counted((vertices[order], rolled), np.zeros(3)))


def clipped(triangle: np.ndarray, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether anything is left of a triangle after cutting it at the six faces of a box."""
    polygon = list(triangle)
    for axis in range(3):
        for sign, limit in ((1, high[axis]), (-1, -low[axis])):
            kept = []
            for p, q in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
                inside_p, inside_q = sign * p[axis] <= limit, sign * q[axis] <= limit
                if inside_p:
                    kept.append(p)
                if inside_p != inside_q:
                    kept.append(p + (limit - sign * p[axis]) / (sign * (q[axis] - p[axis])) * (q - p))
            polygon = kept
    return len(polygon) > 0


@pytest.mark.parametrize("seed", range(12))
def test_beside_is_where_the_cube_about_a_point_is_met(seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangle = rng.uniform(0, 0.15, (3, 3))
    shape = (3, 3, 3)
    counts = counted((triangle, np.array([[0, 1, 2]], np.int32)), np.zeros(3), solid=False, shape=shape)
    points = lattice(np.zeros(3), shape)
    flat = points.reshape(-1, 3)
    met = [clipped(triangle, p - 0.005, p + 0.005) for p in flat]
    expected = voxel_counts(np.array(met).reshape(points.shape[:-1]))
    assert expected.sum() > 10
    assert np.array_equal(counts, expected)


@pytest.mark.parametrize("axis", range(3))
def test_a_sheet_on_a_border_belongs_to_the_lower_side(axis: int) -> None:
    corners = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2]])
    sheet = np.insert(corners, axis, 0.1, axis=1)
    mesh = sheet, np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    counts = np.moveaxis(counted(mesh, np.zeros(3), solid=False, shape=(4, 4, 4)), axis, 0)
    assert (counts[1] == 25).all()
    assert not counts[[0, 2, 3]].any()


def test_a_surface_has_no_gaps() -> None:
    """Free points on either side of a closed sheet never touch by faces."""
    vertices, triangles = turned(torus(0.17, 0.08), Rotation.random(random_state=5).as_matrix(), np.full(3, 0.27))
    vertices, triangles = weld(vertices, triangles)
    yes, no = np.ones(len(triangles), bool), np.zeros(len(triangles), bool)
    fine = VOXEL_M / SIDE
    origin = np.zeros(3)
    inside = count_points(vertices, triangles, yes, no, origin, (54, 54, 54), fine, 1) > 0
    beside = count_points(vertices, triangles, no, yes, origin, (54, 54, 54), fine, 1) > 0
    within, without = inside & ~beside, ~inside & ~beside
    for axis in range(3):
        a, b = (np.moveaxis(x, axis, 0) for x in (within, without))
        assert not (a[1:] & b[:-1]).any()
        assert not (a[:-1] & b[1:]).any()
    assert within.any()
