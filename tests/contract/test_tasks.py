"""The contract of every task: what is asked can be written, read, checked and scored by its primary metric."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.errors import HsbenchError
from hsbench.evaluation.score import score
from hsbench.io.arrays import npz_bytes, read_npz
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
from hsbench.tasks.spec import TRACKS

tasks = pytest.mark.parametrize("spec", TASKS.values(), ids=TASKS)

INPUTS = {"sensor", "frames.rgb", "frames.depth_m", "frames.timestamp_ns", "poses", "activity_maps"}
"""The inputs of a task; everything else is truth."""


def templates(spec: TaskSpec) -> list[np.ndarray]:
    """Predictions of a task's form: empty, full, and anything in between."""
    rng = np.random.default_rng(0)
    return [np.zeros(spec.grid.shape, bool), np.ones(spec.grid.shape, bool), rng.random(spec.grid.shape) < 0.3]


def metadata(spec: TaskSpec, track: str) -> Metadata:
    return Metadata(spec.name, spec.version, "template", track, authors=("A. Author",), causal=True)


@tasks
def test_the_card_is_complete(spec: TaskSpec) -> None:
    assert TASKS[spec.name] is spec
    for field in dataclasses.fields(spec):
        assert getattr(spec, field.name) not in (None, "", ()), field.name
    assert spec.direction in ("higher", "lower")
    assert set(spec.inputs) <= INPUTS
    assert len(set(spec.tracks)) == len(spec.tracks)
    assert set(TRACKS) <= set(spec.tracks)
    assert "poses" in spec.tracks  # a track of its own in every task
    assert all(t in TRACKS or t.startswith("oracle-") for t in spec.tracks)
    assert {"no-activity", "shuffled-activity", "best-constant"} <= set(spec.controls)


@tasks
def test_templates_survive_writing_and_reading(spec: TaskSpec) -> None:
    for grid in templates(spec):
        arrays = spec.prediction.encode(grid)
        assert arrays.keys() == spec.prediction.arrays.keys()
        for name, array in arrays.items():
            assert spec.prediction.arrays[name].fault(array.shape, array.dtype) is None
        data = npz_bytes(arrays)
        back = spec.prediction.decode(read_npz(data, spec.prediction.arrays, spec.prediction.max_bytes))
        assert back.dtype == grid.dtype
        assert np.array_equal(back, grid)


@tasks
def test_the_grid_is_that_of_its_data_set(spec: TaskSpec, rgbd: Path) -> None:
    if spec.dataset != "rgbd-activity":
        pytest.skip("no shared data set of this kind")
    assert load(rgbd, truth=True, frames=False)[0].truth.occupancy.grid == spec.grid
    assert min(t for t in spec.observation_times_s) < 12


@tasks
def test_every_track_is_checked_scored_and_has_the_primary_metric(spec: TaskSpec, rgbd: Path, tmp_path: Path) -> None:
    if spec.dataset != "rgbd-activity":
        pytest.skip("no shared data set of this kind")
    data = load(rgbd, "val", frames=False)
    for track, grid in zip(spec.tracks, templates(spec) * 2, strict=False):
        folder = tmp_path / track.replace("+", "-")
        write_submission(folder, spec, metadata(spec, track), ((i, grid) for i in data.episode_ids))
        assert check(folder, spec, data.episode_ids) == []
        report = score(folder, spec, data)
        assert (report.task, report.task_version, report.protocol) == (spec.name, spec.version, spec.protocol)
        assert report.primary.name == spec.primary_metric
        assert report.primary.value == report.metrics[spec.primary_metric].value
        assert report.primary.value is not None
        assert 0 <= report.primary.value <= 1
        assert report.method.track == track
    with pytest.raises(HsbenchError, match="track is 'telepathy'; expected one of"):
        write_submission(tmp_path / "x", spec, metadata(spec, "telepathy"), [])


@tasks
def test_a_prediction_may_be_given_at_every_observation_time(spec: TaskSpec, tmp_path: Path) -> None:
    """All but the last have a file of their own; the last is the whole observation."""
    names = [prediction_file(spec, "ep-0", t) for t in spec.observation_times_s]
    assert len(set(names)) == len(names)
    assert names[-1] == prediction_file(spec, "ep-0")
    grids = dict(zip(spec.observation_times_s, templates(spec) * 3, strict=False))
    folder = tmp_path / "s"
    with SubmissionWriter(folder, spec, metadata(spec, "poses")) as writer:
        for until_s, grid in grids.items():
            writer.add("ep-0", grid, until_s)
    assert check(folder, spec, ["ep-0"]) == []
    with open_submission(folder) as files:
        for until_s, grid in grids.items():
            assert np.array_equal(Predictions(files, spec).get("ep-0", until_s), grid)
