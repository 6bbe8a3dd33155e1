"""Precision, recall and IoU of 240 x 144 x 240 voxels against numpy: one thread each, the same arrays, one run."""

from __future__ import annotations

import numpy as np

from hsbench.metrics.tables import count
from tests.benchmarks.ratios import best_s, report

SHAPE = (240, 144, 240)


def ours(truth, prediction, mask=None):
    counts = count(truth, prediction, mask)
    return counts.precision, counts.recall, counts.iou


def with_numpy(truth, prediction):
    tp, fp, fn = (truth & prediction).sum(), (~truth & prediction).sum(), (truth & ~prediction).sum()
    return tp / (tp + fp), tp / (tp + fn), tp / (tp + fp + fn)


def with_numpy_masked(truth, prediction, mask):
    tp = (truth & prediction & mask).sum()
    fp = (~truth & prediction & mask).sum()
    fn = (truth & ~prediction & mask).sum()
    return tp / (tp + fp), tp / (tp + fn), tp / (tp + fp + fn)


def with_count_nonzero(truth, prediction):
    tp = np.count_nonzero(truth & prediction)
    truths, predictions = np.count_nonzero(truth), np.count_nonzero(prediction)
    return tp / predictions, tp / truths, tp / (truths + predictions - tp)


def voxels() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    truth, prediction, mask = (rng.random(SHAPE, dtype=np.float32) < share for share in (0.3, 0.3, 0.5))
    return truth, prediction, mask


def test_precision_recall_iou(benchmark) -> None:
    truth, prediction, _ = voxels()
    got = benchmark.pedantic(ours, (truth, prediction), rounds=50, warmup_rounds=2)
    assert got == with_numpy(truth, prediction) == with_count_nonzero(truth, prediction)
    if not benchmark.enabled:
        return
    mine_s = benchmark.stats.stats.min
    theirs_s = best_s(lambda: with_numpy(truth, prediction), 20)
    report("completion P/R/IoU, 240x144x240", "numpy expressions", theirs_s, mine_s, at_least=15)
    fewest_s = best_s(lambda: with_count_nonzero(truth, prediction), 20)
    report("completion P/R/IoU, 240x144x240", "numpy, three count_nonzero", fewest_s, mine_s)


def test_precision_recall_iou_within_a_mask(benchmark) -> None:
    truth, prediction, mask = voxels()
    got = benchmark.pedantic(ours, (truth, prediction, mask), rounds=50, warmup_rounds=2)
    assert got == with_numpy_masked(truth, prediction, mask)
    if not benchmark.enabled:
        return
    theirs_s = best_s(lambda: with_numpy_masked(truth, prediction, mask), 20)
    report("completion P/R/IoU in a mask", "numpy expressions", theirs_s, benchmark.stats.stats.min)
