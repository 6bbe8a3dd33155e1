from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from hsbench.geometry.convex import box, cylinder, span
from hsbench.geometry.triangle_meshes import as_convex, double_areas, outward, pieces, weld
from tests.unit.geometry.meshes import Mesh, flipped, joined, of, torus, turned


def soup(mesh: Mesh) -> Mesh:
    """Every triangle with corners of its own, as files with normals have them."""
    vertices, triangles = mesh
    return vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)


def test_welding_a_soup_gives_the_mesh_again() -> None:
    vertices, triangles = weld(*soup(of(box((1, 2, 3)))))
    assert vertices.shape == (8, 3)
    assert triangles.shape == (12, 3)
    assert triangles.dtype == np.int32
    assert sorted(map(tuple, vertices)) == sorted(map(tuple, box((1, 2, 3)).vertices))


def test_welding_drops_slivers_and_what_nothing_uses() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [9, 9, 9]])
    vertices, triangles = weld(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    assert len(vertices) == 3
    assert len(triangles) == 1
    empty = weld(points, np.empty((0, 3), np.int32))
    assert empty[0].shape == (0, 3)
    assert empty[1].shape == (0, 3)
    assert len(pieces(*empty).closed) == 0


@pytest.mark.parametrize("mesh", [of(box((0.3, 0.2, 0.1))), of(cylinder(0.2, 0, 1)), torus()])
def test_one_closed_piece_has_the_volume_of_its_solid_angles(mesh: Mesh) -> None:
    vertices, triangles = weld(*soup(mesh))
    found = pieces(vertices, triangles)
    assert found.closed.tolist() == [True]
    a, b, c = (mesh[0][mesh[1][:, k]] for k in range(3))
    assert found.volume_m3[0] == pytest.approx(np.einsum("ti,ti->", a, np.cross(b, c)) / 6, rel=1e-12)
    assert found.area_m2[0] == pytest.approx(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, rel=1e-12)
    assert pieces(vertices, triangles[:, ::-1]).volume_m3[0] == pytest.approx(-found.volume_m3[0])


def test_a_missing_triangle_opens_a_piece() -> None:
    vertices, triangles = of(box((1, 1, 1)))
    assert pieces(vertices, triangles[:-1]).closed.tolist() == [False]
    assert pieces(vertices, triangles[:-1]).volume_m3.tolist() == [0.0]


def test_a_triangle_that_faces_the_wrong_way_opens_a_piece() -> None:
    vertices, triangles = of(box((1, 1, 1)))
    triangles[3] = triangles[3][::-1]
    assert pieces(vertices, triangles).closed.tolist() == [False]


def test_pieces_are_told_apart() -> None:
    lid = (np.array([[5.0, 0, 0], [6, 0, 0], [6, 1, 0]]), np.array([[0, 1, 2]], np.int32))
    vertices, triangles = weld(*joined(of(box((1, 1, 1))), flipped(of(box((1, 1, 1), (3, 0, 0)))), lid))
    found = pieces(vertices, triangles)
    assert sorted(zip(found.closed.tolist(), found.volume_m3.round(9).tolist(), strict=True)) == [
        (False, 0.0),
        (True, -1.0),
        (True, 1.0),
    ]
    assert np.bincount(found.of).tolist() in ([12, 12, 1], [12, 1, 12], [1, 12, 12])
    again = pieces(vertices, outward(triangles, found))
    assert sorted(again.volume_m3.round(9).tolist()) == [0.0, 1.0, 1.0]


def test_boxes_that_share_an_edge_are_closed() -> None:
    vertices, triangles = weld(*joined(of(span((0, 0, 0), (1, 1, 1))), of(span((1, 1, 0), (2, 2, 1)))))
    found = pieces(vertices, triangles)
    assert found.closed.all()
    assert found.volume_m3.sum() == pytest.approx(2.0)


def test_two_sheets_on_each_other_enclose_nothing() -> None:
    sheet = (np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    vertices, triangles = weld(*joined(sheet, flipped(sheet)))
    assert pieces(vertices, triangles).closed.tolist() == [False]


@pytest.mark.parametrize("seed", range(8))
def test_a_convex_mesh_becomes_its_solid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 0.3, (40, 3)).round(6)
    hull = ConvexHull(points)
    faces = hull.simplices.copy()
    inward = np.einsum("ti,ti->t", double_areas(points, faces), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    mesh = weld(points, faces.astype(np.int32))
    assert as_convex(*flipped(mesh)) is None
    for vertices, triangles in (mesh, flipped(mesh)):
        solid = as_convex(vertices, outward(triangles, pieces(vertices, triangles)))
        assert solid is not None
        assert solid.volume_m3 == pytest.approx(hull.volume, rel=1e-9)
        samples = rng.normal(0, 0.4, (500, 3))
        expected = (samples @ hull.equations[:, :3].T + hull.equations[:, 3] <= 0).all(axis=1)
        assert np.array_equal(solid.contains(samples), expected)


def test_what_is_not_convex_stays_a_mesh() -> None:
    l_shape = joined(of(span((0, 0, 0), (2, 1, 1))), of(span((0, 1, 0), (1, 2, 1))))
    for mesh in (torus(), l_shape, joined(of(box((1, 1, 1))), of(box((1, 1, 1), (3, 0, 0))))):
        assert as_convex(*weld(*mesh)) is None
    vertices, triangles = of(box((1, 1, 1)))
    assert as_convex(vertices, triangles[2:]) is None


def test_a_turned_and_rounded_box_is_still_convex() -> None:
    vertices, triangles = turned(of(box((2.0, 0.3, 0.9))), Rotation.random(random_state=3).as_matrix(), np.ones(3))
    assert as_convex(*weld(vertices.round(6), triangles)) is not None
