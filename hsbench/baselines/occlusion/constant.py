"""The control "best constant answer": one grid for every episode, fitted on train for the primary IoU.

Every voxel is a bin of its own (``hsbench.baselines.best_iou``).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hsbench.baselines.best_iou import best_bins
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
    return best_bins(hits, count)
