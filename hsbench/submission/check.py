"""Checking a submission without any truth: every fault in one run, each in one line that names its file."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from functools import partial
from math import inf
from pathlib import Path

from hsbench.errors import DataError, SubmissionError
from hsbench.io.arrays import collect_npz
from hsbench.io.dataset_index import DATASET_FILE
from hsbench.schema.episode import Episode
from hsbench.submission.layout import METADATA_FILE, PREDICTIONS_FOLDER, SubmittedTask, prediction_file
from hsbench.submission.metadata import read_metadata
from hsbench.submission.read import SubmissionFiles, open_submission

Inputs = Callable[[str], Episode]
"""Episode id -> the episode, inputs alone."""

FORM = "; expected"  # a fault of an array's dtype or shape says so


def check(
    path: str | Path,
    task: SubmittedTask,
    episode_ids: Sequence[str],
    *,
    allow_missing: bool = False,
    inputs: Inputs | None = None,
    durations_s: Mapping[str, float] | None = None,
) -> list[str]:
    """Every fault of a submission; empty where it may be scored.

    path: a folder or a zip. episode_ids: the episodes of the split. allow_missing: an episode without prediction is
    then no fault (the scorer counts it as the task's missing answer). inputs: for what must fit them, such as one
    label a pose. durations_s: of the episodes: after its end, an episode has its whole answer alone; before, it has an
    answer at each time at which another has one. What is not given is not checked against.
    """
    if (Path(path) / DATASET_FILE).is_file():
        return [f"{path} is a data set, not a submission (are the two arguments swapped?)"]
    try:
        with open_submission(path) as files:
            return _faults(files, task, episode_ids, allow_missing, inputs, durations_s or {})
    except DataError as error:
        return [str(error)]


def check_or_raise(
    path: str | Path,
    task: SubmittedTask,
    episode_ids: Sequence[str],
    *,
    allow_missing: bool = False,
    inputs: Inputs | None = None,
) -> None:
    """Raise SubmissionError with every fault of ``check``, if there is one."""
    faults = check(path, task, episode_ids, allow_missing=allow_missing, inputs=inputs)
    if faults:
        raise SubmissionError(faults)


def _faults(
    files: SubmissionFiles,
    task: SubmittedTask,
    episode_ids: Sequence[str],
    allow_missing: bool,
    inputs: Inputs | None,
    durations_s: Mapping[str, float],
) -> list[str]:
    names = frozenset(files.names)
    known = frozenset(episode_ids)
    faults = list(files.faults) + _metadata_faults(files, task)
    moments: list[float | None] = [None, *task.observation_times_s[:-1]]
    expected = {prediction_file(task, e, moment): (e, moment) for e in episode_ids for moment in moments}
    if not allow_missing:
        complete = (prediction_file(task, episode_id) for episode_id in episode_ids)
        faults.extend(f"{name}: missing" for name in complete if name not in names | files.refused)
        faults.extend(_missing_moments(expected, names | files.refused, durations_s))
    allowed = {METADATA_FILE, *expected}
    faults.extend(_unexpected(name, task, known) for name in files.names if name not in allowed)
    for name, (episode_id, moment) in expected.items():
        if name in names and moment is not None and moment >= durations_s.get(episode_id, inf):
            ends = f"the episode ends after {durations_s[episode_id]:g} s; then its answer is the file without '@'"
            faults.append(f"{name!r}: unexpected file ({ends})")
        elif name in names:
            episode = None if inputs is None else partial(_seen, inputs, episode_id, moment)
            faults.extend(_prediction_faults(files, name, task, episode))
    return faults


def _missing_moments(
    expected: Mapping[str, tuple[str, float | None]], present: frozenset[str], durations_s: Mapping[str, float]
) -> Iterator[str]:
    """Answers that one episode lacks at a time before its end, and another has."""
    moments = {moment for name, (_, moment) in expected.items() if moment is not None and name in present}
    for name, (episode_id, moment) in expected.items():
        if moment in moments and name not in present and moment < durations_s.get(episode_id, 0.0):
            yield f"{name}: missing (other episodes have an answer after {moment:g} s)"


def _metadata_faults(files: SubmissionFiles, task: SubmittedTask) -> list[str]:
    if METADATA_FILE in files.refused:
        return []
    if METADATA_FILE not in files.names:
        inner = next((name for name in files.names if name.endswith("/" + METADATA_FILE)), None)
        hint = f" (found {inner!r}: pack what is in the folder, not the folder)" if inner else ""
        return [f"{METADATA_FILE}: missing{hint}"]
    try:
        data = files.read(METADATA_FILE)
    except DataError as error:
        return [str(error)]
    return read_metadata(data, task)[1]


def _unexpected(name: str, task: SubmittedTask, episode_ids: Container[str]) -> str:
    stem = name.removeprefix(PREDICTIONS_FOLDER + "/").removesuffix(task.prediction.suffix)
    if prediction_file(task, stem) != name:
        hint = f"no part of a submission: {METADATA_FILE} and {prediction_file(task, '<episode_id>')}"
    elif stem.partition("@")[0] in episode_ids:
        times = ", ".join(f"{t:g}" for t in task.observation_times_s[:-1])
        apart = f"times apart are {times} s; the last time" if times else "no times apart; the answer"
        hint = f"{apart} is the file without '@'"
    else:
        hint = "no episode of this split"
    return f"{name!r}: unexpected file ({hint})"


def _seen(inputs: Inputs, episode_id: str, until_s: float | None) -> Episode:
    episode = inputs(episode_id)
    return episode if until_s is None else episode.until(until_s)


def _prediction_faults(
    files: SubmissionFiles, name: str, task: SubmittedTask, episode: Callable[[], Episode] | None
) -> list[str]:
    try:
        data = files.read(name)
    except DataError as error:
        return [str(error)]
    form = task.prediction
    arrays, faults = collect_npz(data, form.arrays, form.max_bytes)
    if not faults:
        faults = form.faults(arrays)
        if not faults and form.misfits is not None and episode is not None:
            faults = form.misfits(arrays, episode())
        return [f"{name}: {fault}" for fault in faults]
    hint = f" ({form.hint})" if form.hint else ""
    return [f"{name}: {fault}{hint if FORM in fault else ''}" for fault in faults]
