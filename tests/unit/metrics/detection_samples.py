"""Random detections for tests: scenes of boxes, most found with some error, and false ones; and their COCO form."""

from __future__ import annotations

import contextlib
import io
from typing import Any

import numpy as np

from hsbench.metrics.detection import Predictions, Truths
from hsbench.typing import AnyArray


def random_boxes2d(rng: np.random.Generator, n: int) -> AnyArray:
    """(n, 4) x, y, w, h in a 640 x 480 picture, areas of all COCO ranges."""
    size = np.exp(rng.uniform(np.log(8), np.log(300), (n, 2)))
    return np.concatenate([rng.uniform(0, 1, (n, 2)) * (np.array([640, 480]) - size), size], axis=1)


def sample2d(
    seed: int,
    scenes: int,
    per_scene: float = 7.0,
    classes: int = 5,
    false_share: float = 2.0,
    crowd: float = 0.0,
    difficult: float = 0.0,
    ties: bool = False,
) -> tuple[list[Truths], list[Predictions]]:
    """Truths and predictions of ``scenes`` pictures; with ``ties`` scores have two digits."""
    rng = np.random.default_rng(seed)
    truths, predictions = [], []
    for _ in range(scenes):
        n = int(rng.poisson(per_scene))
        boxes, labels = random_boxes2d(rng, n), rng.integers(0, classes, n)
        copies = np.repeat(np.arange(n), rng.integers(0, 4, n))
        found = boxes[copies] + rng.normal(0, 0.08, (len(copies), 4)) * np.tile(boxes[copies, 2:], 2)
        found[:, 2:] = np.maximum(found[:, 2:], 2.0)
        false = random_boxes2d(rng, int(rng.poisson(false_share * per_scene)))
        labels_found = np.where(rng.random(len(copies)) < 0.9, labels[copies], rng.integers(0, classes, len(copies)))
        scores = rng.random(len(found) + len(false))
        truths.append(
            Truths(
                boxes,
                labels,
                rng.random(n) < difficult,
                rng.random(n) < crowd,
                # areas of segments are smaller than those of their boxes
                boxes[:, 2] * boxes[:, 3] * rng.uniform(0.5, 1.0, n),
            )
        )
        predictions.append(
            Predictions(
                np.concatenate([found, false]),
                np.round(scores, 2) if ties else scores,
                np.concatenate([labels_found, rng.integers(0, classes, len(false))]),
            )
        )
    return truths, predictions


def sample3d(
    seed: int, scenes: int, classes: int = 3, difficult: float = 0.2, ties: bool = True
) -> tuple[list[Truths], list[Predictions]]:
    """Upright boxes in rooms: most objects found, some twice, some nearly nested; and false boxes."""
    rng = np.random.default_rng(seed)

    def boxes(n: int) -> AnyArray:
        return np.column_stack(
            [rng.uniform(0, 4, (n, 2)), rng.uniform(0.3, 1.2, n), rng.uniform(0.4, 1.8, (n, 3)), rng.uniform(-4, 4, n)]
        )

    truths, predictions = [], []
    for _ in range(scenes):
        n = int(rng.integers(0, 9))
        things = boxes(n)
        copies = np.repeat(np.arange(n), rng.integers(0, 3, n))
        found = things[copies] + rng.normal(0, 0.08, (len(copies), 7))
        found[:, 3:6] = np.maximum(found[:, 3:6], 0.1)
        all_found = np.concatenate([found, boxes(int(rng.integers(0, 8)))])
        scores = rng.random(len(all_found))
        truths.append(Truths(things, rng.integers(0, classes, n), rng.random(n) < difficult))
        predictions.append(
            Predictions(all_found, np.round(scores, 1) if ties else scores, rng.integers(0, classes, len(all_found)))
        )
    return truths, predictions


def coco_objects(truths: list[Truths], predictions: list[Predictions], classes: int) -> tuple[Any, Any]:
    """The same as pycocotools objects. Difficult truths keep their flag ``ignore``."""
    from pycocotools.coco import COCO

    annotations, results = [], []
    for s, (t, p) in enumerate(zip(truths, predictions, strict=True)):
        for i, box in enumerate(t.boxes):
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": s,
                    "category_id": 0 if t.labels is None else int(t.labels[i]),
                    "bbox": box.tolist(),
                    "area": float(box[2] * box[3] if t.measure is None else t.measure[i]),
                    "iscrowd": int(t.crowd is not None and t.crowd[i]),
                    "ignore": int(t.difficult is not None and t.difficult[i]),
                }
            )
        for i, box in enumerate(p.boxes):
            results.append(
                {
                    "image_id": s,
                    "category_id": 0 if p.labels is None else int(p.labels[i]),
                    "bbox": box.tolist(),
                    "score": float(p.scores[i]),
                }
            )
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO()
        truth.dataset = {
            "info": {},
            "images": [{"id": s} for s in range(len(truths))],
            "categories": [{"id": c} for c in range(classes)],
            "annotations": annotations,
        }
        truth.createIndex()
        return truth, truth.loadRes(results)


def coco_numbers(truth: Any, detections: Any) -> list[float]:
    """pycocotools' 12 numbers."""
    from pycocotools.cocoeval import COCOeval

    with contextlib.redirect_stdout(io.StringIO()):
        run = COCOeval(truth, detections, "bbox")
        run.evaluate()
        run.accumulate()
        run.summarize()
    return [float(x) for x in run.stats]
