"""Segmentation with one label a pixel: confusion matrix, IoU, accuracies, and what an absent class is worth.

Task
----
Every pixel (cell, voxel, point) has one label of 0..n-1 in truth and in a prediction. ``multilabel`` scores tables in
which a pixel may have several labels, ``boundary`` the outlines.

Conventions
-----------
``confusion[t, p]`` counts pixels with truth t and prediction p, in int64: exact up to 9e18. Pixels whose truth is
``ignore`` count nowhere, whatever is predicted there. A prediction may hold one value that means "no answer"
(``no_answer``): such a pixel is missed by its true class and nobody's false positive; it fills a further, last column.
Any other label outside 0..n-1 is an error. Matrices add up: of scenes, of chunks, in any order.

Metrics
-------
With row = sum over p, column = sum over t, TP = diagonal:

- IoU of a class = TP / (row + column - TP); mean IoU = mean over classes, see below;
- frequency-weighted IoU = sum over classes with row > 0 of (row / sum of all) IoU;
- pixel accuracy = sum of TP / sum of all; class accuracy = TP / row, and its mean over classes with row > 0.

Pooled: matrices of all scenes are added first and divided once; this is the primary value. Per scene: each scene has
its own values; their mean over scenes stands beside.

A class without truth. Its IoU is undefined if it is not predicted either; if it is predicted, its IoU is 0. hsbench
leaves undefined classes out of the mean and counts them. Other scorers differ; each rule can be asked for by name:

| ``absent`` | neither true nor predicted | predicted, not true |
|---|---|---|
| ``hsbench``, ``cityscapes`` (mmsegmentation and TorchSSC too) | left out | 0 |
| ``scannet`` | the mean is undefined (its script fails on NaN) | 0 |
| ``semantic-kitti`` (MonoScene, VoxFormer too) | 0 | 0 |
| ``occupancy-for-nuscenes`` | 1 | 1 (it looks at truth only) |
| ``torchmetrics-mean-iou`` | left out (it prints -1 for the class; None here) | 0 |
| ``torchmetrics-jaccard`` (macro) | left out, weight 0 | 0 |
| ``average-precision`` (the mAP of AV2 and nuScenes, applied to IoU; *unverified*) | 0 | 0 |

Differences from other scorers
------------------------------
* One matrix of four classes, one absent, three of mean IoU .7, gives .700, .525 or .775 under left out, 0 or 1.
* sklearn.metrics.confusion_matrix takes every label it meets unless told; here a label out of range is an error. Where
  labels are in range the matrices are equal. Its jaccard_score gives an absent class 0: lower means.
* Cityscapes and ScanNet keep predictions of the void label as false negatives: here this is ``no_answer``.
  semantic-kitti fails on them. torchmetrics refuses them.
* torchmetrics and several benchmarks report the mean over images: images with few classes weigh more. Pooled is
  primary here; either may be higher.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.labels import check_counts, check_integer, check_labels, chosen_classes, out_of_range
from hsbench.typing import AnyArray, FloatArray, IntArray

MAX_CLASSES = 4096
CHUNK = 2**20
MAX_PART = 2**31  # elements a compiled table of uint32 may count


@dataclass(frozen=True)
class AbsentRule:
    """What a class without truth is worth: if it is not predicted either, and if it is.

    None leaves the class out of the mean; ``spoils`` makes the mean undefined instead. verified_by: what the rule was
    compared with, None = unverified.
    """

    unpredicted: float | None
    predicted: float
    verified_by: str | None
    spoils: bool = False


_RUN = "the scorer's own answers, tests/reference/absent_class_scorers.json"

ABSENT_RULES: Mapping[str, AbsentRule] = {
    "hsbench": AbsentRule(None, 0.0, "defined by hsbench"),
    "cityscapes": AbsentRule(None, 0.0, "the published example of mmdetection3d; TorchSSC, run"),
    "scannet": AbsentRule(None, 0.0, _RUN, spoils=True),
    "semantic-kitti": AbsentRule(0.0, 0.0, _RUN),
    "occupancy-for-nuscenes": AbsentRule(1.0, 1.0, _RUN),
    "torchmetrics-mean-iou": AbsentRule(None, 0.0, _RUN),
    "torchmetrics-jaccard": AbsentRule(None, 0.0, _RUN),
    "average-precision": AbsentRule(0.0, 0.0, None),
}
"""Rule names of ``score``; the table in the module's docstring."""


@dataclass(frozen=True)
class SegmentationScore:
    """All values of one confusion matrix; None = undefined.

    iou, class_accuracy: one value a class. undefined_classes: neither true nor predicted; absent_classes: without
    truth, predicted or not. Both count among the classes that enter the means. verified_by: what the rule for absent
    classes was compared with, None = unverified.
    """

    absent: str
    iou: tuple[float | None, ...]
    mean_iou: float | None
    frequency_weighted_iou: float | None
    pixel_accuracy: float | None
    class_accuracy: tuple[float | None, ...]
    mean_class_accuracy: float | None
    undefined_classes: int
    absent_classes: int
    verified_by: str | None


