"""Uncertainty of a score: cluster bootstrap over scenes.

Scenes, never frames or voxels, are drawn with replacement: what happens in one room is one observation. Each scene
brings its sufficient statistics (a row of numbers that add up); a replicate adds the rows of the scenes it drew and
computes the statistic once. An interval is the percentile interval of the replicates.

Draws come straight from the bits of a Philox generator, whose stream is fixed for all times, and depend on (seed,
number of scenes) alone: every metric of a report and both methods of a comparison see the same scenes, so that
differences are paired. Integer statistics give the same result to the last bit on any machine.

A replicate in which the statistic is undefined (no denominator) is left out of the percentiles and counted. With
fewer than two scenes there is no interval, and ``reason`` says so.

Differences from other scorers
------------------------------
* Intervals over frames, voxels or detections take what happens in one room for many observations: far too narrow.
* The mean of per-scene values, with their standard error, is another number: here counts are pooled, in every replicate
  too, so scenes weigh by what they hold.
* scipy.stats.bootstrap corrects for bias and skewness (BCa) unless told method="percentile"; it resamples one value a
  scene, not counts. Percentile intervals of few scenes are too narrow: at 95 %, those of a mean of normal values hold
  the truth in 84, 90, 92, 93 % of cases with 5, 10, 20, 30 scenes (3000 trials each).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, FloatArray, IntArray

Statistic: TypeAlias = Callable[[AnyArray], FloatArray]
"""(..., k) summed sufficient statistics -> (...) values, NaN where undefined."""

REPLICATES = 1000
LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A pooled value, or a difference of two, with its percentile interval; None = undefined, ``reason`` says why."""

    estimate: float | None
    low: float | None
    high: float | None
    replicates: int
    undefined_replicates: int
    seed: int
    scenes: int
    level: float = LEVEL
    reason: str | None = None


def scene_weights(scenes: int, replicates: int = REPLICATES, seed: int = 0) -> IntArray:
    """(B, S) int64: how often each replicate draws each scene; every row adds up to S."""
    if scenes < 1 or replicates < 1 or seed < 0:
        raise SchemaError(f"scenes {scenes}, replicates {replicates}, seed {seed}; expected >= 1, >= 1 and >= 0")
    raw = np.random.Philox(seed).random_raw(replicates * scenes)
    # the high 32 bits scaled to 0..S-1: Generator.integers may change its stream between numpy versions, bits do not
    drawn = ((raw >> np.uint64(32)) * np.uint64(scenes)) >> np.uint64(32)
    rows = np.repeat(np.arange(replicates, dtype=np.int64), scenes)
    flat = np.bincount(rows * scenes + drawn.astype(np.int64), minlength=replicates * scenes)
    return flat.reshape(replicates, scenes).astype(np.int64)


def interval(
    stats: AnyArray,
    statistic: Statistic,
    *,
    replicates: int = REPLICATES,
    seed: int = 0,
    level: float = LEVEL,
) -> Interval:
    """Pooled statistic with its interval.

    stats: (S, k) one row of sufficient statistics a scene, in an order fixed by the caller (sort by scene id).
    """
    rows = _check(stats, "stats")
    return resample(lambda weights: statistic(weights @ rows), len(rows), replicates, seed, level)


def paired_difference(
    stats_a: AnyArray,
    stats_b: AnyArray,
    statistic: Statistic,
    *,
    replicates: int = REPLICATES,
    seed: int = 0,
    level: float = LEVEL,
) -> Interval:
    """Pooled statistic of A less that of B with its interval; row s of both is the same scene.

    stats_a, stats_b: (S, k). The methods differ at this level where the interval does not hold 0.
    """
    rows_a, rows_b = _check(stats_a, "stats_a"), _check(stats_b, "stats_b")
    if rows_a.shape != rows_b.shape:
        raise SchemaError(f"stats_b has shape {rows_b.shape}; expected {rows_a.shape} as stats_a (the same scenes?)")
    return resample(
        lambda weights: statistic(weights @ rows_a) - statistic(weights @ rows_b), len(rows_a), replicates, seed, level
    )


def resample(
    value: Callable[[IntArray], FloatArray], scenes: int, replicates: int, seed: int, level: float
) -> Interval:
    """Interval of any value of weighted scenes, for what does not add up over them.

    value: (B, S) how often each replicate draws each scene -> (B,), NaN where undefined.
    """
    if not 0 < level < 1:
        raise SchemaError(f"level is {level}; expected between 0 and 1 (a percentage?)")
    if scenes == 0:
        return Interval(None, None, None, replicates, 0, seed, 0, level, "no scene")
    total = float(value(np.ones((1, scenes), dtype=np.int64))[0])
    estimate = None if np.isnan(total) else total
    if scenes == 1:
        return Interval(estimate, None, None, replicates, 0, seed, 1, level, "one scene: nothing to resample")
    values = value(scene_weights(scenes, replicates, seed))
    defined = values[~np.isnan(values)]
    undefined = replicates - len(defined)
    if estimate is None or not len(defined):
        return Interval(None, None, None, replicates, undefined, seed, scenes, level, "undefined: no denominator")
    low, high = np.quantile(defined, [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate, float(low), float(high), replicates, undefined, seed, scenes, level)


def _check(stats: AnyArray, name: str) -> AnyArray:
    rows = np.asarray(stats)
    if rows.ndim != 2 or rows.dtype.kind not in "buif":
        raise SchemaError(f"{name} is {rows.dtype} {rows.shape}; expected numbers (scenes, statistics)")
    if rows.dtype.kind == "f":
        if not np.isfinite(rows).all():
            raise SchemaError(f"{name} holds NaN or infinity in row {int(np.argwhere(~np.isfinite(rows))[0][0])}")
        return rows.astype(np.float64)
    return rows.astype(np.int64)
