"""Solid voxels against a point-in-solid oracle: every sub-sample of every voxel tested against scipy's hulls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from hsbench.geometry.convex import ConvexSolid, box, cylinder, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.rays import pack_solids
from hsbench.geometry.transforms import apply, planar, rigid
from hsbench.schema.categories import category
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.truth.occupancy import count_subsamples, solid_occupancy

ROOM = np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]])
KINDS = ("sofa", "dining_table", "wardrobe", "plant", "rug")


def scene_of(*objects: SceneObject) -> Scene:
    return Scene("s", (Room("living", ROOM),), 3.0, objects)


def thing(object_id: int, *solids: ConvexSolid, kind: str = "sofa", pose: np.ndarray | None = None) -> SceneObject:
    parts = tuple(Part(f"p{k}", (1, 2, 3), solid=s) for k, s in enumerate(solids))
    return SceneObject(object_id, kind, np.eye(4) if pose is None else pose, parts)


def random_scene(seed: int) -> Scene:
    """Objects of one to three turned convex parts that overlap each other and stick out of the grid."""
    rng = np.random.default_rng(seed)
    objects = []
    for object_id in range(3, 9):
        upright = box(rng.uniform(0.02, 0.3, 3), rng.normal(0, 0.1, 3))  # with the object's yaw: faces exactly vertical
        solids = [upright] if object_id % 2 else []
        for k in range(int(rng.integers(1, 4))):
            turn = rigid(
                Rotation.random(random_state=int(rng.integers(2**31))).as_matrix(), tuple(rng.normal(0, 0.1, 3))
            )
            solid = (
                box(rng.uniform(0.011, 0.4, 3)) if k % 2 == 0 else cylinder(0.15, -0.1, 0.1, sides=9, top_radius_m=0.02)
            )
            solids.append(solid.transformed(turn))
        pose = planar(*rng.uniform(0, 0.6, 2), rng.uniform(0, 7), rng.uniform(0, 0.4))
        objects.append(thing(object_id, *solids, kind=KINDS[object_id % 5], pose=pose))
    return scene_of(*objects)


def subsamples(grid: VoxelGrid) -> np.ndarray:
    """(nx, ny, nz, 125, 3) points at (i + 1/2) / 5 of a voxel's side, from the definition."""
    offsets = np.stack(np.meshgrid(*[(np.arange(5) + 0.5) / 5] * 3, indexing="ij"), axis=-1).reshape(125, 3)
    corner = np.moveaxis(np.indices(grid.shape), 0, -1)[..., None, :]
    return np.asarray(grid.origin_m) + (corner + offsets) * grid.voxel_m


