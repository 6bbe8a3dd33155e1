"""Affordance volumes against plain loops, and what faces a room."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.geometry.convex import box
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema import AffordanceTruth, OccupancyTruth, Room, Scene, category
from hsbench.schema.occupancy import AffordanceVoxels
from hsbench.schema.states import Affordance
from hsbench.truth.affordance_volumes import Volume, volume_truth
from tests.reference import reconstruction_from_tasks as loops
from tests.unit.episode_builders import furniture

SHAPE = (12, 10, 6)
GRID = VoxelGrid((-0.3, -0.25, 0.0), SHAPE, 0.05)
ROOM = np.array([[-0.2, -0.15], [0.2, -0.15], [0.2, 0.15], [-0.2, 0.15]])
INSIDE = {(i, j) for i in range(2, 10) for j in range(2, 8)}
"""Columns with their middle in the room."""


def scene() -> Scene:
    return Scene("scene-0", (Room("living", ROOM),), 2.5, (furniture(1, box((0.1, 0.1, 0.1)), "chair"),))


def occupancy(walls: np.ndarray, solid: np.ndarray) -> OccupancyTruth:
    semantic = np.where(walls, category("wall").category_id, np.where(solid, category("desk").category_id, 0))
    return OccupancyTruth(
        GRID,
        semantic.astype(np.uint8),
        (semantic > 0).astype(np.uint16),
        np.ones(SHAPE, np.uint8),
        np.zeros(SHAPE, bool),
        np.full(SHAPE, np.inf, np.float32),
    )


def surfaces(rng: np.random.Generator) -> np.ndarray:
    bits = np.zeros(SHAPE, dtype=np.uint8)
    bits[2:10, 2:8, 0] = 1 << Affordance.WALKABLE
    for label in (Affordance.SITTABLE, Affordance.INTERACTABLE, Affordance.REACHABLE):
        bits |= (rng.random(SHAPE) < 0.04).astype(np.uint8) * np.uint8(1 << label)
    return bits


@pytest.mark.parametrize("seed", range(4))
def test_volumes_agree_with_plain_loops(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bits = surfaces(rng)
    walls = np.ones(SHAPE, dtype=bool)
    walls[2:10, 2:8] = rng.random((8, 6, 6)) < 0.05
    walls &= rng.random(SHAPE) < 0.9
    solid = rng.random(SHAPE) < 0.1
    plan = AffordanceTruth(np.zeros(SHAPE[:2], np.uint8), np.zeros(SHAPE[:2], bool))
    affordance = dataclasses.replace(plan, voxels=AffordanceVoxels(GRID, bits))
    found = volume_truth(scene(), occupancy(walls, solid), affordance)

    def where(mask: np.ndarray) -> set:
        return {tuple(c) for c in np.argwhere(mask).tolist()}

    walk, sit, use = (where(bits >> label & 1) for label in (0, 1, 2))
    expected = loops.extruded(SHAPE, walk, sit, use, where(walls), INSIDE)
    assert {c: int(found.labels[c]) for c in loops.cells(SHAPE)} == expected
    inside = np.zeros(SHAPE, dtype=bool)
    inside[2:10, 2:8] = True
    assert np.array_equal(found.solid & ~walls, solid & inside & ~walls)
    assert found.solid[found.labels == Volume.WALL].all()
    assert set(np.unique(found.labels)) == set(range(5))


def test_thick_walls_are_one_voxel_thick_and_ignored_columns_are_turned() -> None:
    walls = np.ones(SHAPE, dtype=bool)
    walls[2:10, 2:8] = False
    ignored = np.zeros(SHAPE[:2], dtype=bool)
    ignored[0, 0] = True  # largest x, largest y
    affordance = AffordanceTruth(
        np.zeros(SHAPE[:2], np.uint8), ignored, 0.05, None, AffordanceVoxels(GRID, np.zeros(SHAPE, np.uint8))
    )
    found = volume_truth(scene(), occupancy(walls, ~walls), affordance)
    ring = np.zeros(SHAPE, dtype=bool)
    ring[1, 2:8] = ring[10, 2:8] = ring[2:10, 1] = ring[2:10, 8] = True
    assert np.array_equal(found.labels == Volume.WALL, ring)
    assert np.array_equal(found.solid, ring | ~walls)
    assert np.argwhere(found.ignored.any(axis=2)).tolist() == [[11, 9]]
    assert found.ignored[11, 9].all()


def test_truth_on_other_grids_is_refused() -> None:
    none = np.zeros(SHAPE, dtype=bool)
    bare = AffordanceTruth(np.zeros(SHAPE[:2], np.uint8), np.zeros(SHAPE[:2], bool), 0.05)
    with pytest.raises(SchemaError, match="labelled surfaces are on None; expected"):
        volume_truth(scene(), occupancy(none, none), bare)
    voxels = AffordanceVoxels(GRID, np.zeros(SHAPE, np.uint8))
    small = dataclasses.replace(bare, labels=np.zeros((4, 4), np.uint8), ignored=np.zeros((4, 4), bool), voxels=voxels)
    with pytest.raises(SchemaError, match=r"the map from above has \(4, 4\) cells"):
        volume_truth(scene(), occupancy(none, none), small)
