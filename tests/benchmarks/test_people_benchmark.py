"""How long it takes to walk and to pose people, in microseconds a frame and in times real time for three at 30 Hz."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Idle, concatenate, pose_block, standing
from hsbench.synth.people.joint_limits import limit_violations
from hsbench.synth.people.motion import SeatPose, gesture, sit_down, walk

FPS, PEOPLE = 30, 3
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
