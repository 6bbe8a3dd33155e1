"""Things in hands: closed, turned outwards, where the hands are, moved with the body as one, and seen as the person."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply, planar
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.activities.catalogue import CATALOGUE
from hsbench.synth.activities.life import stream
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.people import HELD, Body, body_mesh
from hsbench.synth.people.body import J
from hsbench.synth.people.channels import Channels, pose, standing
from hsbench.synth.people.gestures import HELD_IN
from hsbench.synth.people.motion import GESTURES, carry, gesture, stand, walk
from hsbench.synth.people.props import held_mesh
from hsbench.synth.people.style import Style
from hsbench.synth.render import open_renderer
from hsbench.synth.seeds import Seeds
from tests.unit.synth.living_rooms import living_room, room

FPS = 30
BODIES = [Body(1.72), Body(1.6, style=Style(hand=0))]
THINGS = HELD[1:]


def holding(body: Body, kind: str) -> np.ndarray:
    """(25, 3) joints of somebody in the middle of a gesture with a thing, or carrying it."""
    start = standing(body, np.array([0.3, -0.2]), 0.4)
    for name, thing in HELD_IN.items():
        if thing == kind:
            chunk = gesture(start, name, 6.0, FPS, np.random.default_rng(0))
            return pose(body, chunk, FPS, None)[90]
    return pose(body, carry(stand(start, 4.0, FPS), 1.0), FPS, None)[60]


@pytest.mark.parametrize("kind", THINGS)
@pytest.mark.parametrize("body", BODIES, ids=["right", "left"])
def test_things_are_closed_bodies_turned_outwards(kind: str, body: Body) -> None:
    vertices, triangles, colours = held_mesh(kind, body.style.hand, holding(body, kind))
    assert triangles.dtype == np.int32
    assert colours.shape == triangles.shape
    for piece in trimesh.Trimesh(vertices, triangles).split(only_watertight=False):
        assert piece.is_watertight
        assert piece.is_winding_consistent
        assert piece.volume > 1e-7


@pytest.mark.parametrize("kind", THINGS)
@pytest.mark.parametrize("body", BODIES, ids=["right", "left"])
def test_things_are_in_the_hands(kind: str, body: Body) -> None:
    joints = holding(body, kind)
    vertices, triangles, _ = held_mesh(kind, body.style.hand, joints)
    hands = {"book": (0, 1), "box": (0, 1), "meal": (0, 1)}.get(kind, (body.style.hand,))
    surface = trimesh.Trimesh(vertices, triangles)
    for side in hands:
        palm = joints[J[("hand_left", "hand_right")[side]]]
        assert trimesh.proximity.closest_point_naive(surface, palm[None])[1][0] < 0.08
    assert np.linalg.norm(vertices - joints[[J["hand_left"], J["hand_right"]]].mean(axis=0), axis=1).max() < 0.75


@pytest.mark.parametrize("kind", THINGS)
def test_things_move_with_the_body(kind: str) -> None:
    joints, moved = holding(BODIES[0], kind), planar(1.3, -2.0, 2.1)
    vertices, triangles, colours = held_mesh(kind, 1, joints)
    again, same, tints = held_mesh(kind, 1, apply(moved, joints))
    assert np.allclose(again, apply(moved, vertices), atol=1e-6)
    assert np.array_equal(same, triangles)
    assert np.array_equal(tints, colours)


def test_a_body_with_a_thing_is_the_body_and_the_thing() -> None:
    joints = holding(BODIES[0], "cup")
    bare, with_cup = body_mesh(BODIES[0], joints), body_mesh(BODIES[0], joints, held="cup")
    cup = held_mesh("cup", 1, joints)
    for one, both, other in zip(bare, with_cup, cup, strict=True):
        assert np.array_equal(both[: len(one)], one)
        assert len(both) == len(one) + len(other)
    assert np.array_equal(with_cup[0][with_cup[1][len(bare[1]) :]], cup[0][cup[1]])


def test_hands_hold_something_during_a_gesture_and_nothing_after_it() -> None:
    start = standing(BODIES[0], np.zeros(2), 0.0)
    for kind in GESTURES:
        chunk = gesture(start, kind, 5.0, FPS, np.random.default_rng(1))
        assert {HELD[int(h)] for h in chunk.held[:-1]} == {HELD_IN[kind]}
        assert chunk.held[-1] == start.held[-1]


def test_a_box_is_carried_between_taking_it_and_putting_it_down() -> None:
    body = BODIES[0]
    way = walk(body, standing(body, np.zeros(2), 0.0), np.array([[0.0, 0.0], [3.0, 0.0]]), None, 1.0, FPS)
    load: Channels = carry(way, 1.0)
    held = np.array([HELD[int(h)] for h in load.held])
    assert held[0] == held[-1] == ""
    assert (held[len(way) // 4 : -len(way) // 4] == "box").all()
    assert not carry(way, 0.0).held.any()


def test_a_life_tells_what_is_held_at_each_pose_whatever_the_division() -> None:
    scene, config = living_room(3), LifeConfig(duration_s=120.0, people=2, mode="natural", start_hour=12.5)
    life = live(scene, Seeds(5), config)
    assert life.held is not None
    assert len(life.held) == len(life.poses)
    pieces = [block.held for block in stream(scene, Seeds(5), config, 17.0)]
    assert np.array_equal(np.concatenate([held for held in pieces if held is not None]), life.held)
    brings = {activity.name: HELD_IN.get(activity.gesture, "") for activity in CATALOGUE}
    for person, stamp, held in zip(life.poses.track_id, life.poses.timestamp_ns, life.held, strict=True):
        if HELD[held] not in ("", "box"):
            rows = (life.events.person_id == person) & (life.events.start_ns <= stamp) & (life.events.end_ns >= stamp)
            assert HELD[held] in {brings.get(life.events.activity[k]) for k in np.flatnonzero(rows)}
    assert life.held.any()


def test_a_thing_is_filmed_as_part_of_the_person_and_not_in_the_background() -> None:
    scene, body = room(5.0, 4.0).moved(planar(-0.5, -2.0, 0.0)), BODIES[0]  # the camera is by the middle of a wall
    joints = holding(body, "box") + [2.2, 0.2, 0.0]
    state = np.full((1, 25), JointState.TRACKED, np.uint8)
    poses = PoseTable(
        KINECT_V2.name, np.array([0]), np.array([1], np.int32), state, joints[None].astype(np.float32)
    )  # fmt: skip
    sensor = Sensor("rgbd", PinholeCamera(120, 90, 90.0, 90.0, 60.0, 45.0), 1.5, 0.1)
    lights, renderer = room_lighting(scene, np.zeros(2)), open_renderer("raycast")
    shown = []
    for held in (None, np.array([HELD.index("box")], np.uint8)):
        filming = Filming(scene, (body,), poses, sensor, renderer, lights, held=held)
        patch = filming.patch(filming.background(), 0)
        shown.append((patch.picture.instance == PERSON_ID_OFFSET + 1).sum())
    assert shown[1] > shown[0] > 100
