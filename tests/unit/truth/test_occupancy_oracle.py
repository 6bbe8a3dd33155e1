"""Occupied voxels against points tried one by one in the hulls of the parts."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.occupancy import solid_occupancy
from tests.reference.rooms_by_hand import limits_of_standing
from tests.reference.solid_points import deepest_object, depth, hull_depth, points_inside, scene_hulls
from tests.unit.synth.living_rooms import living_room

HALF_DIAGONAL_M = 0.0087  # of the 1 cm cubes around the sub-samples: a ball of this radius holds one of them
SHALLOW_FREE = 0.05  # slivers of voxels between sub-samples
TIE_M = 1e-7
SUB = 5
FINE = 20  # .25 cm
TURN = planar(0.777, -0.123, np.radians(31.7))


def scenes():
    return {
        "hand": living_room(0),
        "hand turned": living_room(1).moved(TURN),
        "limits": limits_of_standing().moved(planar(0.013, 0.017, 0.2)),
    }


def generated(number, turned=True):
    scene = build_scene("x", Seeds(0).child(number), RoomConfig(), COMMON_FAMILIES)
    return scene.moved(TURN) if turned else scene


def grid_around(scene):
    """A grid that holds every solid of a scene, with one free layer around."""
    corners = np.concatenate([o.vertices for o in scene.objects])
    low, high = corners.min(axis=0) - 0.063, corners.max(axis=0) + 0.05
    return VoxelGrid(tuple(low.tolist()), tuple(np.ceil((high - low) / 0.05).astype(int).tolist()))


def sub_samples(grid, voxels, n):
    """(K, 3) voxels -> (K, n^3, 3) points at (i + .5) / n of the sides."""
    line = (np.arange(n) + 0.5) / n
    inside = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(grid.origin_m) + (voxels[:, None] + inside) * grid.voxel_m


def near(hulls, grid, voxels):
    """The hulls that may have a part in some of the voxels."""
    low = np.asarray(grid.origin_m) + voxels.min(axis=0) * grid.voxel_m
    high = np.asarray(grid.origin_m) + (voxels.max(axis=0) + 1) * grid.voxel_m
    return [h for h in hulls if (h.low <= high).all() and (h.high >= low).all()]


def sorted_chunks(voxels, size=16):
    """Voxels in chunks of neighbours, so that few hulls are near each."""
    order = np.lexsort((voxels // 8).T)
    return np.array_split(voxels[order], max(1, len(voxels) // size))


def check_points(scene, count, rng):
    """Of ``count`` points at least .87 cm deep none is in a free voxel, of the shallower ones drawn with them few."""
    grid, hulls = grid_around(scene), scene_hulls(scene)
    semantic, _ = solid_occupancy(scene, grid)
    deep, shallow, shallow_free = 0, 0, 0
    while deep < count:
        points = points_inside(hulls, count, rng)
        index, within = grid.index(points)
        assert within.all()
        free = semantic[tuple(index.T)] == 0
        is_deep = depth(hulls, points) >= HALF_DIAGONAL_M
        assert not (free & is_deep).any(), points[free & is_deep][:5]
        deep += is_deep.sum()
        shallow, shallow_free = shallow + (~is_deep).sum(), shallow_free + (free & ~is_deep).sum()
    assert shallow_free < SHALLOW_FREE * shallow
    return deep, shallow_free / shallow


def check_occupied_voxels(scene, count, rng):
    grid, hulls = grid_around(scene), scene_hulls(scene)
    semantic, _ = solid_occupancy(scene, grid)
    voxels = rng.permutation(np.argwhere(semantic > 0))[:count]
    for chunk in sorted_chunks(voxels):
        points = sub_samples(grid, chunk, FINE)
        solid = depth(near(hulls, grid, chunk), points.reshape(-1, 3)).reshape(points.shape[:2]) >= -TIE_M
        assert solid.any(axis=1).all(), chunk[~solid.any(axis=1)]


def check_rule(scene, count, rng):
    """Occupied if and only if one of the 5 x 5 x 5 points is solid; the owner is an object that holds one of them."""
    grid, hulls = grid_around(scene), scene_hulls(scene)
    semantic, instance = solid_occupancy(scene, grid)
    edge = np.zeros(semantic.shape, dtype=bool)  # a voxel with a different neighbour: where the rule is put to the test
    for axis in range(3):
        change = np.diff(semantic > 0, axis=axis)
        edge |= np.insert(change, 0, False, axis) | np.insert(change, change.shape[axis], False, axis)
    voxels = np.concatenate([rng.permutation(np.argwhere(edge))[: count - count // 4],
                             rng.integers(0, grid.shape, (count // 4, 3))])  # fmt: skip
    category = {o.object_id: o.category.category_id for o in scene.objects}
    for chunk in sorted_chunks(voxels):
        points = sub_samples(grid, chunk, SUB)
        around = near(hulls, grid, chunk)
        found = depth(around, points.reshape(-1, 3)).reshape(points.shape[:2]).max(axis=1)
        answer = semantic[tuple(chunk.T)] > 0
        assert answer[found > TIE_M].all()
        assert not answer[found < -TIE_M].any()
        owners = deepest_object(around, points.reshape(-1, 3)).reshape(points.shape[:2])
        for voxel, owner, inside in zip(chunk, owners, points, strict=True):
            mine, kind = instance[tuple(voxel)], semantic[tuple(voxel)]
            assert (mine == 0) == (kind == 0)
            if mine:
                assert kind == category[mine]
                parts = [h for h in around if h.object_id == mine]
                assert mine in owner or any((hull_depth(h, inside) >= -TIE_M).any() for h in parts)


@pytest.mark.parametrize("name", list(scenes()))
def test_deep_points_are_occupied_and_occupied_voxels_hold_points(name):
    rng, scene = np.random.default_rng(1), scenes()[name]
    check_points(scene, 10_000, rng)
    check_occupied_voxels(scene, 100, rng)


@pytest.mark.parametrize("name", list(scenes()))
def test_the_rule_of_the_sub_samples(name):
    check_rule(scenes()[name], 1000, np.random.default_rng(2))


def test_a_generated_room():
    rng, scene = np.random.default_rng(3), generated(0)
    check_points(scene, 10_000, rng)
    check_rule(scene, 500, rng)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_a_million_points_and_ten_thousand_voxels_of_generated_rooms(number):
    rng, scene = np.random.default_rng(4), generated(number, turned=number > 0)
    check_points(scene, 1_000_000, rng)
    check_occupied_voxels(scene, 10_000, rng)
    check_rule(scene, 10_000, rng)
