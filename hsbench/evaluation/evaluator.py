"""Scoring without files: episode by episode, in a training loop or in several workers whose parts are merged."""

from __future__ import annotations

from typing import Any

from hsbench.errors import DataError, SchemaError
from hsbench.evaluation.pooled import summarise
from hsbench.evaluation.report import DatasetRef, EpisodeRow, MetricValue, Report
from hsbench.evaluation.scorers import scorer
from hsbench.evaluation.split import episode_row, split_report
from hsbench.metrics.bootstrap import REPLICATES
from hsbench.schema.episode import Episode
from hsbench.submission.metadata import Metadata
from hsbench.tasks.registry import task


class Evaluator:
    """Collects rows of episodes of one task.

    The numbers are those of a submission with the same answers, whatever the order of episodes and workers.
    Raises SchemaError for an unknown task.
    """

    def __init__(self, task_name: str, *, seed: int = 0, replicates: int = REPLICATES) -> None:
        self._spec = task(task_name)
        self._seed, self._replicates = seed, replicates
        self._rows: dict[str, EpisodeRow] = {}

    def add(self, episode: Episode, prediction: Any | None) -> None:
        """Score one episode, loaded with truth; None is the task's missing answer.

        prediction: as the task's ``encode`` takes it. Raises DataError where the episode has no truth for the task,
        SchemaError where the prediction does not fit or the episode was added before.
        """
        known = episode.truth
        truth = scorer(self._spec.name).truth(episode)
        if truth is None or known is None:
            name = self._spec.name
            raise DataError(f"episode {episode.episode_id} has no truth for task {name} (load with truth=True)")
        form = self._spec.prediction
        answer = None if prediction is None else form.decode(form.encode(prediction))
        scene_id = episode.episode_id if known.scene is None else known.scene.scene_id
        self._take(episode_row(episode.episode_id, scene_id, truth, answer, self._spec))

    def merge(self, other: Evaluator) -> None:
        """Take over the episodes of another worker. Raises SchemaError for another task, or an episode twice."""
        if other._spec.name != self._spec.name:
            raise SchemaError(f"evaluators are of {self._spec.name} and {other._spec.name}; only one task merges")
        for row in other._rows.values():
            self._take(row)

    def metrics(self) -> dict[str, MetricValue]:
        """Every metric over the episodes so far. Raises SchemaError for none."""
        return summarise(self._ordered(), self._spec.name, seed=self._seed, replicates=self._replicates)

    def report(self, dataset: DatasetRef, split: str, method: Metadata) -> Report:
        """The report of the episodes so far."""
        return split_report(
            self._ordered(),
            spec=self._spec,
            dataset=dataset,
            split=split,
            method=method,
            seed=self._seed,
            replicates=self._replicates,
        )

    def _ordered(self) -> list[EpisodeRow]:
        if not self._rows:
            raise SchemaError("no episode was added; expected one or more")
        return [self._rows[episode_id] for episode_id in sorted(self._rows)]

    def _take(self, row: EpisodeRow) -> None:
        if row.episode_id in self._rows:
            raise SchemaError(f"episode {row.episode_id} was added before; expected each once")
        self._rows[row.episode_id] = row
