"""What is likely to be done next: by the hour of the day and a person's habits.

Habits belong to families, some of which only ``test-novel`` uses (``NOVEL_HABITS``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.synth.activities.catalogue import Activity
from hsbench.typing import FloatArray


@dataclass(frozen=True)
class Habits:
    """How a person's days differ: shift_h, later than the table's hours; pace, factor on durations; likes, factors on
    how often some activities are done.
    """

    shift_h: float = 0.0
    pace: float = 1.0
    likes: tuple[tuple[str, float], ...] = ()


class Quota:
    """A share of all contacts of a life, held as they come: of each ``1 / share`` of them one, at a drawn place."""

    def __init__(self, share: float, rng: np.random.Generator) -> None:
        self.share, self._rng = share, rng
        self.contacts = self.done = 0
        self._place = rng.random()  # of the next one, in its stretch

    @property
    def is_due(self) -> bool:
        """Whether the next one is to come now."""
        return self.share * self.contacts > self.done + self._place

    def fill(self) -> None:
        """One has come."""
        self.done += 1
        self._place = self._rng.random()


HABITS: dict[str, Habits] = {
    "average": Habits(),
    "early": Habits(-1.5, 0.9, (("wipe", 2.0), ("water_plant", 2.0), ("cook", 1.5))),
    "late": Habits(2.0, 1.1, (("watch_tv", 2.0), ("nap", 1.5), ("phone", 1.5))),
    "studious": Habits(0.0, 1.2, (("work_at_desk", 3.0), ("read", 3.0), ("write", 2.0), ("watch_tv", 0.5))),
    "tidy": Habits(-0.5, 0.8, (("wipe", 4.0), ("use_storage", 2.5), ("wash_up", 2.0), ("rest", 0.5))),
    "nocturnal": Habits(9.0, 1.0, (("use_fridge", 2.0), ("look_out", 2.0))),
    "restless": Habits(1.0, 0.4, (("wander", 3.0), ("phone", 3.0), ("sleep", 0.3), ("rest", 0.3), ("talk", 2.0))),
}
"""Families by name."""

COMMON_HABITS = ("average", "early", "late", "studious", "tidy")
NOVEL_HABITS = ("nocturnal", "restless")


def weights(activities: Sequence[Activity], hour: float, habits: Habits) -> FloatArray:
    """(A,) how likely each activity is next, not normalised, rounded so that they are the same on every machine."""
    likes = dict(habits.likes)
    time = hour - habits.shift_h
    return np.array([round(a.weight * likes.get(a.name, 1.0) * gain(a, time), 6) for a in activities])


def gain(activity: Activity, hour: float) -> float:
    """How often an activity is done at an hour, against hours without a peak: triangles, the highest counts."""
    best = 1.0
    for at, half_width_h, factor in activity.peaks:
        away = abs((hour - at + 12.0) % 24.0 - 12.0)
        best = max(best, 1.0 + (factor - 1.0) * (1.0 - away / half_width_h))
    return best


def duration_s(activity: Activity, habits: Habits, rng: np.random.Generator) -> float:
    """A duration drawn for an activity, seconds, to the tenth."""
    return max(1.0, round(activity.median_s * habits.pace * float(np.exp(activity.spread * rng.standard_normal())), 1))
