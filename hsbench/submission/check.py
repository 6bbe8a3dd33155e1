"""Checking a submission without any truth: every fault in one run, each in one line that names its file."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path

from hsbench.errors import DataError, SubmissionError
from hsbench.io.arrays import collect_npz
from hsbench.submission.layout import METADATA_FILE, SubmittedTask, prediction_file
from hsbench.submission.metadata import read_metadata
from hsbench.submission.read import SubmissionFiles, open_submission


def check(
    path: str | Path, task: SubmittedTask, episode_ids: Sequence[str], *, allow_missing: bool = False
) -> list[str]:
    """Every fault of a submission; empty where it may be scored.

    path: a folder or a zip. episode_ids: the episodes of the split. allow_missing: an episode without prediction is
    then no fault (the scorer counts it as the task's missing answer).
    """
    try:
        with open_submission(path) as files:
            return _faults(files, task, episode_ids, allow_missing)
    except DataError as error:
        return [str(error)]


def check_or_raise(
    path: str | Path, task: SubmittedTask, episode_ids: Sequence[str], *, allow_missing: bool = False
) -> None:
    """Raise SubmissionError with every fault of ``check``, if there is one."""
    faults = check(path, task, episode_ids, allow_missing=allow_missing)
    if faults:
        raise SubmissionError(faults)


def _faults(files: SubmissionFiles, task: SubmittedTask, episode_ids: Sequence[str], allow_missing: bool) -> list[str]:
    names = set(files.names)
    faults = list(files.faults) + _metadata_faults(files, task)
    moments: list[float | None] = [None, *task.observation_times_s[:-1]]
    expected = [prediction_file(task, episode_id, moment) for episode_id in episode_ids for moment in moments]
    if not allow_missing:
        for episode_id in episode_ids:
            if prediction_file(task, episode_id) not in names:
                faults.append(f"{prediction_file(task, episode_id)}: missing")
    allowed = {METADATA_FILE, *expected}
    faults.extend(_unexpected(name, allowed, task) for name in files.names if name not in allowed)
    for name in expected:
        if name in names:
            faults.extend(_prediction_faults(files, name, task))
    return faults


def _metadata_faults(files: SubmissionFiles, task: SubmittedTask) -> list[str]:
    if METADATA_FILE not in files.names:
        inner = next((name for name in files.names if name.endswith("/" + METADATA_FILE)), None)
        hint = f" (found {inner!r}: pack what is in the folder, not the folder)" if inner else ""
        return [f"{METADATA_FILE}: missing{hint}"]
    try:
        data = files.read(METADATA_FILE)
    except DataError as error:
        return [str(error)]
    return read_metadata(data, task)[1]


def _unexpected(name: str, allowed: set[str], task: SubmittedTask) -> str:
    if "@" in name and not any(
        name.endswith(f"@{t:g}s{task.prediction.suffix}") for t in task.observation_times_s[:-1]
    ):
        times = ", ".join(f"{t:g}" for t in task.observation_times_s[:-1])
        hint = f" (times of their own: {times} s; the last time is the file without '@')"
    else:
        near = difflib.get_close_matches(name, sorted(allowed)[:2000], n=1, cutoff=0.8)
        hint = f" (meant for {near[0]}?)" if near else " (no episode of this split, or not part of a submission)"
    return f"{name!r}: unexpected file{hint}"


def _prediction_faults(files: SubmissionFiles, name: str, task: SubmittedTask) -> list[str]:
    try:
        data = files.read(name)
    except DataError as error:
        return [str(error)]
    _, faults = collect_npz(data, task.prediction.arrays, task.prediction.max_bytes)
    return [f"{name}: {fault}" for fault in faults]
