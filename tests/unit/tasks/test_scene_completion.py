"""The task's numbers are those of its text, and its prediction format is what numpy alone would write."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.arrays import read_npz
from hsbench.metrics.completion import PROTOCOLS
from hsbench.submission import Metadata, check, write_submission
from hsbench.tasks import TASKS, task

SPEC = task("scene-completion")


def test_the_numbers_of_the_specification() -> None:
    assert (SPEC.version, SPEC.datasets, SPEC.direction) == ("0", ("rgbd-activity",), "higher")
    assert SPEC.grid.shape == (128, 128, 48)
    assert SPEC.grid.voxel_m == 0.05
    low = np.array(SPEC.grid.origin_m)
    assert np.allclose(low, [0, -3.2, 0])
    assert np.allclose(low + 0.05 * np.array(SPEC.grid.shape), [6.4, 3.2, 2.4])
    assert SPEC.observation_times_s == (5, 15, 30, 60, 120)
    assert SPEC.protocol in PROTOCOLS
    assert {"poses", "frames", "poses+frames"} <= set(SPEC.tracks)


def test_unknown_tasks_are_told_the_known() -> None:
    assert list(TASKS) == [
        "scene-completion",
        "object-detection-3d",
        "affordance-topdown",
        "affordance-view",
        "action-recognition",
        "scene-reconstruction-360",
    ]
    with pytest.raises(SchemaError, match="task 'completion' is unknown; expected one of scene-completion"):
        task("completion")


def test_prediction_files_are_plain_packed_bits(tmp_path: Path) -> None:
    grid = np.random.default_rng(0).random((128, 128, 48)) < 0.3
    arrays = SPEC.prediction.encode(grid)
    assert arrays["occupied"].shape == (128, 128, 6)
    assert np.array_equal(arrays["occupied"], np.packbits(grid, axis=-1, bitorder="little"))
    assert np.array_equal(SPEC.prediction.decode(arrays), grid)
    # what a participant writes with numpy alone, without hsbench
    np.savez_compressed(tmp_path / "p.npz", occupied=np.packbits(grid, axis=-1, bitorder="little"))
    read = read_npz(tmp_path / "p.npz", SPEC.prediction.arrays, SPEC.prediction.max_bytes)
    assert np.array_equal(SPEC.prediction.decode(read), grid)


@pytest.mark.parametrize(
    "wrong", [np.zeros((128, 128, 48)), np.zeros((128, 128, 48), np.uint8), np.zeros((128, 128, 6), bool), [True]]
)
def test_encode_refuses_anything_but_a_bool_grid(wrong: object) -> None:
    with pytest.raises(SchemaError, match=r"expected bool \(128, 128, 48\)"):
        SPEC.prediction.encode(wrong)


def test_a_real_submission_passes(tmp_path: Path) -> None:
    metadata = Metadata("scene-completion", "0", "all free", "poses+frames", authors=("A. Author",), causal=True)
    grid = np.zeros(SPEC.grid.shape, bool)
    write_submission(tmp_path / "s", SPEC, metadata, [("ep-0", grid), ("ep-1", ~grid)])
    assert check(tmp_path / "s", SPEC, ["ep-0", "ep-1"]) == []
    assert sum(file.stat().st_size for file in (tmp_path / "s").rglob("*.npz")) < 1000


def test_times_must_ascend() -> None:
    with pytest.raises(SchemaError, match="do not ascend"):
        dataclasses.replace(SPEC, observation_times_s=(5.0, 5.0))
