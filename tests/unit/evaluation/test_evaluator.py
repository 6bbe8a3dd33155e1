"""Scoring in memory: the numbers of a submission, in any order and in parts."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.errors import DataError, SchemaError
from hsbench.evaluation import DatasetRef
from hsbench.evaluation.evaluator import Evaluator
from hsbench.evaluation.score import score
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task

SPEC = task("scene-completion")
METHOD = Metadata(SPEC.name, SPEC.version, "noise", "poses")


def answer(episode_id: str) -> np.ndarray:
    return np.random.default_rng(int(episode_id[-2:])).random(SPEC.grid.shape) < 0.3


def test_the_report_is_that_of_a_submission_whatever_the_workers(rgbd: Path, tmp_path: Path) -> None:
    data = load(rgbd, truth=True, frames=False)
    write_submission(tmp_path / "s", SPEC, METHOD, [(e.episode_id, answer(e.episode_id)) for e in data])
    expected = score(SPEC.name, tmp_path / "s", load(rgbd, frames=False))
    workers = [Evaluator(SPEC.name), Evaluator(SPEC.name)]
    for k, episode in enumerate(reversed(list(data))):
        workers[k % 2].add(episode, answer(episode.episode_id))
    workers[1].merge(pickle.loads(pickle.dumps(workers[0])))  # as from another process
    description = data.description
    where = DatasetRef(description["name"], description["splits_version"], data.manifest_sha256)
    assert workers[1].report(where, "all", METHOD).to_json() == expected.to_json()
    assert workers[1].metrics() == expected.metrics


def test_refusals(rgbd: Path) -> None:
    episode = load(rgbd, "val", truth=True, frames=False)[0]
    one = Evaluator(SPEC.name)
    with pytest.raises(SchemaError, match="no episode was added"):
        one.metrics()
    with pytest.raises(DataError, match="load with truth=True"):
        one.add(dataclasses.replace(episode, truth=None), answer(episode.episode_id))
    with pytest.raises(SchemaError, match="expected bool"):
        one.add(episode, np.zeros(SPEC.grid.shape))
    one.add(episode, None)
    assert one.metrics()[SPEC.primary_metric].value == 0.0
    with pytest.raises(SchemaError, match="was added before"):
        one.add(episode, None)
    with pytest.raises(SchemaError, match="was added before"):
        one.merge(one)
    with pytest.raises(SchemaError, match="only one task merges"):
        one.merge(Evaluator("affordance-view"))
    with pytest.raises(SchemaError, match="task 'completion' is unknown"):
        Evaluator("completion")
