"""Segmentation with several labels a pixel: one 2x2 table a label.

Task
----
A pixel may be walkable and interactable at once, or nothing. Each label is a yes or no of its own, in truth and in the
prediction, and may be unknown (ignored) where other labels are known.

Conventions
-----------
``truth``, ``prediction`` and ``ignored`` are bool arrays (L, ...), one plane a label; ``ignored`` may also be one plane
(...) for all labels. A table is the row tp, fp, fn, tn in int64; tables of scenes and of chunks add up.

Metrics
-------
Per label: IoU = tp / (tp + fp + fn), precision = tp / (tp + fp), recall = tp / (tp + fn), None without a denominator.
Mean IoU over the labels whose IoU is defined; the others are counted. Pooled over scenes by adding tables first.

Differences from other scorers
------------------------------
* A score on *exclusive* labels (one winner a pixel, the source's table form) makes a pixel that is two things right in
  one and wrong in the other: lower IoU for the label that loses. Here nothing is exclusive.
* sklearn.metrics.multilabel_confusion_matrix holds the same four numbers as [[tn, fp], [fn, tp]]; its jaccard_score
  gives 0 where neither has a label. Here that is None: means are higher.
* Per-image averages of many multi-label scorers weigh an image with one such pixel like one with a thousand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.labels import check_bool, check_counts
from hsbench.metrics.segmentation import mean_defined
from hsbench.metrics.tables import Counts, count
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class MultiLabelScore:
    """Counts of every label, their ratios, and the mean IoU; None = undefined."""

    labels: tuple[Counts, ...]
    iou: tuple[float | None, ...]
    mean_iou: float | None
    undefined_labels: int


def tables(truth: BoolArray, prediction: BoolArray, ignored: BoolArray | None = None) -> IntArray:
    """Count every label of one scene.

    truth, prediction: (L, ...) bool. ignored: (L, ...) or (...) bool, True where truth is unknown.
    Returns (L, 4) int64 tp, fp, fn, tn. Raises SchemaError for arrays that do not fit.
    """
    check_bool(truth, "truth")
    if truth.ndim < 2 or not len(truth):
        raise SchemaError(f"truth has shape {truth.shape}; expected (labels, ...) (one label? add an axis)")
    check_bool(prediction, "prediction", truth.shape)
    if ignored is not None:
        planes = truth.shape[1:] if np.ndim(ignored) == truth.ndim - 1 else truth.shape
        check_bool(ignored, "ignored", planes)
        ignored = np.broadcast_to(ignored, truth.shape)
    rows = []
    for label in range(len(truth)):
        counts = count(truth[label], prediction[label], None if ignored is None else ~ignored[label])
        rows.append((counts.tp, counts.fp, counts.fn, counts.tn))
    return np.array(rows, dtype=np.int64)


def planes(bits: AnyArray, labels: Sequence[int]) -> BoolArray:
    """(...) unsigned bit field -> (L, ...) bool; labels: bit numbers, as ``schema.states.Affordance``."""
    if not isinstance(bits, np.ndarray) or bits.dtype.kind != "u":
        raise SchemaError(f"bits is {getattr(bits, 'dtype', type(bits).__name__)}; expected unsigned integers")
    width = 8 * bits.dtype.itemsize
    if not all(0 <= label < width for label in labels):
        raise SchemaError(f"labels are {list(labels)}; expected bit numbers 0..{width - 1} (a mask 1 << k?)")
    return np.stack([(bits & bits.dtype.type(1 << int(label))) != 0 for label in labels])


def score(label_tables: IntArray) -> MultiLabelScore:
    """Values of the tables of one scene, or of the sum over scenes.

    label_tables: (L, 4) int64 tp, fp, fn, tn. Raises SchemaError for another shape or negative counts.
    """
    rows = check_counts(label_tables, "label_tables", "(labels, 4)")
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise SchemaError(f"label_tables has shape {rows.shape}; expected (labels, 4): tp, fp, fn, tn")
    labels = tuple(Counts(*map(int, row)) for row in rows)
    ious = tuple(label.iou for label in labels)
    return MultiLabelScore(labels, ious, mean_defined(ious), sum(iou is None for iou in ious))


def mean_iou(counts: AnyArray) -> FloatArray:
    """(..., L * 4) flattened tables -> (...) mean IoU, NaN where no label is defined: the form for resampling."""
    flat = np.asarray(counts)
    if not flat.ndim or not flat.shape[-1] or flat.shape[-1] % 4:
        raise SchemaError(f"counts have shape {flat.shape}; expected (..., 4 L) (tables? flatten their last two axes)")
    rows = flat.reshape(*flat.shape[:-1], -1, 4)
    unions = rows[..., :3].sum(axis=-1)
    ious = np.where(unions > 0, rows[..., 0] / np.maximum(unions, 1), 0.0).sum(axis=-1)
    number = (unions > 0).sum(axis=-1)
    return np.asarray(np.where(number > 0, ious / np.maximum(number, 1), np.nan))
