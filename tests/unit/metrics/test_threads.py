"""Scores computed in several threads at once are those of one thread: kernels release the lock and share nothing."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from hsbench.geometry import boxes
from hsbench.metrics import boundary, completion, detection, multilabel, reconstruction
from hsbench.metrics.action import segment_counts
from hsbench.metrics.bootstrap import scene_weights
from hsbench.metrics.bootstrap_ap import replicate_ap
from hsbench.metrics.segmentation import confusion_matrix
from hsbench.schema import CATEGORIES
from tests.unit.geometry.box_samples import oriented
from tests.unit.metrics.detection_samples import sample2d, sample3d

WORKERS, CALLS = 4, 12


def detect(seed: int, protocol: str) -> Any:
    truths, predictions = sample3d(seed, 12, difficult=0.0)
    return detection.score(truths, predictions, protocol)


def resample(seed: int) -> Any:
    ranking = detection.score(*sample2d(seed, 10)).overall[0].ranking
    return replicate_ap(ranking, scene_weights(10, 40, seed)).tolist()


def arrays(seed: int, *shape: int, high: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.integers(0, high, shape).astype(np.uint8), rng.integers(0, high, shape).astype(np.uint8)


def complete(seed: int) -> Any:
    truth, prediction = arrays(seed, 20, 21, 22, high=len(CATEGORIES) + 1)
    state = arrays(seed + 1, 20, 21, 22, high=7)[0]
    return [completion.score(truth, prediction > 3, state, p) for p in completion.PROTOCOLS]


def overlap(seed: int) -> Any:
    rng = np.random.default_rng(seed)
    return boxes.iou_oriented(oriented(rng, 40), oriented(rng, 30)).tolist()


def surface(seed: int) -> Any:
    rng = np.random.default_rng(seed)
    return reconstruction.counts(rng.random((300, 3)), rng.random((200, 3)))


JOBS: dict[str, Callable[[int], Any]] = {
    **{f"detection {p}": lambda seed, p=p: detect(seed, p) for p in detection.PROTOCOLS},
    "bootstrap of AP": resample,
    "completion": complete,
    "oriented IoU": overlap,
    "reconstruction": surface,
    "confusion matrix": lambda seed: confusion_matrix(*arrays(seed, 200, 300, high=9), 9).tolist(),
    "several labels": lambda seed: multilabel.tables(*(a > 0 for a in arrays(seed, 3, 90, 91, high=2))).tolist(),
    "boundaries": lambda seed: boundary.counts(*arrays(seed, 40, 50, high=3), 3).tolist(),
    "segments": lambda seed: segment_counts(*arrays(seed, 400, high=3)),
}


@pytest.mark.parametrize("job", JOBS)
def test_threads_change_nothing(job: str) -> None:
    alone = [JOBS[job](seed) for seed in range(CALLS)]
    with ThreadPoolExecutor(WORKERS) as pool:
        assert list(pool.map(JOBS[job], range(CALLS))) == alone
