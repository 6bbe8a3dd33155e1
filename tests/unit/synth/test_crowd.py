"""Several people at once, in blocks: the same life however it is divided; what is promised of lives is kept."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from living_rooms import chair, living_room, room, table

from hsbench.errors import SchemaError
from hsbench.schema import Action, Part, Scene
from hsbench.synth.activities import Life, LifeConfig, live, stream
from hsbench.synth.activities.measures import Measures, measure, promises
from hsbench.synth.seeds import Seeds
from hsbench.synth.survey import drawn_scene

CONFIG = LifeConfig(duration_s=90.0, people=3, arrival_s=(1.0, 5.0))
NATURAL = LifeConfig(duration_s=240.0, people=3, mode="natural", start_hour=18.5, habits=("average", "late", "tidy"))


@cache
def home(number: int = 4) -> Scene:
    return drawn_scene(number, 0)


@cache
def explored() -> Life:
    return live(home(), Seeds(5), CONFIG)


@cache
def natural() -> Life:
    return live(home(), Seeds(6), NATURAL)


def same(a: Life, b: Life) -> None:
    assert a.bodies == b.bodies
    for name in ("timestamp_ns", "track_id", "joint_state", "joints_m"):
        assert np.array_equal(getattr(a.poses, name), getattr(b.poses, name)), name
    assert np.array_equal(a.action, b.action)
    for name in ("person_id", "activity", "object_id", "part", "start_ns", "end_ns", "contact"):
        assert np.array_equal(getattr(a.events, name), getattr(b.events, name)), name
    assert np.array_equal(a.motions.timestamp_ns, b.motions.timestamp_ns)
    assert np.array_equal(a.motions.move, b.motions.move)


@pytest.mark.parametrize("block_s", [7.0, 31.0, 500.0])
def test_the_same_life_whatever_the_blocks(block_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hsbench.synth.activities.life.BLOCK_S", block_s)
    monkeypatch.setattr("hsbench.synth.activities.life.stream", lambda s, d, c: stream(s, d, c, block_s))
    same(live(home(), Seeds(5), CONFIG), explored())


def test_a_longer_life_begins_as_a_shorter_one() -> None:
    short = live(home(), Seeds(5), LifeConfig(duration_s=40.0, people=3, arrival_s=(1.0, 5.0)))
    rows = explored().poses.timestamp_ns < 40 * 10**9
    assert np.array_equal(explored().poses.joints_m[rows], short.poses.joints_m)  # type: ignore[index]
    assert np.array_equal(explored().action[rows], short.action)
    starts = explored().events.start_ns < 40 * 10**9
    assert np.array_equal(explored().events.start_ns[starts], short.events.start_ns)


@pytest.mark.parametrize("which", ["explored", "natural"])
def test_promises_are_kept(which: str) -> None:
    life = {"explored": explored, "natural": natural}[which]()
    assert len(life.bodies) == 3
    for line in promises(measure(home(), life)):
        assert line.kept, line


def test_rows_ascend_by_time_and_person_and_have_no_gaps() -> None:
    times, ids = explored().poses.timestamp_ns, explored().poses.track_id
    keys = list(zip(times.tolist(), ids.tolist(), strict=True))
    assert keys == sorted(set(keys))
    for person in (1, 2, 3):
        frames = np.rint(times[ids == person] * 30 / 1e9).astype(int)
        assert np.array_equal(np.diff(frames), np.ones(len(frames) - 1))
        assert frames[-1] == 90 * 30 - 1


def test_in_the_evening_people_do_many_things() -> None:
    names = set(natural().events.activity)
    assert len(names - {"walk", "stand", "sit", "sit_down", "stand_up", "wait", "touch"}) >= 5
    assert "explore" not in names


def test_every_touch_has_its_action_and_every_sit_its_pelvis() -> None:
    life = natural()
    touching, sitting = np.zeros(len(life.action), bool), np.zeros(len(life.action), bool)
    for k, name in enumerate(life.events.activity):
        rows = (life.poses.track_id == life.events.person_id[k]) & (
            (life.poses.timestamp_ns >= life.events.start_ns[k]) & (life.poses.timestamp_ns <= life.events.end_ns[k])
        )
        if name == "touch":
            touching |= rows
            assert life.events.contact[k].startswith("hand_")
        if name == "sit":
            sitting |= rows
            assert life.events.contact[k] == "pelvis"
    assert np.array_equal(touching, life.action == Action.INTERACT)
    assert np.array_equal(sitting, (life.action == Action.SIT) | (touching & sitting))


def tucked_in() -> Scene:
    """A table with a chair pushed under it."""
    return room(5.0, 4.0, table(20, 2.5, 1.6, 0.0), chair(21, 2.5, 2.05, 0.0))


@cache
def at_table() -> Life:
    config = LifeConfig(duration_s=120.0, explore=0.1, sit=1.0, touch=0.0, look=0.0, unused_share=0.0)
    return live(tucked_in(), Seeds(2), config)


def test_a_chair_is_drawn_back_and_put_back() -> None:
    life, motions = at_table(), at_table().motions
    sits = [k for k, name in enumerate(life.events.activity) if name == "sit" and life.events.object_id[k] == 21]
    assert len(sits) >= 2
    assert set(motions.object_id.tolist()) == {21}
    assert set(motions.part) == {""}
    for k in sits:
        (move,) = motions.moves_at(int(life.events.start_ns[k])).values()
        assert move[1] > 0.05  # away from the table: the front is -y
        assert abs(move[0]) < 1e-3
    ends = [k for k, name in enumerate(life.events.activity) if name == "put_back"]
    after = motions.moves_at(int(life.events.end_ns[ends[0]]) + 10**8)
    assert all(np.abs(move).max() == 0.0 for move in after.values())


def test_the_door_opens_for_each_person_and_shuts_behind_them() -> None:
    life, motions = explored(), explored().motions
    entering = [k for k, name in enumerate(life.events.activity) if name == "enter"]
    assert len(entering) == 3
    for k in entering:
        item = home().object(int(life.events.object_id[k]))
        assert item.category_name == "door"
        middle = int(life.events.start_ns[k] + life.events.end_ns[k]) // 2
        open_now = {part: move for (_, part), move in motions.moves_at(middle).items() if part}
        assert {p.name for p in item.parts if p.role in ("door", "handle")} <= set(open_now)
        for part, move in open_now.items():
            assert np.pi / 3 - 1e-3 <= abs(move[2]) <= np.pi / 2 + 1e-3, part
        shut = motions.moves_at(int(life.events.end_ns[k]) + 40 * 10**9 // 30)
        assert all(abs(move[2]) < 1e-2 for (_, part), move in shut.items() if part)


def test_nobody_is_where_the_leaf_swings() -> None:
    life, scene = explored(), home()
    for k, name in enumerate(life.events.activity):
        if name != "enter":
            continue
        item = scene.object(int(life.events.object_id[k]))
        turns = {part: move for (_, part), move in life.motions.moves_at(int(life.events.end_ns[k])).items() if part}
        leaf = next(p for p in item.parts if p.role == "door")
        reach = np.ptp(leaf.vertices[:, 0])
        x, y, yaw = turns[leaf.name]
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        pivot = np.linalg.solve(np.eye(2) - turn, [x, y])
        hinge = item.scene_T_object[:2, :2] @ pivot + item.scene_T_object[:2, 3]
        rows = (life.poses.timestamp_ns >= life.events.end_ns[k]) & (
            life.poses.timestamp_ns <= life.events.end_ns[k] + 10**9
        )
        assert life.poses.joints_m is not None
        assert np.linalg.norm(life.poses.joints_m[rows][:, 0, :2] - hinge, axis=1).min() > reach + 0.2


def test_chairs_move_evenly_and_slowly() -> None:
    chairs = {
        i for i, part in zip(explored().motions.object_id.tolist(), explored().motions.part, strict=True) if not part
    }
    for thing in chairs:
        rows = explored().motions.object_id == thing
        step = np.linalg.norm(np.diff(explored().motions.move[rows, :2], axis=0), axis=1)
        time = np.diff(explored().motions.timestamp_ns[rows]) / 1e9
        assert (step / time).max() < 1.5


def test_some_things_are_never_used_by_anybody() -> None:
    config = LifeConfig(duration_s=60.0, unused_share=1.0)
    life = live(living_room(1), Seeds(3), config)
    assert not any(life.events.contact)


def test_why_things_are_not_done_is_told() -> None:
    persons = {person for person, _, _ in natural().undone}
    assert persons <= {1, 2, 3}
    assert all(activity and reason for _, activity, reason in natural().undone)


def test_measures_add_up() -> None:
    one = measure(tucked_in(), at_table())
    both = one + one
    assert both.frames == 2 * one.frames
    assert dict(both.events)["sit"] == 2 * dict(one.events)["sit"]
    assert Measures() + one == one


def test_a_body_in_a_wall_is_found() -> None:
    """The measure itself: a life shifted into the wall is deep."""
    life = at_table()
    joints = life.poses.joints_m + np.array([2.55, 0.0, 0.0], dtype=np.float32)  # type: ignore[operator]
    shifted = Life(life.bodies, type(life.poses)(*_poses(life, joints)), life.action, life.events, life.motions)
    assert measure(tucked_in(), shifted).deep > 0.3 * measure(tucked_in(), shifted).frames


def _poses(life: Life, joints: np.ndarray) -> tuple[object, ...]:
    return life.poses.skeleton, life.poses.timestamp_ns, life.poses.track_id, life.poses.joint_state, joints


@pytest.mark.parametrize(
    ("change", "message"),
    [({"people": 9}, "people"), ({"mode": "party"}, "mode"), ({"start_hour": 24.0}, "hour"), ({"habits": ("x",)}, "x")],
)
def test_impossible_crowds_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        LifeConfig(**change)  # type: ignore[arg-type]


def test_a_scene_of_meshes_is_lived_in() -> None:
    """Imported parts have no solids: people walk round them all the same, and use them."""
    scene = living_room(2)
    meshed = tuple(
        replace(
            item,
            parts=tuple(Part(p.name, p.colour, p.role, mesh=(p.vertices, p.triangles)) for p in item.parts),
        )
        for item in scene.objects
    )
    life = live(replace(scene, objects=meshed), Seeds(1), LifeConfig(duration_s=60.0, people=2))
    assert len(life.bodies) == 2
    assert any(life.events.contact)
    assert "explore" in life.events.activity
