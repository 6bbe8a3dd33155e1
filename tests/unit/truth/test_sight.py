"""What the camera knows: states from a plain loop over the definition, pixel counts worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.convex import ConvexSolid, box, span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.schema.events import EventTable
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.schema.states import Visibility, VoxelState
from hsbench.truth.objects import object_truth
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.sight import depth_states, inside_room, ray_image, surface_margin_m, true_states

L_SHAPE = np.array([[0.0, -1.5], [4.0, -1.5], [4.0, 0.4], [2.2, 0.4], [2.2, 1.6], [0.0, 1.6]])
CAMERA = PinholeCamera(40, 30, 32.0, 33.0, 19.5, 15.2)
POSE = world_T_camera(1.5, 0.35, 0.02)
GRID = VoxelGrid((-0.6, -1.7, -0.2), (50, 35, 28), 0.1)


def scene_of(*solids: ConvexSolid, room_xy: np.ndarray = L_SHAPE) -> Scene:
    objects = tuple(
        SceneObject(k, "sofa", np.eye(4), (Part("body", (1, 2, 3), solid=solid),)) for k, solid in enumerate(solids, 1)
    )
    return Scene("s", (Room("living", room_xy),), 2.3, objects)


SCENE = scene_of(
    span((-1, -4, -0.1), (6, 4, 0.0)),
    box((0.5, 0.6, 0.8)).transformed(planar(2.0, 0.2, 0.5, 0.4)),
    box((0.4, 0.4, 1.5)).transformed(planar(3.0, -0.8, 0.2, 0.75)),
)


def state_by_definition(point: np.ndarray, depth_m: np.ndarray, voxel_m: float) -> VoxelState:
    """Voxel states: occluded if z > D + sqrt(3)/2 side, surface within that distance of D, else free."""
    x, y, z = (np.linalg.inv(POSE) @ [*point, 1.0])[:3]
    if z <= 0:
        return VoxelState.OUTSIDE_FOV
    u, v = CAMERA.fx_px * x / z + CAMERA.cx_px, CAMERA.fy_px * y / z + CAMERA.cy_px
    if not (0 <= u < CAMERA.width_px and 0 <= v < CAMERA.height_px):
        return VoxelState.OUTSIDE_FOV
    depth = depth_m[math.floor(v), math.floor(u)]
    if depth == 0:
        return VoxelState.MISSING_DEPTH
    if z > depth + math.sqrt(3) / 2 * voxel_m:
        return VoxelState.OCCLUDED
    if abs(z - depth) <= math.sqrt(3) / 2 * voxel_m:
        return VoxelState.SURFACE
    return VoxelState.FREE


def test_states_are_those_of_the_definition() -> None:
    depth_m = ray_image(SCENE, CAMERA, POSE).depth_m.copy()
    depth_m[np.random.default_rng(0).random(depth_m.shape) < 0.1] = 0.0
    states = depth_states(GRID, CAMERA, POSE, depth_m)
    assert states.dtype == np.uint8
    assert set(np.unique(states)) == {
        VoxelState.FREE, VoxelState.SURFACE, VoxelState.OCCLUDED, VoxelState.MISSING_DEPTH, VoxelState.OUTSIDE_FOV,
    }  # fmt: skip
    centres = GRID.centres()
    for index in np.ndindex(*GRID.shape):
        if sum(index) % 3 == 0:
            assert states[index] == state_by_definition(centres[index], depth_m, GRID.voxel_m), index


def test_states_of_float32_depth_follow_the_same_rule() -> None:
    depth_m = ray_image(SCENE, CAMERA, POSE).depth_m.astype(np.float32)
    states = depth_states(GRID, CAMERA, POSE, depth_m)
    centres = GRID.centres()
    for index in np.ndindex(*GRID.shape):
        if sum(index) % 11 == 0:
            assert states[index] == state_by_definition(centres[index], depth_m.astype(float), GRID.voxel_m)


@pytest.mark.parametrize(
    ("beyond_m", "state"),
    [
        (-1.0, VoxelState.FREE),
        (-1e-9, VoxelState.FREE),
        (1e-9, VoxelState.SURFACE),
        (math.sqrt(3) / 2 * 0.05, VoxelState.SURFACE),
        (math.sqrt(3) * 0.05 - 1e-9, VoxelState.SURFACE),
        (math.sqrt(3) * 0.05 + 1e-9, VoxelState.OCCLUDED),
        (1.5, VoxelState.OCCLUDED),
    ],
)
def test_the_margin_is_half_a_voxels_diagonal(beyond_m: float, state: VoxelState) -> None:
    # One voxel on the axis of a level camera, its centre beyond the near end of the surface band by beyond_m.
    assert surface_margin_m(0.05) == math.sqrt(3) / 2 * 0.05
    grid = VoxelGrid((2.975, -0.025, 0.975), (1, 1, 1))
    camera = PinholeCamera(3, 3, 2.0, 2.0, 1.5, 1.5)
    depth_m = np.full((3, 3), 3.0 - beyond_m + math.sqrt(3) / 2 * 0.05)
    assert depth_states(grid, camera, world_T_camera(1.0, 0.0), depth_m).item() == state


def test_nothing_hit_is_free_and_behind_is_outside() -> None:
    grid = VoxelGrid((-1.0, -0.5, 0.5), (20, 10, 10), 0.1)
    states = depth_states(grid, CAMERA, world_T_camera(1.0, 0.0), np.full((30, 40), np.inf))
    x = grid.centres()[..., 0]
    assert (states[x < 0] == VoxelState.OUTSIDE_FOV).all()
    assert set(np.unique(states[x > 0])) <= {VoxelState.FREE, VoxelState.OUTSIDE_FOV}
    assert (states == VoxelState.FREE).any()


@pytest.mark.parametrize("shape", [(40, 30), (30, 41), (60, 80), (30, 40, 1)])
def test_depth_of_another_size_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(SchemaError, match=r"depth_m has shape .*; expected \(30, 40\) as the camera says"):
        depth_states(GRID, CAMERA, POSE, np.ones(shape))


def test_inside_the_room_is_within_outline_floor_and_ceiling() -> None:
    inside = inside_room(SCENE, GRID, POSE[:2, 3])
    x, y, z = np.moveaxis(GRID.centres(), -1, 0)
    plan = (x > 0) & (y > -1.5) & (x < 4.0) & (y < 1.6) & ((x < 2.2) | (y < 0.4))
    assert np.array_equal(inside, plan & (z > 0) & (z < 2.3))


def test_another_room_is_outside_the_room_of_the_camera() -> None:
    room = SCENE.rooms[0]
    next_door = Room("kitchen", room.outline_xy + np.array([10.0, 0.0]))
    flat = replace(SCENE, rooms=(next_door, room))
    assert np.array_equal(inside_room(flat, GRID, POSE[:2, 3]), inside_room(SCENE, GRID, POSE[:2, 3]))
    assert not inside_room(flat, GRID, np.array([11.0, -0.5])).any(), "the grid ends before the kitchen"


def test_true_states_know_what_lies_outside_the_room() -> None:
    image = ray_image(SCENE, CAMERA, POSE)
    states = true_states(SCENE, GRID, CAMERA, POSE, image)
    inside = inside_room(SCENE, GRID, POSE[:2, 3])
    assert (states[~inside] == VoxelState.OUTSIDE_ROOM).all()
    assert np.array_equal(states[inside], depth_states(GRID, CAMERA, POSE, image.depth_m)[inside])
    assert VoxelState.OUTSIDE_ROOM not in states[inside]
    assert VoxelState.MISSING_DEPTH not in states


def test_voxels_deep_in_seen_solids_are_never_free() -> None:
    _, instance = solid_occupancy(SCENE, GRID)
    states = true_states(SCENE, GRID, CAMERA, POSE, ray_image(SCENE, CAMERA, POSE))
    deep = np.zeros(GRID.shape, dtype=bool)
    for item in SCENE.objects[1:]:
        deep |= item.solids[0].contains(GRID.centres(), margin_m=0.12)
    assert (instance[deep] > 0).all()
    assert deep.sum() > 20
    assert VoxelState.FREE not in states[deep]


# ---------------------------------------------------------------- visible and amodal pixels

LENS = PinholeCamera(160, 120, 160.0, 160.0, 80.0, 60.0)
LEVEL = world_T_camera(1.0, 0.0)


def counts_of(*solids: ConvexSolid) -> tuple[list[int], list[int], list[int]]:
    """(visible, amodal, class) of each object, through the whole of the truth."""
    scene = scene_of(*solids)
    grid = VoxelGrid((0.0, -1.0, 0.0), (4, 4, 4))
    zeros = np.zeros(grid.shape)
    empty = OccupancyTruth(
        grid, zeros.astype(np.uint8), zeros.astype(np.uint16), zeros.astype(np.uint8), zeros.astype(bool),
        zeros.astype(np.float32),
    )  # fmt: skip
    none32, none64 = np.zeros(0, np.int32), np.zeros(0, np.int64)
    nothing = EventTable(none32, (), none32, (), none64, none64, ())
    truth = object_truth(scene, ray_image(scene, LENS, LEVEL), empty, nothing)
    assert truth.object_id.tolist() == list(range(1, len(solids) + 1))
    return truth.visible_px.tolist(), truth.amodal_px.tolist(), truth.visibility.tolist()


TARGET = span((4.0, -0.5, 0.5), (4.4, 0.5, 1.5))  # front face: 160 px / 4 m * 1 m = 40 px square


def test_a_half_hidden_box() -> None:
    screen = span((2.0, 0.0, 0.0), (2.1, 3.0, 2.0))  # hides everything left of the middle column
    visible, amodal, classes = counts_of(TARGET, screen)
    assert visible == [20 * 40, 80 * 120]
    assert amodal == [40 * 40, 80 * 120]
    assert classes == [Visibility.PARTIAL, Visibility.VISIBLE]


def test_a_box_alone_behind_a_screen_and_outside() -> None:
    screen = span((2.0, -0.5, 0.5), (2.1, 0.5, 1.5))  # 80 px square, nearer than the target and as large
    behind_camera, beside = span((-2, -1, 0), (-1, 1, 2)), span((1.0, 3.0, 0.0), (1.5, 4.0, 1.0))
    assert counts_of(TARGET) == ([1600], [1600], [Visibility.VISIBLE])
    visible, amodal, classes = counts_of(TARGET, screen, behind_camera, beside)
    assert visible == [0, 6400, 0, 0]
    assert amodal == [1600, 6400, 0, 0]
    assert classes == [Visibility.FULLY_OCCLUDED, Visibility.VISIBLE, Visibility.OUTSIDE, Visibility.OUTSIDE]


@pytest.mark.parametrize(
    ("columns", "expected"),
    [(0, Visibility.FULLY_OCCLUDED), (1, Visibility.PARTIAL), (23, Visibility.PARTIAL), (24, Visibility.VISIBLE)],
)
def test_classes_by_columns_left_free(columns: int, expected: Visibility) -> None:
    # A screen at 2 m leaves so many of the target's 40 columns free on its right: 24 of 40 are 60 %.
    edge = -(20 - columns) * 2.0 / 160.0
    visible, amodal, classes = counts_of(TARGET, span((2.0, edge, 0.0), (2.1, 3.0, 2.0)))
    assert (visible[0], amodal[0]) == (columns * 40, 1600)
    assert classes[0] == expected
