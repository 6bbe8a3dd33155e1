"""Every method of every task end to end: checked, scored, and each control has the property it is named for."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lived_rooms import lived, lived_in

from hsbench import Evaluator, load
from hsbench.baselines.method import Method, Settings
from hsbench.baselines.registry import METHODS, find
from hsbench.baselines.run import predict
from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError, SchemaError
from hsbench.io.arrays import npz_bytes
from hsbench.submission import Predictions, check, open_submission
from hsbench.tasks import TASKS, task

ON_RGBD = ("object-detection-3d",)
ON_LIVED = ("affordance-topdown", "affordance-view", "action-recognition", "scene-reconstruction-360")


def takes_long(name: str) -> tuple[pytest.MarkDecorator, ...]:
    """Volumes of three million voxels."""
    return (pytest.mark.slow,) if name == "scene-reconstruction-360" else ()


EVERY = [
    pytest.param(method, id=f"{name}-{method.name}", marks=takes_long(name))
    for name in ON_RGBD + ON_LIVED
    for method in METHODS[name].values()
]
every_task = pytest.mark.parametrize("name", [pytest.param(n, marks=takes_long(n)) for n in ON_RGBD + ON_LIVED])


@pytest.fixture(scope="module")
def data(rgbd: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Dataset, Dataset]]:
    """Task -> (train, data to answer)."""
    nowhere = tmp_path_factory.mktemp("nowhere")

    def rooms(name: str) -> tuple[Dataset, Dataset]:
        return tuple(lived_in([lived(name, k) for k in numbers], nowhere) for numbers in ((0, 1, 2), (10, 11)))

    on_360 = rooms("activity-360")
    return {
        **dict.fromkeys(ON_RGBD, (load(rgbd, "train"), load(rgbd, "val"))),
        **dict.fromkeys(ON_LIVED, on_360),
        "affordance-view": rooms("timelapse-activity"),
    }


Answers = dict[str, Any]


@pytest.fixture(scope="module")
def answered(data: dict[str, tuple[Dataset, Dataset]], tmp_path_factory: pytest.TempPathFactory) -> Any:
    """(task, method) -> predictions by episode id, from a submission that passed its check; made when asked for."""
    made: dict[tuple[str, str], Answers] = {}

    def of(task_name: str, name: str) -> Answers:
        if (task_name, name) not in made:
            train, asked = data[task_name]
            folder = tmp_path_factory.mktemp("p") / name
            spec = task(task_name)
            assert tuple(predict(METHODS[task_name][name], asked, folder, train=train)) == asked.episode_ids
            assert check(folder, spec, asked.episode_ids, inputs=asked.episode) == []
            with open_submission(folder) as files:
                stored = Predictions(files, spec)
                made[task_name, name] = {i: stored.get(i) for i in asked.episode_ids}
        return made[task_name, name]

    return of


def value(task_name: str, answers: Answers, asked: Dataset) -> float | None:
    evaluator = Evaluator(task_name)
    for episode in dataclasses.replace(asked, truth=True):
        evaluator.add(episode, answers[episode.episode_id])
    return evaluator.metrics()[task(task_name).primary_metric].value


def shuffled(task_name: str) -> list[Method]:
    """The shuffled controls of a task."""
    return [method for method in METHODS[task_name].values() if method.control == "shuffled-activity"]


def written(task_name: str, answer: Any) -> bytes:
    return npz_bytes(task(task_name).prediction.encode(answer))


# ---------------------------------------------------------------- registry


def test_every_task_has_every_control_and_methods_that_the_controls_belong_to() -> None:
    assert list(METHODS) == list(TASKS)
    for name, methods in METHODS.items():
        assert all((method.task, key) == (name, method.name) for key, method in methods.items())
        assert {m.control for m in methods.values() if m.control} == set(TASKS[name].controls)
        shuffled = [m for m in methods.values() if m.control == "shuffled-activity"]
        for control in shuffled:
            assert control.track == methods[control.name.removesuffix("-shuffled")].track
        assert all(m.needs_train for m in methods.values() if m.control == "best-constant")


def test_a_method_is_found_by_name_and_task() -> None:
    assert find("carve", "rgbd-activity") is METHODS["scene-completion"]["carve"]
    assert find("carve", "one's own") is METHODS["scene-completion"]["carve"]
    assert find("traces", "timelapse-activity") is METHODS["affordance-view"]["traces"]
    assert find("best-constant", "x", "action-recognition") is METHODS["action-recognition"]["best-constant"]
    with pytest.raises(DataError, match=r"several tasks: affordance-topdown, .*; name one with --task"):
        find("traces", "activity-360")
    with pytest.raises(DataError, match=r"method 'carve' is unknown; expected one of cuboids, .* for task object-det"):
        find("carve", "rgbd-activity", "object-detection-3d")
    with pytest.raises(DataError, match="method 'crave' is unknown; expected one of carve"):
        find("crave", "rgbd-activity")
    with pytest.raises(SchemaError, match="task 'detection' is unknown"):
        find("stops", "rgbd-activity", "detection")


def test_a_method_fits_its_task() -> None:
    good = METHODS["affordance-topdown"]["traces"]
    with pytest.raises(SchemaError, match="track is 'telepathy'"):
        dataclasses.replace(good, track="telepathy")
    with pytest.raises(SchemaError, match="control is 'luck'"):
        dataclasses.replace(good, control="luck")


# ---------------------------------------------------------------- end to end


@pytest.mark.parametrize("method", EVERY)
def test_answers_pass_their_check_and_have_a_score(method: Method, data: Any, answered: Any) -> None:
    found = value(method.task, answered(method.task, method.name), data[method.task][1])
    assert found is not None
    assert 0.0 <= found <= 1.0


@every_task
def test_a_constant_is_the_same_for_all_and_a_shuffled_answer_is_another(name: str, answered: Any) -> None:
    constant = answered(name, "best-constant")
    if name == "action-recognition":  # as many labels as poses
        assert len({label for answer in constant.values() for label in np.unique(answer)}) == 1
    else:
        assert len({written(name, answer) for answer in constant.values()}) == 1
    for method in shuffled(name):
        usual, other = answered(name, method.name.removesuffix("-shuffled")), answered(name, method.name)
        assert all(written(name, usual[i]) != written(name, other[i]) for i in usual)


@pytest.mark.parametrize("name", [pytest.param(n, marks=takes_long(n)) for n in ON_LIVED])
def test_activity_says_more_than_any_control(name: str, data: Any, answered: Any) -> None:
    """In rooms that are what their people do, activity tells much, and all else what rooms have in common."""
    asked = data[name][1]
    ours = value(name, answered(name, "pose" if name == "action-recognition" else "traces"), asked)
    others = [value(name, answered(name, m.name), asked) for m in METHODS[name].values() if m.control]
    assert ours > max(others) + 0.1


@pytest.mark.parametrize("method", [p for p in EVERY if p.values[0].needs_train])
def test_fitted_methods_need_train_and_no_method_sees_truth_of_what_it_answers(method: Method, data: Any) -> None:
    train, asked = data[method.task]
    with pytest.raises(DataError, match="is fitted on split train, which this data set lacks"):
        method.prepare(Settings(asked, None))
    assert not method.oracle
    predictor = method.prepare(Settings(asked[:2], dataclasses.replace(train, truth=True)))
    bare = asked[0]
    assert bare.truth is None
    assert predictor(bare) is not None


@every_task
def test_shuffling_takes_another_episode_and_follows_its_seed(name: str, data: Any) -> None:
    train, asked = data[name]
    train = dataclasses.replace(train, truth=True)
    for method in shuffled(name):
        with pytest.raises(DataError, match="poses of another episode; found 1 episode"):
            method.prepare(Settings(asked[:1], train))
        first, again = (method.prepare(Settings(asked, train))(asked[0]) for _ in range(2))
        assert written(name, first) == written(name, again)


@pytest.mark.parametrize(
    ("name", "method", "lacks", "words"),
    [
        ("affordance-topdown", "traces", "poses", "no observed poses"),
        ("affordance-view", "colours", "frames", "no picture"),
        ("object-detection-3d", "components", "frames", "no depth"),
        ("object-detection-3d", "cuboids-alone", "frames", "no depth"),
        ("object-detection-3d", "stops", "poses", "no observed poses"),
        ("action-recognition", "pose", "poses", "no observed poses"),
    ],
)
def test_what_a_method_lacks_is_named(name: str, method: str, lacks: str, words: str, data: Any) -> None:
    from hsbench.schema.episode import FrameList

    train, asked = data[name]
    answer = METHODS[name][method].prepare(Settings(asked, dataclasses.replace(train, truth=True)))
    less = dataclasses.replace(asked[0], **{lacks: None if lacks == "poses" else FrameList()})
    with pytest.raises(DataError, match=words):
        answer(less)
    with pytest.raises(DataError, match="lacks the truth of"):
        METHODS[name]["best-constant"].prepare(Settings(asked, asked))


def test_poses_of_both_kinds_and_pictures_of_both_kinds_are_answered(rgbd: Path, data: Any) -> None:
    """Action recognition takes a Kinect's poses in metres too, and the view of a 360 camera is its whole panorama."""
    train = load(rgbd, "train", truth=True)
    for episode in load(rgbd, "val"):
        for method in METHODS["action-recognition"].values():
            answer = method.prepare(Settings(load(rgbd, "val"), train))(episode)
            assert answer.shape == (len(episode.poses),)
            assert set(np.unique(answer)) <= {1, 2, 3}
    views, _ = data["affordance-view"]
    _, panoramas = data["affordance-topdown"]
    for method in METHODS["affordance-view"].values():
        answer = method.prepare(Settings(panoramas, dataclasses.replace(views, truth=True)))(panoramas[0])
        assert answer.shape == (3, 256, 512)
