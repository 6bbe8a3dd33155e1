"""The contract of every task: what is asked can be written, read, checked and scored by its primary metric."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench import load
from hsbench.datasets.dataset import Dataset
from hsbench.errors import HsbenchError
from hsbench.evaluation.pooled import recompute
from hsbench.evaluation.score import score
from hsbench.evaluation.scorers import SCORERS, scorer
from hsbench.io.arrays import collect_npz, npz_bytes, read_npz
from hsbench.schema import Episode
from hsbench.submission import (
    Metadata,
    Predictions,
    SubmissionWriter,
    check,
    open_submission,
    prediction_file,
    write_submission,
)
from hsbench.tasks import TASKS, TaskSpec
from hsbench.tasks.object_detection import CLASSES, Boxes
from hsbench.tasks.probability_maps import LABELS
from hsbench.tasks.spec import OBSERVATION_TIMES_S, TRACKS

tasks = pytest.mark.parametrize("spec", TASKS.values(), ids=TASKS)


def takes_long(dataset: str) -> tuple[pytest.MarkDecorator, ...]:
    """All but ``rgbd-activity``, which every test run makes anyway, are generated for these tests alone."""
    return () if dataset == "rgbd-activity" else (pytest.mark.slow,)


with_data = pytest.mark.parametrize(
    "spec", [pytest.param(spec, id=name, marks=takes_long(spec.datasets[0])) for name, spec in TASKS.items()]
)
boards = pytest.mark.parametrize(
    ("spec", "dataset"),
    [
        pytest.param(spec, name, id=f"{spec.name}-{name}", marks=takes_long(name))
        for spec in TASKS.values()
        for name in spec.datasets
    ],
)

INPUTS = {"sensor", "frames.rgb", "frames.depth_m", "frames.timestamp_ns", "poses", "activity_maps"}
"""The inputs of a task; everything else is truth."""

MAY_BE_EMPTY = {
    ("affordance-view", "grid"),  # on the pixels of a picture
    ("action-recognition", "grid"),  # on poses
    ("action-recognition", "observation_times_s"),  # a label belongs to a time of its own
}


def some_boxes(rng: np.random.Generator) -> Boxes:
    n = int(rng.integers(1, 65))
    boxes = np.column_stack([rng.uniform(0, 3, (n, 3)), rng.uniform(0.3, 2, (n, 3)), rng.uniform(-3, 3, n)])
    return Boxes.of(boxes, rng.random(n), rng.choice([0, *(c.category_id for c in CLASSES)], n), 0.3)


RANDOM: dict[str, Callable[[np.random.Generator, Any], Any]] = {
    "scene-completion": lambda rng, like: rng.random(like.shape) < 0.3,
    "object-detection-3d": lambda rng, like: some_boxes(rng),
    "affordance-topdown": lambda rng, like: rng.random(like.shape),
    "affordance-view": lambda rng, like: rng.random(like.shape),
    "action-recognition": lambda rng, like: rng.integers(0, 4, like.shape).astype(np.uint8),
    "scene-reconstruction-360": lambda rng, like: rng.integers(0, 5, like.shape).astype(np.uint8),
}
"""Any prediction of a task's form, from the one that says nothing."""

TRUE: dict[str, Callable[[Any], Any]] = {
    "scene-completion": lambda true: true.solid,
    "object-detection-3d": lambda true: Boxes.of(true.boxes, np.ones(len(true.boxes)), true.labels),
    "affordance-topdown": lambda true: np.stack([true.labels >> label & 1 for label in LABELS]).astype(bool),
    "affordance-view": lambda true: np.stack([true >> label & 1 for label in LABELS]).astype(bool),
    "action-recognition": lambda true: true.action,
    "scene-reconstruction-360": lambda true: true.labels,
}
"""The right answer of a task, from what its scorer takes of an episode's truth."""


def answers(spec: TaskSpec, episode: Episode) -> list[Any]:
    """Nothing, and two that are anything."""
    nothing = spec.dummy(episode)
    rng = np.random.default_rng(0)
    return [nothing, RANDOM[spec.name](rng, nothing), RANDOM[spec.name](rng, nothing)]


def metadata(spec: TaskSpec, track: str) -> Metadata:
    return Metadata(spec.name, spec.version, "template", track, authors=("A. Author",), causal=True)


def same(spec: TaskSpec, a: Any, b: Any) -> bool:
    """Whether two predictions are written alike."""
    return npz_bytes(spec.prediction.encode(a)) == npz_bytes(spec.prediction.encode(b))


@pytest.fixture(name="episode")
def _episode(spec: TaskSpec, data_of: Callable[[str], Path]) -> Episode:
    return load(data_of(spec.datasets[0]), "val", frames=False)[0]


@tasks
def test_the_card_is_complete(spec: TaskSpec) -> None:
    assert TASKS[spec.name] is spec
    for field in dataclasses.fields(spec):
        if (spec.name, field.name) not in MAY_BE_EMPTY:
            assert getattr(spec, field.name) not in (None, "", ()), field.name
    assert spec.direction in ("higher", "lower")
    assert set(spec.inputs) <= INPUTS
    assert len(set(spec.tracks)) == len(spec.tracks)
    assert set(TRACKS) <= set(spec.tracks)
    assert "poses" in spec.tracks  # a track of its own in every task
    assert all(t in TRACKS or t.startswith("oracle-") for t in spec.tracks)
    assert {"no-activity", "shuffled-activity", "best-constant"} <= set(spec.controls)


