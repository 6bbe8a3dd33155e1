"""Action recognition: labels of single poses, and segments of a sequence.

Task
----
Every observed pose has one action in truth (``schema.states.Action``: stand, sit, interact; IGNORED does not count) and
one in the prediction. A prediction may leave a pose without answer, which is wrong.

Conventions
-----------
Labels are integers 0..n-1 in the order of time, one a step. ``confusion`` [truth, prediction] is that of
``segmentation.confusion_matrix``: poses with ignored truth count nowhere; a last column holds missing answers. With
``Action``: ``confusion_matrix(truth, prediction, 4, ignore=0, no_answer=0)``, and ``score`` with classes (1, 2, 3).
A segment is a run of one label. Ignored steps are cut out, and what lies before and after a cut is never joined: a
segment, true or predicted, ends where ignored steps begin.

Metrics of poses
----------------
accuracy = sum of TP / all; per class precision = TP / column, recall = TP / row, F1 = 2 TP / (row + column);
macro F1 = mean F1 over classes that are true or predicted somewhere. Undefined is None and counted. Pooled: matrices of
episodes are added first.

Metrics of segments (C. Lea, M. Flynn, R. Vidal, A. Reiter, G. Hager, *Temporal Convolutional Networks for Action
Segmentation and Detection*, CVPR 2017, section 4)
- edit score = 1 - Levenshtein distance of the two sequences of segment labels / the longer one's length;
- F1@k: in the order of time each predicted segment takes the true segment of its label with the highest IoU (the
  earliest of equals); it is right if that IoU >= k and the segment has not been taken; F1 = 2 TP / (predicted + true).
``background`` leaves the segments of one label out of both. k is .1, .25, .5 in the paper.

Differences from other scorers
------------------------------
* sklearn.metrics.f1_score(average="macro") counts a label that occurs nowhere as 0 if it is listed: lower.
* Lea et al. average edit score and F1 over videos, MS-TCN (Farha and Gall, CVPR 2019) adds TP, FP, FN of all videos
  first. Here pooled F1 is primary and the mean over sequences stands beside; the edit score is a mean.
* Both fail, or give NaN, where truth or prediction has no segment. Here the edit score is None if neither has one, else
  0; F1 is None if neither has one, else 0.
* The published scripts know no ignored steps: on sequences without them the values are equal (``verified_by``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.labels import check_bool, check_labels, chosen_classes
from hsbench.metrics.segmentation import check_matrix, mean_defined, unflattened
from hsbench.metrics.tables import ratio
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray

OVERLAPS = (0.1, 0.25, 0.5)  # Lea et al. 2017, section 4

VERIFIED_BY = "the answers of edit_score and overlap_f1 of Lea et al., tests/reference/segment_scorers.json"


@dataclass(frozen=True)
class ActionScore:
    """Values of one confusion matrix; None = undefined. undefined_classes: neither true nor predicted."""

    accuracy: float | None
    macro_f1: float | None
    precision: tuple[float | None, ...]
    recall: tuple[float | None, ...]
    f1: tuple[float | None, ...]
    undefined_classes: int


@dataclass(frozen=True)
class SegmentCounts:
    """Sufficient statistics of one sequence, or of a sum: the edit distance, and per overlap the right segments.

    longer: number of segments of the longer side. hits: right predicted segments, one value an overlap.
    """

    distance: int
    longer: int
    hits: tuple[int, ...]
    predicted: int
    true: int

    @property
    def edit_score(self) -> float | None:
        """1 - distance / longer, None without any segment."""
        return 1 - self.distance / self.longer if self.longer else None

    @property
    def f1(self) -> tuple[float | None, ...]:
        """F1 at every overlap, None without any segment."""
        return tuple(ratio(2 * hits, self.predicted + self.true) for hits in self.hits)


@dataclass(frozen=True)
class SegmentScore:
    """Several sequences. edit_score: mean over sequences. f1: pooled, one value an overlap. None = undefined.

    undefined_sequences: sequences without any segment, left out of both means.
    """

    overlaps: tuple[float, ...]
    edit_score: float | None
    f1: tuple[float | None, ...]
    f1_over_sequences: tuple[float | None, ...]
    sequences: tuple[SegmentCounts, ...]
    undefined_sequences: int
    verified_by: str = VERIFIED_BY


def score(confusion: AnyArray, classes: Sequence[int] | None = None) -> ActionScore:
    """Values of a matrix of ``segmentation.confusion_matrix``, (n, n) or (n, n + 1) with missing answers.

    classes: those that enter macro F1, default all. Raises SchemaError for what does not fit.
    """
    matrix = check_matrix(confusion)
    n = len(matrix)
    chosen = chosen_classes(classes, n)
    hits = [int(value) for value in np.diagonal(matrix)]
    rows, columns = matrix.sum(axis=1).tolist(), matrix.sum(axis=0).tolist()
    f1 = tuple(ratio(2 * hits[c], rows[c] + columns[c]) for c in range(n))
    return ActionScore(
        accuracy=ratio(sum(hits), sum(rows)),
        macro_f1=mean_defined([f1[c] for c in chosen]),
        precision=tuple(ratio(hits[c], columns[c]) for c in range(n)),
        recall=tuple(ratio(hits[c], rows[c]) for c in range(n)),
        f1=f1,
        undefined_classes=sum(f1[c] is None for c in chosen),
    )


def macro_f1(counts: AnyArray) -> FloatArray:
    """(..., k) flattened confusion matrices -> (...) macro F1, NaN where undefined: the form for resampling.

    k is n^2, or n (n + 1) with missing answers. Raises SchemaError for any other.
    """
    matrices = unflattened(counts)
    sums = matrices.sum(axis=-1) + matrices.sum(axis=-2)[..., : matrices.shape[-2]]
    hits = np.diagonal(matrices, axis1=-2, axis2=-1)
    values = np.where(sums > 0, 2 * hits / np.maximum(sums, 1), 0.0).sum(axis=-1)
    number = (sums > 0).sum(axis=-1)
    return np.asarray(np.where(number > 0, values / np.maximum(number, 1), np.nan))


def segments(labels: AnyArray, ignored: BoolArray | None = None) -> IntArray:
    """(T,) labels of steps -> (K, 3) int64: label, first step, step after the last, of every run; cut at ignored."""
    check_labels(labels, "labels")
    if labels.ndim != 1:
        raise SchemaError(f"labels have shape {labels.shape}; expected (steps,): one sequence at a time")
    if ignored is not None:
        check_bool(ignored, "ignored", labels.shape)
    kept = np.ones(len(labels), dtype=bool) if ignored is None else ~ignored
    changes = np.ones(len(labels) + 1, dtype=bool)
    changes[1:-1] = (labels[1:] != labels[:-1]) | (kept[1:] != kept[:-1])
    limits = np.flatnonzero(changes)
    runs = np.stack([labels[limits[:-1]].astype(np.int64), limits[:-1], limits[1:]], axis=1)
    return np.asarray(runs[kept[limits[:-1]]])


def segment_counts(
    truth: AnyArray,
    prediction: AnyArray,
    *,
    ignore: int | None = None,
    background: int | None = None,
    overlaps: Sequence[float] = OVERLAPS,
) -> SegmentCounts:
    """Compare the segments of one sequence.

    truth, prediction: (T,) integer labels in the order of time. ignore: label of truth whose steps are cut out.
    background: label whose segments do not count. overlaps: IoU thresholds in (0, 1]. Raises SchemaError.
    """
    check_labels(truth, "truth")
    check_labels(prediction, "prediction", truth.shape)
    if not all(0 < k <= 1 for k in overlaps):
        raise SchemaError(f"overlaps are {tuple(overlaps)}; expected thresholds in (0, 1] (percentages?)")
    ignored = None if ignore is None else truth == ignore
    true, predicted = segments(truth, ignored), segments(prediction, ignored)
    if background is not None:
        true, predicted = true[true[:, 0] != background], predicted[predicted[:, 0] != background]
    from hsbench.metrics.kernels import edit_distance

    distance = edit_distance(np.ascontiguousarray(predicted[:, 0]), np.ascontiguousarray(true[:, 0]))
    best, which = _best_overlap(predicted, true)
    # each true segment is taken by the first predicted one that reaches the threshold on it
    hits = tuple(len(np.unique(which[best >= k])) for k in overlaps)
    return SegmentCounts(int(distance), max(len(true), len(predicted)), hits, len(predicted), len(true))


def segment_score(sequences: Sequence[SegmentCounts], overlaps: Sequence[float] = OVERLAPS) -> SegmentScore:
    """Sequences together; overlaps: those the counts were made with. Raises SchemaError where they do not fit."""
    for number, counts in enumerate(sequences):
        if len(counts.hits) != len(overlaps):
            raise SchemaError(f"sequences[{number}] has {len(counts.hits)} overlaps; expected {len(overlaps)}")
    pairs = sum(c.predicted + c.true for c in sequences)
    pooled = tuple(ratio(2 * sum(c.hits[k] for c in sequences), pairs) for k in range(len(overlaps)))
    over = tuple(mean_defined([c.f1[k] for c in sequences]) for k in range(len(overlaps)))
    edits = [c.edit_score for c in sequences]
    return SegmentScore(
        tuple(overlaps), mean_defined(edits), pooled, over, tuple(sequences), sum(edit is None for edit in edits)
    )


def _best_overlap(predicted: IntArray, true: IntArray) -> tuple[FloatArray, IntArray]:
    """(K,) highest IoU of every predicted segment with a true one of its label, 0 without, and (K,) which one."""
    best, which = np.zeros(len(predicted)), np.full(len(predicted), -1, dtype=np.int64)
    for k, (label, start, stop) in enumerate(predicted if len(true) else ()):
        shared = np.minimum(stop, true[:, 2]) - np.maximum(start, true[:, 1])
        spanned = np.maximum(stop, true[:, 2]) - np.minimum(start, true[:, 1])
        ious = np.where(true[:, 0] == label, np.maximum(shared, 0) / spanned, 0.0)
        which[k] = np.argmax(ious)
        best[k] = ious[which[k]]
    return best, which
