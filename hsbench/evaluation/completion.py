"""Scoring task ``scene-completion``: (truth, predictions) -> Report.

``episode_row`` is the work of one episode and may run anywhere, in any order; ``completion_report`` joins rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np

import hsbench
from hsbench.errors import SchemaError
from hsbench.evaluation.pooled import scenes_of, summarise
from hsbench.evaluation.report import DatasetRef, EpisodeRow, Primary, Provenance, Report, ReportCounts
from hsbench.metrics.bootstrap import LEVEL, REPLICATES
from hsbench.metrics.completion import PROTOCOL_VERSION, episode_counts
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.submission.metadata import Metadata
from hsbench.tasks.spec import TaskSpec
from hsbench.typing import BoolArray


class CompletionPredictions(Protocol):
    """Where predictions come from: a dict will do, or ``hsbench.submission.Predictions``."""

    def get(self, episode_id: str, /) -> BoolArray | None:
        """(nx, ny, nz) bool on the task's grid, None where there is no prediction."""
        ...


def score_completion(
    episodes: Iterable[tuple[str, str, OccupancyTruth]],
    predictions: CompletionPredictions,
    *,
    spec: TaskSpec,
    dataset: DatasetRef,
    split: str,
    method: Metadata,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Report:
    """Score predictions against the truth of every episode of a split.

    episodes: (episode_id, scene_id, truth), taken one at a time. An episode without prediction counts as an empty
    one: all its truth is missed. Raises SchemaError where truth is on another grid or a prediction does not fit.
    """
    rows = (
        episode_row(episode_id, scene_id, truth, predictions.get(episode_id), spec)
        for episode_id, scene_id, truth in episodes
    )
    return completion_report(
        rows, spec=spec, dataset=dataset, split=split, method=method, seed=seed, replicates=replicates
    )


def episode_row(
    episode_id: str, scene_id: str, truth: OccupancyTruth, prediction: BoolArray | None, spec: TaskSpec
) -> EpisodeRow:
    """The sufficient statistics of one episode: tp, fp, fn, tn of every region."""
    if truth.grid != spec.grid:
        raise SchemaError(f"episode {episode_id}: truth is on {truth.grid}; task {spec.name} asks for {spec.grid}")
    answer = np.zeros(spec.grid.shape, dtype=bool) if prediction is None else prediction
    try:
        counts = episode_counts(truth, answer)
    except SchemaError as error:
        raise SchemaError(f"episode {episode_id}: {error}") from error
    statistics = {region: (c.tp, c.fp, c.fn, c.tn) for region, c in counts.items()}
    return EpisodeRow(episode_id, scene_id, prediction is None, statistics)


def completion_report(
    rows: Iterable[EpisodeRow],
    *,
    spec: TaskSpec,
    dataset: DatasetRef,
    split: str,
    method: Metadata,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Report:
    """Join rows, in any order, into the report of a split. Raises SchemaError for no row or one episode twice."""
    ordered = tuple(sorted(rows, key=lambda row: row.episode_id))
    if not ordered:
        raise SchemaError(f"split {split!r} holds no episode to score")
    metrics = summarise(ordered, spec.name, seed=seed, replicates=replicates)
    primary = metrics[spec.primary_metric]
    missing = sum(row.missing for row in ordered)
    return Report(
        task=spec.name,
        task_version=spec.version,
        protocol=spec.protocol,
        dataset=dataset,
        split=split,
        method=method,
        primary=Primary(spec.primary_metric, primary.value, primary.low, primary.high),
        metrics=metrics,
        counts=ReportCounts(len(ordered) - missing, missing, primary.undefined_episodes, len(scenes_of(ordered))),
        episodes=ordered,
        provenance=Provenance(hsbench.__version__, PROTOCOL_VERSION, seed, replicates, LEVEL),
    )
