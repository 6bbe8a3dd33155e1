"""Sittable cells and reached surfaces against bodies tried in place, which know nothing of the package's own answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

from hsbench.geometry.transforms import planar
from hsbench.schema.states import Affordance
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.truth.affordance import afford, top_down
from tests.reference.body_fit import LITERAL, SETTLED, cell_centres, sittable, sittings, walkable
from tests.reference.hand_reach import reached
from tests.reference.rooms_by_hand import (
    REACH_NO,
    REACH_YES,
    SIT_NO,
    SIT_YES,
    armchair_before,
    limits_of_reach,
    limits_of_sitting,
    round_stool,
)
from tests.unit.synth.living_rooms import living_room, room

CELL_M = 0.05
IOU = PRECISION = RECALL = 0.95
TURN = planar(1.234, -0.567, np.radians(27.3))


def generated(number):
    scene = build_scene("x", Seeds(0).child(number), RoomConfig(), COMMON_FAMILIES)
    return scene.moved(TURN) if number % 2 else scene


def plan_of(scene):
    """Minimum corner and shape of a top-down grid that holds a scene."""
    corners = np.concatenate([o.vertices for o in scene.objects])[:, :2]
    low = corners.min(axis=0) - CELL_M
    return low, tuple(np.ceil((corners.max(axis=0) + CELL_M - low) / CELL_M).astype(int))


def places_of(scene, origin_xy, shape, reading=SETTLED):
    walk = cell_centres(origin_xy, shape)[walkable(scene, origin_xy, shape)]
    return walk, sittings(scene, walk, reading)


def without_border(truth):
    """(nx, ny) bool: the cells whose eight neighbours are like them."""
    square = np.ones((3, 3), dtype=bool)
    return binary_erosion(truth, square) | ~binary_dilation(truth, square)


def compared(scene, count, seed=0):
    """Sittable cells with neighbours that are like them, and ``count`` points a functional part: ((C,) bool of the
    oracle, (C,) bool of ours), ((N,), (N,)).

    Both sides stand on the same grid of cells.
    """
    found = afford(scene)
    walk, places = places_of(scene, found.walk.origin_xy, found.walk.free.shape)
    plan = plan_of(scene)
    mine, theirs = sittable(scene, places, *plan), top_down(found, *plan) >> Affordance.SITTABLE & 1 == 1
    inner = without_border(mine)
    if not count:
        return (mine[inner], theirs[inner]), (np.empty(0, dtype=bool), np.empty(0, dtype=bool))
    ids, parts, points, reached_ = reached(scene, walk, places, count, np.random.default_rng(seed))
    return (mine[inner], theirs[inner]), (reached_, found.reaches(points, ids, parts))


def agree(scenes, count):
    """IoU of sittable cells, precision and recall of reached points over all parts of some scenes: the cells of one
    seat and the points of one part stand or fall together, so that a room of a dozen parts is too small a sample.
    """
    seats, hands = zip(*(compared(scene, count) for scene in scenes), strict=True)
    mine, theirs = (np.concatenate(found) for found in zip(*seats, strict=True))
    assert mine.any()
    assert (mine & theirs).sum() >= IOU * (mine | theirs).sum()
    if count:
        mine, theirs = (np.concatenate(found) for found in zip(*hands, strict=True))
        assert mine.any()
        assert (mine & theirs).sum() >= PRECISION * theirs.sum()
        assert (mine & theirs).sum() >= RECALL * mine.sum()


def test_the_limits_of_sitting():
    scene = limits_of_sitting().moved(TURN)
    plan = plan_of(scene)
    _, places = places_of(scene, *plan, LITERAL)
    assert {p.object_id for p in places} == set(SIT_YES)
    mine = sittable(scene, places, *plan)
    assert mine.sum() * CELL_M**2 == pytest.approx(5 * 0.4**2 + 0.36**2, rel=0.05)
    theirs = top_down(afford(scene), *plan) >> Affordance.SITTABLE & 1 == 1
    for number in (*SIT_YES, *SIT_NO):
        cell = np.floor((scene.object(number).box[:2] - plan[0]) / CELL_M).astype(int)
        assert mine[tuple(cell)] == theirs[tuple(cell)] == (number in SIT_YES), number


def test_the_limits_of_reach():
    scene = limits_of_reach()
    found = afford(scene)
    walk, places = places_of(scene, *plan_of(scene), LITERAL)
    ids, parts, points, mine = reached(scene, walk, places, 20, np.random.default_rng(0))
    assert set(ids[mine]) == set(REACH_YES)
    theirs = found.reaches(points, ids, parts)
    assert set(ids[theirs]) == set(REACH_YES)
    assert not set(REACH_NO) & set(ids[mine | theirs])


@pytest.mark.parametrize(
    ("clear_m", "answer"),
    [
        (0.34, False),
        (0.355, True),
        (0.38, True),
    ],
)
def test_an_armchair_with_a_rounded_rim_needs_a_free_depth_of_35_cm(clear_m, answer):
    scene = armchair_before(clear_m)
    plan = plan_of(scene)
    assert bool(places_of(scene, *plan, SETTLED)[1]) == answer
    assert bool((top_down(afford(scene), *plan) >> Affordance.SITTABLE & 1).any()) == answer


def test_a_round_stool_is_where_readers_differ():
    scene = room(4.0, 4.0, round_stool(10, 2.0, 2.0, diameter=0.4))
    plan = plan_of(scene)
    assert not places_of(scene, *plan, LITERAL)[1]
    assert places_of(scene, *plan, SETTLED)[1]
    assert (top_down(afford(scene), *plan) >> Affordance.SITTABLE & 1).any()


def test_a_room_made_by_hand():
    agree([living_room(1).moved(TURN)], 100)


def test_a_generated_room():
    agree([generated(4)], 20)


def test_a_stool_is_drawn_out_on_the_side_that_one_sits_on():
    """Kitchen 27 has a stool under its counter that comes out sideways: a stool has no back to be drawn against."""
    agree([generated(27)], 0)


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, 6, 12, 18])
def test_generated_rooms(first):
    agree([generated(i) for i in range(first, first + 6)], 20)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(24, 84, 6))
def test_seats_of_generated_rooms(first):
    agree([generated(i) for i in range(first, first + 6)], 0)
