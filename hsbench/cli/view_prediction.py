"""What ``hsbench view --prediction`` reads: an episode, and its answer in a submission."""

from __future__ import annotations

from pathlib import Path

from hsbench.datasets.dataset import load
from hsbench.errors import DataError, HsbenchError, SubmissionError
from hsbench.io.episodes import read_episode
from hsbench.io.strict_json import parse_json
from hsbench.schema.episode import Episode
from hsbench.submission import Predictions, open_submission, prediction_file, read_metadata
from hsbench.submission.layout import METADATA_FILE
from hsbench.submission.read import SubmissionFiles
from hsbench.tasks import TaskSpec, task
from hsbench.viz.prediction import TASKS, Answer


def read_answer(data: Path, episode_id: str | None, submission: Path) -> tuple[Episode, Answer]:
    """The episode, with truth where it is there, and its answer.

    data: a data set or the folder of one episode. episode_id: None = the first one that has an answer.
    Raises HsbenchError for a submission of another task or without an answer, DataError for a damaged one.
    """
    with open_submission(submission) as files:
        data_bytes = files.read(METADATA_FILE)
        spec = _task(data_bytes, submission)
        metadata, faults = read_metadata(data_bytes, spec)
        if metadata is None:
            raise SubmissionError(faults)
        episode = _episode(data, episode_id, files, spec, submission)
        value = Predictions(files, spec).get(episode.episode_id)
    if value is None:
        name = prediction_file(spec, episode.episode_id)
        raise HsbenchError(f"{submission} has no prediction of {episode.episode_id}; expected {name} (another split?)")
    return episode, Answer(spec.name, metadata.method, value)


def _task(data: bytes, submission: Path) -> TaskSpec:
    """The task a submission is of. Raises HsbenchError where it is none that can be drawn."""
    value = parse_json(data)
    name = value.get("task") if isinstance(value, dict) else None
    if name not in TASKS:
        raise HsbenchError(f"{submission} is of task {str(name)[:80]!r}; view --prediction draws {' and '.join(TASKS)}")
    return task(str(name))


def _episode(data: Path, episode_id: str | None, files: SubmissionFiles, spec: TaskSpec, submission: Path) -> Episode:
    if (data / "episode.json").is_file():
        if episode_id is not None and episode_id != data.name:
            raise HsbenchError(f"{data} is the folder of one episode; expected no --episode, or a data set")
        return read_episode(data, truth=True)
    episodes = load(data, truth=True)
    if episode_id is None:
        names = frozenset(files.names)
        answered = (e for e in episodes.episode_ids if prediction_file(spec, e) in names)
        episode_id = next(answered, None)
    if episode_id is None:
        raise DataError(f"{submission} has no prediction of any episode of {data} (made on another data set?)")
    return episodes.episode(episode_id)
