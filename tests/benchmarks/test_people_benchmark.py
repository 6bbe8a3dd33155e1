"""How long it takes to walk and to pose people, in microseconds a frame and in times real time for three at 30 Hz; and
how many activity maps are made a second.
"""

from __future__ import annotations

import os
import resource
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hsbench.io.episodes import write_episode
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Idle, concatenate, pose_block, standing
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.motion import SeatPose, gesture, sit_down, walk
from hsbench.synth.recipes import Unit, find_recipe
from hsbench.synth.seeds import Seeds

FPS, PEOPLE = 30, 3
WARM_UP_SCENES = 3
BODY = Body(1.72)
SEAT = SeatPose((-0.35, 0.0, 0.55), 0.0, ((0.17, 0.09, 0.0275), (0.17, -0.09, 0.0275)))
ROUTE = np.array([[0.0, 0.0], [2.5, 0.0], [2.8, 0.3], [2.8, 2.2], [0.0, 0.0]])


def per_frame(what: str, seconds: float, frames: int) -> None:
    """Print a time. No assertion: speed depends on the machine."""
    print(f"\n{what}: {seconds / frames * 1e6:.2f} us a frame, {frames / FPS / PEOPLE / seconds:.0f}x real time")


def test_posing_ten_minutes(benchmark: Any) -> None:
    start = standing(BODY, np.zeros(2), 0.0)
    way = walk(BODY, start, ROUTE, 0.0, 1.2, FPS)
    down = sit_down(way, SEAT, 1.3, FPS)
    eating = gesture(down, "eat", 10.0, FPS, np.random.default_rng(0))
    round_trip = concatenate([way, down, eating, down.backwards()])
    life = concatenate([round_trip] * (10 * 60 * FPS // len(round_trip)))
    idle = Idle.sample(np.random.default_rng(0))
    joints = benchmark.pedantic(pose_block, (BODY, life, 0, FPS, idle), rounds=9, warmup_rounds=1)
    assert limit_violations(joints).max() < 2e-3
    if benchmark.enabled:
        per_frame("posing a life (goal 10 us)", benchmark.stats.stats.min, len(life))


def test_planning_a_walk(benchmark: Any) -> None:
    start = standing(BODY, ROUTE[0], 0.0)
    way = benchmark.pedantic(walk, (BODY, start, ROUTE, 0.0, 1.2, FPS), rounds=50, warmup_rounds=2)
    joints = pose_block(BODY, way, 0, FPS, None)
    assert np.linalg.norm(joints[-1, J["spine_base"], :2] - ROUTE[-1]) < 0.05
    if benchmark.enabled:
        per_frame("planning a walk", benchmark.stats.stats.min, len(way))


@pytest.mark.slow
def test_activity_maps(benchmark: Any, tmp_path: Path) -> None:
    """Samples a second of five-minute lives, 256 x 256 cells each, scenes and truth included, by one process; and what
    memory they take. 10,000 samples: HSBENCH_MAP_SCENES=500.
    """
    scenes = int(os.environ.get("HSBENCH_MAP_SCENES", "3"))
    first_mb = maps_of(range(WARM_UP_SCENES), tmp_path)[-1]
    measured = range(WARM_UP_SCENES, WARM_UP_SCENES + scenes)
    samples, made_s, written_s, last_mb = benchmark.pedantic(maps_of, (measured, tmp_path), rounds=1)
    assert samples >= scenes
    print(f"\nactivity maps: {samples / made_s:.1f} samples a second (goal 30), ", end="")
    print(f"{samples / (made_s + written_s):.1f} with writing; peak memory {first_mb:.0f} MB after the first")
    print(f"{WARM_UP_SCENES} scenes, {last_mb:.0f} MB after {scenes} more, {samples} samples")


def maps_of(scenes: range, folder: Path) -> tuple[int, float, float, float]:
    """How many samples some scenes give, CPU seconds to make and to write them, and the peak memory so far in MB."""
    recipe = find_recipe("activity-maps")
    config = {**recipe.config, "life": {**recipe.config["life"], "minutes": [5.0, 5.0]}}
    samples, made_s, written_s = 0, 0.0, 0.0
    for number in scenes:
        unit = Unit(Seeds(0).child("scene").child(number), number, "train", "none", None)
        times = [time.process_time()]
        episodes = list(recipe.build(config, unit))
        times.append(time.process_time())
        for episode in episodes:
            write_episode(folder / episode.episode_id, episode, unit.scene_id, unit.split)
            shutil.rmtree(folder / episode.episode_id)
        times.append(time.process_time())
        samples, made_s, written_s = (
            samples + len(episodes),
            made_s + times[1] - times[0],
            written_s + times[2] - times[1],
        )
    return samples, made_s, written_s, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
