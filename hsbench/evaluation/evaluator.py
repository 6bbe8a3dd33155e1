"""Scoring without files: episode by episode, in a training loop or in several workers whose parts are merged."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from hsbench.errors import DataError, SchemaError
from hsbench.evaluation.observation import Watched
from hsbench.evaluation.pooled import summarise
from hsbench.evaluation.report import DatasetRef, EpisodeRow, MetricValue, Report
from hsbench.evaluation.scorers import scorer
from hsbench.evaluation.split import episode_row, watched_report
from hsbench.metrics.bootstrap import REPLICATES
from hsbench.schema.episode import Episode
from hsbench.submission.metadata import Metadata
from hsbench.tasks.registry import task
from hsbench.tasks.spec import TaskSpec


class Evaluator:
    """Collects rows of episodes of one task.

    The numbers are those of a submission with the same answers, whatever the order of episodes and workers. May be
    pickled, so that workers send theirs. Raises SchemaError for an unknown task.
    """

    def __init__(self, task_name: str, *, seed: int = 0, replicates: int = REPLICATES) -> None:
        self._task = task(task_name).name
        self._seed, self._replicates = seed, replicates
        self._watched: dict[str, Watched] = {}

    def add(
        self, episode: Episode, prediction: Any | None, earlier: Mapping[float, Any | None] = MappingProxyType({})
    ) -> None:
        """Score one episode, loaded with truth; None is the task's missing answer.

        prediction: as the task's ``encode`` takes it. earlier: likewise, by seconds of watching, at observation times
        of the task before the episode ends; what other episodes have too gives the report a curve. Raises DataError
        where the episode has no truth for the task, SchemaError where a prediction does not fit or the episode was
        added before.
        """
        known = episode.truth
        truth = scorer(self._task).truth(episode)
        if truth is None or known is None:
            name = self._task
            raise DataError(f"episode {episode.episode_id} has no truth for task {name} (load with truth=True)")
        scene_id = episode.episode_id if known.scene is None else known.scene.scene_id

        def row(answer: Any | None) -> EpisodeRow:
            form = self._spec.prediction
            said = None if answer is None else form.decode(form.encode(answer))
            return episode_row(episode.episode_id, scene_id, truth, said, self._spec)

        at = {observed_s: row(answer) for observed_s, answer in earlier.items()}
        self._take(Watched(row(prediction), episode.duration_s, at))

    def merge(self, other: Evaluator) -> None:
        """Take over the episodes of another worker. Raises SchemaError for another task, or an episode twice."""
        if other._task != self._task:
            raise SchemaError(f"evaluators are of {self._task} and {other._task}; only one task merges")
        for episode in other._watched.values():
            self._take(episode)

    def metrics(self) -> dict[str, MetricValue]:
        """Every metric over the episodes so far. Raises SchemaError for none."""
        rows = [episode.whole for episode in self._ordered()]
        return summarise(rows, self._task, seed=self._seed, replicates=self._replicates)

    def report(self, dataset: DatasetRef, split: str, method: Metadata) -> Report:
        """The report of the episodes so far. Raises SchemaError where they have answers at different times."""
        return watched_report(
            self._ordered(),
            spec=self._spec.on(dataset.name),
            dataset=dataset,
            split=split,
            method=method,
            seed=self._seed,
            replicates=self._replicates,
        )

    @property
    def _spec(self) -> TaskSpec:
        return task(self._task)  # looked up, as a task has functions, which are not pickled

    def _ordered(self) -> list[Watched]:
        if not self._watched:
            raise SchemaError("no episode was added; expected one or more")
        return [self._watched[episode_id] for episode_id in sorted(self._watched)]

    def _take(self, episode: Watched) -> None:
        episode_id = episode.whole.episode_id
        if episode_id in self._watched:
            raise SchemaError(f"episode {episode_id} was added before; expected each once")
        self._watched[episode_id] = episode
