"""Scoring a split of any task: (truths, predictions) -> rows of episodes -> Report.

``episode_row`` is the work of one episode and may run anywhere, in any order; ``split_report`` joins rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Protocol

import hsbench
from hsbench.errors import SchemaError
from hsbench.evaluation.code_hash import code_sha256
from hsbench.evaluation.observation import Watched, curve_of
from hsbench.evaluation.pooled import scenes_of, summarise
from hsbench.evaluation.report import DatasetRef, EpisodeRow, Primary, Provenance, Report, ReportCounts, split_sha256
from hsbench.evaluation.scorers import scorer
from hsbench.metrics.bootstrap import LEVEL, REPLICATES
from hsbench.submission.metadata import Metadata
from hsbench.tasks.spec import TaskSpec


class PredictionSource(Protocol):
    """Where predictions come from: a dict will do, or ``hsbench.submission.Predictions``."""

    def get(self, episode_id: str, /) -> Any | None:
        """The prediction of an episode in the task's plain form, None where there is none."""
        ...


def score_episodes(
    episodes: Iterable[tuple[str, str, Any]],
    predictions: PredictionSource,
    *,
    spec: TaskSpec,
    dataset: DatasetRef,
    split: str,
    method: Metadata,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Report:
    """Score predictions against the truth of every episode of a split.

    episodes: (episode_id, scene_id, truth as the task's scorer takes it), taken one at a time. An episode without
    prediction counts as the task's missing answer. Raises SchemaError where truth or a prediction does not fit.
    """
    rows = (
        episode_row(episode_id, scene_id, truth, predictions.get(episode_id), spec)
        for episode_id, scene_id, truth in episodes
    )
    return split_report(rows, spec=spec, dataset=dataset, split=split, method=method, seed=seed, replicates=replicates)


def episode_row(episode_id: str, scene_id: str, truth: Any, prediction: Any | None, spec: TaskSpec) -> EpisodeRow:
    """The sufficient statistics of one episode."""
    try:
        statistics = scorer(spec.name).statistics(truth, prediction, spec)
    except SchemaError as error:
        raise SchemaError(f"episode {episode_id}: {error}") from error
    return EpisodeRow(episode_id, scene_id, prediction is None, statistics)


def split_report(
    rows: Iterable[EpisodeRow],
    *,
    spec: TaskSpec,
    dataset: DatasetRef,
    split: str,
    method: Metadata,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Report:
    """Join rows, in any order, into the report of a split, without a curve. Raises as ``watched_report``."""
    whole = (Watched(row, math.inf, {}) for row in rows)
    return watched_report(
        whole, spec=spec, dataset=dataset, split=split, method=method, seed=seed, replicates=replicates
    )


def watched_report(
    episodes: Iterable[Watched],
    *,
    spec: TaskSpec,
    dataset: DatasetRef,
    split: str,
    method: Metadata,
    seed: int = 0,
    replicates: int = REPLICATES,
) -> Report:
    """Join the rows of episodes, in any order, into the report of a split, with its curve where answers are earlier.

    Raises SchemaError for no episode, one twice, or answers at other times than those of the other episodes.
    """
    watched = sorted(episodes, key=lambda episode: episode.whole.episode_id)
    ordered = tuple(episode.whole for episode in watched)
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
        curve=curve_of(watched, spec, seed=seed, replicates=replicates),
        provenance=Provenance(
            hsbench.__version__,
            scorer(spec.name).version,
            code_sha256(),
            split_sha256(ordered),
            seed,
            replicates,
            LEVEL,
        ),
    )
