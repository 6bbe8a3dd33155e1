"""The prediction file of task scene-reconstruction-360."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.arrays import npz_bytes
from hsbench.submission import Metadata, check, write_submission
from hsbench.tasks import task

SPEC = task("scene-reconstruction-360")


def test_labels_survive_and_every_fault_is_named(tmp_path: Path) -> None:
    label = np.random.default_rng(0).integers(0, 5, SPEC.grid.shape).astype(np.uint8)
    assert np.array_equal(SPEC.prediction.decode(SPEC.prediction.encode(label)), label)
    empty = np.zeros(SPEC.grid.shape, np.uint8)
    write_submission(tmp_path / "s", SPEC, Metadata(SPEC.name, "0", "none", "poses"), [("ep-0", empty)])
    assert check(tmp_path / "s", SPEC, ["ep-0"]) == []
    empty[0, 0, :3] = [5, 5, 255]
    (tmp_path / "s" / "predictions" / "ep-0.npz").write_bytes(npz_bytes({"label": empty}))
    lines = check(tmp_path / "s", SPEC, ["ep-0"])
    assert [line.partition(";")[0] for line in lines] == [
        "predictions/ep-0.npz: label 5 in 2 voxels",
        "predictions/ep-0.npz: label 255 in 1 voxels",
    ]


@pytest.mark.parametrize("wrong", [np.zeros((256, 256, 48)), np.zeros((48, 256, 256), np.uint8), [0]])
def test_encode_refuses_anything_but_a_grid_of_labels(wrong: object) -> None:
    with pytest.raises(SchemaError, match=r"expected uint8 \(256, 256, 48\)"):
        SPEC.prediction.encode(wrong)


def test_encode_refuses_unknown_labels() -> None:
    with pytest.raises(SchemaError, match="label 9 in 1 voxels"):
        SPEC.prediction.encode(np.pad(np.full((1, 1, 1), 9, np.uint8), [(0, 255), (0, 255), (0, 47)]))
