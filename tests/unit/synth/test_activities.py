"""Lives: whole, repeatable, in contact with what the events say, and in nothing else."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from living_rooms import living_room, part, room

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import planar
from hsbench.schema import Action, JointState, Scene, SceneObject
from hsbench.schema.motions import scene_at
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.activities.contact import Obstacles, body_depth
from hsbench.synth.activities.measures import measure
from hsbench.synth.furniture import COMMON_FAMILIES
from hsbench.synth.people.body import J
from hsbench.synth.rooms.build import build_scene
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import connected_to_doors, walk_map

SEEDS = range(5)
NS = 1_000_000_000
ACTIVITIES = {
    "explore", "walk", "stand", "wait", "look", "sit", "sit_down", "stand_up", "touch", "draw_back", "put_back", "enter"
}  # fmt: skip


@cache
def lived_in(k: int) -> tuple[Scene, Life]:
    """A scene and its life: hand-made rooms first, then generated ones."""
    seed = k % len(SEEDS)
    scene = living_room(seed)
    if k >= len(SEEDS):
        scene = build_scene(f"r{seed}", Seeds(seed).child("room"), RoomConfig(), COMMON_FAMILIES)
    return scene, live(scene, Seeds(seed), LifeConfig())


ALL = range(2 * len(SEEDS))


@pytest.fixture(params=ALL, ids=lambda k: f"{'made' if k < len(SEEDS) else 'built'}-{k % len(SEEDS)}")
def lived(request: pytest.FixtureRequest) -> tuple[Scene, Life]:
    return lived_in(request.param)


def rows_of(life: Life, event: int) -> np.ndarray:
    times = life.poses.timestamp_ns
    return (times >= life.events.start_ns[event]) & (times <= life.events.end_ns[event])


def joints_of(life: Life) -> np.ndarray:
    assert life.poses.joints_m is not None
    return life.poses.joints_m.astype(np.float64)


def part_of(scene: Scene, life: Life, event: int) -> list:
    item = scene.object(int(life.events.object_id[event]))
    return [p.solid.transformed(item.scene_T_object) for p in item.parts if p.name == life.events.part[event]]


def test_times_ids_and_states(lived: tuple[Scene, Life]) -> None:
    life = lived[1]
    frames = np.arange(30, 3600, dtype=np.int64)
    assert np.array_equal(life.poses.timestamp_ns, (frames * NS + 15) // 30)
    assert (life.poses.track_id == 1).all()
    assert len(life.bodies) == 1
    assert (life.poses.joint_state == JointState.TRACKED).all()
    assert set(life.events.activity) <= ACTIVITIES
    assert len(life.action) == len(life.poses)
    joints = joints_of(life)
    assert np.allclose(joints, joints.round(4), atol=1e-6)


def test_bones_never_stretch(lived: tuple[Scene, Life]) -> None:
    joints = joints_of(lived[1])
    for parent, child in lived[1].poses.layout.bones:
        assert np.ptp(np.linalg.norm(joints[:, parent] - joints[:, child], axis=1)) < 1e-3


def test_walks_stay_on_free_cells_and_begin_at_the_door(lived: tuple[Scene, Life]) -> None:
    scene, life = lived
    walk = walk_map(scene)
    reachable = connected_to_doors(walk, scene)
    # the pelvis sways by some centimetres about the route, which itself stays in free cells
    grown = np.zeros_like(walk.free)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            grown |= np.roll(reachable, (di, dj), axis=(0, 1))
    for event, name in enumerate(life.events.activity):
        if name in ("walk", "explore"):
            index, inside = walk.index(joints_of(life)[rows_of(life, event), 0, :2])
            assert inside.all()
            assert grown[tuple(index.T)].all()
    door = next(o for o in scene.objects if o.category_name == "door")
    assert np.linalg.norm(joints_of(life)[0, 0, :2] - door.box[:2]) < 1.0


def test_bodies_are_not_inside_furniture(lived: tuple[Scene, Life]) -> None:
    scene, life = lived
    found = measure(scene, life)
    assert found.deep <= 0.005 * found.frames
    assert found.over_limit == 0
    assert max(found.seat_error_m, default=0.0) < 0.03
    walking = np.zeros(len(life.poses), dtype=bool)
    for event, name in enumerate(life.events.activity):
        if name in ("walk", "explore"):
            walking |= rows_of(life, event)
    depth = body_depth(Obstacles.of(scene), life.bodies[0], joints_of(life)[walking][::3])
    torso_and_head = [0, 1, 2, 3, 11, 12]
    assert depth[:, torso_and_head].max() < 0.03


def test_sitting_is_on_the_seat(lived: tuple[Scene, Life]) -> None:
    scene, life = lived
    joints = joints_of(life)
    for event, name in enumerate(life.events.activity):
        if name != "sit":
            continue
        rows = rows_of(life, event)
        assert life.events.contact[event] == "pelvis"
        pelvis = joints[rows, J["spine_base"], :2]
        for time, place in zip(life.poses.timestamp_ns[rows], joints[rows, J["spine_base"]], strict=True):
            solids = part_of(
                scene_at(scene, life.motions.moves_at(int(time))), life, event
            )  # a chair moves with who sits
            solid = min(solids, key=lambda s: np.sum((s.bounds.mean(axis=0) - place) ** 2))
            assert 0.05 < place[2] - solid.bounds[1, 2] < 0.25
            low, high = (f([s.bounds[k, :2] for s in solids], axis=0) for k, f in ((0, np.min), (1, np.max)))
            assert (place[:2] > low - 0.01).all()
            assert (place[:2] < high + 0.01).all()
        assert set(life.action[rows]) <= {Action.SIT, Action.INTERACT}
        across = (joints[rows, J["hip_left"]] - joints[rows, J["hip_right"]])[:, :2]
        facing = np.column_stack([across[:, 1], -across[:, 0]])
        knees = (joints[rows, J["knee_left"]] + joints[rows, J["knee_right"]])[:, :2] / 2 - pelvis
        assert (np.sum(facing * knees, axis=1) > 0).all()
        if scene.object(int(life.events.object_id[event])).category_name in ("chair", "armchair", "sofa"):
            front = -scene.object(int(life.events.object_id[event])).scene_T_object[:2, 1]
            assert ((facing @ front) > 0.9 * np.linalg.norm(facing, axis=1)).all()


def test_hands_touch_what_the_events_say(lived: tuple[Scene, Life]) -> None:
    scene, life = lived
    joints = joints_of(life)
    touching = np.zeros(len(life.poses), dtype=bool)
    for event, name in enumerate(life.events.activity):
        if name != "touch":
            continue
        rows = rows_of(life, event)
        touching |= rows
        tips = joints[rows, J[life.events.contact[event].replace("hand", "hand_tip")]]
        gaps = [np.abs((tips @ s.planes[:, :3].T - s.planes[:, 3]).max(axis=1)) for s in part_of(scene, life, event)]
        assert np.min(gaps, axis=0).max() < 0.03
    assert np.array_equal(touching, life.action == Action.INTERACT)


def test_transitions_are_ignored(lived: tuple[Scene, Life]) -> None:
    life = lived[1]
    moving = np.zeros(len(life.poses), dtype=bool)
    for event, name in enumerate(life.events.activity):
        if name in ("sit_down", "stand_up"):
            moving |= rows_of(life, event)
    assert np.array_equal(moving, life.action == Action.IGNORED)


def test_a_life_has_variety_and_goes_everywhere() -> None:
    actions = [life.action for _, life in map(lived_in, ALL)]
    shares = np.mean([np.bincount(action, minlength=4) / len(action) for action in actions], axis=0)
    assert shares[Action.STAND] > 0.4
    assert shares[Action.SIT] > 0.08
    assert shares[Action.INTERACT] > 0.03
    walked = []
    for scene, life in map(lived_in, ALL):
        walk = walk_map(scene)
        reachable, centres = connected_to_doors(walk, scene), walk.centres()
        near = np.zeros_like(reachable)
        for x, y in joints_of(life)[::10, 0, :2]:
            near |= np.sum((centres - (x, y)) ** 2, axis=-1) < 0.4**2
        walked.append((near & reachable).sum() / reachable.sum())
    assert np.mean(walked) > 0.7


def test_the_same_seeds_give_the_same_life() -> None:
    scene, life = lived_in(0)
    again = live(scene, Seeds(0), LifeConfig())
    other = live(scene, Seeds(1), LifeConfig())
    assert np.array_equal(joints_of(life), joints_of(again))
    assert np.array_equal(life.action, again.action)
    assert life.events.activity == again.events.activity
    assert life.bodies == again.bodies
    assert not np.array_equal(joints_of(life)[:100], joints_of(other)[:100])


def test_an_empty_room_is_walked() -> None:
    life = live(room(4.0, 3.0), Seeds(3), LifeConfig(duration_s=30.0))
    assert set(life.events.activity) <= {"explore", "walk", "stand", "look"}
    assert len(life.poses) == 29 * 30
    assert (life.action == Action.STAND).all()


def test_without_a_door_one_starts_in_the_open() -> None:
    life = live(room(4.0, 3.0, door=False), Seeds(3), LifeConfig(duration_s=5.0))
    assert np.allclose(joints_of(life)[0, 0, :2], (2.0, 1.5), atol=0.6)


def test_a_room_without_floor_stays_empty() -> None:
    block = SceneObject(20, "wardrobe", planar(2.0, 1.5, 0.0), (part("body", (-1.9, -1.4, 0), (1.9, 1.4, 2.0)),))
    life = live(room(4.0, 3.0, block), Seeds(3), LifeConfig())
    assert life.bodies == ()
    assert len(life.poses) == 0
    assert len(life.events) == 0
    assert len(life.action) == 0


def test_a_sealed_cell_is_stood_in() -> None:
    walls = [
        ((-1.0, -1.0), (-0.3, 1.0)), ((0.3, -1.0), (1.0, 1.0)), ((-1.0, 0.3), (1.0, 1.0)), ((-1.0, -1.0), (1.0, -0.3))
    ]  # fmt: skip
    boxes = tuple(part(f"w{i}", (*a, 0.0), (*b, 2.2)) for i, (a, b) in enumerate(walls))
    big = part("rest", (1.0, -1.4, 0), (2.9, 1.4, 2.2))
    scene = room(4.0, 3.0, SceneObject(20, "wardrobe", planar(1.0, 1.5, 0.0), (*boxes, big)), door=False)
    life = live(scene, Seeds(1), LifeConfig(duration_s=10.0))
    assert len(life.poses) == 270


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fps": 0}, "fps"),
        ({"empty_s": 200.0}, "empty_s"),
        ({"sit_s": (5.0, 2.0)}, "sit_s"),
        ({"sit": -1.0}, "weights"),
        ({"atypical_share": 4.0}, "percent"),
    ],
)
def test_impossible_configurations_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        LifeConfig(**change)  # type: ignore[arg-type]
