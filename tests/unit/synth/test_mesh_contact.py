"""Bodies against meshes: the distance to triangles, and that a chair is the same chair as solids and as meshes."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.mesh_contact import first_hit, gap_m, mesh_obstacle

SEAT_M, LIMIT_M = 0.45, 0.5
OUTLINE = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    found = trimesh.creation.box(bounds=[low, high])
    return np.array(found.vertices, dtype=np.float64), np.array(found.faces, dtype=np.int32)


def solid(name: str, role: str | None, low: tuple[float, float, float], high: tuple[float, float, float]) -> Part:
    return Part(name, (90, 90, 90), role, solid=span(low, high))


def one_mesh(parts: list[Part]) -> Part:
    """A chair in one piece, as importers give it."""
    first = np.cumsum([0, *(len(p.vertices) for p in parts)])
    triangles = np.concatenate([p.triangles + k for p, k in zip(parts, first, strict=False)]).astype(np.int32)
    return Part("chair", (90, 90, 90), "seat", mesh=(np.concatenate([p.vertices for p in parts]), triangles))


CHAIR = [
    solid("seat", "seat", (-0.25, -0.25, 0.40), (0.25, 0.25, SEAT_M)),
    solid("back", None, (-0.25, 0.20, SEAT_M), (0.25, 0.25, 0.95)),
    solid("foot", None, (-0.25, -0.25, 0.0), (0.25, 0.25, 0.15)),
]


def scene_of(parts: list[Part]) -> Scene:
    chair = SceneObject(1, "chair", planar(0.4, -0.2, 0.5), tuple(parts))
    return Scene("room", (Room("room", OUTLINE),), 2.6, (chair,))


@given(st.integers(0, 2**32 - 1))
def test_the_distance_is_that_of_trimesh(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = rng.uniform(-1, 1, (12, 3)), rng.permutation(12).reshape(4, 3).astype(np.int32)
    item = SceneObject(1, "object", planar(0.0, 0.0, 0.0), (Part("p", (1, 1, 1), mesh=(vertices, triangles)),))
    points = rng.uniform(-1.5, 1.5, (20, 3))
    nearest = [trimesh.triangles.closest_point(vertices[triangles], np.tile(p, (len(triangles), 1))) for p in points]
    away = np.array([np.linalg.norm(n - p, axis=1).min() for n, p in zip(nearest, points, strict=True)])
    assert np.allclose(gap_m(item, item.parts[0], points, LIMIT_M), np.minimum(away, LIMIT_M), atol=1e-9)


def test_a_mesh_stops_balls_outside_it_as_the_solids_do() -> None:
    """But for the corners, where the distance to a solid's planes is less than that to the solid."""
    solids, mesh = Obstacles.of(scene_of(CHAIR)), Obstacles.of(scene_of([one_mesh(CHAIR)]))
    rng = np.random.default_rng(3)
    points = rng.uniform((-0.4, -1.0, 0.0), (1.2, 0.6, 1.2), (4000, 3))
    radii = np.full(len(points), 0.06)
    outside = solids.depth(points, np.zeros(len(points))) <= 0
    by_solids, by_mesh = solids.depth(points, radii)[outside], mesh.depth(points, radii)[outside]
    assert (by_mesh <= by_solids + 1e-9).all()
    assert np.median(np.abs(by_mesh - by_solids)[by_mesh > 0]) < 1e-9


def test_only_the_seat_gives_way_under_who_uses_it() -> None:
    mesh = Obstacles.of(scene_of([one_mesh(CHAIR)]))
    chair = scene_of(CHAIR).objects[0]
    local = np.array([[0.0, 0.0, SEAT_M], [0.0, 0.18, 0.7], [0.0, 0.0, 0.17]])  # on the seat, at the back, on the foot
    points = local @ chair.scene_T_object[:3, :3].T + chair.scene_T_object[:3, 3]
    radii = np.full(3, 0.05)
    assert (mesh.depth(points, radii) > 0.02).all()
    assert (mesh.depth(points, radii, used_id=1) > 0.02).tolist() == [False, True, True]


def test_a_moved_mesh_is_where_it_was_moved_to() -> None:
    mesh, shift = Obstacles.of(scene_of([one_mesh(CHAIR)])), np.array([0.7, 0.3])
    points = np.random.default_rng(5).uniform((-0.4, -1.0, 0.0), (1.2, 0.6, 1.2), (500, 3))
    radii = np.full(len(points), 0.1)
    there = mesh.with_moved(1, shift).depth(points + np.append(shift, 0.0), radii)
    assert np.allclose(there, mesh.depth(points, radii), atol=1e-12)
    assert not mesh.without(1).depth(points, radii).any()


def test_lines_and_rays_meet_the_surface() -> None:
    scene = scene_of([one_mesh(CHAIR)])
    (chair,), obstacles = scene.objects, Obstacles.of(scene)
    above, below = np.array([0.4, -0.2, 1.5]), np.array([0.4, -0.2, 0.3])
    hit = first_hit(chair, chair.parts[0], above, np.array([0.0, 0.0, -1.0]))
    assert hit is not None
    assert hit[2] == pytest.approx(SEAT_M)
    assert obstacles.block(above, below)
    assert not obstacles.block(above, np.array([0.4, -0.2, 0.5]))


def test_what_is_stepped_on_is_no_obstacle() -> None:
    flat = Part("floor", (9, 9, 9), mesh=box((-2.0, -2.0, -0.1), (2.0, 2.0, 0.0)))
    scene = scene_of([flat])
    found = mesh_obstacle(scene, scene.objects[0])
    assert found is not None
    assert found.hard is None
    assert found.soft is None
