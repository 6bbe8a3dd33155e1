"""Prediction files of the affordance tasks: what fits, and every fault of one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.arrays import npz_bytes
from hsbench.schema import Episode
from hsbench.schema.episode import FrameList
from hsbench.submission import Metadata, check, write_submission
from hsbench.tasks import task
from tests.unit.episode_builders import SENSORS

PLAN, VIEW = task("affordance-topdown"), task("affordance-view")
EPISODE = Episode("ep-0", "timelapse-activity", SENSORS["monocular"], FrameList(), None, 0, 9)
ROWS, COLUMNS = 18, 24


def metadata(name: str) -> Metadata:
    return Metadata(name, "0", "maps", "frames")


def test_the_numbers_of_the_specification() -> None:
    assert (PLAN.grid.shape, PLAN.grid.cell_m) == ((256, 256), 0.05)
    assert PLAN.observation_times_s == (60, 120, 300, 600, 1800, 3600)
    assert VIEW.observation_times_s == tuple(3600 * h for h in (0.25, 0.5, 1, 2, 4, 8, 12))
    assert (PLAN.datasets, VIEW.datasets) == (("activity-360",), ("timelapse-activity", "activity-360"))
    assert VIEW.on("activity-360").observation_times_s == PLAN.observation_times_s
    assert VIEW.on("timelapse-activity") == VIEW.on("my-office") == VIEW
    assert PLAN.primary_metric == VIEW.primary_metric == "mean-iou"


@pytest.mark.parametrize(("spec", "shape"), [(PLAN, (3, 256, 256)), (VIEW, (3, ROWS, COLUMNS))])
def test_binary_maps_and_probabilities_are_written_alike(spec, shape: tuple[int, ...]) -> None:
    yes = np.random.default_rng(0).random(shape) < 0.5
    for maps in (yes, yes.astype(np.float64)):
        arrays = spec.prediction.encode(maps)
        assert arrays["probability"].dtype == np.float32
        assert np.array_equal(spec.prediction.decode(arrays), yes)
    assert spec.prediction.encode(spec.dummy(EPISODE))["probability"].shape == shape


@pytest.mark.parametrize(
    ("maps", "words"),
    [
        (np.zeros((3, 4, 4), np.uint8), "prediction is uint8; expected bool or floats"),
        (np.zeros((4, 4)), r"prediction has shape \(4, 4\)"),
        (np.full((3, 4, 4), 1.5), "probability of walkable spans 1.5 .. 1.5; expected 0..1"),
        (np.full((3, 4, 4), np.nan), "probability of walkable spans nan"),
        ([[0.5]], "prediction is list"),
    ],
)
def test_what_are_no_maps_is_refused(maps: object, words: str) -> None:
    with pytest.raises(SchemaError, match=words):
        VIEW.prediction.encode(maps)


def test_faults_of_a_file(tmp_path: Path) -> None:
    maps = np.zeros((3, ROWS, COLUMNS))
    write_submission(tmp_path / "s", VIEW, metadata(VIEW.name), [("ep-0", maps)])
    inputs = {"ep-0": EPISODE}.__getitem__
    assert check(tmp_path / "s", VIEW, ["ep-0"], inputs=inputs) == []
    write_submission(tmp_path / "s", VIEW, metadata(VIEW.name), [("ep-0", maps.swapaxes(1, 2))], replace=True)
    (line,) = check(tmp_path / "s", VIEW, ["ep-0"], inputs=inputs)
    assert line == (
        "predictions/ep-0.npz: array 'probability' is of (24, 18) pixels; expected (18, 24) (rows and columns swapped?)"
    )
    assert check(tmp_path / "s", VIEW, ["ep-0"]) == []  # without inputs a size cannot be judged
    wrong = np.zeros((3, ROWS, COLUMNS), np.float32)
    wrong[0, 0, 0], wrong[2, 3, 4] = 2, -1
    (tmp_path / "s" / "predictions" / "ep-0.npz").write_bytes(npz_bytes({"probability": wrong}))
    lines = check(tmp_path / "s", VIEW, ["ep-0"], inputs=inputs)
    assert [line.partition(" spans ")[0] for line in lines] == [
        "predictions/ep-0.npz: probability of walkable",
        "predictions/ep-0.npz: probability of interactable",
    ]


def test_a_plan_of_another_size_is_a_fault(tmp_path: Path) -> None:
    write_submission(tmp_path / "s", PLAN, metadata(PLAN.name), [("ep-0", np.zeros((3, 128, 128)))])
    (line,) = check(tmp_path / "s", PLAN, ["ep-0"])
    assert "array 'probability': shape is (3, 128, 128); expected (3, 256, 256)" in line
