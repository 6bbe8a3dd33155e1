"""From rows of episodes to the metrics of a split: sum first, divide once, resample scenes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from hsbench.evaluation.metric import Metric, Weighted
from hsbench.evaluation.report import EpisodeRow, MetricValue, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.metrics.bootstrap import LEVEL, resample


def scenes_of(rows: Iterable[EpisodeRow]) -> list[str]:
    """Scene ids in the order in which they are resampled: ascending."""
    return sorted({row.scene_id for row in rows})


def by_scene(rows: Sequence[EpisodeRow], metric: Metric) -> Weighted:
    """A metric as a function of (B, S) how often each scene counts, scenes in the order of ``scenes_of``."""
    position = {scene: i for i, scene in enumerate(scenes_of(rows))}
    group = np.array([position[row.scene_id] for row in rows], dtype=np.int64)
    return metric.weighted(rows, group, len(position))


def summarise(rows: Sequence[EpisodeRow], task: str, *, seed: int, replicates: int) -> dict[str, MetricValue]:
    """Every metric of a task over a split's rows; the order of rows makes no difference."""
    return {name: _summary(rows, metric, seed, replicates) for name, metric in metrics_of(task).items()}


def recompute(report: Report) -> list[str]:
    """Where a report's pooled values do not follow from its own rows: one line a metric, empty where all do."""
    own = summarise(report.episodes, report.task, seed=report.provenance.seed, replicates=report.provenance.replicates)
    faults = [f"metric {name!r} is missing" for name in own if name not in report.metrics]
    for name, stated in report.metrics.items():
        if name not in own:
            faults.append(f"metric {name!r} is unknown to task {report.task}")
            continue
        for item in ("value", "low", "high", "mean_over_episodes", "undefined_episodes"):
            said, computed = getattr(stated, item), getattr(own[name], item)
            if (said is None) != (computed is None) or (said is not None and abs(said - computed) > 1e-12):
                faults.append(f"metric {name!r}: {item} is {said}; its episodes give {computed}")
    return faults


def _summary(rows: Sequence[EpisodeRow], metric: Metric, seed: int, replicates: int) -> MetricValue:
    pooled = resample(by_scene(rows, metric), len(scenes_of(rows)), replicates, seed, LEVEL)
    alone = np.eye(len(rows), dtype=np.int64)
    each = metric.weighted(rows, np.arange(len(rows)), len(rows))(alone)
    defined = each[~np.isnan(each)]
    return MetricValue(
        value=pooled.estimate,
        low=pooled.low,
        high=pooled.high,
        # fsum: the order of episodes must not show in the last bit
        mean_over_episodes=math.fsum(defined) / len(defined) if len(defined) else None,
        undefined_episodes=len(each) - len(defined),
        undefined_replicates=pooled.undefined_replicates,
        reason=pooled.reason,
    )
