"""Published metric examples with their numbers: segmentation (mmdet3d) and completion (a real SSCNet prediction).

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from hsbench.metrics import completion, segmentation, semantic_completion

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
EXPECTED = REALDATA / "metrics" / "expected.json"
PREDICTION = REALDATA / "ssc" / "derived_sscnet_nyu0001_gt_pred_60x36x60.npz"
pytestmark = pytest.mark.skipif(
    not (EXPECTED.is_file() and PREDICTION.is_file()), reason=f"needs the examples in {REALDATA} (set HSBENCH_REALDATA)"
)


def expected(prefix: str) -> dict:
    table = json.loads(EXPECTED.read_text(encoding="utf-8"))
    return next(value for name, value in table.items() if name.startswith(prefix))


def test_segmentation_of_mmdet3d() -> None:
    example = expected("mmdet3d seg_eval")
    truth, prediction = np.array(example["gt"]), np.array(example["pred"])
    # its label 4 is void in truth; where it is predicted, the true class is missed
    got = segmentation.score(segmentation.confusion_matrix(truth, prediction, 4, ignore=4, no_answer=4), "cityscapes")
    assert got.iou == pytest.approx(tuple(example["iou"]), abs=1e-7)
    assert got.mean_iou == pytest.approx(example["miou"], abs=1e-7)
    assert got.pixel_accuracy == pytest.approx(example["acc"], abs=1e-12)
    assert got.mean_class_accuracy == pytest.approx(example["acc_cls"], abs=1e-12)


def test_completion_of_sscnet_on_nyu0001() -> None:
    example = expected("sscnet NYU0001")
    with np.load(PREDICTION, allow_pickle=False) as arrays:
        truth, prediction = arrays["gt"], arrays["pred"]
    plain = completion.aggregate([completion.score(truth, prediction, protocol="monoscene")])
    for name in ("precision", "recall", "iou"):
        assert round(getattr(plain, name), 3) == example[name], name
    semantic = semantic_completion.score(truth, prediction, protocol="monoscene", n_classes=12)
    ious = semantic_completion.aggregate([semantic]).class_iou
    classes = {"ceiling": 1, "floor": 2, "wall": 3, "furniture": 10, "objects": 11}
    assert {name: round(ious[classes[name] - 1], 3) for name in example["class_iou"]} == example["class_iou"]
