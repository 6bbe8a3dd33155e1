"""Measures of a walk from its joints alone: where feet stand on the floor, and how far they slide while they do."""

from __future__ import annotations

import numpy as np

from hsbench.synth.people.body import (
    ANKLE_HEIGHT,
    BALL_FORWARD,
    BALL_HEIGHT,
    HEEL_BACK,
    SIDES,
    TOE_FORWARD,
    Body,
    J,
)
from hsbench.typing import BoolArray, FloatArray

ON_FLOOR_M = 0.003  # a sole's end this low bears weight


def soles(body: Body, joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T, 2, 2, 3) heel and toe end of the left and the right sole, in metres."""
    ends = np.empty((len(joints), 2, 2, 3))
    drop = np.arctan2(ANKLE_HEIGHT - BALL_HEIGHT, BALL_FORWARD)
    for side, name in enumerate(SIDES):
        ankle, ball = joints[:, J[f"ankle_{name}"]], joints[:, J[f"foot_{name}"]]
        bone = ball - ankle
        level = np.sqrt(np.sum(bone[:, :2] ** 2, axis=1))
        pitch = np.arctan2(-bone[:, 2], level) - drop
        heading = bone[:, :2] / np.maximum(level, 1e-9)[:, None]
        for end, (ahead, origin, down) in enumerate(
            ((-HEEL_BACK, ankle, ANKLE_HEIGHT), (TOE_FORWARD, ball, BALL_HEIGHT))
        ):
            along = body.of_stature(1) * (ahead * np.cos(pitch) - down * np.sin(pitch))
            fall = body.of_stature(1) * (ahead * np.sin(pitch) + down * np.cos(pitch))
            ends[:, side, end, :2] = origin[:, :2] + along[:, None] * heading
            ends[:, side, end, 2] = origin[:, 2] - fall
    return ends


def stance_slides(body: Body, joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (N,) metres that each end of a sole moves over the floor in each of its N rests on it."""
    ends = soles(body, joints).reshape(len(joints), 4, 3)
    slides = []
    for k in range(4):
        for first, last in _runs(ends[:, k, 2] < ON_FLOOR_M):
            steps = np.diff(ends[first : last + 1, k, :2], axis=0)
            slides.append(float(np.sum(np.sqrt(np.sum(steps**2, axis=1)))))
    return np.array(slides)


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    """First and last row of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
