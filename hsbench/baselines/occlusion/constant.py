"""The control "best constant answer": one grid for every episode, fitted on train for the primary IoU.

A voxel belongs to the best constant where it is solid in more than a share of the training episodes in which it is
scored; the share is the one with the largest pooled IoU. IoU is a ratio of sums, so no other choice of voxels does
better (Dinkelbach 1967).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hsbench.typing import BoolArray


def fit_constant(samples: Iterable[tuple[BoolArray, BoolArray]]) -> BoolArray:
    """(mask, solid) grids of the training episodes -> the best constant grid.

    Raises ValueError without a sample.
    """
    count: np.ndarray | None = None
    for mask, solid in samples:
        if count is None:
            count, hits = np.zeros(mask.shape, np.int64), np.zeros(mask.shape, np.int64)
        count += mask
        hits += mask & solid
    if count is None:
        raise ValueError("the best constant has no training episode; expected at least one of split train")
    share = np.where(count > 0, hits / np.maximum(count, 1), -1.0).ravel()
    order = np.argsort(-share, kind="stable")
    order = order[share[order] >= 0]
    if not len(order):
        return np.zeros(count.shape, dtype=bool)
    true_positive = np.cumsum(hits.ravel()[order])
    predicted = np.cumsum(count.ravel()[order])
    iou = true_positive / np.maximum(predicted + hits.sum() - true_positive, 1)
    chosen = np.zeros(count.size, dtype=bool)
    chosen[order[: int(np.argmax(iou)) + 1]] = True
    return chosen.reshape(count.shape)
