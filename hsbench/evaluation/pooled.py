"""From rows of episodes to the metrics of a split: sum first, divide once, resample scenes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from hsbench.evaluation.metric import Metric, Weighted
from hsbench.evaluation.report import EpisodeRow, MetricValue, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.metrics.bootstrap import LEVEL, resample
from hsbench.metrics.curves import Curve, area
from hsbench.tasks.registry import task
from hsbench.typing import FloatArray, IntArray

TOLERANCE = 1e-12
"""Between a stated value and the one that its rows give: other machines may divide otherwise in the last bits."""


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
    scenes = len(scenes_of(rows))
    return {
        name: metric_value(by_scene(rows, metric), of_each(rows, metric), scenes, seed=seed, replicates=replicates)
        for name, metric in metrics_of(task).items()
    }


def area_value(
    times_s: Sequence[float], rows: Sequence[Sequence[EpisodeRow]], metric: Metric, *, seed: int, replicates: int
) -> MetricValue:
    """Area under a metric over log time (``hsbench.metrics.curves``), scenes being drawn for all times at once.

    rows: of every time, the same episodes in the same order.
    """
    count = len(rows[0])
    pooled = [by_scene(at, metric) for at in rows]
    alone = [metric.weighted(at, np.arange(count), count) for at in rows]

    def areas(values: Sequence[Weighted], weights: IntArray) -> FloatArray:
        each = np.stack([value(weights) for value in values], axis=1)
        lines = (tuple(None if math.isnan(value) else value for value in line) for line in each.tolist())
        found = (area(Curve(tuple(times_s), line), (times_s[0], times_s[-1])) for line in lines)
        return np.array([np.nan if value is None else value for value in found])

    return metric_value(
        lambda weights: areas(pooled, weights),
        areas(alone, np.eye(count, dtype=np.int64)),
        len(scenes_of(rows[0])),
        seed=seed,
        replicates=replicates,
    )


def recompute(report: Report) -> list[str]:
    """Where a report's pooled values do not follow from its own rows: one line a value, empty where all do."""
    seed, replicates = report.provenance.seed, report.provenance.replicates
    faults = _metric_faults(report.metrics, report.episodes, report)
    if report.curve is None:
        return faults
    known = task(report.task).on(report.dataset.name).observation_times_s
    odd = [m.observed_s for m in report.curve.moments if m.observed_s not in known[:-1]]
    if odd or report.curve.whole_s > known[-1]:
        return [*faults, f"the curve is over {odd or report.curve.whole_s} s; expected times of the task: {known}"]
    for moment in report.curve.moments:
        after = f"after {moment.observed_s:g} s: "
        faults += [after + fault for fault in _metric_faults(moment.metrics, moment.episodes, report)]
    times_s = (*(moment.observed_s for moment in report.curve.moments), report.curve.whole_s)
    rows = (*(moment.episodes for moment in report.curve.moments), report.episodes)
    own = area_value(times_s, rows, metrics_of(report.task)[report.primary.name], seed=seed, replicates=replicates)
    return faults + _value_faults("area of the curve", report.curve.area, own)


def _metric_faults(stated: Mapping[str, MetricValue], rows: Sequence[EpisodeRow], report: Report) -> list[str]:
    own = summarise(rows, report.task, seed=report.provenance.seed, replicates=report.provenance.replicates)
    faults = [f"metric {name!r} is missing" for name in own if name not in stated]
    for name, value in stated.items():
        if name not in own:
            faults.append(f"metric {name!r} is unknown to task {report.task}")
        else:
            faults += _value_faults(f"metric {name!r}", value, own[name])
    return faults


def _value_faults(name: str, stated: MetricValue, own: MetricValue) -> list[str]:
    faults = []
    for item in ("value", "low", "high", "mean_over_episodes", "undefined_episodes"):
        said, computed = getattr(stated, item), getattr(own, item)
        if (said is None) != (computed is None) or (said is not None and abs(said - computed) > TOLERANCE):
            faults.append(f"{name}: {item} is {said}; its episodes give {computed}")
    return faults


def metric_value(pooled: Weighted, each: FloatArray, scenes: int, *, seed: int, replicates: int) -> MetricValue:
    """A metric of a split with its interval. each: (E,) its value of every episode alone, NaN where undefined."""
    found = resample(pooled, scenes, replicates, seed, LEVEL)
    defined = each[~np.isnan(each)]
    return MetricValue(
        value=found.estimate,
        low=found.low,
        high=found.high,
        # fsum: the order of episodes must not show in the last bit
        mean_over_episodes=math.fsum(defined) / len(defined) if len(defined) else None,
        undefined_episodes=len(each) - len(defined),
        undefined_replicates=found.undefined_replicates,
        reason=found.reason,
    )


def of_each(rows: Sequence[EpisodeRow], metric: Metric) -> FloatArray:
    """(E,) a metric of every episode alone, NaN where undefined."""
    return metric.weighted(rows, np.arange(len(rows)), len(rows))(np.eye(len(rows), dtype=np.int64))
