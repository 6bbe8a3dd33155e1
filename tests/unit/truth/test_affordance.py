"""Labels of whole rooms: closed forms where there are any, hand-worked rooms, invariance, and storage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.io.arrays import load_npz, npz_bytes, write_npz
from hsbench.schema import codec
from hsbench.schema.occupancy import AffordanceTruth, AffordanceVoxels, PartAffordances
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.truth.affordance import (
    AffordanceScene,
    afford,
    affordance_truth,
    part_affordances,
    top_down,
    voxel_affordances,
)
from hsbench.truth.walkable import connected_to_doors, walk_map
from tests.unit.synth.living_rooms import bed, chair, living_room, part, room, sofa, table, wardrobe

SHAPE = (100, 100)
Corner = tuple[float, float, float]


def slab(
    number: int, low: Corner, high: Corner, role: str | None = None, category: str = "dining_table"
) -> SceneObject:
    return SceneObject(number, category, np.eye(4), (part("slab", low, high, role),))


def plan(found: AffordanceScene, kind: Affordance) -> np.ndarray:
    return (top_down(found, np.zeros(2), SHAPE) >> kind & 1).astype(bool)


def has(scene: Scene, kind: Affordance) -> set[tuple[int, str]]:
    """(object id, part name) of the parts that have a label."""
    parts = part_affordances(afford(scene))
    flags = (parts.labels >> kind & 1).astype(bool)
    return {(int(parts.object_id[k]), parts.part[k]) for k in np.flatnonzero(flags)}


def centres() -> np.ndarray:
    x = (np.arange(SHAPE[0]) + 0.5) * 0.05
    return np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)


def square(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    c = centres()
    return np.asarray(((c > np.array(low)) & (c < np.array(high))).all(axis=-1))


def test_a_table_is_interactable_as_far_as_an_arm_reaches_in() -> None:
    scene = room(5, 5, slab(10, (1.5, 1.0, 0.7), (3.5, 3.0, 0.75), "top"))
    found = afford(scene)
    walk = walk_map(scene)
    cells = walk.centres()[connected_to_doors(walk, scene)]
    top = square((1.5, 1.0), (3.5, 3.0))
    points = np.column_stack([centres()[top], np.full(top.sum(), 0.75)])
    shoulders = np.column_stack([cells, np.full(len(cells), 1.4)])
    near = (np.linalg.norm(points[:, None] - shoulders[None], axis=-1) <= 0.75 + 1e-6).any(axis=1)
    expected = np.zeros(SHAPE, dtype=bool)
    expected[top] = near
    assert np.array_equal(plan(found, Affordance.INTERACTABLE), expected)
    assert 0 < near.mean() < 1


@pytest.mark.parametrize(("low", "labelled"), [(0.34, False), (0.35, True), (1.34, True), (1.36, False)])
def test_a_top_serves_between_two_heights(low: float, labelled: bool) -> None:
    seat = slab(9, (1.7, 1.7, 0.0), (2.3, 2.1, 0.45), "seat", "bench")  # sat on sideways, a low top is in reach
    scene = room(4, 4, seat, slab(10, (1.5, 1.0, low), (2.5, 1.6, low + 0.05), "top"))
    assert ((10, "slab") in has(scene, Affordance.INTERACTABLE)) == labelled
    assert (10, "slab") in has(scene, Affordance.REACHABLE)


def test_reach_needs_a_role_to_be_interaction() -> None:
    plain = room(4, 4, slab(10, (1.5, 1.0, 0.7), (2.5, 1.6, 0.75)))
    assert (10, "slab") in has(plain, Affordance.REACHABLE)
    assert not has(plain, Affordance.INTERACTABLE)
    assert has(plain, Affordance.REACHABLE) <= {(10, "slab"), (3, "south"), (3, "east"), (3, "north"), (3, "west"),
                                                (4, "leaf"), (5, "pane")}  # fmt: skip


def test_a_top_under_a_shelf() -> None:
    desk = slab(10, (1.5, 3.2, 0.7), (2.5, 4.0, 0.75), "top", "desk")
    low_shelf = slab(11, (1.5, 3.2, 0.85), (2.5, 4.0, 0.9), None, "shelf")
    high_shelf = slab(11, (1.5, 3.5, 1.5), (2.5, 4.0, 1.55), None, "shelf")
    alone = plan(afford(room(4, 4, desk)), Affordance.INTERACTABLE)
    covered = plan(afford(room(4, 4, desk, low_shelf)), Affordance.INTERACTABLE)
    inner = slice(32, 48), slice(65, 66)  # a hand slips .05 m under the rim; over the open top it comes .1 m in
    assert not covered[inner].any()
    assert alone[inner].any()
    assert np.array_equal(plan(afford(room(4, 4, desk, high_shelf)), Affordance.INTERACTABLE), alone)


def test_the_top_over_a_pushed_in_seat_is_interactable_and_the_seat_sittable() -> None:
    scene = room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0))
    found = afford(scene)
    sittable, interactable = plan(found, Affordance.SITTABLE), plan(found, Affordance.INTERACTABLE)
    seat = square((1.78, 1.42), (2.22, 1.86))
    assert np.array_equal(sittable, seat)  # where it stands, not where it is pulled to
    over = seat & square((0, 0), (5, 1.6))
    assert over.any()
    assert interactable[over].all()


def test_a_chair_pulled_to_its_table_and_a_chair_boxed_in() -> None:
    wall = slab(12, (0.9, 1.9, 0), (3.1, 1.95, 1.0))
    assert has(room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0)), Affordance.SITTABLE) == {(11, "seat")}
    assert not has(room(4, 4, table(10, 2, 1.2, 0), chair(11, 2, 1.64, 0), wall), Affordance.SITTABLE)


def test_what_carries_small_things() -> None:
    top = slab(10, (1.5, 1.0, 0.7), (2.5, 2.0, 0.75), "top")
    vase = slab(11, (1.9, 1.4, 0.75), (2.1, 1.6, 1.0), None, "vase")
    near_the_edge = slab(
        12, (1.5, 1.05, 0.75), (1.55, 1.95, 0.8), None, "books"
    )  # .05 m of the top are left at its side
    board = slab(13, (1.5, 1.0, 0.84), (1.75, 1.2, 0.86), None, "books")  # .09 m above
    found = afford(room(4, 4, top, vase, near_the_edge, board))
    expected = square((1.5, 1.0), (2.5, 2.0)) & ~square((1.9, 1.4), (2.1, 1.6)) & ~square((1.5, 1.05), (1.55, 1.95))
    # The ends beside the books: a square of .1 m does not fit between their end and the edge of the top.
    expected &= ~square((1.5, 1.0), (1.75, 1.2)) & ~square((1.5, 1.95), (1.55, 2.0))
    expected |= square((1.5, 1.0), (1.75, 1.2)) | square((1.9, 1.4), (2.1, 1.6))  # the board and the vase themselves
    assert np.array_equal(plan(found, Affordance.SUPPORTABLE), expected)
    parts = part_affordances(found)
    flags = parts.labels >> Affordance.SUPPORTABLE & 1
    assert [int(f) for f, i in zip(flags, parts.object_id, strict=True) if i >= 10] == [1, 1, 0, 1]


@pytest.mark.parametrize(("z", "labelled"), [(0.19, False), (0.21, True), (1.59, True), (1.61, False)])
def test_heights_that_carry(z: float, labelled: bool) -> None:
    assert bool(has(room(4, 4, slab(10, (1.5, 1.0, z - 0.05), (2.5, 2.0, z))), Affordance.SUPPORTABLE)) == labelled


@pytest.mark.parametrize(("gap", "opens"), [(0.29, False), (0.31, True)])
def test_a_drawer_opens_with_room_in_front(gap: float, opens: bool) -> None:
    front = part("drawer", (-0.4, -0.32, 1.05), (0.4, -0.3, 1.25), "drawer")
    dresser = SceneObject(10, "dresser", planar(2, 3.7, 0), (part("body", (-0.4, -0.3, 0), (0.4, 0.3, 1.3)), front))
    bar = slab(11, (1.0, 3.37 - gap, 1.1), (3.0, 3.38 - gap, 1.12))
    assert ((10, "drawer") in has(room(4, 4, dresser, bar), Affordance.OPENABLE)) == opens
    assert (10, "drawer") in has(room(4, 4, dresser, bar), Affordance.INTERACTABLE)


def test_doors_and_handles_open_and_bodies_do_not() -> None:
    opens = has(room(4, 4, wardrobe(10, 2, 3.68, 0.0)), Affordance.OPENABLE)
    assert opens == {(10, "door"), (10, "handle")}
    assert has(room(4, 4, wardrobe(10, 2, 3.68, 0.0), sofa(11, 2, 2.9, 0.0)), Affordance.OPENABLE) == {(10, "handle")}


def test_an_entrance_door_opens_from_the_side_that_is_reached() -> None:
    leaf = part("leaf", (-0.4, -0.04, 0), (0.4, 0.0, 2.0), "door")
    shell = room(4, 4, door=False).objects
    door = SceneObject(4, "door", planar(2, 0, np.pi), (leaf,))
    outline = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], dtype=np.float64)

    def scene(*things: SceneObject) -> Scene:
        return Scene("s", (Room("living", outline),), 2.5, (*shell[:3], door, *shell[3:], *things))

    assert (4, "leaf") in has(scene(), Affordance.OPENABLE)
    bar = slab(10, (1.0, 0.2, 1.0), (3.0, 0.21, 1.02))
    assert (4, "leaf") in has(scene(bar), Affordance.REACHABLE)
    assert (4, "leaf") not in has(scene(bar), Affordance.OPENABLE)


def test_beds_and_long_sofas_are_lain_upon() -> None:
    def long_sofa(width: float, depth: float, gap: float = 0.02) -> SceneObject:
        half = width / 2
        seats = [part(f"seat{k}", (a, -depth / 2, 0.1), (b, depth / 2, 0.45), "seat")
                 for k, (a, b) in enumerate([(-half, -gap / 2), (gap / 2, half)])]  # fmt: skip
        return SceneObject(10, "sofa", planar(2.5, 2.5, 0.4), tuple(seats))

    seats = {(10, "seat0"), (10, "seat1")}
    assert has(room(5, 5, bed(10, 1.0, 3.9, 0.0)), Affordance.LYABLE) == {(10, "mattress")}
    assert has(room(5, 5, long_sofa(1.6, 0.5)), Affordance.LYABLE) == seats
    assert not has(room(5, 5, long_sofa(1.59, 0.5)), Affordance.LYABLE)
    assert not has(room(5, 5, long_sofa(1.7, 0.49)), Affordance.LYABLE)
    assert not has(room(5, 5, long_sofa(1.8, 0.6, gap=0.1)), Affordance.LYABLE)
    low = slab(11, (1, 1, 0.94), (4, 4, 1.0))
    assert not has(room(5, 5, long_sofa(1.6, 0.5), low), Affordance.LYABLE)
    assert not has(room(5, 5, table(10, 2, 2, 0.0), chair(11, 2, 1, 0.0)), Affordance.LYABLE)


def test_walkable_is_the_walk_map_from_the_doors() -> None:
    scene = living_room(3)
    walk = walk_map(scene)
    free = connected_to_doors(walk, scene)
    found = afford(scene)
    assert np.allclose(walk.origin_xy, np.zeros(2))
    expected = np.zeros((120, 120), dtype=bool)
    expected[: free.shape[0], : free.shape[1]] = free
    assert np.array_equal(top_down(found, np.zeros(2), (120, 120)) & 1, expected)
    fine = top_down(found, np.zeros(2), (480, 480), 0.0125) & 1
    assert np.array_equal(fine, expected.repeat(4, axis=0).repeat(4, axis=1))
    grid = VoxelGrid((0.0, 0.0, -0.1), (120, 120, 40))
    volume = voxel_affordances(found, grid).labels & 1
    assert np.array_equal(volume[:, :, 2], expected)  # the layer from z = 0 on
    assert volume.sum() == expected.sum()


@given(st.integers(0, 3), st.integers(-30, 30), st.integers(-30, 30), st.integers(0, 5))
@settings(max_examples=8, deadline=None)
def test_a_move_by_whole_cells_and_quarter_turns_moves_the_map(turns: int, i: int, j: int, seed: int) -> None:
    scene = living_room(seed)
    before = top_down(afford(scene), np.array([-1.0, -1.0]), (160, 160))
    a_T_scene = planar(0.05 * i, 0.05 * j, turns * np.pi / 2)
    corners = np.array([[-1.0, -1.0], [7.0, 7.0]]) @ a_T_scene[:2, :2].T + a_T_scene[:2, 3]
    moved = afford(scene.moved(a_T_scene))
    after = np.rot90(top_down(moved, corners.min(axis=0).round(6), (160, 160)), -turns)
    assert (before != after).mean() < 2e-4  # thin turned parts pass through a cell's corner one way and not the other
    assert np.array_equal(before & 0b100111, after & 0b100111)
    assert np.array_equal(part_affordances(afford(scene)).labels, part_affordances(moved).labels)


def test_without_a_door_nothing_is_used_and_without_things_nothing_is_there() -> None:
    found = afford(room(4, 4, table(10, 2, 1.2, 0), sofa(11, 2, 3, 0), door=False))
    assert set(np.unique(top_down(found, np.zeros(2), SHAPE))) == {0, 1 << Affordance.SUPPORTABLE}
    bare = Scene("s", room(4, 4).rooms, 2.5, ())
    truth = affordance_truth(bare, VoxelGrid((0.0, 0.0, 0.0), (4, 4, 4)))
    assert not truth.labels.any()
    assert truth.parts is not None
    assert truth.parts.part == ()


def test_twice_the_same_bytes() -> None:
    grid = VoxelGrid((-3.2, -3.2, 0.0), (128, 128, 48))
    first, second = (affordance_truth(living_room(4), grid) for _ in range(2))
    assert npz_bytes(codec.affordance_to_arrays(first)) == npz_bytes(codec.affordance_to_arrays(second))


def test_the_three_forms_agree() -> None:
    scene = living_room(1)
    truth = affordance_truth(scene.moved(planar(-2.3, -2.4, 0.3)), VoxelGrid((-6.4, -6.4, 0.0), (256, 256, 48)))
    assert truth.parts is not None
    assert truth.voxels is not None
    cells, volume = truth.labels[::-1, ::-1], truth.voxels.labels
    assert cells.shape == (256, 256)
    assert not truth.ignored.any()
    anywhere = np.bitwise_or.reduce(truth.parts.labels) | 1
    assert np.bitwise_or.reduce(cells.ravel()) == np.bitwise_or.reduce(volume.ravel()) == anywhere
    for kind in Affordance:
        column = (volume >> kind & 1).any(axis=2)
        drawn = (cells >> kind & 1).astype(bool)
        grown = np.zeros_like(column)
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                grown |= np.roll(column, (a, b), axis=(0, 1))
        assert not (drawn & ~grown).any()
    assert [(int(i), int(j)) for i, j in zip(truth.parts.object_id, truth.parts.part_index, strict=True)] == [
        (item.object_id, j) for item in scene.objects for j in range(len(item.parts))
    ]


@pytest.mark.parametrize("grid", [None, VoxelGrid((-3.2, -3.2, -0.05), (40, 50, 30), 0.1)])
def test_stored_and_read_it_is_the_same(grid: VoxelGrid | None, tmp_path: Path) -> None:
    truth = affordance_truth(living_room(2).moved(planar(-2, -2, 1.0)), grid, side_cells=120)
    arrays = codec.affordance_to_arrays(truth)
    write_npz(tmp_path / "affordance.npz", **arrays)
    read = codec.affordance_from_arrays(load_npz(tmp_path / "affordance.npz"))
    assert np.array_equal(read.labels, truth.labels)
    assert (read.cell_m, read.ignored.dtype) == (truth.cell_m, np.bool_)
    assert read.parts is not None
    assert truth.parts is not None
    assert read.parts.part == truth.parts.part
    for name in ("object_id", "part_index", "labels"):
        assert np.array_equal(getattr(read.parts, name), getattr(truth.parts, name))
    assert (read.voxels is None) == (truth.voxels is None) == (grid is None)
    if read.voxels is not None and truth.voxels is not None:
        assert read.voxels.grid == grid
        assert np.array_equal(read.voxels.labels, truth.voxels.labels)
    assert npz_bytes(codec.affordance_to_arrays(read)) == npz_bytes(arrays)


def test_impossible_truth_cannot_be_built() -> None:
    one = np.ones(1, dtype=np.int32)
    with pytest.raises(SchemaError, match="twice"):
        PartAffordances(np.array([1, 1], dtype=np.int32), np.zeros(2, np.int32), ("a", "b"), np.zeros(2, np.uint8))
    with pytest.raises(SchemaError, match=r"holds 128; expected bits 0\.\.6"):
        PartAffordances(one, one, ("a",), np.array([128], dtype=np.uint8))
    with pytest.raises(SchemaError, match="voxels"):
        AffordanceVoxels(VoxelGrid((0.0, 0.0, 0.0), (2, 2, 2)), np.zeros((2, 2), np.uint8))
    with pytest.raises(SchemaError, match="holds 200"):
        AffordanceTruth(np.full((2, 2), 200, dtype=np.uint8), np.zeros((2, 2), dtype=bool))


def test_reach_of_an_unknown_object_is_an_error() -> None:
    with pytest.raises(SchemaError, match="no object 77"):
        afford(room(4, 4)).reaches(np.zeros((1, 3)), np.array([77]), np.array([0]))
