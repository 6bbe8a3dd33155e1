"""The control "shuffled activity": poses of another episode, turned, clipped to the estimated boundary.

It keeps what any room's activity has in common (people are in the middle, not in the walls) and removes what this
room's activity says. Of evenly spaced turns from a random start the one that keeps most poses inside is taken, so
that the control is not weak for want of poses.
"""

from __future__ import annotations

import numpy as np

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.boundary import Boundary
from hsbench.typing import BoolArray, FloatArray

TURNS = 36


def shuffled_activity(
    other: Activity, other_boundary: Boundary, boundary: Boundary, rng: np.random.Generator
) -> Activity:
    """The activity of another episode moved into this one: boundary centre onto boundary centre, turned, clipped."""
    offset = other.position - other_boundary.centre
    start = rng.uniform(0.0, 2 * np.pi)
    best: tuple[FloatArray, BoolArray] | None = None
    for angle in start + 2 * np.pi * np.arange(TURNS) / TURNS:
        c, s = np.cos(angle), np.sin(angle)
        position = offset @ np.array([[c, s], [-s, c]]) + boundary.centre
        inside = boundary.contains(position)
        if best is None or inside.sum() > best[1].sum():
            best = position, inside
    assert best is not None
    position, inside = best
    return Activity(position[inside], other.action[inside], other.pelvis_m[inside])
