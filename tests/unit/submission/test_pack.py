"""Writing a submission and reading the same back, as folder and as zip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import DataError, SchemaError, SubmissionError
from hsbench.submission import (
    Metadata,
    Predictions,
    SubmissionWriter,
    check,
    open_submission,
    read_metadata,
    write_submission,
)
from tests.unit.submission.submitted import EPISODES, GRID, METADATA, TASK, as_zip, sound


def test_what_is_written_is_read_as_folder_and_as_zip(tmp_path: Path) -> None:
    with SubmissionWriter(tmp_path / "s", TASK, METADATA) as writer:
        writer.add("ep-1", GRID)
        writer.add("ep-1", ~GRID, until_s=5)
        writer.add("ep-2", GRID, until_s=120)  # the last time is the whole observation
    names = ("predictions/ep-1.npz", "predictions/ep-1@5s.npz", "predictions/ep-2.npz", "submission.json")
    for path in (tmp_path / "s", as_zip(tmp_path / "s")):
        with open_submission(path) as files:
            assert files.names == names
            assert files.faults == ()
            predictions = Predictions(files, TASK)
            assert np.array_equal(predictions.get("ep-1"), GRID)
            assert np.array_equal(predictions.get("ep-1", 5.0), ~GRID)
            assert np.array_equal(predictions.get("ep-2", 120.0), GRID)
            assert predictions.get("ep-2", 5.0) is None
            assert predictions.get("ep-3") is None
            assert read_metadata(files.read("submission.json"), TASK) == (METADATA, [])


def test_the_same_predictions_give_the_same_bytes(tmp_path: Path) -> None:
    one, two = sound(tmp_path / "one"), sound(tmp_path / "two", EPISODES[::-1])
    for file in one.rglob("*.*"):
        assert file.read_bytes() == (two / file.relative_to(one)).read_bytes()
    assert check(one, TASK, EPISODES) == check(two, TASK, EPISODES) == []


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    def predictions():
        yield "ep-1", GRID
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_submission(tmp_path / "s", TASK, METADATA, predictions())
    assert list(tmp_path.iterdir()) == []


def test_an_error_while_a_submission_is_open_stays_what_it_is(tmp_path: Path) -> None:
    folder = sound(tmp_path / "s")
    (folder / "predictions" / "ep-1.npz").write_bytes(b"x")
    for path in (folder, as_zip(folder)):
        with open_submission(path) as files, pytest.raises(DataError, match=r"^predictions/ep-1\.npz: not a zip"):
            Predictions(files, TASK).get("ep-1")
        error = DataError("of another file")
        with pytest.raises(DataError, match=r"^of another file$"), open_submission(path):
            raise error


def test_finish_without_with(tmp_path: Path) -> None:
    writer = SubmissionWriter(tmp_path / "s", TASK, METADATA)
    writer.add("ep-1", GRID)
    assert not (tmp_path / "s").exists()
    writer.finish()
    assert check(tmp_path / "s", TASK, ["ep-1"]) == []
    with pytest.raises(DataError, match="exists already"):
        SubmissionWriter(tmp_path / "s", TASK, METADATA)
    with SubmissionWriter(tmp_path / "s", TASK, METADATA, replace=True) as again:
        again.add("ep-2", GRID)
    assert check(tmp_path / "s", TASK, ["ep-2"]) == []


def test_refusals_name_the_mistake(tmp_path: Path) -> None:
    with SubmissionWriter(tmp_path / "s", TASK, METADATA) as writer:
        writer.add("ep-1", GRID)
        with pytest.raises(SchemaError, match="added before"):
            writer.add("ep-1", GRID, until_s=120.0)
        with pytest.raises(SchemaError, match="until_s is 7; expected one of 5, 15, 120 s"):
            writer.add("ep-2", GRID, until_s=7)
        with pytest.raises(SchemaError, match=r"episode_id is '\.\./x'"):
            writer.add("../x", GRID)
        with pytest.raises(SchemaError, match=r"episode ep-2: prediction has shape \(3, 2\)"):
            writer.add("ep-2", GRID.T)
    with pytest.raises(SubmissionError, match="track is 'magic'; expected one of poses, frames"):
        SubmissionWriter(tmp_path / "t", TASK, Metadata("toy", "0", "m", "magic"))
    assert [p.name for p in tmp_path.iterdir()] == ["s"]
