"""What the affordance tasks share: tables of the three labels, and the metrics made of them.

Each label is a yes or no of its own (``hsbench.metrics.multilabel``). Under ``exclusive/`` a cell has one label, the
first of sittable, interactable, walkable, none that holds, in truth and in the answer: the form of published tables.
"""

from __future__ import annotations

import numpy as np

from hsbench.evaluation.confusion import class_cells
from hsbench.evaluation.metric import PooledMetric, mean_of, share
from hsbench.metrics import multilabel
from hsbench.metrics.segmentation import confusion_matrix
from hsbench.tasks.probability_maps import LABELS, THRESHOLD
from hsbench.typing import AnyArray, BoolArray, UInt8Array

NAMES = tuple(label.name.lower() for label in LABELS)
EXCLUSIVE = ("none", "walkable", "interactable", "sittable")  # the later wins
IGNORED = 255


def predicted(probability: AnyArray) -> BoolArray:
    """(3, ...) probabilities -> (3, ...) bool."""
    return np.asarray(probability >= THRESHOLD)


def table_statistics(truth: BoolArray, answer: BoolArray, ignored: BoolArray) -> tuple[int, ...]:
    """tp, fp, fn, tn of each label in turn: 12 counts. Raises SchemaError for arrays that do not fit."""
    return tuple(multilabel.tables(truth, answer, ignored).reshape(-1).tolist())


def exclusive_statistics(truth: BoolArray, answer: BoolArray, ignored: BoolArray) -> tuple[int, ...]:
    """The confusion matrix [truth, answer] of exclusive labels: 16 counts."""
    true = np.where(ignored, IGNORED, _exclusive(truth)).astype(np.uint8)
    table = confusion_matrix(true, _exclusive(answer), len(EXCLUSIVE), ignore=IGNORED)
    return tuple(table.reshape(-1).tolist())


def label_metrics(prefix: str, statistics: str) -> dict[str, PooledMetric]:
    """Mean IoU, and IoU, precision and recall of each label, from ``table_statistics`` of a name."""
    columns = 4 * len(NAMES)
    metrics = {f"{prefix}mean-iou": PooledMetric(statistics, columns, multilabel.mean_iou)}
    for k, name in enumerate(NAMES):
        tp, fp, fn = 4 * k, 4 * k + 1, 4 * k + 2
        metrics[f"{prefix}{name}/iou"] = PooledMetric(statistics, columns, share([tp], [tp, fp, fn]))
        metrics[f"{prefix}{name}/precision"] = PooledMetric(statistics, columns, share([tp], [tp, fp]))
        metrics[f"{prefix}{name}/recall"] = PooledMetric(statistics, columns, share([tp], [tp, fn]))
    return metrics


def exclusive_metrics(statistics: str) -> dict[str, PooledMetric]:
    """Mean IoU of the three labels, IoU of each and of none, and accuracy, from ``exclusive_statistics`` of a name."""
    n = len(EXCLUSIVE)
    ious = {name: class_cells(k, n, n).iou for k, name in enumerate(EXCLUSIVE)}
    of_labels = mean_of([iou for name, iou in ious.items() if name != EXCLUSIVE[0]])
    metrics = {"exclusive/mean-iou": PooledMetric(statistics, n * n, of_labels)}
    metrics |= {f"exclusive/{name}/iou": PooledMetric(statistics, n * n, iou) for name, iou in ious.items()}
    diagonal = [k * (n + 1) for k in range(n)]
    metrics["exclusive/accuracy"] = PooledMetric(statistics, n * n, share(diagonal, range(n * n)))
    return metrics


def _exclusive(planes: BoolArray) -> UInt8Array:
    """(3, ...) bool, as ``LABELS`` -> (...) index into ``EXCLUSIVE``."""
    held = [planes[NAMES.index(name)] * np.uint8(rank) for rank, name in enumerate(EXCLUSIVE) if rank]
    return np.asarray(np.maximum.reduce(held))
