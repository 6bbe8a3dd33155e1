"""Is the difference between two methods real? Paired over the scenes both were scored on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hsbench.errors import SchemaError
from hsbench.evaluation.metric import Weighted
from hsbench.evaluation.pooled import by_scene, scenes_of
from hsbench.evaluation.report import DatasetRef, Report
from hsbench.evaluation.scorers import metrics_of
from hsbench.metrics.bootstrap import LEVEL, REPLICATES, Interval, resample


@dataclass(frozen=True)
class Comparison:
    """Method A less method B, each metric with its paired interval.

    differences: by metric; the methods differ where the interval does not hold 0. unpaired: episodes that only one
    of the reports has, left out.
    """

    task: str
    task_version: str
    protocol: str
    dataset: DatasetRef
    split: str
    method_a: str
    method_b: str
    primary_metric: str
    differences: Mapping[str, Interval]
    scenes: int
    episodes: int
    unpaired: int

    @property
    def primary(self) -> Interval:
        """The difference in the number of the board."""
        return self.differences[self.primary_metric]

    @property
    def is_real(self) -> bool | None:
        """Whether the primary difference's interval excludes 0; None where there is no interval."""
        low, high = self.primary.low, self.primary.high
        return None if low is None or high is None else low > 0 or high < 0


def compare(report_a: Report, report_b: Report, *, seed: int = 0, replicates: int = REPLICATES) -> Comparison:
    """Paired bootstrap of every pooled metric over the common scenes.

    Raises SchemaError where task, version, protocol, data or split differ, or no episode is common.
    """
    for item in ("task", "task_version", "protocol", "dataset", "split"):
        a, b = getattr(report_a, item), getattr(report_b, item)
        if a != b:
            raise SchemaError(f"reports differ in {item}: {a!r} and {b!r}; only scores of the same thing compare")
    versions = report_a.provenance.protocol_version, report_b.provenance.protocol_version
    if versions[0] != versions[1]:
        raise SchemaError(f"reports count by versions {versions[0]!r} and {versions[1]!r} of the protocol; score again")
    rows_a = {row.episode_id: row for row in report_a.episodes}
    rows_b = {row.episode_id: row for row in report_b.episodes}
    common = sorted(rows_a.keys() & rows_b.keys())
    if not common:
        raise SchemaError("reports have no episode in common")
    moved = next((e for e in common if rows_a[e].scene_id != rows_b[e].scene_id), None)
    if moved is not None:
        raise SchemaError(f"episode {moved} is in scene {rows_a[moved].scene_id} and {rows_b[moved].scene_id}")
    scenes = scenes_of(rows_a[e] for e in common)
    paired_a, paired_b = [rows_a[e] for e in common], [rows_b[e] for e in common]
    differences = {
        name: resample(
            _less(by_scene(paired_a, metric), by_scene(paired_b, metric)), len(scenes), replicates, seed, LEVEL
        )
        for name, metric in metrics_of(report_a.task).items()
    }
    return Comparison(
        task=report_a.task,
        task_version=report_a.task_version,
        protocol=report_a.protocol,
        dataset=report_a.dataset,
        split=report_a.split,
        method_a=report_a.method.method,
        method_b=report_b.method.method,
        primary_metric=report_a.primary.name,
        differences=differences,
        scenes=len(scenes),
        episodes=len(common),
        unpaired=len(rows_a) + len(rows_b) - 2 * len(common),
    )


def _less(a: Weighted, b: Weighted) -> Weighted:
    return lambda weights: a(weights) - b(weights)
