"""Ranks of methods and how sure they are: rank probabilities from the cluster bootstrap over scenes.

Task
----
Several methods were scored on the same scenes. How likely is each to be first, second, ... on other scenes of the kind?

Conventions
-----------
``stats`` is (M, S, k): method, scene, the scene's sufficient statistics, as for ``bootstrap``. All methods see the same
draws of scenes (``bootstrap.scene_weights``, seeded), so that comparisons are paired. Rank 1 is best. Average precision
does not add up over scenes; ``bootstrap_ap.rank_probabilities`` ranks by it.

Metrics
-------
- rank probability [m, r] = share of replicates in which method m has rank r + 1. Methods with equal values share their
  ranks evenly: two that tie for first are first and second with 1/2 each. Every row and every column adds up to 1;
- better [a, b] = share of replicates in which a is better than b, ties counting one half; [a, b] + [b, a] = 1.
A replicate in which the statistic of any method is undefined has no ranks; it is left out and counted. With fewer than
two scenes, or no replicate left, there are no probabilities (None), and ``reason`` says so.

Differences from other scorers
------------------------------
* Ranks from resampled *frames* or voxels look far more certain: what happens in one room is one observation.
* Unpaired intervals that overlap do not mean that two methods cannot be told apart; paired shares can tell earlier.
* A rank probability is no posterior: .95 here says that in 95 % of resampled sets of scenes the order holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics.bootstrap import REPLICATES, Statistic, scene_weights
from hsbench.typing import AnyArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class RankProbabilities:
    """Ranks of M methods. estimates: (M,) values on all scenes, NaN-free, None = undefined.

    probabilities: (M, M) float64 [method, rank - 1] and better: (M, M) [a, b], or None where ``reason`` says why.
    """

    estimates: tuple[float | None, ...]
    probabilities: FloatArray | None
    better: FloatArray | None
    replicates: int
    undefined_replicates: int
    seed: int
    scenes: int
    reason: str | None = None


def rank_probabilities(
    stats: AnyArray,
    statistic: Statistic,
    *,
    higher_is_better: bool = True,
    replicates: int = REPLICATES,
    seed: int = 0,
) -> RankProbabilities:
    """Rank methods over resampled scenes.

    stats: (M, S, k) numbers; scenes in one order for all methods, fixed by the caller (sort by scene id).
    statistic: (..., k) summed statistics -> (...) values, NaN where undefined.
    Raises SchemaError for what does not fit.
    """
    table = np.asarray(stats)
    if table.ndim != 3 or not len(table) or table.dtype.kind not in "buif":
        raise SchemaError(f"stats is {table.dtype} {table.shape}; expected numbers (methods, scenes, statistics)")
    if table.dtype.kind == "f" and not np.isfinite(table).all():
        method, scene, _ = np.argwhere(~np.isfinite(table))[0]
        raise SchemaError(f"stats holds NaN or infinity at method {method}, scene {scene}; expected numbers")
    rows = table.astype(np.float64 if table.dtype.kind == "f" else np.int64)

    def values(weights: IntArray) -> FloatArray:
        return np.stack([statistic(weights @ method) for method in rows])

    return resample(values, rows.shape[0], rows.shape[1], higher_is_better, replicates, seed)


def resample(
    value: Callable[[IntArray], FloatArray],
    methods: int,
    scenes: int,
    higher_is_better: bool,
    replicates: int,
    seed: int,
) -> RankProbabilities:
    """Ranks by any value of weighted scenes, for what does not add up over them.

    value: (B, S) how often each replicate draws each scene -> (M, B), NaN where undefined.
    """
    totals = value(np.ones((1, scenes), dtype=np.int64))[:, 0].tolist() if scenes else [np.nan] * methods
    estimates = tuple(None if np.isnan(total) else total for total in totals)
    if scenes < 2:
        reason = "one scene: nothing to resample" if scenes else "no scene"
        return RankProbabilities(estimates, None, None, replicates, 0, seed, scenes, reason)
    values = value(scene_weights(scenes, replicates, seed))
    defined = ~np.isnan(values).any(axis=0)
    undefined = replicates - int(defined.sum())
    if not defined.any():
        reason = "undefined: no denominator"
        return RankProbabilities(estimates, None, None, replicates, undefined, seed, scenes, reason)
    values = values[:, defined] if higher_is_better else -values[:, defined]
    ahead = (values[:, None] > values[None, :]).sum(axis=2)
    tied = (values[:, None] == values[None, :]).sum(axis=2)
    better = (ahead + tied / 2) / values.shape[1]
    return RankProbabilities(estimates, _ranks(values), better, replicates, undefined, seed, scenes)


def _ranks(values: FloatArray) -> FloatArray:
    """(M, B) values, higher is better -> (M, M) share of replicates at each rank; ties share the ranks they cover."""
    methods, number = values.shape
    shares = np.zeros((methods, methods))
    for m in range(methods):
        before = (values > values[m]).sum(axis=0)
        equal = (values == values[m]).sum(axis=0)
        for rank in range(methods):
            shares[m, rank] = np.where((before <= rank) & (rank < before + equal), 1.0 / equal, 0.0).sum() / number
    return shares