def test_every_task_has_a_scorer_with_its_primary_metric() -> None:
    assert list(SCORERS) == list(TASKS)
    for name, spec in TASKS.items():
        assert spec.primary_metric in scorer(name).metrics
        assert spec.observation_times_s in (OBSERVATION_TIMES_S[spec.datasets[0]], ())


@with_data
def test_templates_survive_writing_and_reading(spec: TaskSpec, episode: Episode) -> None:
    for answer in answers(spec, episode):
        arrays = spec.prediction.encode(answer)
        assert arrays.keys() == spec.prediction.arrays.keys()
        for name, array in arrays.items():
            assert spec.prediction.arrays[name].fault(array.shape, array.dtype) is None
        assert spec.prediction.faults(arrays) == []
        data = npz_bytes(arrays)
        back = spec.prediction.decode(read_npz(data, spec.prediction.arrays, spec.prediction.max_bytes))
        assert npz_bytes(spec.prediction.encode(back)) == data
        assert type(back) is type(answer)


@tasks
def test_numbers_of_eight_bytes_are_told_by_their_type_and_not_by_their_size(spec: TaskSpec) -> None:
    """The usual mistake, numpy's own default, gets as far as the check of types."""
    shapes = {name: [side or 1 for side in array.shape] for name, array in spec.prediction.arrays.items()}
    data = npz_bytes({name: np.zeros(shape, np.int64) for name, shape in shapes.items()})
    _, faults = collect_npz(data, spec.prediction.arrays, spec.prediction.max_bytes)
    assert len(faults) == len(shapes)
    assert all("dtype is int64; expected " in fault for fault in faults)


@with_data
def test_the_grid_is_that_of_its_data_set(spec: TaskSpec, data_of: Callable[[str], Path]) -> None:
    truth = load(data_of(spec.datasets[0]), truth=True, frames=False)[0].truth
    if spec.name in ("scene-completion", "object-detection-3d", "scene-reconstruction-360"):
        assert truth.occupancy.grid == spec.grid
    elif spec.name == "affordance-topdown":
        assert (truth.affordance.labels.shape, truth.affordance.cell_m) == (spec.grid.shape, spec.grid.cell_m)
    else:
        assert spec.grid is None


def submit(folder: Path, spec: TaskSpec, data: Dataset, track: str, which: int) -> Path:
    write_submission(folder, spec, metadata(spec, track), ((e.episode_id, answers(spec, e)[which]) for e in data))
    return folder


@boards
def test_every_track_is_checked_scored_and_has_the_primary_metric(
    spec: TaskSpec, dataset: str, data_of: Callable[[str], Path], tmp_path: Path
) -> None:
    data = load(data_of(dataset), "val", frames=False)
    for number, track in enumerate(spec.tracks[:3]):
        folder = submit(tmp_path / str(number), spec, data, track, number)
        assert check(folder, spec, data.episode_ids, inputs=data.episode) == []
        report = score(spec.name, folder, data)
        assert (report.task, report.task_version, report.protocol) == (spec.name, spec.version, spec.protocol)
        assert report.primary.name == spec.primary_metric
        assert report.primary.value == report.metrics[spec.primary_metric].value
        assert report.primary.value is not None
        assert 0 <= report.primary.value < 0.9
        assert report.method.track == track
        assert recompute(report) == []
    for track in spec.tracks:
        SubmissionWriter(tmp_path / "t", spec, metadata(spec, track), replace=True).finish()
    with pytest.raises(HsbenchError, match="track is 'telepathy'; expected one of"):
        write_submission(tmp_path / "x", spec, metadata(spec, "telepathy"), [])


@boards
def test_truth_as_prediction_is_perfect_and_a_missing_answer_says_nothing(
    spec: TaskSpec, dataset: str, data_of: Callable[[str], Path], tmp_path: Path
) -> None:
    data = load(data_of(dataset), "val", frames=False)
    truths = [(e.episode_id, scorer(spec.name).truth(e)) for e in dataclasses.replace(data, truth=True)]
    right = ((episode_id, TRUE[spec.name](true)) for episode_id, true in truths)
    write_submission(tmp_path / "right", spec, metadata(spec, "poses"), right)
    assert score(spec.name, tmp_path / "right", data).primary.value == 1.0
    write_submission(tmp_path / "none", spec, metadata(spec, "poses"), [])
    missing = score(spec.name, tmp_path / "none", data, allow_missing=True)
    nothing = score(spec.name, submit(tmp_path / "nothing", spec, data, "poses", 0), data)
    assert missing.metrics == nothing.metrics
    assert (missing.counts.missing, nothing.counts.missing) == (len(data), 0)
    assert missing.primary.value == 0.0


@with_data
def test_a_prediction_may_be_given_at_every_observation_time(spec: TaskSpec, episode: Episode, tmp_path: Path) -> None:
    """All but the last have a file of their own; the last is the whole observation."""
    times = spec.observation_times_s
    names = [prediction_file(spec, "ep-0", t) for t in times]
    assert len(set(names)) == len(names)
    assert prediction_file(spec, "ep-0") in (names or [prediction_file(spec, "ep-0")])[-1:]
    given = dict(zip(times or (None,), answers(spec, episode) * 3, strict=False))
    folder = tmp_path / "s"
    with SubmissionWriter(folder, spec, metadata(spec, "poses")) as writer:
        for until_s, answer in given.items():
            writer.add("ep-0", answer, until_s)
    assert check(folder, spec, ["ep-0"]) == []
    with open_submission(folder) as files:
        for until_s, answer in given.items():
            assert same(spec, Predictions(files, spec).get("ep-0", until_s), answer)