@dataclass(frozen=True)
class ScenesScore:
    """Scores of several scenes: pooled (the primary one), each scene, and the mean of the scenes' mean IoU.

    undefined_scenes: scenes without any class to average; they are left out of ``mean_over_scenes``.
    """

    pooled: SegmentationScore
    scenes: tuple[SegmentationScore, ...]
    mean_over_scenes: float | None
    undefined_scenes: int


def confusion_matrix(
    truth: AnyArray,
    prediction: AnyArray,
    n_classes: int,
    ignore: int | None = None,
    *,
    no_answer: int | None = None,
) -> IntArray:
    """Count pixels by (truth, prediction).

    truth, prediction: arrays of one shape, bool or integer labels 0..n_classes-1.
    ignore: label of truth whose pixels do not count; it may be any integer.
    no_answer: value of the prediction that stands for no class; the matrix then has a last column for it. Either may
    be one of 0..n_classes-1, which then is no class: its row or column stays 0.
    Returns (n, n) int64, or (n, n + 1) with ``no_answer``. Raises SchemaError for arrays that do not fit and for other
    labels at pixels that count.
    """
    check_integer(n_classes, "n_classes", 1, MAX_CLASSES)
    for name, value in (("ignore", ignore), ("no_answer", no_answer)):
        if value is not None:
            check_integer(value, name)
    check_labels(truth, "truth")
    check_labels(prediction, "prediction", truth.shape)
    table = _table(truth, prediction, n_classes, ignore, no_answer)
    if table[n_classes + 1].any():
        bad = _codes(truth, n_classes, ignore) == n_classes + 1
        extra = "" if ignore is None else f" or {ignore} (ignore)"
        raise out_of_range(truth, "truth", bad, n_classes, extra, "ignore")
    if table[:n_classes, n_classes + 1].any():
        bad = _codes(prediction, n_classes, no_answer) == n_classes + 1
        if ignore is not None:
            bad &= truth != ignore
        extra = "" if no_answer is None else f" or {no_answer} (no answer)"
        raise out_of_range(prediction, "prediction", bad, n_classes, extra, "no_answer")
    return table[:n_classes, : n_classes + (no_answer is not None)].copy()


def score(confusion: AnyArray, absent: str = "hsbench", *, classes: Sequence[int] | None = None) -> SegmentationScore:
    """Values of one confusion matrix.

    confusion: (n, n) or (n, n + 1) counts [truth, prediction]. absent: a name of ``ABSENT_RULES``.
    classes: the classes that enter the means, default all. Raises SchemaError for what does not fit.
    """
    matrix = check_matrix(confusion)
    if absent not in ABSENT_RULES:
        raise SchemaError(f"absent rule {absent!r} is unknown; expected one of {', '.join(ABSENT_RULES)}")
    n = len(matrix)
    chosen = chosen_classes(classes, n)
    hits, rows, columns = np.diagonal(matrix), matrix.sum(axis=1), matrix[:, :n].sum(axis=0)
    unions = rows + columns - hits
    rule = ABSENT_RULES[absent]
    iou = tuple(_class_iou(int(hits[c]), int(rows[c]), int(unions[c]), rule) for c in range(n))
    accuracy = tuple(_ratio(int(hits[c]), int(rows[c])) for c in range(n))
    total = int(rows.sum())
    spoilt = rule.spoils and any(unions[c] == 0 for c in chosen)
    return SegmentationScore(
        absent=absent,
        iou=iou,
        mean_iou=None if spoilt else mean_defined([iou[c] for c in chosen]),
        frequency_weighted_iou=_frequency_weighted(hits, rows, unions) if total else None,
        pixel_accuracy=_ratio(int(hits.sum()), total),
        class_accuracy=accuracy,
        mean_class_accuracy=mean_defined([accuracy[c] for c in chosen]),
        undefined_classes=sum(int(unions[c] == 0) for c in chosen),
        absent_classes=sum(int(rows[c] == 0) for c in chosen),
        verified_by=rule.verified_by,
    )


def score_scenes(
    confusions: Sequence[AnyArray], absent: str = "hsbench", *, classes: Sequence[int] | None = None
) -> ScenesScore:
    """Pooled and per-scene values of one confusion matrix a scene, all of one shape. Raises SchemaError for none."""
    if not len(confusions):
        raise SchemaError("confusions holds no scene; expected one matrix a scene")
    matrices = [check_matrix(confusion) for confusion in confusions]
    for number, matrix in enumerate(matrices):
        if matrix.shape != matrices[0].shape:
            raise SchemaError(
                f"confusions[{number}] has shape {matrix.shape}; expected {matrices[0].shape} as the first"
            )
    scenes = tuple(score(matrix, absent, classes=classes) for matrix in matrices)
    pooled = score(np.stack(matrices).sum(axis=0), absent, classes=classes)
    values = [scene.mean_iou for scene in scenes]
    return ScenesScore(pooled, scenes, mean_defined(values), sum(value is None for value in values))


