"""The course of a movement: how many frames it takes, and how it starts and stops."""

from __future__ import annotations

import numpy as np

from hsbench.typing import FloatArray


def frames_of(duration_s: float, fps: float) -> int:
    """Frames of a duration, at least one."""
    return max(1, round(duration_s * fps))


def shares_of(duration_s: float, fps: float) -> FloatArray:
    """(T,) share of a movement that is over after each of its frames: the last is 1."""
    n = frames_of(duration_s, fps)
    return np.arange(1, n + 1) / n


def smooth(share: FloatArray) -> FloatArray:
    """Minimum-jerk rise from 0 to 1 over share 0..1 (Flash & Hogan 1985)."""
    x = np.clip(share, 0.0, 1.0)
    return np.asarray(x * x * x * (10 - 15 * x + 6 * x * x))
