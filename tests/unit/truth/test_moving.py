"""What is ignored because things moved: against a count over all moments, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from episode_builders import furniture
from hypothesis import given
from hypothesis import strategies as st

from hsbench.geometry.convex import span
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import planar
from hsbench.schema import ObjectMotions, Part, Room, Scene, SceneObject
from hsbench.schema.motions import Move, Thing, scene_at
from hsbench.schema.states import Affordance
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.moving import ignored
from hsbench.truth.occupancy import solid_occupancy
from hsbench.typing import UInt8Array

MOMENTS = 12
GRID = VoxelGrid((-0.5, -0.5, 0.0), (20, 10, 2), 0.1)
OUTLINE = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])


def semantic(scene: Scene) -> UInt8Array:
    return solid_occupancy(scene, GRID)[0]


def boxes(*at_x: float) -> Scene:
    """Boxes of .4 x .4 x .1 m in a row, ids from 1 on, each of another category."""
    kinds = ("sideboard", "object", "stool")
    box = span((-0.2, -0.2, 0), (0.2, 0.2, 0.1))
    objects = tuple(furniture(k + 1, box, kinds[k], planar(x, 0.0, 0.0)) for k, x in enumerate(at_x))
    return Scene("s", (Room("living", OUTLINE),), 2.5, objects)


def motions(keys: list[tuple[int, Thing, Move]]) -> ObjectMotions:
    rows = sorted(keys)
    return ObjectMotions(
        np.array([t for t, _, _ in rows], dtype=np.int64),
        np.array([of[0] for _, of, _ in rows], dtype=np.int32),
        tuple(of[1] for _, of, _ in rows),
        np.array([move for _, _, move in rows], dtype=np.float64).reshape(-1, 3),
    )


def stepwise(object_id: int, steps: list[tuple[int, Move]]) -> list[tuple[int, Thing, Move]]:
    """Key poses of an object that rests and moves within a moment, at moment ``when`` for each step."""
    keys: dict[int, Move] = {}
    here: Move = (0.0, 0.0, 0.0)
    for when, there in sorted(steps):
        keys.setdefault(when, here)
        keys[when + 1] = here = there
    return [(when, (object_id, ""), move) for when, move in keys.items()]


TENTHS = st.integers(-6, 6).map(lambda n: n / 10)
STEPS = st.lists(
    st.tuples(st.integers(-2, MOMENTS + 1), st.tuples(TENTHS, TENTHS, st.sampled_from([0.0, 0.5]))),
    max_size=5,
    unique_by=lambda step: step[0],
)


@given(STEPS, STEPS, STEPS, st.floats(0.1, 1.2), st.floats(0.1, 1.2))
def test_the_same_as_counting_moments(a, b, c, gap: float, other: float) -> None:
    """Whatever moves, near each other or not: truth asked in the middle of every moment of the episode."""
    scene = boxes(-0.3, -0.3 + gap, -0.3 + gap + other)
    moved = motions([key for k, steps in enumerate((a, b, c)) for key in stepwise(k + 1, steps)])
    doubled = ObjectMotions(2 * moved.timestamp_ns, moved.object_id, moved.part, moved.move)  # middles are whole
    count = sum(
        (semantic(scene_at(scene, doubled.moves_at(2 * moment + 1))) != semantic(scene)).astype(int)
        for moment in range(MOMENTS)
    )
    found = ignored(semantic(scene), semantic, scene, doubled, 0, 2 * MOMENTS)
    assert np.array_equal(found, 2 * count > MOMENTS)


def away(until_ns: int) -> ObjectMotions:
    """A box goes aside by its width from 0 to 2 ns, and back in the 2 ns before ``until_ns``."""
    aside, home = (0.4, 0.0, 0.0), (0.0, 0.0, 0.0)
    return motions([(t, (1, ""), m) for t, m in ((0, home), (2, aside), (until_ns - 2, aside), (until_ns, home))])


@pytest.mark.parametrize(("until_ns", "voxels"), [(50, 0), (51, 16), (54, 16), (55, 32), (100, 32)])
def test_more_than_half_by_hand(until_ns: int, voxels: int) -> None:
    """Of 100 ns. The box fills 4 x 4 voxels here or there, and on its way, for 2 + 2 ns, half of each."""
    scene = boxes(0.0)
    found = ignored(semantic(scene), semantic, scene, away(until_ns), 0, 100)
    assert found.sum() == voxels
    x, y, z = (GRID.axis_centres(k)[at] for k, at in enumerate(np.nonzero(found)))
    assert ((np.abs(x - 0.2) < 0.4) & (np.abs(y) < 0.2) & (z < 0.1)).all()
    if voxels == 16:
        assert ((x < 0.0) | ((x > 0.2) & (x < 0.4))).all()  # left at once; reached at once


def test_a_thing_that_never_moves_far_or_long_is_not_asked_for() -> None:
    scene = boxes(0.0)

    def refuse(_: Scene) -> UInt8Array:
        raise AssertionError("nothing can differ for long enough")

    assert not ignored(semantic(scene), refuse, scene, away(50), 0, 100).any()
    assert not ignored(semantic(scene), refuse, scene, ObjectMotions.none(), 0, 100).any()


def test_things_far_apart_are_asked_for_one_by_one() -> None:
    """Two boxes are each away for 40 % of the time, and together for 80 %: no voxel differs for more than half."""
    scene = boxes(-0.3, 1.2)
    keys = [(t, (1, ""), m) for t, m in ((0, (0.0, 0.0, 0.0)), (1, (0.0, 0.1, 0.0)), (39, (0.0, 0.1, 0.0)))]
    keys += [(40, (1, ""), (0.0, 0.0, 0.0)), (40, (2, ""), (0.0, 0.0, 0.0)), (41, (2, ""), (0.0, 0.1, 0.0))]
    keys += [(79, (2, ""), (0.0, 0.1, 0.0)), (80, (2, ""), (0.0, 0.0, 0.0))]

    def refuse(_: Scene) -> UInt8Array:
        raise AssertionError("nothing can differ for long enough")

    assert not ignored(semantic(scene), refuse, scene, motions(keys), 0, 100).any()


@pytest.mark.parametrize(("end_ns", "expected"), [(150, True), (210, False)])
def test_cells_from_which_a_table_was_carried_away(end_ns: int, expected: bool) -> None:
    """From 0 to 100 it stands 1 m aside, where nobody walks then; where it was at t0 people do."""
    floor = SceneObject(1, "floor", np.eye(4), (Part("floor", (9, 9, 9), None, span((-2, -2, -0.1), (2, 2, 0))),))
    door = SceneObject(
        2, "door", planar(0, -2, np.pi), (Part("leaf", (9, 9, 9), "door", span((-0.4, -0.05, 0), (0.4, 0, 2))),)
    )
    table = SceneObject(
        3,
        "dining_table",
        planar(-0.5, 0.5, 0.0),
        (Part("top", (9, 9, 9), "top", span((-0.3, -0.3, 0), (0.3, 0.3, 0.7))),),
    )
    scene = Scene("s", (Room("living", OUTLINE),), 2.5, (floor, door, table))
    moved = motions([(t, (3, ""), (x, 0.0, 0.0)) for t, x in ((-1, 0.0), (0, 1.0), (100, 1.0), (101, 0.0))])

    def labels(room: Scene) -> UInt8Array:
        return affordance_truth(room, side_cells=80).labels

    found = ignored(labels(scene), labels, scene, moved, 0, end_ns)
    other = labels(scene_at(scene, moved.moves_at(50)))
    assert np.array_equal(found, (labels(scene) != other) & expected)
    walkable = (labels(scene) >> Affordance.WALKABLE & 1) != (other >> Affordance.WALKABLE & 1)
    assert walkable.sum() > 200