def mean_iou(counts: AnyArray) -> FloatArray:
    """(..., k) flattened confusion matrices -> (...) mean IoU, NaN where undefined: the form for resampling.

    k is n^2, or n (n + 1) with missing answers. Raises SchemaError for any other.
    """
    matrices = unflattened(counts)
    hits = np.diagonal(matrices, axis1=-2, axis2=-1)
    unions = matrices.sum(axis=-1) + matrices.sum(axis=-2)[..., : matrices.shape[-2]] - hits
    defined = unions > 0
    ious = np.where(defined, hits / np.where(defined, unions, 1), 0.0)
    number = defined.sum(axis=-1)
    return np.asarray(np.where(number > 0, ious.sum(axis=-1) / np.maximum(number, 1), np.nan))


def unflattened(counts: AnyArray) -> AnyArray:
    """(..., n^2) or (..., n (n + 1)) flattened confusion matrices -> (..., n, n) or (..., n, n + 1)."""
    flat = np.asarray(counts)
    k = flat.shape[-1] if flat.ndim else 0
    n = math.isqrt(k)
    if not k or k not in (n * n, n * (n + 1)):
        raise SchemaError(
            f"counts have shape {flat.shape}; expected (..., n^2), or (..., n (n + 1)) with missing answers"
            " (matrices? flatten their last two axes)"
        )
    return flat.reshape(*flat.shape[:-1], n, k // n)


def check_matrix(confusion: AnyArray) -> IntArray:
    """A confusion matrix as int64. Raises SchemaError unless it holds counts, (n, n) or (n, n + 1)."""
    shape = "(n, n), or (n, n + 1) with missing answers"
    matrix = check_counts(confusion, "confusion", shape)
    if matrix.ndim != 2 or matrix.shape[1] - matrix.shape[0] not in (0, 1) or not matrix.size:
        raise SchemaError(f"confusion has shape {matrix.shape}; expected {shape}")
    return matrix


def mean_defined(values: Sequence[float | None]) -> float | None:
    """Mean of the values that are not None; None where there is none."""
    defined = [value for value in values if value is not None]
    return sum(defined) / len(defined) if defined else None


def _class_iou(hits: int, row: int, union: int, rule: AbsentRule) -> float | None:
    if row:
        return hits / union
    return rule.predicted if union else rule.unpredicted


def _frequency_weighted(hits: IntArray, rows: IntArray, unions: IntArray) -> float:
    present = rows > 0
    return float((rows[present] * (hits[present] / unions[present])).sum() / rows.sum())


def _ratio(numerator: int, denominator: int) -> float | None:
    return numerator / denominator if denominator else None


def _table(truth: AnyArray, prediction: AnyArray, n: int, ignore: int | None, no_answer: int | None) -> IntArray:
    """(n + 2, n + 2) int64 counts; index n is ``ignore`` or ``no_answer``, n + 1 anything else."""
    if all(a.dtype.itemsize == 1 and a.dtype.kind in "bu" for a in (truth, prediction)) and n + 2 <= 256:
        raw = _pair_table(truth.reshape(-1).view(np.uint8), prediction.reshape(-1).view(np.uint8))
        values = np.arange(256)
        table = np.zeros((n + 2, n + 2), dtype=np.int64)
        np.add.at(table, (_codes(values, n, ignore)[:, None], _codes(values, n, no_answer)[None, :]), raw)
        return table
    first, second = truth.reshape(-1), prediction.reshape(-1)
    table = np.zeros((n + 2, n + 2), dtype=np.int64)
    for start in range(0, len(first), CHUNK):  # codes of a chunk stay in cache
        part = slice(start, start + CHUNK)
        t, p = _codes(first[part], n, ignore), _codes(second[part], n, no_answer)
        if n + 2 <= 256:
            table += _pair_table(t.astype(np.uint8), p.astype(np.uint8))[: n + 2, : n + 2]
        else:
            table += np.bincount(t * (n + 2) + p, minlength=(n + 2) ** 2).reshape(n + 2, n + 2)
    return table


def _codes(values: AnyArray, n: int, special: int | None) -> IntArray:
    """Labels -> themselves in 0..n-1, n for ``special``, which may be one of these, n + 1 for anything else."""
    wide = (
        values.astype(np.int64, copy=False)
        if values.dtype != np.uint64
        else np.minimum(values, MAX_PART).astype(np.int64)
    )
    codes = np.where((wide >= 0) & (wide < n), wide, n + 1)
    if special is not None:
        codes[wide == special] = n
    return codes


def _pair_table(first: AnyArray, second: AnyArray) -> IntArray:
    from hsbench.metrics.kernels import pair_counts

    table = np.zeros((256, 256), dtype=np.int64)
    for start in range(0, len(first), MAX_PART):
        part = slice(start, start + MAX_PART)
        table += pair_counts(np.ascontiguousarray(first[part]), np.ascontiguousarray(second[part])).reshape(256, 256)
    return table
