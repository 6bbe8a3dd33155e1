"""Seconds of scoring a split on disk, printed with their goal, and how many times faster than the plain loops that it
agrees with.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench import load
from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.evaluation.score import score
from hsbench.io.atomic import write_json
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import DATASET_FILE, unit_folders, write_index
from hsbench.io.splits import read_splits
from hsbench.io.strict_json import read_json
from hsbench.schema import AffordanceTruth
from hsbench.submission import Metadata, write_submission
from hsbench.synth.generate import Job, generate
from hsbench.tasks import TaskSpec, task
from hsbench.tasks.spec import PlanGrid
from tests.benchmarks.ratios import report
from tests.reference import affordance_from_tasks, completion_from_tasks

SPLITS = (("scene-completion", "rgbd-activity", 200, 60.0), ("affordance-topdown", "activity-360", 40, 20.0))
"""Task, data set, episodes of a split, and seconds in which two cores should score it."""

PLANS = 10
AT_LEAST = 5.0
"""Loops over voxels cannot be so near; slower than this, something is wrong whatever the machine."""


def made(name: str, folder: Path) -> None:
    """The rooms of split val of size mini, at full length, without pictures."""
    units = tuple(unit for unit in read_splits(name).numbers("mini") if unit[1] == "val")
    for _ in generate(Job(name, 0, units, "none", "raycast"), folder / "data"):
        pass


def copies(source: Path, count: int, out: Path) -> Path:
    """A data set of ``count`` episodes under names and scenes of their own, which are those of ``source`` by turns."""
    units = unit_folders(source)
    for number in range(count):
        unit = units[number % len(units)]
        episode_id = f"{unit.name.rpartition('-')[0]}-{900_000 + number}"
        new = Path(shutil.copytree(unit, out / "episodes" / episode_id, copy_function=os.link))
        for name, changed in (
            ("episode.json", {"episode_id": episode_id}),
            ("index.json", {"episode_id": episode_id, "scene_id": f"scene-{900_000 + number}"}),
        ):
            known = read_json(new / name)
            (new / name).unlink()  # a link to the file of the source
            write_json(new / name, known | changed)
        (new / "manifest.json").unlink()
        write_json(new / "manifest.json", manifest(new))
    shutil.copy(source / DATASET_FILE, out)
    write_index(out)
    return out


@pytest.mark.slow
@pytest.mark.parametrize(("name", "dataset", "count", "goal_s"), SPLITS, ids=[name for name, *_ in SPLITS])
def test_seconds_of_a_split(
    benchmark: Any,
    made_once: Callable[[str, Callable[[Path], None]], Path],
    tmp_path: Path,
    name: str,
    dataset: str,
    count: int,
    goal_s: float,
) -> None:
    """Check, hashes, reading, counting and intervals of a whole split on disk; its rooms are copies of two."""
    source = made_once(f"scored-{dataset}", lambda folder: made(dataset, folder)) / "data"
    count = len(load(source)) + 1 if benchmark.disabled else count
    spec, data = task(name), load(copies(source, count, tmp_path / "data"), frames=False)
    rng = np.random.default_rng(0)
    noise = ((episode_id, rng.random(like(spec)) < 0.3) for episode_id in data.episode_ids)
    write_submission(tmp_path / "s", spec, Metadata(spec.name, spec.version, "noise", "poses"), noise)
    start = time.perf_counter()
    got = benchmark.pedantic(score, (name, tmp_path / "s", data), rounds=1)
    seconds = time.perf_counter() - start
    assert (got.counts.scored, got.counts.scenes) == (count, count)
    if benchmark.stats:
        print(f"\n{name}, {count} episodes on disk: {seconds:.1f} s on one core (goal {goal_s:g} s on two)")


def like(spec: TaskSpec) -> tuple[int, ...]:
    """The shape of an answer."""
    assert spec.grid is not None
    return (3, *spec.grid.shape) if isinstance(spec.grid, PlanGrid) else spec.grid.shape


@pytest.mark.slow
def test_scene_completion_from_disk_against_plain_loops(benchmark: Any, rgbd: Path, tmp_path: Path) -> None:
    """Check, reading and counting, against counting alone."""
    spec, data = task("scene-completion"), load(rgbd, frames=False)
    rng = np.random.default_rng(0)
    answers = {episode_id: rng.random(spec.grid.shape) < 0.3 for episode_id in data.episode_ids}
    write_submission(tmp_path / "s", spec, Metadata(spec.name, spec.version, "noise", "poses"), answers.items())
    got = benchmark.pedantic(score, (spec.name, tmp_path / "s", data), rounds=3, warmup_rounds=1)
    assert got.counts.scored == len(data)
    if not benchmark.stats:
        return
    start = time.perf_counter()
    first = data.episode_ids[0]
    expected = completion_from_tasks.score_episode(rgbd / "episodes" / first, answers[first])
    theirs_s = time.perf_counter() - start
    assert tuple(got.episodes[0].statistics["occluded"]) == tuple(expected["occluded"])
    ours_s = benchmark.stats.stats.min / len(data)
    report("scene-completion, an episode", "plain loops", theirs_s, ours_s, AT_LEAST)
    assert theirs_s > AT_LEAST * ours_s


def test_affordance_topdown_against_plain_loops(benchmark: Any) -> None:
    """With the 41 factors of the scale-free score."""
    spec = task("affordance-topdown")
    rng = np.random.default_rng(0)
    shape = spec.grid.shape
    truths = [
        AffordanceTruth(rng.integers(0, 8, shape).astype(np.uint8), rng.random(shape) < 0.1) for _ in range(PLANS)
    ]
    episodes = [(f"ep-{k:02d}", f"room-{k:02d}", truth) for k, truth in enumerate(truths)]
    answers = {episode_id: rng.random((3, *shape)).astype(np.float32) for episode_id, _, _ in episodes}
    method = Metadata(spec.name, spec.version, "noise", "poses")

    def scored() -> Report:
        where = DatasetRef(spec.datasets[0], "0", "ab" * 32)
        return score_episodes(episodes, answers, spec=spec, dataset=where, split="val", method=method)

    got = benchmark.pedantic(scored, rounds=2, warmup_rounds=1)
    assert got.counts.scored == PLANS
    if not benchmark.stats:
        return
    planes = [(truths[0].labels >> k & 1).astype(bool).tolist() for k in range(3)]
    one = [(planes, answers["ep-00"].tolist(), truths[0].ignored.tolist())]
    start = time.perf_counter()
    affordance_from_tasks.metric(one)
    affordance_from_tasks.exclusive(one)
    affordance_from_tasks.scale_free(one)
    theirs_s = time.perf_counter() - start
    ours_s = benchmark.stats.stats.min / PLANS
    report("affordance-topdown, an episode", "plain loops", theirs_s, ours_s, AT_LEAST)
    assert theirs_s > AT_LEAST * ours_s
