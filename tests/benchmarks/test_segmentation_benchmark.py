"""Confusion matrix of 50 Mpx and 21 classes against scikit-learn: one thread each, the same arrays, one run."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.metrics.segmentation import confusion_matrix
from tests.benchmarks.ratios import best_s, report

N_CLASSES = 21
PIXELS = 50_000_000


def labels() -> tuple[np.ndarray, np.ndarray]:
    """(5000, 10000) uint8 truth in patches of 25 px and a prediction that errs at one pixel in five."""
    rng = np.random.default_rng(0)
    truth = np.kron(rng.integers(0, N_CLASSES, (200, 400), dtype=np.uint8), np.ones((25, 25), np.uint8))
    wrong = rng.random(truth.shape, dtype=np.float32) < 0.2
    return truth, np.where(wrong, rng.integers(0, N_CLASSES, truth.shape, dtype=np.uint8), truth)


def test_confusion_matrix(benchmark) -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    truth, prediction = labels()
    assert truth.size == PIXELS
    got = benchmark.pedantic(confusion_matrix, (truth, prediction, N_CLASSES), rounds=5, warmup_rounds=1)
    if not benchmark.enabled:
        return
    expected: list[np.ndarray] = []
    theirs_s = best_s(
        lambda: expected.append(metrics.confusion_matrix(truth.ravel(), prediction.ravel(), labels=range(N_CLASSES))), 2
    )
    assert np.array_equal(got, expected[0])
    report("confusion matrix, 50 Mpx, 21 classes", "sklearn", theirs_s, benchmark.stats.stats.min, at_least=30)
