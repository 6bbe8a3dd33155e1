"""The prediction file of task object-detection-3d: what numpy alone would write, and every fault of one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.arrays import npz_bytes
from hsbench.schema import category
from hsbench.submission import Metadata, Predictions, check, open_submission, write_submission
from hsbench.tasks import task
from hsbench.tasks.object_detection import ARRAYS, Boxes, faults

SPEC = task("object-detection-3d")
CHAIR, RUG = category("chair").category_id, category("rug").category_id
METADATA = Metadata(SPEC.name, SPEC.version, "boxes", "poses")


def two() -> Boxes:
    return Boxes.of([[1, 0, 0.5, 1, 1, 1, 0.3], [2, 1, 0.5, 1, 2, 1, -3]], [0.9, 0.2], [CHAIR, 0], 0.25)


def test_boxes_survive_a_submission(tmp_path: Path) -> None:
    write_submission(tmp_path / "s", SPEC, METADATA, [("ep-0", two()), ("ep-1", Boxes.none())])
    assert check(tmp_path / "s", SPEC, ["ep-0", "ep-1"]) == []
    with open_submission(tmp_path / "s") as files:
        read = Predictions(files, SPEC).get("ep-0")
    for name in ARRAYS:
        assert np.array_equal(getattr(read, name), getattr(two(), name))


def test_every_fault_is_named_with_its_row(tmp_path: Path) -> None:
    write_submission(tmp_path / "s", SPEC, METADATA, [("ep-0", two())])
    wrong = SPEC.prediction.encode(two())
    wrong["boxes"][1, 4] = 0.0
    wrong["scores"][0] = 1.5
    wrong["category_ids"][1] = RUG
    wrong["operating_score"][0] = -1
    (tmp_path / "s" / "predictions" / "ep-0.npz").write_bytes(npz_bytes(wrong))
    lines = check(tmp_path / "s", SPEC, ["ep-0"])
    assert [line.partition(": ")[0] for line in lines] == ["predictions/ep-0.npz"] * 4
    for line, words in zip(
        lines, ("boxes row 1: [2.0, 1.0, 0.5, 1.0, 0.0, 1.0, -3.0]", "scores row 0: 1.5", "row 1", "-1.0"), strict=True
    ):
        assert words in line


def test_too_many_boxes_and_lists_of_other_lengths() -> None:
    many = {**SPEC.prediction.encode(two()), "boxes": np.ones((65, 7), np.float32)}
    lines = faults(many)
    assert lines[0].startswith("65 boxes; expected at most 64")
    assert "array 'scores' has 2 rows for 65 boxes" in lines[1]
    assert "array 'category_ids' has 2 rows for 65 boxes" in lines[2]
    assert len(faults({**many, "boxes": np.zeros((10_000, 7), np.float32)})) == 3 + 64


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([[0, 0, 0, 1, 1, -1, 0]], [0.5]), "boxes row 0: "),
        (([[0, 0, np.nan, 1, 1, 1, 0]], [0.5]), "boxes row 0"),
        (([[0, 0, 0, 1, 1, 1]], [0.5]), r"boxes: shape is \(1, 6\)"),
        (([[0, 0, 0, 1, 1, 1, 0]], [np.nan]), "scores row 0"),
        (([[0, 0, 0, 1, 1, 1, 0]], [0.5, 0.5]), "2 rows for 1 boxes"),
    ],
)
def test_boxes_that_are_none_cannot_be_made(arguments: tuple, words: str) -> None:
    with pytest.raises(SchemaError, match=words):
        Boxes.of(*arguments)


def test_encode_wants_boxes() -> None:
    with pytest.raises(SchemaError, match="prediction is ndarray; expected"):
        SPEC.prediction.encode(np.zeros((0, 7)))
