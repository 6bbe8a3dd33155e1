"""Boundary F-score of a segmentation: do outlines lie where they should?

Task and source
---------------
G. Csurka, D. Larlus, F. Perronnin, *What is a good evaluation measure for semantic segmentation?*, BMVC 2013: for each
class, the boundary of the predicted region is compared with that of the true region.

Conventions
-----------
Images are (h, w), lengths in pixels. A pixel is on the boundary of class c if it has label c and one of its four
neighbours has another label. The border of the image is no boundary, nor is the border of an ignored region: pairs of
which one pixel is ignored in truth are left out in both images.

Metrics
-------
Precision = share of predicted boundary pixels within ``tolerance_px`` (Euclidean, limit included) of a true one,
recall the reverse, F = 2 P R / (P + R). The tolerance is .75 % of the image's diagonal unless given, as in the paper.
Counts of images add up; F is taken once from the sums. F is 0 where one side has no boundary at all, None where neither
has, and None is left out of the mean over classes and counted.

Differences from other scorers
------------------------------
* Csurka et al. average F over the images in which a class occurs; here counts are pooled: long outlines weigh more.
* DAVIS (Perazzi et al. 2016) uses morphological dilation by a disk of a rounded radius and .8 % of the diagonal: up to
  half a pixel more generous or strict.
* Boundary IoU (Cheng et al. 2021) is another measure: it compares bands, not lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.labels import check_counts, check_integer, check_labels, out_of_range
from hsbench.metrics.segmentation import mean_defined
from hsbench.metrics.tables import ratio
from hsbench.typing import AnyArray, BoolArray, IntArray

TOLERANCE_OF_DIAGONAL = 0.0075  # Csurka et al. 2013, section 3


@dataclass(frozen=True)
class BoundaryScore:
    """Per class precision, recall and F of boundaries, and the mean F; None = undefined."""

    precision: tuple[float | None, ...]
    recall: tuple[float | None, ...]
    f_score: tuple[float | None, ...]
    mean_f_score: float | None
    undefined_classes: int


def counts(
    truth: AnyArray,
    prediction: AnyArray,
    n_classes: int,
    ignore: int | None = None,
    *,
    tolerance_px: float | None = None,
) -> IntArray:
    """Boundary pixels of one image.

    truth, prediction: (h, w) integer labels 0..n_classes-1; where truth is ``ignore``, which may be any integer, the
    prediction may hold anything. Returns (n, 4) int64 per class: predicted boundary pixels near a true one, predicted
    ones, true ones near a predicted one, true ones. Raises SchemaError for arrays and labels that do not fit.
    """
    check_integer(n_classes, "n_classes", 1)
    if ignore is not None:
        check_integer(ignore, "ignore")
    check_labels(truth, "truth")
    if truth.ndim != 2 or not truth.size:
        raise SchemaError(f"truth has shape {truth.shape}; expected (h, w): one image at a time")
    check_labels(prediction, "prediction", truth.shape)
    tolerance = TOLERANCE_OF_DIAGONAL * float(np.hypot(*truth.shape)) if tolerance_px is None else tolerance_px
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise SchemaError(f"tolerance_px is {tolerance}; expected a number of pixels >= 0")
    valid = np.ones(truth.shape, dtype=bool) if ignore is None else truth != ignore
    for name, labels, extra in (
        ("truth", truth, "" if ignore is None else f" or {ignore} (ignore)"),
        ("prediction", prediction, ""),
    ):
        outside = valid & ((labels < 0) | (labels >= n_classes))
        if outside.any():
            raise out_of_range(labels, name, outside, n_classes, extra, "ignore" if name == "truth" else None)
    edges = [_edges(labels, valid) for labels in (prediction, truth)]
    rows = []
    for c in range(n_classes):
        predicted, true = (edge & (labels == c) for edge, labels in zip(edges, (prediction, truth), strict=True))
        rows.append((_near(predicted, true, tolerance), predicted.sum(), _near(true, predicted, tolerance), true.sum()))
    return np.array(rows, dtype=np.int64).reshape(n_classes, 4)


def score(boundary_counts: IntArray) -> BoundaryScore:
    """Values of the counts of one image, or of their sum over images; (n, 4) as ``counts`` returns."""
    rows = check_counts(boundary_counts, "boundary_counts", "(classes, 4)")
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise SchemaError(f"boundary_counts has shape {rows.shape}; expected (classes, 4)")
    if (rows[:, ::2] > rows[:, 1::2]).any():
        c = int(np.argmax((rows[:, ::2] > rows[:, 1::2]).any(axis=1)))
        raise SchemaError(f"boundary_counts[{c}] is {rows[c].tolist()}; expected near <= all twice (columns swapped?)")
    precision = tuple(ratio(int(row[0]), int(row[1])) for row in rows)
    recall = tuple(ratio(int(row[2]), int(row[3])) for row in rows)
    f_scores = tuple(f_score(p, r) for p, r in zip(precision, recall, strict=True))
    return BoundaryScore(precision, recall, f_scores, mean_defined(f_scores), sum(f is None for f in f_scores))


def f_score(precision: float | None, recall: float | None) -> float | None:
    """2 P R / (P + R); 0 where one of them is undefined or both are 0, None where both are undefined."""
    if precision is None and recall is None:
        return None
    if not precision or not recall:
        return 0.0
    return 2 * precision * recall / (precision + recall)


def _edges(labels: AnyArray, valid: BoolArray) -> BoolArray:
    """Pixels with a valid neighbour of another label."""
    edges = np.zeros(labels.shape, dtype=bool)
    for a, b in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        differs = (labels[a] != labels[b]) & valid[a] & valid[b]
        edges[a] |= differs
        edges[b] |= differs
    return edges


def _near(of: BoolArray, to: BoolArray, tolerance: float) -> int:
    """Number of pixels of ``of`` within a distance of a pixel of ``to``."""
    if not of.any() or not to.any():
        return 0
    from scipy.ndimage import distance_transform_edt

    slack = 1 + 1e-12  # distances are square roots of integers: this includes the limit itself and nothing beyond
    return int((distance_transform_edt(~to)[of] <= tolerance * slack).sum())
