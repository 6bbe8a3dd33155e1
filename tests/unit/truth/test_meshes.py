"""Objects given as meshes: the truth of what is closed is that of convex solids, what is open is its surface."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.convex import ConvexSolid, box, cylinder, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.rays import pack_solids
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.meshes import count_mesh_subsamples, mesh_body
from hsbench.truth.occupancy import SUBSAMPLES, count_subsamples, solid_occupancy
from hsbench.truth.sight import ray_image
from hsbench.truth.walkable import walk_map
from tests.unit.geometry.meshes import Mesh, flipped, joined, of, torus

ROOM = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
GREY = (120, 120, 120)


def scene_of(*objects: SceneObject) -> Scene:
    return Scene("s", (Room("living", ROOM),), 2.5, objects)


def solid_thing(object_id: int, kind: str, pose: np.ndarray, *solids: ConvexSolid) -> SceneObject:
    return SceneObject(object_id, kind, pose, tuple(Part(f"p{k}", GREY, solid=s) for k, s in enumerate(solids)))


def mesh_thing(object_id: int, kind: str, pose: np.ndarray, *meshes: Mesh) -> SceneObject:
    parts = tuple(Part(f"p{k}", GREY, mesh=(v, t.astype(np.int32))) for k, (v, t) in enumerate(meshes))
    return SceneObject(object_id, kind, pose, parts)


def as_meshes(scene: Scene, soup: bool = False) -> Scene:
    """The same scene, every part a mesh; ``soup``: every triangle with corners of its own."""

    def mesh(part: Part) -> Part:
        vertices, triangles = part.vertices, part.triangles
        if soup:
            vertices = vertices[triangles].reshape(-1, 3)
            triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
        return dataclasses.replace(part, solid=None, mesh=(np.array(vertices), np.array(triangles)))

    objects = tuple(dataclasses.replace(o, parts=tuple(map(mesh, o.parts))) for o in scene.objects)
    return dataclasses.replace(scene, objects=objects)


def furnished(seed: int) -> Scene:
    """A table, a shelf on the wall, a pillar from floor to ceiling, a rug, a tilted lamp: some overlap."""
    rng = np.random.default_rng(seed)

    def pose(z: float = 0.0) -> np.ndarray:
        x, y = rng.uniform([0.8, 0.8], [3.2, 2.2]).round(2)
        return planar(float(x), float(y), float(rng.integers(-3, 4)) / 2, z)

    legs = [span((x - 0.02, y - 0.02, 0), (x + 0.02, y + 0.02, 0.7)) for x in (-0.5, 0.5) for y in (-0.3, 0.3)]
    return scene_of(
        solid_thing(1, "floor", np.eye(4), span((0, 0, -0.1), (4, 3, 0))),
        solid_thing(2, "wall", np.eye(4), span((-0.1, 3, 0), (4.1, 3.1, 2.5)), span((4, 0, 0), (4.1, 3, 2.5))),
        solid_thing(5, "dining_table", pose(), span((-0.6, -0.4, 0.7), (0.6, 0.4, 0.73)), *legs),
        solid_thing(6, "wall_cabinet", pose(1.5), span((-0.4, -0.15, 0), (0.4, 0.15, 0.6))),
        solid_thing(7, "object", pose(), span((-0.3, -0.3, 0), (0.3, 0.3, 2.5))),
        solid_thing(8, "rug", pose(), span((-0.9, -0.6, 0), (0.9, 0.6, 0.015))),
        solid_thing(9, "floor_lamp", pose(), cylinder(0.14, 0, 0.03), cylinder(0.2, 1.3, 1.5, top_radius_m=0.1)),
    )


GRID = VoxelGrid((-0.2, -0.1, 0.0), (88, 66, 50))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("soup", [False, True])
def test_occupancy_of_meshes_is_that_of_the_solids(seed: int, soup: bool) -> None:
    scene = furnished(seed)
    for ours, theirs in zip(solid_occupancy(as_meshes(scene, soup), GRID), solid_occupancy(scene, GRID), strict=True):
        assert np.array_equal(ours, theirs)
        assert len(np.unique(theirs)) > 5


STEP = st.integers(-12, 90)


@settings(max_examples=80, deadline=None)
@given(st.tuples(STEP, STEP, STEP), st.tuples(*[st.integers(2, 50)] * 3))
def test_faces_on_the_points_themselves_count_alike(low: tuple, size: tuple) -> None:
    corner = np.array(low) * 0.005
    solid = span(corner, corner + np.array(size) * 0.005)
    grid = VoxelGrid((0.0, 0.0, 0.0), (9, 8, 7))
    theirs = count_subsamples(pack_solids([solid]), grid)
    ours = count_mesh_subsamples(mesh_body(mesh_thing(3, "sofa", np.eye(4), of(solid))), grid, SUBSAMPLES)
    assert (ours is None) == (theirs is None)
    if ours is not None and theirs is not None:
        assert np.array_equal(ours[0], theirs[0])
        assert np.array_equal(ours[1], theirs[1])


def test_a_part_of_the_grid_is_the_same_part_of_the_truth() -> None:
    scene = scene_of(mesh_thing(4, "sofa", planar(1.01, 1.02, 0.4, 0.3), torus()))
    whole = solid_occupancy(scene, VoxelGrid((0.0, 0.0, 0.0), (40, 40, 20)))[1]
    part = solid_occupancy(scene, VoxelGrid((0.5, 0.75, 0.1), (13, 9, 6)))[1]
    assert np.array_equal(whole[10:23, 15:24, 2:8], part)
    assert part.any()


@pytest.mark.parametrize("seed", range(3))
def test_what_a_camera_sees_of_meshes_is_what_it_sees_of_solids(seed: int) -> None:
    scene = furnished(seed)
    camera = PinholeCamera(64, 48, 45.0, 45.0, 32.0, 24.0)
    pose = planar(0.2, 0.2, 0.7) @ world_T_camera(1.6, 0.35)
    pairs = enumerate(zip(as_meshes(scene).objects, scene.objects, strict=True))
    mixed = dataclasses.replace(scene, objects=tuple(mesh if k % 2 else solid for k, (mesh, solid) in pairs))
    expected = ray_image(scene, camera, pose)
    for other in (as_meshes(scene), mixed):
        found = ray_image(other, camera, pose)
        assert np.array_equal(found.owner, expected.owner)
        assert np.array_equal(found.amodal_px, expected.amodal_px)
        assert np.allclose(found.depth_m, expected.depth_m, rtol=1e-12)
    assert len(np.unique(expected.owner)) >= 4


@pytest.mark.parametrize("seed", range(4))
def test_one_walks_around_meshes_as_around_solids(seed: int) -> None:
    scene = furnished(seed)
    expected = walk_map(scene)
    found = walk_map(as_meshes(scene))
    assert np.array_equal(found.free, expected.free)
    assert 0 < expected.free.mean() < 0.9
    assert np.array_equal(walk_map(as_meshes(scene, soup=True)).free, expected.free)


def test_nobody_stands_inside_a_closed_mesh_or_on_its_hidden_floor() -> None:
    pillar = scene_of(mesh_thing(3, "object", planar(2, 1.5, 0.3), of(span((-1, -1, -0.1), (1, 1, 2.6)))))
    walk = walk_map(pillar)
    middle = walk.index(np.array([[2.0, 1.5]]))[0][0]
    assert not walk.free[tuple(middle)]
    assert walk.free.any()


def test_an_inside_out_mesh_is_turned() -> None:
    thing = span((0.5, 0.5, 0), (1.1, 1.3, 0.8))
    right, wrong = (scene_of(mesh_thing(3, "sofa", np.eye(4), m)) for m in (of(thing), flipped(of(thing))))
    assert np.array_equal(solid_occupancy(right, GRID)[1], solid_occupancy(wrong, GRID)[1])


def test_a_cavity_of_furniture_is_solid_that_of_a_wall_is_a_room() -> None:
    shell = joined(of(span((0.5, 0.5, 0.5), (2.5, 2.5, 1.5))), flipped(of(span((0.6, 0.6, 0.6), (2.4, 2.4, 1.4)))))
    cupboard = solid_occupancy(scene_of(mesh_thing(3, "wardrobe", np.eye(4), shell)), GRID)[1]
    whole = solid_occupancy(
        scene_of(solid_thing(3, "wardrobe", np.eye(4), span((0.5, 0.5, 0.5), (2.5, 2.5, 1.5)))), GRID
    )[1]
    assert np.array_equal(cupboard, whole)
    wall = solid_occupancy(scene_of(mesh_thing(3, "wall", np.eye(4), shell)), GRID)[1]
    centres = GRID.centres()
    within = ((centres > 0.65) & (centres < [2.35, 2.35, 1.35])).all(axis=-1)
    assert not wall[within].any()
    assert 0 < wall.sum() < whole.sum()


def test_the_faces_of_a_room_seen_from_within_are_a_surface() -> None:
    faces = flipped(of(span((0.5, 0.5, 0.5), (2.5, 2.5, 1.5))))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # closed: nothing to warn of
        wall = solid_occupancy(scene_of(mesh_thing(3, "wall", np.eye(4), faces)), GRID)[1]
    centres = GRID.centres()
    assert not wall[((centres > 0.55) & (centres < [2.45, 2.45, 1.45])).all(axis=-1)].any()
    assert wall.any(axis=2).sum() > 40 * 40


def test_an_open_mesh_is_its_surface_and_is_named() -> None:
    vertices, triangles = of(span((0.5, 0.5, 0.0), (1.5, 1.5, 1.0)))
    top = (vertices[triangles][:, :, 2] > 0.9).all(axis=1)
    scene = scene_of(mesh_thing(3, "sofa", np.eye(4), (vertices, triangles[~top])))
    with pytest.warns(UserWarning, match=r"open pieces .* only the surface is solid: 3 sofa 100%"):
        instance = solid_occupancy(scene, GRID)[1]
    centres = GRID.centres()
    within = ((centres > [0.6, 0.6, 0.1]) & (centres < [1.4, 1.4, 0.9])).all(axis=-1)
    assert not instance[within].any()
    sides = (instance == 3).any(axis=2)
    i, j = GRID.index(np.array([[0.5, 1.0, 0.5]]))[0][0, :2]
    assert sides[i - 1 : i + 1, j].any()


@pytest.mark.parametrize("thickness", [0.002, 0.004, 0.009])
@pytest.mark.parametrize("start", [0.501, 0.5, 0.5058])
def test_a_closed_pane_thinner_than_the_points_are_apart_is_not_lost(thickness: float, start: float) -> None:
    for axis in range(3):
        low, high = np.full(3, 0.3), np.full(3, 1.3)
        low[axis], high[axis] = start, start + thickness
        instance = solid_occupancy(scene_of(mesh_thing(3, "mirror", np.eye(4), of(span(low, high)))), GRID)[1]
        held = (instance == 3).any(axis=axis)
        assert held.sum() >= 20 * 20
        assert (instance == 3).sum() <= 2 * held.sum()


def test_a_thin_walled_cup_is_whole() -> None:
    outer, inner = cylinder(0.2, 0.0, 0.4, sides=24), cylinder(0.196, 0.0, 0.4, sides=24)
    ring = [*range(24)]
    walls = [f for f in of(outer)[1].tolist() if not (set(f) <= set(range(24, 48)))]
    inside = [[a + 48, c + 48, b + 48] for a, b, c in of(inner)[1].tolist() if not ({a, b, c} <= set(range(24, 48)))]
    rim = []
    for k in ring:
        n = (k + 1) % 24
        rim += [[24 + k, 24 + n, 72 + n], [24 + k, 72 + n, 72 + k]]
    inner_points = np.array(inner.vertices)
    inner_points[:24, 2] += 0.004
    cup = np.concatenate([outer.vertices, inner_points]), np.array([*walls, *inside, *rim], np.int32)
    item = mesh_thing(3, "vase", planar(1.0, 1.0, 0.2), cup)
    assert mesh_body(item).open_share == 0
    instance = solid_occupancy(scene_of(item), GRID)[1]
    around = (instance[:, :, 2:7] == 3).any(axis=2)
    assert (instance[:, :, 3] == 3).sum() > 20  # the whole wall, not the odd point of it
    assert not instance[24, 22, 5]  # and nothing within
    assert around.any()


def test_an_object_of_solids_and_meshes_counts_once() -> None:
    left, right = span((0.5, 0.5, 0), (1.0, 1.0, 0.5)), span((0.9, 0.5, 0), (1.5, 1.0, 0.5))
    both = solid_thing(3, "sofa", np.eye(4), left, right)
    parts = (both.parts[0], mesh_thing(3, "sofa", np.eye(4), of(right)).parts[0])
    mixed = SceneObject(3, "sofa", np.eye(4), parts)
    theirs = count_subsamples(pack_solids([left, right]), GRID)
    ours = count_mesh_subsamples(mesh_body(mixed), GRID, SUBSAMPLES)
    assert ours is not None
    assert theirs is not None
    assert np.array_equal(ours[1], theirs[1])
    camera, pose = PinholeCamera(32, 24, 20.0, 20.0, 16.0, 12.0), planar(0, 0, 0.6) @ world_T_camera(1.0, 0.3)
    assert ray_image(scene_of(mixed), camera, pose).amodal_px == ray_image(scene_of(both), camera, pose).amodal_px


def test_boxes_of_any_kind_stand_on_the_grid_they_miss() -> None:
    far = mesh_thing(3, "sofa", planar(50, 50, 0), of(box((1, 1, 1))))
    assert count_mesh_subsamples(mesh_body(far), GRID, SUBSAMPLES) is None
    assert not solid_occupancy(scene_of(far), GRID)[1].any()
