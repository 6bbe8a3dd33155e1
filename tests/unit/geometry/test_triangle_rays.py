"""Rays against triangles tried one by one, and depth images against those of convex solids."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.convex import box
from hsbench.geometry.rays import cast, pack_solids
from hsbench.geometry.transforms import apply, planar, rigid
from hsbench.geometry.triangle_rays import depth_image, is_cut, nearest, triangle_tree
from tests.unit.geometry.meshes import joined, of, torus, turned

CAMERA = PinholeCamera(48, 36, 40.0, 42.0, 23.7, 18.2)


def one_by_one(vertices: np.ndarray, triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(N,) nearest hit in front of the origins, by solving for the corner weights (Moller & Trumbore)."""
    best = np.full(len(origins), np.inf)
    for a, b, c in vertices[triangles]:
        for k in range(len(origins)):
            matrix = np.column_stack([-directions[k], b - a, c - a])
            if abs(np.linalg.det(matrix)) < 1e-14:
                continue
            t, u, v = np.linalg.solve(matrix, origins[k] - a)
            if t > 0 and u >= 0 and v >= 0 and u + v <= 1:
                best[k] = min(best[k], t)
    return best


@pytest.mark.parametrize("seed", range(5))
def test_nearest_hits_are_those_of_every_triangle_tried(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = rng.uniform(-1, 1, (40, 3)), rng.integers(0, 40, (120, 3)).astype(np.int32)
    origins, directions = rng.uniform(-1, 1, (80, 3)), rng.normal(size=(80, 3))
    directions[:20, rng.integers(3)] = 0.0  # along the walls of the tree's boxes
    tree = triangle_tree(vertices, triangles)
    found, expected = nearest(tree, origins, directions, 0.0), one_by_one(vertices, triangles, origins, directions)
    assert np.isfinite(expected).sum() > 20
    assert 0.1 < np.isfinite(expected).mean() < 1
    assert np.array_equal(np.isfinite(found), np.isfinite(expected))
    hit = np.isfinite(expected)
    assert np.allclose(found[hit], expected[hit], rtol=1e-9, atol=0)


def test_hits_before_the_start_do_not_count_and_pieces_can_be_chosen() -> None:
    walls = [of(box((0.1, 1, 1), (x, 0, 0))) for x in (1.0, 2.0)]
    vertices, triangles = joined(*walls)
    tree = triangle_tree(vertices, triangles, np.repeat([4, 7], 12).astype(np.int32))
    origin, direction = np.zeros((1, 3)), np.array([[1.0, 0.01, 0.02]])
    starts = [nearest(tree, origin, direction, start)[0] for start in (0.0, 0.97, 1.07, 1.97, 2.07)]
    assert np.allclose(starts[:4], [0.95, 1.05, 1.95, 2.05], rtol=1e-12)
    assert starts[4] == np.inf
    assert nearest(tree, origin, direction, 0.0, np.array([7]))[0] == pytest.approx(1.95)
    assert nearest(tree, origin, direction, 0.0, np.array([5]))[0] == np.inf


@pytest.mark.parametrize("seed", range(4))
def test_no_ray_slips_through_the_edges_and_corners_of_a_closed_mesh(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = turned(torus(), Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3))
    tree = triangle_tree(vertices, triangles)
    # From the ring of middles of the tube, which is inside, to every corner and every middle of an edge, and beyond.
    inner = vertices.reshape(24, 12, 3).mean(axis=1)
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    targets = np.concatenate([vertices, vertices[edges].mean(axis=1)])
    for origin in inner[::6]:
        hits = nearest(tree, np.broadcast_to(origin, targets.shape), 1.7 * (targets - origin), 0.0)
        assert (hits <= 1 / 1.7 + 1e-12).all()


def test_the_numbering_of_triangles_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    vertices, triangles = torus()
    origins, directions = rng.uniform(-1, 1, (500, 3)), rng.normal(size=(500, 3))
    first = nearest(triangle_tree(vertices, triangles), origins, directions, 0.0)
    second = nearest(triangle_tree(vertices, triangles[rng.permutation(len(triangles))]), origins, directions, 0.0)
    assert np.array_equal(first, second)


@pytest.mark.parametrize("seed", range(5))
def test_the_depth_of_a_mesh_is_that_of_the_solid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = rigid(Rotation.random(random_state=seed).as_matrix(), (2.5, float(rng.uniform(-0.5, 0.5)), 1.0))
    solid = box(rng.uniform(0.2, 1.0, 3)).transformed(pose)
    camera = planar(0.1, -0.2, 0.1) @ world_T_camera(1.3, 0.2, 0.05)
    image = cast(CAMERA, camera, pack_solids([solid]), np.zeros(1, np.int32), 1)
    depth = depth_image(triangle_tree(solid.vertices, solid.triangles), CAMERA, camera)
    seen = image.owner == 0
    assert seen.sum() > 30
    assert np.array_equal(np.isfinite(depth), seen)
    assert np.allclose(depth[seen], image.depth_m[seen], rtol=1e-12)


def test_an_empty_tree_is_never_hit() -> None:
    tree = triangle_tree(np.empty((0, 3)), np.empty((0, 3), np.int32))
    assert nearest(tree, np.zeros((2, 3)), np.ones((2, 3)), 0.0).tolist() == [np.inf, np.inf]


def test_a_sheet_is_seen_from_both_sides() -> None:
    vertices = np.array([[1.0, -1, -1], [1, 1, -1], [1, 0, 2]])
    for order in ([0, 1, 2], [0, 2, 1]):
        tree = triangle_tree(vertices, np.array([order], np.int32))
        for origin, direction in (((0.0, 0, 0), (2.0, 0, 0)), ((3.0, 0, 0), (-4.0, 0, 0))):
            assert nearest(tree, np.array([origin]), np.array([direction]), 0.0)[0] == 0.5
    moved = triangle_tree(apply(planar(2, 0, 0.3), vertices), np.array([[0, 1, 2]], np.int32))
    assert np.isfinite(depth_image(moved, CAMERA, world_T_camera(0.0, 0.0))).any()


def test_a_segment_is_cut_where_its_ray_hits_between_the_ends() -> None:
    rng = np.random.default_rng(3)
    tree = triangle_tree(*torus())
    origins, ends = rng.uniform(-0.5, 0.5, (2, 400, 3))
    share = nearest(tree, origins, ends - origins, 0.0)
    cut = np.array([is_cut(tree, a, b) for a, b in zip(origins, ends, strict=True)])
    assert np.array_equal(cut, share < 1.0)
    assert 0.2 < cut.mean() < 0.9


def test_nothing_is_hit_beyond_the_end_that_is_asked_for() -> None:
    rng = np.random.default_rng(4)
    tree = triangle_tree(*torus())
    origins, directions = rng.uniform(-0.5, 0.5, (2, 300, 3))
    every = nearest(tree, origins, directions, 0.0)
    assert np.array_equal(nearest(tree, origins, directions, 0.0, end=0.7), np.where(every < 0.7, every, np.inf))
