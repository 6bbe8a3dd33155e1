"""Speed of detection against pycocotools and against re-running AP: ratios within one run, printed.

One thread on both sides. The data are the same objects; what is timed begins where each library has them in memory.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from hsbench.metrics.bootstrap import scene_weights
from hsbench.metrics.bootstrap_ap import replicate_ap
from hsbench.metrics.detection import Ranking, score
from hsbench.typing import FloatArray, IntArray
from tests.benchmarks.ratios import report
from tests.unit.metrics.detection_samples import coco_numbers, coco_objects, sample2d

BOOTSTRAP_SCENES, MATCHED, REPLICATES, RERUNS = 500, 100_000, 1000, 40


@pytest.mark.slow
def test_coco_ap_of_2000_images_and_70k_detections(benchmark: Any) -> None:
    pytest.importorskip("pycocotools")
    truths, predictions = sample2d(1, 2000, 7.0, 80, false_share=3.5)
    assert 68_000 < sum(len(p.boxes) for p in predictions) < 72_000
    objects = coco_objects(truths, predictions, 80)
    score(truths, predictions, "coco")  # compiled kernels come from the cache from here on
    start = time.perf_counter()
    expected = coco_numbers(*objects)
    theirs_s = time.perf_counter() - start
    got = benchmark.pedantic(score, (truths, predictions, "coco"), rounds=7)
    assert list(got.summary.values()) == pytest.approx(expected, abs=1e-12)
    if benchmark.stats:
        report("COCO AP, 2000 images, 70k detections", "pycocotools", theirs_s, benchmark.stats.stats.median, 40)


def rerun(scenes: list[tuple[FloatArray, IntArray]], truths: IntArray, weights: IntArray) -> float:
    """AP of the drawn scenes from scratch: gather, sort, cumulate, integrate."""
    drawn = np.repeat(np.arange(len(scenes)), weights)
    scores, hits = (np.concatenate([scenes[s][i] for s in drawn]) for i in (0, 1))
    tp = np.cumsum(hits[np.argsort(-scores, kind="stable")])
    precision = tp / np.arange(1, len(tp) + 1)
    recall = tp / (truths @ weights)
    return float((np.diff(recall, prepend=0.0) * np.maximum.accumulate(precision[::-1])[::-1]).sum())


def test_bootstrap_of_ap_over_1e5_matched_detections(benchmark: Any) -> None:
    rng = np.random.default_rng(0)
    scores = np.sort(rng.random(MATCHED))[::-1]
    scene = rng.integers(0, BOOTSTRAP_SCENES, MATCHED)
    outcome = (rng.random(MATCHED) < 0.2 + 0.6 * scores).astype(np.int8)
    truths = np.bincount(scene[outcome == 1], minlength=BOOTSTRAP_SCENES) + rng.integers(0, 30, BOOTSTRAP_SCENES)
    ranking = Ranking(scores, outcome, scene, truths, False)
    weights = scene_weights(BOOTSTRAP_SCENES, REPLICATES, 0)
    apart = [(scores[scene == s], outcome[scene == s]) for s in range(BOOTSTRAP_SCENES)]
    replicate_ap(ranking, weights[:1])
    start = time.perf_counter()
    expected = [rerun(apart, truths, w) for w in weights[:RERUNS]]
    theirs_s = (time.perf_counter() - start) * REPLICATES / RERUNS
    got = benchmark.pedantic(replicate_ap, (ranking, weights), rounds=5)
    assert got[:RERUNS] == pytest.approx(expected, abs=1e-12)
    if benchmark.stats:
        report("bootstrap of AP, 1000 x 1e5 detections", "re-running AP", theirs_s, benchmark.stats.stats.median, 50)
