"""Running a method over a data set: predictions lie on disk as a submission before anything is scored."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from hsbench.baselines.method import Method, Settings
from hsbench.datasets.dataset import Dataset, load
from hsbench.submission.metadata import Metadata
from hsbench.submission.pack import SubmissionWriter
from hsbench.tasks.registry import task

AUTHORS = ("The hsbench developers",)


def predict(
    method: Method, data: Dataset, out: Path, *, train: Dataset | None = None, seed: int = 0, replace_out: bool = False
) -> Iterator[str]:
    """Write a method's submission for every episode of ``data`` to ``out``, yielding each id when it is answered.

    train: episodes with truth, for the methods that are fitted; default the train split of the same data set. No method
    but an oracle is handed truth of what it answers. The folder appears when all is done. Raises DataError for missing
    inputs.
    """
    spec = task(method.task)
    if method.needs_train and train is None and any(r["split"] == "train" for r in load(data.root).rows):
        train = load(data.root, "train")
    if train is not None:
        train = replace(train, truth=True)
    data = replace(data, truth=method.oracle)
    answer = method.prepare(Settings(data, train, seed))
    metadata = Metadata(
        task=spec.name,
        task_version=spec.version,
        method=method.name,
        track=method.track,
        authors=AUTHORS,
        causal=True,
        training_data=(f"{data.name}/train",) if method.needs_train else (),
    )
    with SubmissionWriter(out, spec, metadata, replace=replace_out) as writer:
        for episode in data:
            writer.add(episode.episode_id, answer(episode))
            yield episode.episode_id
