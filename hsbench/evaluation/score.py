"""Scoring a submission on disk: check it, then compare it with the truth of a data set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError, SubmissionError
from hsbench.evaluation.observation import Watched
from hsbench.evaluation.report import DatasetRef, Report
from hsbench.evaluation.scorers import scorer
from hsbench.evaluation.split import episode_row, watched_report
from hsbench.io.dataset_index import verify_unit
from hsbench.submission.check import check
from hsbench.submission.layout import METADATA_FILE
from hsbench.submission.metadata import read_metadata
from hsbench.submission.read import Predictions, open_submission
from hsbench.tasks.registry import task
from hsbench.tasks.spec import TaskSpec

ALL_SPLITS = "all"
ANNOTATED = ", annotated"
"""What follows the split's name where only those episodes of it that have truth were scored."""


def check_on(predictions: str | Path, spec: TaskSpec, data: Dataset, *, allow_missing: bool = False) -> list[str]:
    """Every fault of a submission to a task over the episodes of ``data``; reads no truth."""
    inputs = replace(data, truth=False, frames=False).episode
    return check(
        predictions,
        spec.on(data.name),
        data.episode_ids,
        allow_missing=allow_missing,
        inputs=inputs,
        durations_s=_durations_s(data),
    )


def score(
    task_name: str,
    predictions: str | Path,
    data: Dataset,
    *,
    allow_missing: bool = False,
    annotated_only: bool = False,
) -> Report:
    """The report of a submission to a task, over every episode of ``data``, whose truth is read here.

    predictions: a folder or a zip; answers at earlier times give the report its curve. annotated_only: leave out
    episodes without truth for the task; the name of the report's split then says so. Raises SubmissionError listing
    every fault; DataError where an episode, or with annotated_only every one, has no truth for the task; SchemaError
    for an unknown task.
    """
    spec = task(task_name).on(data.name)
    if faults := check_on(predictions, spec, data, allow_missing=allow_missing):
        raise SubmissionError(faults)
    description = data.description
    splits = {row["split"] for row in data.rows}
    with open_submission(predictions) as files:
        metadata, _ = read_metadata(files.read(METADATA_FILE), spec)
        assert metadata is not None  # checked above
        watched = list(_watched(data, Predictions(files, spec), spec, annotated_only))
    if not watched:
        raise DataError(f"{data.root} has no episode with truth for task {spec.name}; scoring needs open truth")
    split = (splits.pop() if len(splits) == 1 else "") or ALL_SPLITS
    return watched_report(
        watched,
        spec=spec,
        dataset=DatasetRef(description["name"], description["splits_version"], data.manifest_sha256),
        split=split if len(watched) == len(data) else split + ANNOTATED,
        method=metadata,
    )


def _watched(data: Dataset, answers: Predictions, spec: TaskSpec, annotated_only: bool) -> Iterator[Watched]:
    """The rows of every episode; its truth is read once for all its answers."""
    times, durations_s = answers.earlier_s(data.episode_ids), _durations_s(data)
    for episode_id, scene_id, truth in _truths(data, spec, annotated_only):
        duration_s = durations_s[episode_id]
        whole = episode_row(episode_id, scene_id, truth, answers.get(episode_id), spec)
        earlier = {
            observed_s: episode_row(episode_id, scene_id, truth, answers.get(episode_id, observed_s), spec)
            for observed_s in times
            if observed_s < duration_s
        }
        yield Watched(whole, duration_s, earlier)


def _durations_s(data: Dataset) -> dict[str, float]:
    return {row["episode_id"]: row["duration_s"] for row in data.rows}


def _truths(data: Dataset, spec: TaskSpec, annotated_only: bool) -> Iterator[tuple[str, str, Any]]:
    """(episode_id, scene_id, truth of the task) of every episode, or of those that have it, one at a time."""
    for episode_id in data.episode_ids:
        if faults := verify_unit(data.root, episode_id, "truth/"):
            raise DataError(f"{faults[0]}; a score on it would be of other data (hsbench verify lists every fault)")
    truth_of = scorer(spec.name).truth
    for row, episode in zip(data.rows, replace(data, truth=True, frames=False), strict=True):
        truth = truth_of(episode)
        if truth is not None:
            yield episode.episode_id, row["scene_id"], truth
        elif not annotated_only:
            raise DataError(
                f"episode {episode.episode_id} has no truth for task {spec.name}; scoring needs open truth (score "
                "--annotated-only leaves such episodes out)"
            )
