"""Sitting on what is no seat: the floor, edges and arms; and side steps to seats without room to turn."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from living_rooms import living_room

from hsbench.schema import Part, Scene
from hsbench.schema.states import Action
from hsbench.synth.activities import Life, LifeConfig, live
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.measures import measure
from hsbench.synth.activities.odd_seats import floor_places, odd_surfaces
from hsbench.synth.activities.sidling import STEP_M, sidle
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.motion import sit_down
from hsbench.synth.seeds import Seeds
from hsbench.synth.survey import drawn_scene
from hsbench.truth.sittable import SEAT_ROLES
from hsbench.truth.walkable import walk_map

FPS = 30.0


def body(seed: int = 0) -> Body:
    return Body.sample(np.random.default_rng(seed))


@cache
def home() -> Scene:
    return drawn_scene(4, 0)


@cache
def odd_life() -> Life:
    """Every contact is followed by a sit on what is no seat."""
    return live(home(), Seeds(1), LifeConfig(duration_s=240.0, atypical_share=1.0, touches_seated=0))


def role_of(scene: Scene, life: Life, event: int) -> str | None:
    item = scene.object(int(life.events.object_id[event]))
    return next(part.role for part in item.parts if part.name == life.events.part[event])


def test_floors_edges_and_arms_are_offered_and_seats_are_not() -> None:
    found = odd_surfaces(home())
    assert "floor" in {s.item.category_name for s in found}
    assert any(s.part.role == "top" for s in found)
    assert any(s.part.name.startswith("armrest") for s in found)
    assert all(s.part.role not in SEAT_ROLES for s in found)


@pytest.mark.parametrize("seed", range(3))
def test_who_sits_on_the_floor_is_on_it_within_joint_limits_with_something_behind(seed: int) -> None:
    scene, who = living_room(0), body(seed)
    walk, obstacles = walk_map(scene), Obstacles.of(scene)
    surfaces = [s for s in odd_surfaces(scene) if s.item.category_name == "floor"]
    poses = [place for s in surfaces for place in floor_places(s, who, walk, obstacles)]
    assert poses
    for place in poses[:: max(1, len(poses) // 8)]:
        pelvis = np.array(place.pelvis_m)
        ahead = np.array([np.cos(place.yaw_rad), np.sin(place.yaw_rad), 0.0])
        assert obstacles.block(pelvis, pelvis - ahead)
        start = standing(who, np.mean(place.balls_m, axis=0)[:2], place.yaw_rad)
        down = sit_down(start, place, 2.4, FPS)
        joints = pose(who, down, FPS, None)
        assert limit_violations(joints).max() == 0.0
        assert np.allclose(joints[-1, J["spine_base"]], pelvis, atol=1e-3)
        assert np.allclose(joints[-1, [J["foot_left"], J["foot_right"]]], place.balls_m, atol=2e-3)
        assert joints[:, :, 2].min() > -0.02


def test_an_empty_room_without_walls_has_nothing_to_lean_on() -> None:
    scene = living_room(0)
    bare = replace(scene, objects=tuple(o for o in scene.objects if o.category_name == "floor"))
    (surface, *_) = odd_surfaces(bare)
    assert list(floor_places(surface, body(), walk_map(bare), Obstacles.of(bare))) == []


def test_odd_sits_follow_contacts_and_keep_the_promises() -> None:
    life = odd_life()
    sits = [k for k, name in enumerate(life.events.activity) if name == "sit"]
    odd = [k for k in sits if role_of(home(), life, k) not in SEAT_ROLES]
    found = measure(home(), life)
    assert len(odd) >= 2
    assert found.atypical == len(odd)
    assert found.deep < 0.01 * found.frames
    assert max(found.seat_error_m) < 0.03
    assert found.over_limit == 0


def test_none_sits_oddly_if_none_is_to() -> None:
    life = live(home(), Seeds(1), LifeConfig(duration_s=60.0, atypical_share=0.0))
    assert measure(home(), life).atypical == 0


def test_odd_sits_are_actions_of_sitting() -> None:
    life = odd_life()
    for k, name in enumerate(life.events.activity):
        if name == "sit":
            times = life.poses.timestamp_ns
            rows = (times >= life.events.start_ns[k]) & (times <= life.events.end_ns[k])
            assert set(life.action[rows]) <= {Action.SIT, Action.INTERACT}


def test_floors_of_triangles_are_sat_on_too() -> None:
    scene = living_room(0)
    meshed = tuple(
        replace(o, parts=tuple(Part(p.name, p.colour, p.role, mesh=(p.vertices, p.triangles)) for p in o.parts))
        for o in scene.objects
    )
    scene = replace(scene, objects=meshed)
    floors = [s for s in odd_surfaces(scene) if s.item.category_name == "floor"]
    walk, obstacles = walk_map(scene), Obstacles.of(scene)
    assert any(True for s in floors for _ in floor_places(s, body(), walk, obstacles))


@settings(max_examples=30, deadline=None)
@given(yaw=st.floats(-3.0, 3.0), x=st.floats(-0.8, 0.8), y=st.floats(-0.8, 0.8), seed=st.integers(0, 20))
def test_side_steps_arrive_with_the_heading_kept_and_feet_that_do_not_cross(
    yaw: float, x: float, y: float, seed: int
) -> None:
    who, goal = body(seed), np.array([x, y])
    line = sidle(who, standing(who, np.zeros(2), yaw), goal, FPS)
    assert np.allclose(line.xy[-1], goal)
    assert (line.yaw == line.yaw[0]).all()
    left = np.array([-np.sin(yaw), np.cos(yaw)])
    apart = (line.feet.ball[:, 0, :2] - line.feet.ball[:, 1, :2]) @ left
    assert apart.min() > 0.0
    assert np.abs(np.diff(line.xy, axis=0)).max() < 2.5 * STEP_M / (0.55 * FPS)
