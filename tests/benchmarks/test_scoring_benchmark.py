"""Seconds of scoring a split, printed with its goal, and how many times faster than the plain loops it agrees with."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench import load
from hsbench.evaluation import DatasetRef, Report, score_episodes
from hsbench.evaluation.score import score
from hsbench.schema import AffordanceTruth
from hsbench.submission import Metadata, write_submission
from hsbench.tasks import task
from tests.benchmarks.ratios import report
from tests.reference import affordance_from_tasks, completion_from_tasks

ROOMS, ROOMS_GOAL_S = 200, 60.0
PLANS, PLANS_GOAL_S = 40, 20.0
AT_LEAST = 5.0
"""Loops over voxels cannot be so near; slower than this, something is wrong whatever the machine."""


def show(what: str, count: int, seconds: float, goal_s: float) -> None:
    print(f"\n{what}, {count} episodes: {seconds:.1f} s on one core (goal {goal_s:g} s on two)")


@pytest.mark.slow
def test_a_split_of_scene_completion_from_disk(benchmark: Any, rgbd: Path, tmp_path: Path) -> None:
    """Check, reading and counting of the episodes at hand, taken as often as a split of 200 has them."""
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
    show("scene-completion", ROOMS, ROOMS * ours_s, ROOMS_GOAL_S)
    report("scene-completion, an episode", "plain loops", theirs_s, ours_s, AT_LEAST)
    assert theirs_s > AT_LEAST * ours_s


def test_a_split_of_affordance_topdown(benchmark: Any) -> None:
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
    show("affordance-topdown", PLANS, PLANS * ours_s, PLANS_GOAL_S)
    report("affordance-topdown, an episode", "plain loops", theirs_s, ours_s, AT_LEAST)
    assert theirs_s > AT_LEAST * ours_s
