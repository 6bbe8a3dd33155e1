"""Scoring task ``object-detection-3d``: rankings for AP, counts for recall, precision and F1.

Rules: protocol ``hsbench`` of ``hsbench.metrics.detection``. ``ap-25`` is class-agnostic AP at IoU .25, ``map-25`` the
mean over classes, ``ap-25/chair`` one of them. Under ``difficult/``, objects that are fully occluded and neither used
nor skirted are neither hit nor miss. All else is at IoU .25: with all boxes, and under ``operating/`` with those from
the submission's own operating score on. ``voc/map-25`` is the mean over classes by another benchmark's rules.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.evaluation.metric import Metric, PooledMetric, share
from hsbench.evaluation.ranked import RankedMetric, ranking_statistics
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.metrics import detection
from hsbench.metrics.detection import Predictions, Ranking, Truths
from hsbench.metrics.detection_inputs import SIZE_GROUP
from hsbench.metrics.detection_matching import FALSE, HIT
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.episode import Episode
from hsbench.schema.states import Evidence, Visibility
from hsbench.tasks.object_detection import CLASSES, Boxes
from hsbench.tasks.scene_completion import GRID
from hsbench.tasks.spec import TaskSpec
from hsbench.truth.detectable import detectable

IOU = (0.25, 0.5)
NAMED = {"voc": (0.25, 0.5), "sunrgbd": (0.25,)}
"""Other benchmarks' protocols whose mean AP over classes stands beside, with their thresholds."""
SEEN_AND_TOUCHED = "visibility-evidence"
SIZES = ("small", "medium", "large")  # keys 0, 1, 2 of the group of sizes

GROUPS: dict[tuple[str, tuple[int, ...]], str] = {
    **{
        (SEEN_AND_TOUCHED, (int(v), int(e))): f"{v.name.lower().replace('_', '-')}/{e.name.lower()}"
        for v in Visibility
        for e in Evidence
    },
    **{(SIZE_GROUP, (key,)): f"{SIZE_GROUP}/{name}" for key, name in enumerate(SIZES)},
}
"""(group, key) of a truth -> what its recall is called."""


def truth(episode: Episode) -> Truths | None:
    """Boxes, classes and groups of the objects that count; the hopeless ones are ``difficult``."""
    if episode.truth is None or episode.truth.scene is None or episode.truth.objects is None:
        return None
    scene, objects = episode.truth.scene, episode.truth.objects
    asked = detectable(scene, GRID)
    hopeless = (objects.visibility == Visibility.FULLY_OCCLUDED) & (objects.evidence == Evidence.NEITHER)
    return Truths(
        np.array([item.box for item in scene.objects]).reshape(-1, 7)[asked],
        np.array([item.category.category_id for item in scene.objects], dtype=np.int64)[asked],
        difficult=hopeless[asked],
        groups={SEEN_AND_TOUCHED: detection.visibility_by_evidence(objects)[asked]},
    )


def statistics(true: Truths, found: Boxes | None, spec: TaskSpec) -> Statistics:
    """Rankings and counts of one episode; a missing prediction counts as no box."""
    answer = Boxes.none() if found is None else found
    predictions = Predictions(
        answer.boxes.astype(np.float64), answer.scores.astype(np.float64), answer.category_ids.astype(np.int64)
    )
    operating = float(answer.operating_score[0])
    counting_all = replace(true, difficult=None)
    scored = detection.score([counting_all], [predictions], spec.protocol, IOU, operating_score=operating)
    lenient = detection.score([true], [predictions], spec.protocol, IOU)
    lists: dict[str, tuple[int, ...]] = {}
    for t, plain, spared in zip(IOU, scored.overall, lenient.overall, strict=True):
        lists |= ranking_statistics(_ap(t), plain.ranking)
        lists |= ranking_statistics(f"difficult/{_ap(t)}", spared.ranking)
    for one in scored.per_class:
        if one.label:
            lists |= ranking_statistics(f"{_ap(one.iou)}/{CATEGORIES[one.label - 1].name}", one.ranking)
    for protocol, steps in NAMED.items():
        for one in detection.score([counting_all], [predictions], protocol, steps).per_class:
            if one.label:
                name = f"{protocol}/{_ap(one.iou)}/{CATEGORIES[one.label - 1].name}"
                lists |= ranking_statistics(name, one.ranking)
    of_all = scored.overall[0].ranking
    rows = {(row.group, row.key): row for row in scored.recall if row.iou == IOU[0]}
    for key, name in GROUPS.items():
        row = rows.get(key)
        lists[f"recall/{name}"] = (0, 0, 0) if row is None else (row.hits, row.hits_at_score or 0, row.truths)
    return {**lists, "boxes": _counts(of_all, 0.0), "boxes-at-score": _counts(of_all, operating)}


def _ap(iou: float) -> str:
    return f"ap-{round(100 * iou)}"


def _counts(ranking: Ranking, least: float) -> tuple[int, int, int]:
    """tp, fp, fn of the boxes from a score on."""
    kept = ranking.outcome[ranking.scores >= least]
    hits = int((kept == HIT).sum())
    return hits, int((kept == FALSE).sum()), ranking.truths - hits


def _metrics() -> dict[str, Metric]:
    named: dict[str, Metric] = {name: RankedMetric((name,)) for name in map(_ap, IOU)}
    named |= {f"difficult/{name}": RankedMetric((f"difficult/{name}",)) for name in map(_ap, IOU)}
    classes = {t: tuple(f"{_ap(t)}/{c.name}" for c in CLASSES) for t in IOU}
    named |= {f"m{_ap(t)}": RankedMetric(names) for t, names in classes.items()}
    for protocol, steps in NAMED.items():
        for t in steps:
            names = tuple(f"{protocol}/{_ap(t)}/{c.name}" for c in CLASSES)
            named[f"{protocol}/m{_ap(t)}"] = RankedMetric(names, blocks=False)
    for prefix, counts in (("", "boxes"), ("operating/", "boxes-at-score")):
        named[f"{prefix}precision"] = PooledMetric(counts, 3, share([0], [0, 1]))
        named[f"{prefix}recall"] = PooledMetric(counts, 3, share([0], [0, 2]))
        named[f"{prefix}f1"] = PooledMetric(counts, 3, share([0, 0], [0, 0, 1, 2]))
    for prefix, hits in (("", 0), ("operating/", 1)):
        named |= {
            f"{prefix}recall/{name}": PooledMetric(f"recall/{name}", 3, share([hits], [2])) for name in GROUPS.values()
        }
    named |= {name: RankedMetric((name,)) for names in classes.values() for name in names}
    return named


OBJECT_DETECTION = Scorer(truth, statistics, _metrics(), detection.PROTOCOL_VERSION)
