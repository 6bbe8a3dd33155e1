"""Observation curves: what another minute of watching buys.

Task
----
A score is taken from the first t seconds of observation, for several t. The curve says how fast watching pays.

Conventions
-----------
Times are seconds of observation, > 0 and ascending; the axis is log time, so that every doubling counts the same.
Between two times the curve is straight on that axis; it is not continued to either side. Scores are higher-is-better
unless said otherwise. A time whose score is undefined (None) is left out and counted; what lies between its neighbours
is then their straight line.

Metrics
-------
- area = integral of the score over log time / (log of last time - log of first): the mean score on the log axis, in the
  score's own unit. None with fewer than two defined times. A range asked for must lie within the defined times;
- time to reach a level = the first time at which the curve is at or above it (at or below for lower-is-better), None if
  it never is. ``at_start`` says that the first time reached it already: the true time is earlier, unknown.

Differences from other scorers
------------------------------
* An area over *linear* time is ruled by the last minutes: with times 5..120 s, half of it lies after 62 s; here half
  lies after 24 s. Curves that rise early score higher here.
* sklearn.metrics.auc is the same trapezoid rule but not divided by the range: multiply ours by it.
* A step curve (the score known last holds until the next time) is lower where scores rise: by half a step each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import FloatArray


@dataclass(frozen=True)
class Curve:
    """Scores at seconds of observation; None = undefined there. Checked when built."""

    observed_s: tuple[float, ...]
    scores: tuple[float | None, ...]
    higher_is_better: bool = True

    def __post_init__(self) -> None:
        for name in ("observed_s", "scores"):
            if not isinstance(getattr(self, name), tuple):
                found = type(getattr(self, name)).__name__
                raise SchemaError(f"curve.{name} is a {found}; expected a tuple of numbers")
        if len(self.observed_s) != len(self.scores) or not self.observed_s:
            raise SchemaError(f"curve has {len(self.observed_s)} times and {len(self.scores)} scores; expected as many")
        for number, time in enumerate(self.observed_s):
            if not (math.isfinite(time) and time > 0):
                raise SchemaError(f"curve.observed_s[{number}] is {time}; expected seconds > 0 (log axis)")
            if number and time <= self.observed_s[number - 1]:
                raise SchemaError(
                    f"curve.observed_s[{number}] is {time}; expected more than {self.observed_s[number - 1]}"
                )
        for number, value in enumerate(self.scores):
            if value is not None and not math.isfinite(value):
                raise SchemaError(f"curve.scores[{number}] is {value}; expected a number, or None where undefined")

    @property
    def undefined(self) -> int:
        """Number of times without a score."""
        return self.scores.count(None)

    def defined(self) -> tuple[FloatArray, FloatArray]:
        """(K,) natural logarithms of seconds and (K,) scores, where there is one."""
        kept = [(math.log(t), s) for t, s in zip(self.observed_s, self.scores, strict=True) if s is not None]
        table = np.array(kept, dtype=np.float64).reshape(-1, 2)
        return table[:, 0], table[:, 1]


@dataclass(frozen=True)
class Reach:
    """When a level is reached. seconds: None = never. at_start: already at the first time."""

    level: float
    seconds: float | None
    at_start: bool


def area(curve: Curve, range_s: tuple[float, float] | None = None) -> float | None:
    """Mean score over log time.

    range_s: first and last second, default those of the defined times; a range beyond them is undefined: None, as with
    fewer than two defined times. Raises SchemaError for a range that is none.
    """
    log_s, scores = curve.defined()
    if range_s is not None and not 0 < range_s[0] < range_s[1]:
        raise SchemaError(f"range_s is {range_s}; expected two ascending times in seconds > 0")
    if len(log_s) < 2:
        return None
    low, high = (log_s[0], log_s[-1]) if range_s is None else (math.log(range_s[0]), math.log(range_s[1]))
    if low < log_s[0] or high > log_s[-1]:
        return None
    inner = (log_s > low) & (log_s < high)
    x = np.concatenate([[low], log_s[inner], [high]])
    y = np.interp(x, log_s, scores)
    return float(np.trapezoid(y, x) / (high - low))


def time_to_reach(curve: Curve, level: float) -> Reach:
    """The first time at which the curve reaches a level, between times on the straight line over log time."""
    if not math.isfinite(level):
        raise SchemaError(f"level is {level}; expected a number")
    log_s, scores = curve.defined()
    sign = 1.0 if curve.higher_is_better else -1.0
    reached = np.flatnonzero(sign * scores >= sign * level)
    if not len(reached):
        return Reach(level, None, at_start=False)
    k = int(reached[0])
    if k == 0 or scores[k] == level:
        times = [t for t, s in zip(curve.observed_s, curve.scores, strict=True) if s is not None]
        return Reach(level, float(times[k]), at_start=k == 0)
    share = (level - scores[k - 1]) / (scores[k] - scores[k - 1])
    return Reach(level, math.exp(log_s[k - 1] + share * (log_s[k] - log_s[k - 1])), at_start=False)


def mean_curve(curves: Sequence[Curve]) -> Curve:
    """Mean over curves of one axis, time by time, of the scores that are defined; None where none is.

    Raises SchemaError for no curve, or different times or directions.
    """
    axes = {(curve.observed_s, curve.higher_is_better) for curve in curves}
    if len(axes) != 1:
        raise SchemaError(f"there are {len(curves)} curves on {len(axes)} axes; expected some, all at the same times")
    observed_s, higher = axes.pop()
    columns = zip(*(curve.scores for curve in curves), strict=True)
    kept = [[value for value in column if value is not None] for column in columns]
    return Curve(observed_s, tuple(sum(k) / len(k) if k else None for k in kept), higher)
