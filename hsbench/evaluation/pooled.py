"""From rows of episodes to pooled metrics: sum first, divide once, resample scenes.

A task names its metrics in a table {metric: (statistics it needs, vectorised ratio)}; all else here is common.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.report import EpisodeRow, MetricValue, Report
from hsbench.metrics import completion
from hsbench.metrics.bootstrap import Statistic, interval
from hsbench.typing import IntArray


@dataclass(frozen=True)
class PooledMetric:
    """A metric as a function of summed statistics.

    statistics: their name in a row; columns: how many there are, k; value: (..., k) -> (...), NaN where undefined.
    """

    statistics: str
    columns: int
    value: Statistic


_RATIOS: Mapping[str, Statistic] = {
    "iou": completion.iou,
    "precision": completion.precision,
    "recall": completion.recall,
}

_METRICS: Mapping[str, Mapping[str, PooledMetric]] = {
    "scene-completion": {
        f"{region}/{name}": PooledMetric(region, 4, ratio)
        for region in completion.REGIONS
        for name, ratio in _RATIOS.items()
    }
}


def metrics_of(task: str) -> Mapping[str, PooledMetric]:
    """The pooled metrics of a task by name, e.g. ``occluded/iou``. Raises SchemaError for a task without any."""
    if task not in _METRICS:
        raise SchemaError(f"task {task!r} has no pooled metrics; expected one of {', '.join(_METRICS)}")
    return _METRICS[task]


def scenes_of(rows: Iterable[EpisodeRow]) -> list[str]:
    """Scene ids in the order in which they are resampled: ascending."""
    return sorted({row.scene_id for row in rows})


def by_episode(rows: Sequence[EpisodeRow], metric: PooledMetric) -> IntArray:
    """(E, k) int64 statistics of each row. Raises SchemaError for a row without them."""
    for row in rows:
        if len(row.statistics.get(metric.statistics, ())) != metric.columns:
            raise SchemaError(f"episode {row.episode_id} lacks {metric.columns} statistics {metric.statistics!r}")
    return np.array([row.statistics[metric.statistics] for row in rows], dtype=np.int64)


def by_scene(rows: Sequence[EpisodeRow], metric: PooledMetric) -> IntArray:
    """(S, k) int64 statistics summed within each scene, in the order of ``scenes_of``."""
    position = {scene: i for i, scene in enumerate(scenes_of(rows))}
    summed = np.zeros((len(position), metric.columns), dtype=np.int64)
    np.add.at(summed, [position[row.scene_id] for row in rows], by_episode(rows, metric))
    return summed


def summarise(rows: Sequence[EpisodeRow], task: str, *, seed: int, replicates: int) -> dict[str, MetricValue]:
    """Every pooled metric of a task over a split's rows; the order of rows makes no difference."""
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


def _summary(rows: Sequence[EpisodeRow], metric: PooledMetric, seed: int, replicates: int) -> MetricValue:
    pooled = interval(by_scene(rows, metric), metric.value, replicates=replicates, seed=seed)
    each = metric.value(by_episode(rows, metric))
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
