"""Walkable cells against a body tried in place: sampled solids and a flood fill that know nothing of the package."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

from hsbench.geometry.transforms import planar
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import connected_to_doors, walk_map
from tests.reference.body_fit import cell_centres, connected, standable, walkable
from tests.reference.rooms_by_hand import STAND_NO, STAND_YES, limits_of_standing, two_rooms
from tests.unit.synth.living_rooms import living_room, room

IOU = 0.95
DIFFERENT = 0.01  # of the walkable cells, borders included
TURN = planar(1.234, -0.567, np.radians(27.3))


def generated(number):
    return build_scene("x", Seeds(0).child(number), RoomConfig(), COMMON_FAMILIES)


def iou_without_border(truth, other):
    """IoU over the cells whose eight neighbours in ``truth`` are like them."""
    square = np.ones((3, 3), dtype=bool)
    inner = binary_erosion(truth, square, border_value=0) | ~binary_dilation(truth, square)
    both, either = (truth & other & inner).sum(), ((truth | other) & inner).sum()
    return both / either if either else 1.0


def agree(scene):
    walk = walk_map(scene)
    origin, shape = walk.origin_xy, walk.free.shape
    centres = cell_centres(origin, shape, walk.cell_m)
    np.testing.assert_allclose(walk.centres(), centres, atol=1e-9)
    free = standable(scene, centres)
    mine, theirs = connected(scene, free, centres), connected_to_doors(walk, scene)
    assert iou_without_border(free, walk.free) >= IOU
    assert iou_without_border(mine, theirs) >= IOU
    assert (mine != theirs).sum() <= DIFFERENT * mine.sum()


def test_the_oracle_in_an_empty_room_leaves_a_border_of_one_radius():
    free = walkable(room(3.0, 2.0), (0.0, 0.0), (60, 40))
    # Cells whose centres keep .25 m: 5 from each wall.
    assert np.array_equal(np.argwhere(free).min(axis=0), [5, 5])
    assert free.sum() == 50 * 30


def test_without_a_door_nothing_is_walkable_for_the_oracle():
    assert not walkable(room(3.0, 2.0, door=False), (0.0, 0.0), (60, 40)).any()


def test_walkable_cells_at_the_limits_of_standing():
    scene = limits_of_standing()
    walk = walk_map(scene)
    mine = walkable(scene, walk.origin_xy, walk.free.shape)
    theirs = connected_to_doors(walk, scene)
    for name, xy in {**STAND_YES, **STAND_NO}.items():
        cell = tuple(np.floor((np.array(xy) - walk.origin_xy) / walk.cell_m).astype(int))
        assert mine[cell] == theirs[cell] == (name in STAND_YES), name


@pytest.mark.parametrize("shut", [False, True])
def test_walkable_cells_on_both_sides_of_an_opening(shut):
    agree(two_rooms(0.9, shut))


def test_a_room_behind_a_passage_too_narrow_for_a_body():
    agree(two_rooms(0.45))


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(i, marks=pytest.mark.slow) for i in range(2, 8))])
def test_walkable_cells_of_rooms_made_by_hand(seed):
    agree(living_room(seed).moved(TURN))


@pytest.mark.parametrize("number", [0, *(pytest.param(i, marks=pytest.mark.slow) for i in range(1, 12))])
def test_walkable_cells_of_generated_rooms(number):
    scene = generated(number)
    agree(scene.moved(TURN) if number % 2 else scene)
