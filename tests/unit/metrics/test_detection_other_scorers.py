"""Foreign protocols against what their own scorers say: pycocotools live, the others from a file of their runs."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench.metrics.detection import PROTOCOLS, Predictions, Truths, score
from tests.unit.metrics.detection_samples import coco_numbers, coco_objects, sample2d

RUNS = json.loads((Path(__file__).parents[2] / "reference" / "detection_other_scorers.json").read_text("utf-8"))


def sides(difficult: bool, depth: bool) -> tuple[list[Truths], list[Predictions]]:
    truths, predictions = [], []
    for scene in RUNS["scenes"]:
        t = np.array(scene["truths"]).reshape(-1, 9)
        p = np.array(scene["detections"]).reshape(-1, 9)
        truths.append(
            Truths(
                t[:, :6],
                t[:, 6].astype(int),
                t[:, 7] > 0 if difficult else None,
                measure=t[:, 8] if depth else None,
            )
        )
        predictions.append(Predictions(p[:, :6], p[:, 7], p[:, 6].astype(int), p[:, 8] if depth else None))
    return truths, predictions


def test_every_foreign_protocol_is_compared_here_and_says_so() -> None:
    compared = {"voc", "sunrgbd", "class-agnostic", "omni3d", "coco"}
    assert compared == {name for name in PROTOCOLS if name != "hsbench"}
    assert all(PROTOCOLS[name].verified for name in compared)
    assert all(name in RUNS for name in compared - {"coco"})


def test_voc_as_mmdet3d() -> None:
    got = score(*sides(False, False), "voc", (0.25, 0.5))
    values = RUNS["voc"]["values"]
    for c in got.per_class:
        ap, recall = values[f"{c.label}_AP_{c.iou:.2f}"], values[f"{c.label}_rec_{c.iou:.2f}"]
        if ap is None:  # predicted, never true: NaN there, and so is its mean of all classes
            assert c.ap is None
            assert c.label in got.labels_without_truth
            assert values["mAP_0.25"] is None
        else:
            assert c.ap == pytest.approx(ap, abs=1e-7)  # float32 there
            assert c.recall == pytest.approx(recall, abs=1e-12)
    assert {c.label for c in got.per_class} == set(range(5))


def test_sunrgbd_as_its_toolbox() -> None:
    got = {c.label: c for c in score(*sides(True, False), "sunrgbd").per_class}
    for label, ap, recall, hits, false in RUNS["sunrgbd"]["values"]:
        assert got[label].ap == pytest.approx(ap, abs=1e-12)
        assert got[label].recall == pytest.approx(recall, abs=1e-12)
        assert (got[label].hits, got[label].false) == (hits, false)


def test_class_agnostic_as_its_toolbox() -> None:
    run = RUNS["class-agnostic"]
    got = score(*sides(False, False), "class-agnostic")
    assert got.iou == pytest.approx(run["thresholds"])
    for name in ("precision", "recall", "label_precision", "label_recall"):
        assert [getattr(p, name) for p in got.pairs] == pytest.approx(run[name], abs=1e-12)


def test_omni3d_as_its_evaluator() -> None:
    got = score(*sides(True, True), "omni3d").summary
    assert list(got) == list(RUNS["omni3d"]["values"])
    assert got == pytest.approx(RUNS["omni3d"]["values"], abs=1e-12)
    unknown = score(*sides(True, False), "omni3d").summary
    assert {name for name, value in unknown.items() if value is None} == {"APn", "APm", "APf", "ARn", "ARm", "ARf"}


def as_pycocotools(summary: Any) -> list[float]:
    return [-1.0 if value is None else value for value in summary.values()]


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize("crowd", [0.0, 0.15])
@pytest.mark.parametrize("classes", [1, 6])
def test_coco_as_pycocotools(classes: int, crowd: float, ties: bool) -> None:
    pytest.importorskip("pycocotools")
    for seed in range(4):
        truths, predictions = sample2d(seed, 25, classes=classes, crowd=crowd, ties=ties)
        expected = coco_numbers(*coco_objects(truths, predictions, classes))
        got = score(truths, predictions, "coco").summary
        assert as_pycocotools(got) == pytest.approx(expected, abs=1e-12)


def test_coco_beyond_a_hundred_boxes_and_on_equal_iou() -> None:
    pytest.importorskip("pycocotools")
    rng = np.random.default_rng(0)
    truths, predictions = [], []
    for n, m in ((8, 130), (70, 300), (0, 5), (5, 0)):  # whole pixels: many equal overlaps and exact thresholds
        t, p = (np.concatenate([rng.integers(0, 9, (k, 2)), rng.integers(2, 5, (k, 2))], axis=1) for k in (n, m))
        truths.append(Truths(t, np.zeros(n, int)))
        predictions.append(Predictions(p, rng.integers(0, 50, m) / 50, np.zeros(m, int)))
    got = score(truths, predictions, "coco")
    assert as_pycocotools(got.summary) == pytest.approx(coco_numbers(*coco_objects(truths, predictions, 1)), abs=1e-12)
    assert got.over_limit == 230


def test_coco_ignores_difficult_truths_as_pycocotools_would_if_it_kept_the_flag() -> None:
    cocoeval = pytest.importorskip("pycocotools.cocoeval")

    class Keeping(cocoeval.COCOeval):  # type: ignore[misc]
        def _prepare(self) -> None:
            kept = {a["id"]: a["ignore"] for a in self.cocoGt.dataset["annotations"]}
            super()._prepare()
            for here in self._gts.values():
                for a in here:
                    a["ignore"] = a["ignore"] or kept[a["id"]]

    truths, predictions = sample2d(9, 30, classes=3, crowd=0.1, difficult=0.3)
    with contextlib.redirect_stdout(io.StringIO()):
        run = Keeping(*coco_objects(truths, predictions, 3), "bbox")
        run.evaluate()
        run.accumulate()
        run.summarize()
    got = score(truths, predictions, "coco")
    assert as_pycocotools(got.summary) == pytest.approx(run.stats.tolist(), abs=1e-12)
