"""An import is whole or leaves nothing: whatever stops it, and wherever."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.datasets.faults import dataset_faults
from hsbench.datasets.importers import capture_set
from hsbench.datasets.importers.capture_set import add_capture, add_captures
from hsbench.errors import DataError, SchemaError
from hsbench.io.checksums import manifest
from hsbench.io.locks import sole_writer
from hsbench.schema import Episode
from hsbench.schema.episode import Frame, FrameList
from tests.unit.episode_builders import SENSORS, poses


class Stopping(Sequence[Frame]):
    """Frames of which one raises an error: a damaged picture, or Ctrl-C while it is read."""

    def __init__(self, error: BaseException) -> None:
        self.error = error
        self.timestamps_ns = np.arange(3, dtype=np.int64)

    def __len__(self) -> int:
        return 3

    def __getitem__(self, index: int) -> Frame:
        if index == 2:
            raise self.error
        return Frame(index, rgb=np.zeros((18, 24, 3), np.uint8))


def episode(name: str, frames: object = None, dataset: str = "lab") -> Episode:
    end_ns = int(poses().timestamp_ns[-1])
    return Episode(name, dataset, SENSORS["monocular"], frames or FrameList(), poses(), 0, end_ns)  # type: ignore[arg-type]


STOPS = [DataError("damaged"), KeyboardInterrupt(), OSError(28, "No space left on device")]
of_any_kind = pytest.mark.parametrize("error", STOPS, ids=lambda error: type(error).__name__)


@of_any_kind
@pytest.mark.parametrize("made", ["", "lab", "new/deep/lab"])
def test_a_stopped_import_leaves_no_new_data_set(error: BaseException, made: str, tmp_path: Path) -> None:
    base = tmp_path / "base"
    base.mkdir()
    with pytest.raises(type(error)):
        add_captures(base / made, [episode("a"), episode("b", Stopping(error))])
    assert list(base.iterdir()) == []


@of_any_kind
def test_a_stopped_import_leaves_an_older_data_set_as_it_was(error: BaseException, tmp_path: Path) -> None:
    add_capture(tmp_path / "lab", episode("old"))
    before = manifest(tmp_path)
    with pytest.raises(type(error)):
        add_captures(tmp_path / "lab", [episode("a"), episode("b", Stopping(error))])
    assert manifest(tmp_path) == before


def test_a_stop_while_the_index_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(root: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(capture_set, "write_index", stopped)
    with pytest.raises(KeyboardInterrupt):
        add_capture(tmp_path / "lab", episode("a"))
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_already_stays(tmp_path: Path) -> None:
    out = tmp_path / "lab"
    add_capture(out, episode("a"))
    before = manifest(out)
    with pytest.raises(DataError, match="exists already"):
        add_captures(out, [episode("b"), episode("a")])
    with pytest.raises(DataError, match="holds data set 'lab'; expected 'other'"):
        add_capture(out, episode("c", dataset="other"))
    with sole_writer(out), pytest.raises(DataError, match="another run is writing"):
        add_capture(out, episode("c"))
    assert manifest(out) == before
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("mine")
    with pytest.raises(DataError, match="is not empty"):
        add_capture(tmp_path / "full", episode("a"))
    with pytest.raises(DataError, match="lies inside of the data set"):
        add_capture(out / "more", episode("a"))
    assert [p.name for p in (tmp_path / "full").iterdir()] == ["thesis.tex"]
    assert manifest(out) == before


def test_what_is_added_is_sound_and_one_place_is_one_scene(tmp_path: Path) -> None:
    out = tmp_path / "lab"
    out.mkdir()
    add_capture(out, episode("alone"))
    add_captures(out, [episode("a"), episode("b")], "kitchen")
    assert [fault for found in dataset_faults(out) for fault in found] == []
    data = load(out)
    assert (data.episode_ids, data.scene_ids) == (("a", "alone", "b"), ("kitchen", "alone", "kitchen"))
    with pytest.raises(SchemaError, match="episode_id"):
        replace(data[0], episode_id="no id")
