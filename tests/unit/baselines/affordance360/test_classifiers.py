"""Classifiers of poses: each tells apart what can be told apart; their training sample is even and repeatable."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsbench.baselines.affordance360 import classifiers
from hsbench.baselines.affordance360.classifiers import METHODS, samples
from hsbench.baselines.method import Settings
from hsbench.errors import DataError
from hsbench.schema import Episode, PoseTable
from hsbench.schema.states import Action
from tests.unit.baselines.lived_rooms import lived, lived_in

pytest.importorskip("sklearn")

BLOCK = 60  # poses that a person does one thing


def ordered(number: int) -> Episode:
    """A lived-in room in which people do one thing after the other for seconds."""
    episode = lived("activity-360", number)
    assert episode.truth is not None
    assert episode.truth.poses is not None
    assert episode.poses is not None
    action = episode.truth.poses.action
    rows = np.concatenate([np.flatnonzero(action == a)[:BLOCK] for a in (1, 2, 3)])
    stamps = np.arange(len(rows), dtype=np.int64) * 100_000_000

    def picked(poses: PoseTable) -> PoseTable:
        return PoseTable(
            poses.skeleton, stamps, poses.track_id[rows], poses.joint_state[rows],
            None if poses.joints_m is None else poses.joints_m[rows],
            None if poses.joints_px is None else poses.joints_px[rows],
        )  # fmt: skip

    true = replace(
        episode.truth.poses, poses=picked(episode.truth.poses.poses), action=action[rows], match=np.arange(len(rows))
    )
    return replace(episode, poses=picked(episode.poses), truth=replace(episode.truth, poses=true))


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    train = lived_in([ordered(k) for k in range(4)], tmp_path, truth=True)
    return Settings(lived_in([ordered(9)], tmp_path), train)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_each_tells_figures_apart_and_says_the_same_again(settings: Settings, method: object) -> None:
    assert method in METHODS
    episode = ordered(9)
    assert episode.truth is not None
    assert episode.truth.poses is not None
    said, again = (METHODS[METHODS.index(method)].prepare(settings)(episode) for _ in range(2))  # type: ignore[arg-type]
    assert np.array_equal(said, again)
    assert (said == episode.truth.poses.action).mean() > 0.9
    assert episode.poses is not None
    nobody = replace(episode, truth=None, poses=episode.poses.select(np.zeros(len(episode.poses), bool)))
    assert len(METHODS[0].prepare(settings)(nobody)) == 0


def test_the_sample_is_even_over_actions_and_episodes(settings: Settings) -> None:
    features, actions = samples(settings, "svm-linear", 40)
    assert np.bincount(actions)[1:].tolist() == [40, 40, 40]  # 10 of each action of each episode
    assert len(features) == len(actions) == 120
    again, _ = samples(settings, "svm-linear", 40)
    assert np.array_equal(features, again, equal_nan=True)
    other, _ = samples(replace(settings, seed=1), "svm-linear", 40)
    assert not np.array_equal(features, other, equal_nan=True)


def test_where_train_knows_one_action_it_is_the_answer_and_none_is_refused(tmp_path: Path) -> None:
    episode = ordered(0)
    assert episode.truth is not None
    assert episode.truth.poses is not None

    def doing(action: Action) -> Settings:
        assert episode.truth is not None
        assert episode.truth.poses is not None
        true = replace(episode.truth.poses, action=np.full_like(episode.truth.poses.action, action))
        train = lived_in([replace(episode, truth=replace(episode.truth, poses=true))], tmp_path, truth=True)
        return Settings(train, train)

    assert (METHODS[0].prepare(doing(Action.SIT))(ordered(1)) == Action.SIT).all()
    with pytest.raises(DataError, match="no observed pose whose action is known"):
        METHODS[0].prepare(doing(Action.IGNORED))


def test_without_the_package_the_extra_is_named(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "sklearn.impute", None)
    with pytest.raises(ImportError, match=r"hsbench\[learn\]"):
        classifiers.METHODS[0].prepare(settings)
