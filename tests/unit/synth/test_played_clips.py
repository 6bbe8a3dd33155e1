"""A person's own motion capture within a life."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from living_rooms import living_room

from hsbench.schema.states import Action
from hsbench.synth.activities import Life, LifeConfig, live, stream
from hsbench.synth.activities.catalogue import CATALOGUE
from hsbench.synth.activities.life import joined
from hsbench.synth.people.body import Body
from hsbench.synth.people.bvh import Clip, on_body
from hsbench.synth.people.channels import concatenate, pose, standing
from hsbench.synth.people.motion import reach, walk
from hsbench.synth.seeds import Seeds

CLIP_FPS = 60.0


@cache
def clip() -> Clip:
    """Somebody else raises a hand, takes two steps and turns."""
    who = Body.sample(np.random.default_rng(3))
    start = standing(who, np.array([5.0, 5.0]), 0.7)
    up = reach(start, 1, np.array([5.2, 5.2, 1.6]), 0.0, 0.0, 1.0, CLIP_FPS)
    way = np.array([[5.0, 5.0], [5.3, 5.25]])
    chunks = [up, up.backwards(), walk(who, start, way, 2.0, 0.6, CLIP_FPS)]
    return Clip(pose(who, concatenate(chunks), CLIP_FPS, None), CLIP_FPS)


def config() -> LifeConfig:
    return LifeConfig(duration_s=90.0, people=2, mode="natural", clips=(clip(),))


@pytest.fixture
def life(monkeypatch: pytest.MonkeyPatch) -> Life:
    monkeypatch.setattr(
        "hsbench.synth.activities.person.CATALOGUE", tuple(a for a in CATALOGUE if a.name in ("wander", "stand"))
    )
    return live(living_room(1), Seeds(2), config())


def rows_of(life: Life, event: int) -> np.ndarray:
    times = life.poses.timestamp_ns
    within = (times >= life.events.start_ns[event]) & (times <= life.events.end_ns[event])
    return np.flatnonzero(within & (life.poses.track_id == life.events.person_id[event]))


def apart(joints: np.ndarray) -> np.ndarray:
    """Distances of all pairs of joints: a pose, whatever its place and heading."""
    return np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)


def test_the_clip_is_played_on_the_persons_own_body_at_the_lifes_rate(life: Life) -> None:
    played = [k for k, name in enumerate(life.events.activity) if name == "play_clip"]
    assert played
    assert life.poses.joints_m is not None
    compared = 0
    for k in played:
        rows = rows_of(life, k)
        body = life.bodies[int(life.events.person_id[k]) - 1]
        expected = on_body(body, clip().joints)[::2]  # 60 frames a second to 30
        inner = slice(20, max(min(len(rows), len(expected)) - 20, 20))  # none where the life ends in the first steps
        compared += inner.stop - inner.start
        assert abs(len(rows) - len(expected)) <= 1 or rows[-1] == len(life.poses) - 1
        assert np.abs(apart(life.poses.joints_m[rows][inner]) - apart(expected[inner])).max(initial=0.0) < 2e-3
        assert set(life.action[rows]) == {Action.STAND}
    assert compared > len(clip().joints) / 2


def test_nobody_jumps_into_or_out_of_a_clip(life: Life) -> None:
    assert life.poses.joints_m is not None
    for person in (1, 2):
        pelvis = life.poses.joints_m[life.poses.track_id == person][:, 0]
        assert np.linalg.norm(np.diff(pelvis, axis=0), axis=1).max() * 30 < 2.0


def test_the_same_clips_whatever_the_blocks(life: Life) -> None:
    again = joined(list(stream(living_room(1), Seeds(2), config(), 11.0)))
    assert np.array_equal(again.poses.joints_m, life.poses.joints_m)  # type: ignore[arg-type]


def test_a_clip_without_room_is_not_played_and_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hsbench.synth.activities.person.CATALOGUE", tuple(a for a in CATALOGUE if a.name == "wander"))
    far = clip().joints.copy()
    far[:, :, 0] += np.linspace(0.0, 30.0, len(far))[:, None]
    life = live(living_room(1), Seeds(2), LifeConfig(duration_s=40.0, mode="natural", clips=(Clip(far, CLIP_FPS),)))
    assert "play_clip" not in life.events.activity
    assert (1, "play_clip", "there is no room for the clip") in life.undone
