"""Running a method over a data set: predictions lie on disk as a submission before anything is scored."""

from __future__ import annotations

import secrets
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from hsbench.baselines.method import Method, Predictor, Settings
from hsbench.baselines.model_card import bundled, read_card
from hsbench.baselines.registry import find
from hsbench.datasets.dataset import Dataset, load
from hsbench.errors import DataError
from hsbench.submission.metadata import Metadata
from hsbench.submission.pack import SubmissionWriter
from hsbench.synth.executors import Processes, in_order
from hsbench.tasks.registry import task

AUTHORS = ("The hsbench developers",)


def predict(
    method: Method,
    data: Dataset,
    out: Path,
    *,
    train: Dataset | None = None,
    seed: int = 0,
    weights: Path | None = None,
    replace_out: bool = False,
    workers: int = 1,
) -> Generator[str, None, None]:
    """Write a method's submission for every episode of ``data`` to ``out``, yielding each id when it is answered.

    train: episodes with truth, for the methods that are fitted; default the train split of the same data set. No method
    but an oracle is handed truth of what it answers. weights: of a network, in place of those that come with hsbench.
    The folder appears when all is done. workers: processes, each of which prepares the method for itself; with several
    it is one of ``METHODS``. The bytes do not depend on them. Raises DataError for missing inputs, and for weights that
    the method does not take.
    """
    spec = task(method.task)
    if method.needs_train and train is None and any(r["split"] == "train" for r in load(data.root).rows):
        train = load(data.root, "train")
    if train is not None:
        train = replace(train, truth=True)
    data = replace(data, truth=method.oracle)
    trained_on = _trained_on(method, data, weights)
    answers = _answers(method, Settings(data, train, seed, weights), min(workers, len(data)))
    metadata = Metadata(
        task=spec.name,
        task_version=spec.version,
        method=method.name,
        track=method.track,
        authors=AUTHORS,
        causal=True,
        training_data=trained_on,
    )
    with closing(answers), SubmissionWriter(out, spec, metadata, replace=replace_out) as writer:
        for episode_id, answer in zip(data.episode_ids, answers, strict=True):
            writer.add(episode_id, answer)
            yield episode_id


def _trained_on(method: Method, data: Dataset, weights: Path | None) -> tuple[str, ...]:
    """What a submission names as training data. Raises DataError for weights that the method does not take."""
    if method.weights is None:
        if weights is not None:
            raise DataError(f"{method.name} has no weights; leave out {weights}, or choose a method that is a network")
        return (f"{data.name}/train",) if method.needs_train else ()
    return (f"{read_card(weights or bundled(method.weights))['data']['name']}/train",)


def _answers(method: Method, settings: Settings, workers: int) -> Generator[Any, None, None]:
    """The answers of a method to the episodes, in order."""
    if workers > 1:
        job = _Job(method.name, method.task, secrets.token_hex(), settings)
        return in_order(
            Processes(workers, recycled_after=len(settings.data)), partial(_answer, job), settings.data.episode_ids
        )
    answer = method.prepare(settings)
    return (answer(episode) for episode in settings.data)


@dataclass(frozen=True)
class _Job:
    """A method by name, and what it is prepared with; jobs of one run, told by its token, are equal in any process."""

    method: str
    task: str
    run: str
    settings: Settings = field(compare=False)


def _answer(job: _Job, episode_id: str) -> Any:
    return _prepared(job)(job.settings.data.episode(episode_id))


@lru_cache(maxsize=1)
def _prepared(job: _Job) -> Predictor:
    """The method prepared: once a process, as fitting takes long."""
    return find(job.method, job.settings.data.name, job.task).prepare(job.settings)
