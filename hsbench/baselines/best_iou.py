"""Answers of the form "yes in these bins": the set of bins with the largest pooled IoU on training episodes.

Whatever a method can tell of a place (where it is, how far from where people walked, its colour) is made a number of a
bin. A bin belongs to the answer where its places are positive in more than a share of the training data; the share is
the one with the largest pooled IoU. IoU is a ratio of sums, so no other set of bins does better (Dinkelbach 1967).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hsbench.typing import AnyArray, BoolArray, IntArray


def best_bins(hits: IntArray, count: IntArray) -> BoolArray:
    """(...) positive and (...) all places of each bin -> (...) bool: the bins to say yes in. Bins without place: no."""
    share = np.where(count > 0, hits / np.maximum(count, 1), -1.0).ravel()
    order = np.argsort(-share, kind="stable")
    order = order[share[order] >= 0]
    chosen = np.zeros(count.size, dtype=np.bool_)
    if len(order):
        true_positive = np.cumsum(hits.ravel()[order])
        predicted = np.cumsum(count.ravel()[order])
        iou = true_positive / np.maximum(predicted + hits.sum() - true_positive, 1)
        if iou.max() > 0:
            chosen[order[: int(np.argmax(iou)) + 1]] = True
    return chosen.reshape(count.shape)


def fit_bins(samples: Iterable[tuple[AnyArray, BoolArray, BoolArray]], bins: int) -> BoolArray:
    """The best bins of L labels.

    samples: of each training episode (L, ...) number of the bin of each place for each label, (L, ...) bool truth, and
    (...) bool: places that do not count. Returns (L, bins) bool. Raises ValueError without a sample.
    """
    hits: IntArray | None = None
    for places, truth, ignored in samples:
        if hits is None:
            hits = np.zeros((len(truth), bins), dtype=np.int64)
            count = np.zeros_like(hits)
        for label, (own, true) in enumerate(zip(places, truth, strict=True)):
            count[label] += np.bincount(own[~ignored], minlength=bins)
            hits[label] += np.bincount(own[true & ~ignored], minlength=bins)
    if hits is None:
        raise ValueError("there is no training episode to fit on; expected at least one of split train")
    return np.stack([best_bins(h, c) for h, c in zip(hits, count, strict=True)])


def answer(chosen: BoolArray, places: AnyArray) -> BoolArray:
    """(L, bins) bool of ``fit_bins``, (L, ...) number of the bin of each place -> (L, ...) bool."""
    return np.stack([own[where] for own, where in zip(chosen, places, strict=True)])
