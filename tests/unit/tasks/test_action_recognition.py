"""The prediction file of task action-recognition: one label a pose, and every fault of one."""

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
from tests.unit.episode_builders import SENSORS, poses

SPEC = task("action-recognition")
EPISODE = Episode("ep-0", "rgbd-activity", SENSORS["rgbd"], FrameList(), poses(n=6), 0, 10**9)
INPUTS = {"ep-0": EPISODE}.__getitem__
METADATA = Metadata(SPEC.name, SPEC.version, "labels", "poses")


def test_one_answer_for_the_whole_observation_on_two_boards() -> None:
    assert SPEC.datasets == ("activity-360", "rgbd-activity")
    assert SPEC.observation_times_s == ()
    assert SPEC.primary_metric == "macro-f1"


def test_labels_survive_and_the_dummy_fits(tmp_path: Path) -> None:
    for labels in (np.array([1, 2, 3, 0, 1, 1], np.uint8), SPEC.dummy(EPISODE)):
        write_submission(tmp_path / "s", SPEC, METADATA, [("ep-0", labels)], replace=True)
        assert check(tmp_path / "s", SPEC, ["ep-0"], inputs=INPUTS) == []
        assert np.array_equal(SPEC.prediction.decode(SPEC.prediction.encode(labels)), labels)


def test_faults_of_a_file(tmp_path: Path) -> None:
    write_submission(tmp_path / "s", SPEC, METADATA, [("ep-0", np.ones(5, np.uint8))])
    file = tmp_path / "s" / "predictions" / "ep-0.npz"
    (line,) = check(tmp_path / "s", SPEC, ["ep-0"], inputs=INPUTS)
    assert line == "predictions/ep-0.npz: array 'action' has 5 labels; expected 6, one an observed pose"
    file.write_bytes(npz_bytes({"action": np.array([1, 9, 9, 4, 0, 1], np.uint8)}))
    lines = check(tmp_path / "s", SPEC, ["ep-0"], inputs=INPUTS)
    assert len(lines) == 2
    assert "action row 3: 4, in 1 rows" in lines[0]
    assert "action row 1: 9, in 2 rows" in lines[1]
    file.rename(file.with_name("ep-0@5s.npz"))
    lines = check(tmp_path / "s", SPEC, ["ep-0"], inputs=INPUTS)
    assert any("no times apart" in line for line in lines)


@pytest.mark.parametrize("labels", [np.ones(6), np.ones((6, 1), np.uint8), [1, 2], np.full(6, 7, np.uint8)])
def test_encode_refuses_what_are_no_labels(labels: object) -> None:
    with pytest.raises(SchemaError, match="expected"):
        SPEC.prediction.encode(labels)
