"""Writing a submission: the folder appears under its name when it is whole, or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

from hsbench.errors import DataError, SchemaError, SubmissionError
from hsbench.io.arrays import npz_bytes
from hsbench.io.atomic import atomic_folder, json_bytes
from hsbench.io.dataset_index import require_outside
from hsbench.schema.episode import check_id
from hsbench.submission.layout import METADATA_FILE, PREDICTIONS_FOLDER, SubmittedTask, prediction_file
from hsbench.submission.metadata import Metadata, read_metadata


class SubmissionWriter:
    """Builds a submission episode by episode; use it in a ``with`` statement, or call ``finish``.

    An exception inside the ``with`` leaves nothing behind. Raises SubmissionError at once where the metadata would
    not pass the check, and DataError where ``path`` exists and ``replace`` is False, or lies inside of a data set.
    """

    def __init__(self, path: str | Path, task: SubmittedTask, metadata: Metadata, *, replace: bool = False) -> None:
        self._task = task
        encoded = json_bytes(metadata.to_json())
        _, faults = read_metadata(encoded, task)
        if faults:
            raise SubmissionError(faults)
        require_outside(path)
        if replace:
            refuse_foreign(path)
        self._open = ExitStack()
        self._folder = self._open.enter_context(atomic_folder(path, replace=replace))
        (self._folder / METADATA_FILE).write_bytes(encoded)
        (self._folder / PREDICTIONS_FOLDER).mkdir()

    def add(self, episode_id: str, prediction: Any, until_s: float | None = None) -> None:
        """Write the prediction of one episode, in the form the task's ``encode`` takes.

        until_s: the observation time it was made at; None or the last time = after the whole observation.
        Raises SchemaError where the prediction does not fit, the time is none of the task's, or it was given before.
        """
        check_id(episode_id, "episode_id")
        times = self._task.observation_times_s
        if until_s is not None and until_s not in times:
            allowed = f"one of {', '.join(f'{t:g}' for t in times)} s" if times else "None: one answer an episode"
            raise SchemaError(f"until_s is {until_s}; expected {allowed}")
        name = prediction_file(self._task, episode_id, until_s)
        file = self._folder / name
        if file.exists():
            raise SchemaError(f"{name} was added before; expected one prediction per episode and observation time")
        try:
            data = npz_bytes(self._task.prediction.encode(prediction))
        except SchemaError as error:
            raise SchemaError(f"episode {episode_id}: {error}") from error
        file.write_bytes(data)

    def finish(self) -> None:
        """Move the submission to its place. Nothing can be added afterwards."""
        self._open.close()

    def __enter__(self) -> SubmissionWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.__exit__(kind, error, trace)


def refuse_foreign(path: str | Path) -> None:
    """Raise DataError unless ``path`` is free, or a submission and nothing else, which may be replaced."""
    place = Path(path)
    if not place.exists():
        return
    ours = {METADATA_FILE, PREDICTIONS_FOLDER}
    if not place.is_dir() or not (place / METADATA_FILE).is_file() or {p.name for p in place.iterdir()} - ours:
        raise DataError(f"{place} is no submission, or holds other things too; only a submission is replaced")


def write_submission(
    path: str | Path,
    task: SubmittedTask,
    metadata: Metadata,
    predictions: Iterable[tuple[str, Any]],
    *,
    replace: bool = False,
) -> None:
    """Write a whole submission from (episode_id, prediction) pairs, each taken and written in turn."""
    with SubmissionWriter(path, task, metadata, replace=replace) as writer:
        for episode_id, prediction in predictions:
            writer.add(episode_id, prediction)
