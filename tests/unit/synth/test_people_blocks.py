"""A life posed in blocks has the joints of the life posed at once, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import OVERLAP_S, Channels, Idle, concatenate, pose, pose_block, standing
from hsbench.synth.people.motion import GESTURES, SeatPose, gesture, reach, sit_down, stand, walk
from hsbench.synth.people.style import Style

FPS = 30
BODY = Body(1.68, style=Style(gaze=1.3, lean_rad=0.03))
SEAT = SeatPose((-0.35, 0.0, 0.55), 0.0, ((0.17, 0.09, 0.0275), (0.17, -0.09, 0.0275)))


def life() -> Channels:
    rng = np.random.default_rng(5)
    chunks = [standing(BODY, np.zeros(2), 0.0)]
    for kind in GESTURES:
        to = rng.uniform(-2, 2, 2)
        chunks.append(walk(BODY, chunks[-1], np.array([chunks[-1].xy[-1], to, [0.0, 0.0]]), 0.0, 1.3, FPS))
        chunks.append(sit_down(chunks[-1], SEAT, 1.3, FPS))
        down = chunks[-1]
        chunks.append(gesture(down, kind, 4.0, FPS, rng))
        chunks.append(down.backwards())
        out = reach(down.backwards(), 1, np.array([0.4, -0.2, 0.9]), 0.2, 0.03, 0.8, FPS)
        chunks += [out, stand(out, 1.0, FPS), out.backwards()]
    return concatenate(chunks)


@pytest.mark.parametrize("block_s", [7, 60, 1.1])
def test_blocks_are_the_whole(block_s: float) -> None:
    channels, idle = life(), Idle.sample(np.random.default_rng(2))
    whole = pose_block(BODY, channels, 0, FPS, idle)
    more, size = int(np.ceil(OVERLAP_S * FPS)), round(block_s * FPS)
    parts = []
    for first in range(0, len(channels), size):
        begin, end = max(first - more, 0), min(first + size + more, len(channels))
        joints = pose_block(BODY, channels.part(begin, end), begin, FPS, idle)
        parts.append(joints[first - begin : first - begin + size])
    assert np.array_equal(np.concatenate(parts), whole)


def test_pose_is_the_block_that_is_all() -> None:
    channels = life()
    idle = Idle.sample(np.random.default_rng(7))
    assert np.array_equal(pose(BODY, channels, FPS, np.random.default_rng(7)), pose_block(BODY, channels, 0, FPS, idle))


def test_idle_motion_follows_absolute_time() -> None:
    still, idle = stand(standing(BODY, np.zeros(2), 0.0), 20.0, FPS), Idle.sample(np.random.default_rng(3))
    early, late = (pose_block(BODY, still, first, FPS, idle) for first in (0, 300))
    assert np.array_equal(early[300:], late[:300])
    assert not np.array_equal(early[:300], late[:300])
