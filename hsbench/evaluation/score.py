"""Scoring a submission on disk: check it, then compare it with the truth of a data set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError
from hsbench.evaluation.completion import score_completion
from hsbench.evaluation.report import DatasetRef, Report
from hsbench.io.dataset_index import verify_unit
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.submission.check import check_or_raise
from hsbench.submission.layout import METADATA_FILE
from hsbench.submission.metadata import read_metadata
from hsbench.submission.read import Predictions, open_submission
from hsbench.tasks.spec import TaskSpec

ALL_SPLITS = "all"


def score(submission: str | Path, spec: TaskSpec, data: Dataset, *, allow_missing: bool = False) -> Report:
    """The report of a submission (folder or zip) over every episode of ``data``, whose truth is read here.

    Raises SubmissionError listing every fault; DataError where an episode has no truth for the task.
    """
    check_or_raise(submission, spec, data.episode_ids, allow_missing=allow_missing)
    description = data.description
    splits = {row["split"] for row in data.rows}
    with open_submission(submission) as files:
        metadata, _ = read_metadata(files.read(METADATA_FILE), spec)
        assert metadata is not None  # checked above
        return score_completion(
            _truths(data),
            Predictions(files, spec),
            spec=spec,
            dataset=DatasetRef(description["name"], description["splits_version"], data.manifest_sha256),
            split=(splits.pop() if len(splits) == 1 else "") or ALL_SPLITS,
            method=metadata,
        )


def _truths(data: Dataset) -> Iterator[tuple[str, str, OccupancyTruth]]:
    """(episode_id, scene_id, occupancy truth) of every episode, one at a time."""
    for episode_id in data.episode_ids:
        if faults := verify_unit(data.root, episode_id, "truth/"):
            raise DataError(f"{faults[0]}; a score on it would be of other data (hsbench verify lists every fault)")
    for row, episode in zip(data.rows, replace(data, truth=True, frames=False), strict=True):
        truth = None if episode.truth is None else episode.truth.occupancy
        if truth is None:
            raise DataError(f"episode {episode.episode_id} has no occupancy truth; scoring needs open truth")
        yield episode.episode_id, row["scene_id"], truth
