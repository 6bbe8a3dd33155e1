"""Published detection examples with their published numbers (review_object_detection_metrics, MIT).

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench.metrics.average_precision import RULES
from hsbench.metrics.detection import Predictions, Truths, score

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
METRICS = REALDATA / "metrics"
pytestmark = pytest.mark.skipif(not METRICS.is_dir(), reason=f"needs {METRICS} (set HSBENCH_REALDATA)")


@pytest.fixture(scope="module")
def expected() -> dict[str, Any]:
    whole = json.loads((METRICS / "expected.json").read_text("utf-8"))
    return {name.split(" ")[0]: values for name, values in whole.items()}


def rows(path: Path) -> np.ndarray:
    return np.array([[float(x) for x in line.split()[1:]] for line in path.read_text("utf-8").splitlines()])


@pytest.mark.parametrize("threshold", ["0.1", "0.3", "0.5", "0.75"])
def test_seven_pictures_under_voc(expected: dict[str, Any], threshold: str) -> None:
    truths, predictions = [], []
    for path in sorted((METRICS / "rodm_test_case_1" / "gts").iterdir()):
        one_more = np.array([0, 0, 1, 1])  # both border pixels count there
        truths.append(Truths(rows(path) + one_more))
        found = rows(METRICS / "rodm_test_case_1" / "dets" / path.name)
        predictions.append(Predictions(found[:, 1:] + one_more, found[:, 0]))
    (got,) = score(truths, predictions, "voc", float(threshold)).overall
    values = expected["rodm_test_case_1"]
    assert got.ranking.ap(RULES["area"]) == pytest.approx(values["every_point_AP"][threshold], abs=1e-9)
    assert got.ranking.ap(RULES["voc11"]) == pytest.approx(values["eleven_point_AP"][threshold], abs=1e-9)


def test_coco_sample(expected: dict[str, Any]) -> None:
    whole = json.loads((METRICS / "rodm_coco_sampled_gts_bbox_area.json").read_text("utf-8"))
    found = json.loads((METRICS / "rodm_coco_sampled_bbox_results.json").read_text("utf-8"))["annotations"]
    images = sorted(image["id"] for image in whole["images"])
    truths, predictions = [], []
    for image in images:
        there = [a for a in whole["annotations"] if a["image_id"] == image]
        here = [d for d in found if d["image_id"] == image]
        truths.append(
            Truths(
                np.array([a["bbox"] for a in there], dtype=float).reshape(-1, 4),
                np.array([a["category_id"] for a in there], dtype=int),
                crowd=np.array([bool(a.get("iscrowd", 0)) for a in there], dtype=bool),
                measure=np.array([a["area"] for a in there], dtype=float),
            )
        )
        predictions.append(
            Predictions(
                np.array([d["bbox"] for d in here], dtype=float).reshape(-1, 4),
                np.array([d["score"] for d in here], dtype=float),
                np.array([d["category_id"] for d in here], dtype=int),
            )
        )
    assert score(truths, predictions, "coco").summary == pytest.approx(expected["rodm_coco_sampled"], abs=1e-6)
