"""People go out and come back, fetch things, and keep nobody outside."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from hsbench.schema import Scene
from hsbench.schema.states import Action
from hsbench.synth.activities import Life, LifeConfig, live, stream
from hsbench.synth.activities.catalogue import CATALOGUE
from hsbench.synth.activities.life import joined
from hsbench.synth.activities.measures import measure
from hsbench.synth.people.body import J
from hsbench.synth.seeds import Seeds
from hsbench.synth.survey import drawn_scene

NS = 1_000_000_000
CONFIG = LifeConfig(duration_s=200.0, people=2, mode="natural", start_hour=10.0)


@cache
def home() -> Scene:
    return drawn_scene(4, 0)


def only(*names: str) -> object:
    """The catalogue with but a few activities, short ones."""
    return tuple(replace(a, median_s=15.0, spread=0.1) for a in CATALOGUE if a.name in (*names, "wander"))


@pytest.fixture
def outgoing(monkeypatch: pytest.MonkeyPatch) -> Life:
    monkeypatch.setattr("hsbench.synth.activities.person.CATALOGUE", only("go_out"))
    return live(home(), Seeds(3), CONFIG)


def events(life: Life, *names: str) -> list[int]:
    return [k for k, name in enumerate(life.events.activity) if name in names]


def test_who_has_left_is_not_there_until_coming_back(outgoing: Life) -> None:
    life, gaps = outgoing, 0
    for person in (1, 2):
        times = life.poses.timestamp_ns[life.poses.track_id == person]
        passing = [k for k in events(life, "enter", "leave") if life.events.person_id[k] == person]
        names = [life.events.activity[k] for k in passing]
        assert names == ["enter", "leave"] * (len(names) // 2) + ["enter"] * (len(names) % 2)
        for first, second in pairwise(passing):
            between = (times > life.events.end_ns[first]) & (times < life.events.start_ns[second])
            if life.events.activity[first] == "leave":
                assert not between.any()
                gaps += 1
            else:
                assert between.any()
    assert gaps >= 1


def test_the_door_is_open_while_one_leaves_and_shut_afterwards(outgoing: Life) -> None:
    life = outgoing
    for k in events(life, "leave"):
        assert home().object(int(life.events.object_id[k])).category_name == "door"
        middle = int(life.events.start_ns[k] + life.events.end_ns[k]) // 2
        assert max(abs(move[2]) for (_, part), move in life.motions.moves_at(middle).items() if part) > 1.0
        after = int(life.events.end_ns[k]) + 2 * NS
        if after < life.poses.timestamp_ns[-1] and not any(
            life.events.start_ns[j] <= after for j in events(life, "enter", "leave") if j > k
        ):
            assert (
                max([abs(move[2]) for (_, part), move in life.motions.moves_at(after).items() if part], default=0.0)
                < 1e-2
            )


def test_nobody_is_met_by_who_goes_and_comes(outgoing: Life) -> None:
    found = measure(home(), outgoing)
    assert found.met == 0
    assert max(found.stuck_s) <= 10.0


def test_the_same_comings_and_goings_whatever_the_blocks(outgoing: Life, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hsbench.synth.activities.person.CATALOGUE", only("go_out"))
    again = joined(list(stream(home(), Seeds(3), CONFIG, 37.0)))
    assert np.array_equal(again.poses.joints_m, outgoing.poses.joints_m)  # type: ignore[arg-type]
    assert np.array_equal(again.poses.timestamp_ns, outgoing.poses.timestamp_ns)
    assert np.array_equal(again.action, outgoing.action)


def test_what_is_fetched_is_carried_before_the_belly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hsbench.synth.activities.person.CATALOGUE", only("fetch"))
    life = live(home(), Seeds(2), replace(CONFIG, duration_s=120.0))
    carried = events(life, "carry")
    assert carried
    assert life.poses.joints_m is not None
    for k in carried:
        rows = (life.poses.track_id == life.events.person_id[k]) & (
            (life.poses.timestamp_ns >= life.events.start_ns[k]) & (life.poses.timestamp_ns <= life.events.end_ns[k])
        )
        joints = life.poses.joints_m[rows]
        middle = joints[len(joints) // 2]
        hands = middle[[J["hand_left"], J["hand_right"]]]
        assert np.linalg.norm(hands[0] - hands[1]) < 0.45
        assert (np.linalg.norm(hands[:, :2] - middle[J["spine_mid"], :2], axis=1) < 0.6).all()
        assert set(life.action[rows]) == {Action.STAND}
        person = life.events.person_id[k]
        before = [j for j in events(life, "fetch") if life.events.person_id[j] == person and j < k]
        assert life.events.end_ns[before[-1]] <= life.events.start_ns[k]


@pytest.mark.parametrize("seed", range(4, 8))
def test_nobody_at_work_keeps_another_outside_for_long(seed: int) -> None:
    config = LifeConfig(duration_s=90.0, people=3, mode="natural", start_hour=18.5, arrival_s=(2.0, 5.0))
    life = live(home(), Seeds(seed), config)
    assert len(life.bodies) == 3
    assert max(life.events.start_ns[k] for k in events(life, "enter")) < 60 * NS
