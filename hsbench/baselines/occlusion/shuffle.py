"""The control "shuffled activity" of carving: another episode's activity about the centre of this one's boundary."""

from __future__ import annotations

import numpy as np

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.boundary import Boundary
from hsbench.tasks.shuffle import turn_inside, turned


def shuffled_activity(
    other: Activity, other_boundary: Boundary, boundary: Boundary, rng: np.random.Generator
) -> Activity:
    """The activity of another episode moved into this one: boundary centre onto boundary centre, turned, clipped."""
    centres = other_boundary.centre, boundary.centre
    angle, inside = turn_inside(other.position, boundary.corners, rng, *centres)
    position = turned(other.position[inside], angle, *centres)
    return Activity(position, other.action[inside], other.pelvis_m[inside])