def oracle(scene: Scene, grid: VoxelGrid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(semantic, instance, counts per object): points in the hull of any part, most points win, lower id on a tie."""
    points = subsamples(grid)
    counts = []
    for item in scene.objects:
        inside = np.zeros(points.shape[:-1], dtype=bool)
        for part in item.parts:
            equations = ConvexHull(apply(item.scene_T_object, part.vertices)).equations
            inside |= (points @ equations[:, :3].T + equations[:, 3] <= 0).all(axis=-1)
        counts.append(inside.sum(axis=-1))
    best, winner = np.zeros(grid.shape, dtype=int), np.full(grid.shape, -1)
    for k in range(len(counts)):
        winner = np.where(counts[k] > best, k, winner)
        best = np.maximum(best, counts[k])
    ids = np.array([0, *(o.object_id for o in scene.objects)])
    kinds = np.array([0, *(o.category.category_id for o in scene.objects)])
    return kinds[winner + 1], ids[winner + 1], np.array(counts)


@pytest.mark.parametrize("seed", range(6))
def test_every_voxel_agrees_with_the_oracle(seed: int) -> None:
    grid = VoxelGrid((0.013 * seed, -0.07, 0.021), (12, 11, 9))
    scene = random_scene(seed)
    semantic, instance = solid_occupancy(scene, grid)
    expected_semantic, expected_instance, counts = oracle(scene, grid)
    assert semantic.dtype == np.uint8
    assert instance.dtype == np.uint16
    assert np.array_equal(instance, expected_instance)
    assert np.array_equal(semantic, expected_semantic)
    assert 0 < (instance > 0).mean() < 1
    assert ((counts > 0).sum(axis=0) > 1).any()  # some voxels are shared
    for k, item in enumerate(scene.objects):
        held = count_subsamples(pack_solids(item.solids), grid)
        full = np.zeros(grid.shape, dtype=int)
        if held is not None:
            low, window = held
            full[tuple(slice(a, a + n) for a, n in zip(low, window.shape, strict=True))] = window
        assert np.array_equal(full, counts[k])


def test_counts_of_a_box_by_hand() -> None:
    # Sub-samples at .005, .015, ... .045 of a 5 cm voxel; the box holds 2, 3 and 5 of them along the axes.
    grid = VoxelGrid((0.0, 0.0, 0.0), (3, 3, 3))
    low, counts = count_subsamples(pack_solids([span((0.058, 0.05, 0.05), (0.082, 0.081, 0.1))]), grid)
    full = np.zeros((3, 3, 3), dtype=int)
    full[tuple(slice(a, a + n) for a, n in zip(low, counts.shape, strict=True))] = counts
    expected = np.zeros((3, 3, 3), dtype=int)
    expected[1, 1, 1] = 2 * 3 * 5
    assert np.array_equal(full, expected)


def test_overlapping_parts_count_once() -> None:
    grid = VoxelGrid((0.0, 0.0, 0.0), (2, 2, 2))
    solid = span((-1, -1, -1), (1, 1, 1))
    _, counts = count_subsamples(pack_solids([solid, solid, span((0, 0, 0), (0.02, 0.02, 0.02))]), grid)
    assert (counts == 125).all()


@pytest.mark.parametrize(("split", "winner"), [(0.03, 1), (0.02, 7)])
def test_the_label_is_who_holds_most(split: float, winner: int) -> None:
    # A plane between the layers of sub-samples: 3 of 5 layers to one, 2 to the other.
    left, right = span((0, 0, 0), (split, 0.05, 0.05)), span((split, 0, 0), (0.05, 0.05, 0.05))
    semantic, instance = solid_occupancy(
        scene_of(thing(1, left), thing(7, right, kind="plant")), VoxelGrid((0.0, 0.0, 0.0), (1, 1, 1))
    )
    assert instance.item() == winner
    assert semantic.item() == category("sofa" if winner == 1 else "plant").category_id


def test_a_tie_goes_to_the_lower_id() -> None:
    grid = VoxelGrid((0.0, 0.0, 0.0), (1, 1, 1))
    low, high = span((0, 0, 0), (0.02, 0.05, 0.05)), span((0.03, 0, 0), (0.05, 0.05, 0.05))
    for a, b in ((low, high), (high, low)):
        semantic, instance = solid_occupancy(scene_of(thing(4, a, kind="rug"), thing(5, b)), grid)
        assert instance.item() == 4
        assert semantic.item() == category("rug").category_id


@pytest.mark.parametrize("seed", range(3))
def test_a_part_of_the_grid_is_the_same_part_of_the_truth(seed: int) -> None:
    scene = random_scene(seed)
    whole = solid_occupancy(scene, VoxelGrid((-0.5, -0.5, -0.5), (40, 40, 40)))
    part = solid_occupancy(scene, VoxelGrid((-0.1, 0.05, 0.2), (7, 9, 5)))
    for a, b in zip(whole, part, strict=True):
        assert np.array_equal(a[8:15, 11:20, 14:19], b)
    assert part[1].any()


def test_solids_outside_the_grid_leave_it_empty() -> None:
    grid = VoxelGrid((0.0, 0.0, 0.0), (4, 4, 4))
    far = [span((1, 0, 0), (2, 1, 1)), span((0, -2, 0), (1, -1, 1)), span((0, 0, -0.1), (1, 1, 0.0))]
    for solid in far:
        semantic, instance = solid_occupancy(scene_of(thing(1, solid)), grid)
        assert not semantic.any()
        assert not instance.any()
    assert count_subsamples(pack_solids([far[0]]), grid) is None
    semantic, instance = solid_occupancy(scene_of(), grid)
    assert not semantic.any()
    assert not instance.any()


def test_a_solid_around_the_grid_fills_it() -> None:
    grid = VoxelGrid((0.0, 0.0, 0.0), (4, 5, 6))
    _, instance = solid_occupancy(scene_of(thing(59999, span((-1, -1, -1), (1, 1, 1)))), grid)
    assert (instance == 59999).all()


@settings(max_examples=40)
@given(st.floats(0.011, 0.2), st.floats(0.0, 0.5), st.sampled_from([0, 1, 2]))
def test_a_board_of_a_centimetre_is_never_lost(thickness: float, start: float, axis: int) -> None:
    low, high = np.zeros(3), np.full(3, 0.8)
    low[axis], high[axis] = start, start + thickness
    _, instance = solid_occupancy(scene_of(thing(1, span(low, high))), VoxelGrid((0.0, 0.0, 0.0), (16, 16, 16)))
    assert (instance == 1).any(axis=axis).all()
    along = np.flatnonzero((instance == 1).any(axis=tuple(a for a in range(3) if a != axis)))
    assert along.min() >= np.floor(start / 0.05 - 1e-9)
    assert along.max() <= np.floor((start + thickness) / 0.05 + 1e-9)


def test_an_open_mesh_is_named() -> None:
    surface = Part("scan", (1, 2, 3), mesh=(np.eye(3) + 5, np.array([[0, 1, 2]], dtype=np.int32)))
    item = SceneObject(8, "chair", np.eye(4), (Part("seat", (1, 2, 3), solid=box((1, 1, 1))), surface))
    with pytest.warns(UserWarning, match=r"only the surface is solid: 8 chair 13%"):
        _, instance = solid_occupancy(scene_of(item), VoxelGrid((0.0, 0.0, 0.0), (2, 2, 2)))
    assert (instance == 8).all()
