"""Things that move: where they are at a time, the scene then, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from episode_builders import SENSORS, motions, same, scene
from hypothesis import given
from hypothesis import strategies as st

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_angle
from hsbench.geometry.transforms import apply, planar
from hsbench.schema import Episode, EpisodeTruth, ObjectMotions, Scene, codec
from hsbench.schema.episode import FrameList
from hsbench.schema.motions import Move, Thing, scene_at

TABLE, LEG, SCAN = (4, ""), (4, "leg"), (7, "scan")
Keys = list[tuple[int, Thing, Move]]

LENGTHS = st.integers(-30_000, 30_000).map(lambda n: n / 10_000)
ANGLES = st.integers(-9_000, 9_000).map(lambda n: quantise_angle(math.radians(n / 100)))
MOVES = st.tuples(LENGTHS, LENGTHS, ANGLES)
TIMES = st.integers(0, 1_000)


def table(keys: Keys) -> ObjectMotions:
    rows = sorted(keys)
    return ObjectMotions(
        np.array([t for t, _, _ in rows], dtype=np.int64),
        np.array([thing[0] for _, thing, _ in rows], dtype=np.int32),
        tuple(thing[1] for _, thing, _ in rows),
        np.array([move for _, _, move in rows], dtype=np.float64).reshape(-1, 3),
    )


def tables() -> st.SearchStrategy[ObjectMotions]:
    key = st.tuples(TIMES, st.sampled_from([TABLE, LEG, SCAN]), MOVES)
    return st.lists(key, max_size=8, unique_by=lambda k: k[:2]).map(table)


def vertices(room: Scene) -> np.ndarray:
    return np.concatenate([o.vertices for o in room.objects])


# ---------------------------------------------------------------- where things are


@given(tables())
def test_before_its_first_key_pose_everything_is_as_at_t0(found: ObjectMotions) -> None:
    before = int(found.timestamp_ns[0]) - 1 if len(found) else 0
    assert found.moves_at(before) == {}
    assert same(scene_at(scene(), found.moves_at(before)), scene())


@given(tables())
def test_at_a_key_pose_and_after_the_last_a_thing_is_there(found: ObjectMotions) -> None:
    for thing, (times, moves) in found.tracks.items():
        for time, move in [*zip(times.tolist(), moves, strict=True), (5_000, moves[-1])]:
            assert found.moves_at(time).get(thing, (0.0, 0.0, 0.0)) == pytest.approx(tuple(move), abs=1e-12)


@given(tables(), TIMES)
def test_what_is_back_where_it_was_is_not_named(found: ObjectMotions, time: int) -> None:
    moves = found.moves_at(time)
    assert all(any(move) for move in moves.values())
    assert list(moves) == sorted(moves)


@given(st.floats(0.0, 1.0), st.integers(-18_000, 18_000).map(lambda n: math.radians(n / 100)), LENGTHS, LENGTHS)
def test_a_leaf_turns_about_its_hinge(share: float, angle: float, x: float, y: float) -> None:
    """The hinge (x, y) stays on its place at all times, and the angle grows evenly."""
    hinge = np.array([x, y, 0.0])

    def open_by(angle_rad: float) -> Move:
        dx, dy, _ = hinge - apply(planar(0.0, 0.0, angle_rad), hinge)
        return float(dx), float(dy), angle_rad

    time = round(share * 1e9)
    moves = table([(0, LEG, (0.0, 0.0, 0.0)), (10**9, LEG, open_by(angle))]).moves_at(time)
    move = moves.get(LEG, (0.0, 0.0, 0.0))
    assert apply(planar(*move), hinge) == pytest.approx(hinge, abs=1e-3)  # .01 degree at 4 m
    assert move[2] == pytest.approx(time / 1e9 * angle, abs=1e-4)


@given(MOVES, MOVES, st.integers(0, 100))
def test_without_a_turn_things_move_on_a_line(first: Move, last: Move, percent: int) -> None:
    last = (*last[:2], first[2])
    share = percent / 100
    move = table([(0, TABLE, first), (100, TABLE, last)]).moves_at(percent).get(TABLE, (0.0, 0.0, 0.0))
    assert move == pytest.approx([(1 - share) * a + share * b for a, b in zip(first, last, strict=True)], abs=1e-4)


@given(MOVES, MOVES, st.integers(0, 100))
def test_the_way_back_is_the_way_there(first: Move, last: Move, percent: int) -> None:
    there = table([(0, TABLE, first), (100, TABLE, last)]).moves_at(percent)
    back = table([(0, TABLE, last), (100, TABLE, first)]).moves_at(100 - percent)
    assert there.get(TABLE, (0, 0, 0)) == pytest.approx(back.get(TABLE, (0, 0, 0)), abs=1.1e-4)


# ---------------------------------------------------------------- the scene


@given(MOVES, MOVES)
def test_there_and_back_is_the_identity(whole: Move, leg: Move) -> None:
    def inverse(move: Move) -> Move:
        back = np.linalg.inv(planar(*move))
        return float(back[0, 3]), float(back[1, 3]), -move[2]

    there = scene_at(scene(), {TABLE: whole, LEG: leg})
    back = scene_at(there, {TABLE: inverse(whole), LEG: inverse(leg)})
    assert vertices(back) == pytest.approx(vertices(scene()), abs=1e-9)


@given(tables(), TIMES, LENGTHS, LENGTHS, st.floats(-4.0, 4.0))
def test_moving_things_and_giving_the_scene_in_another_frame_commute(
    found: ObjectMotions, time: int, x: float, y: float, yaw: float
) -> None:
    a_T_scene, moves = planar(x, y, yaw), found.moves_at(time)
    one, other = scene_at(scene().moved(a_T_scene), moves), scene_at(scene(), moves).moved(a_T_scene)
    assert vertices(one) == pytest.approx(vertices(other), abs=1e-9)


def test_whole_and_part_by_hand() -> None:
    """A table turned by a right angle and pushed 1 m ahead in its frame; its leg first slides 2 m along its own x."""
    right = math.pi / 2
    before, after = scene(), scene_at(scene(), {TABLE: (1.0, 0.0, right), LEG: (2.0, 0.0, 0.0)})
    item = before.object(4)
    for part, moved, slide in zip(item.parts, after.object(4).parts, (0.0, 2.0), strict=True):
        x, y, z = (part.vertices + (slide, 0, 0)).T
        expected = apply(item.scene_T_object, np.column_stack([1.0 - y, x, z]))
        assert apply(after.object(4).scene_T_object, moved.vertices) == pytest.approx(expected, abs=1e-9)
        assert same(replace(moved, solid=part.solid), part)
    for other in (1, 7):
        assert same(before.object(other), after.object(other))
    assert same(after.rooms, before.rooms)


# ---------------------------------------------------------------- tables, and what is refused


@given(tables())
def test_through_a_table(found: ObjectMotions) -> None:
    plain = codec.motions_to_table(found)
    assert plain.column_names == ["timestamp_ns", "object_id", "part", "x_m", "y_m", "yaw_rad"]
    assert same(codec.motions_from_table(plain), found)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"timestamp_ns": pa.array([5, 5, 4], pa.int64())}, r"row 2 .* comes too late; expected rows by time"),
        ({"object_id": pa.array([4, 4, 4], pa.int64())}, "object_id has dtype int64; expected int32"),
        ({"part": pa.array(["", None, ""], pa.string())}, "part has type string and 1 nulls"),
        ({"part": pa.array(["", "", ""], pa.string())}, r"row 1 \(5, 4, ''\) repeats"),
        ({"x_m": pa.array([0.0, np.nan, 0.0])}, "holds NaN or infinity"),
        ({"yaw_rad": pa.array([180.0, 0.0, 0.0])}, r"object 4 '' by 180 rad .*are these degrees"),
    ],
)
def test_tables_that_are_refused(change: dict[str, Any], message: str) -> None:
    plain = codec.motions_to_table(motions())
    for name, column in change.items():
        plain = plain.set_column(plain.column_names.index(name), name, column)
    with pytest.raises(SchemaError, match=message):
        codec.motions_from_table(plain)


@pytest.mark.parametrize("column", ["timestamp_ns", "object_id", "part", "x_m", "y_m", "yaw_rad"])
def test_every_column_is_needed(column: str) -> None:
    with pytest.raises(SchemaError, match=rf"motions table lacks columns \['{column}'\]"):
        codec.motions_from_table(codec.motions_to_table(motions()).drop_columns([column]))


@pytest.mark.parametrize(
    ("thing", "message"),
    [((4, "lid"), "object 4 has no part 'lid'; expected one of leg, top"), ((5, ""), "has no object 5")],
)
def test_things_that_the_scene_does_not_have(thing: Thing, message: str) -> None:
    found = table([(3, thing, (0.0, 0.1, 0.0))])
    with pytest.raises(SchemaError, match=message):
        EpisodeTruth(scene=scene(), motions=found)
    with pytest.raises(SchemaError, match=message):
        scene_at(scene(), found.moves_at(3))


def test_truth_is_the_scene_at_t0() -> None:
    """The first key poses of ``motions()`` are at 5 ns: an episode may begin before, not then."""
    truth = EpisodeTruth(scene=scene(), motions=motions())
    assert Episode("e", "d", SENSORS["topdown"], FrameList(), None, 4, 9, truth=truth).truth is truth
    with pytest.raises(
        SchemaError, match=r"episode e: things are moved at t0 \(\(4, ''\)\); expected motions from t0 on"
    ):
        Episode("e", "d", SENSORS["topdown"], FrameList(), None, 5, 9, truth=truth)


def test_things_that_move_need_a_scene() -> None:
    with pytest.raises(SchemaError, match="motions of things but no scene"):
        EpisodeTruth(motions=motions())
    assert EpisodeTruth(motions=ObjectMotions.none()).motions is not None
