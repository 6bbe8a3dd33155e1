"""Uncertainty of average precision: ``bootstrap`` for a score that does not add up over scenes.

Matching happens within a scene, so a replicate only changes how often a scene's detections and truths count. The
ranking is sorted once; a replicate is one walk through it with integer weights, many replicates side by side. Equal
scores keep the rule of the ranking: at block ends, precision and recall do not depend on the order inside a block;
without blocks the order (-score, scene, index) is kept, and a scene drawn twice repeats each detection in place.

AP here is the area rule, over all classes of ``rankings`` with truth in the replicate (one class: its AP).
A replicate without any truth is undefined, left out and counted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import NDArray

from hsbench.errors import SchemaError
from hsbench.metrics import ranking as ranks
from hsbench.metrics.bootstrap import LEVEL, REPLICATES, Interval, resample
from hsbench.metrics.detection_matching import FALSE, HIT
from hsbench.metrics.detection_ranking import Ranking
from hsbench.metrics.ranking import RankProbabilities
from hsbench.typing import BoolArray, FloatArray, IntArray

SIDE_BY_SIDE = 16
"""Replicates of one walk: their weights of a scene fill one cache line of 32-bit integers."""


def interval(
    rankings: Sequence[Ranking], *, replicates: int = REPLICATES, seed: int = 0, level: float = LEVEL
) -> Interval:
    """Mean AP over classes with its interval. All rankings are of the same scenes in the same order."""
    scenes = _scenes(rankings, "rankings")
    walks = [_Walk(r) for r in rankings]
    return resample(lambda weights: _mean_ap(walks, weights), scenes, replicates, seed, level)


def paired_difference(
    rankings_a: Sequence[Ranking],
    rankings_b: Sequence[Ranking],
    *,
    replicates: int = REPLICATES,
    seed: int = 0,
    level: float = LEVEL,
) -> Interval:
    """Mean AP of method A less that of B with its interval, on the same drawn scenes."""
    scenes, others = _scenes(rankings_a, "rankings_a"), _scenes(rankings_b, "rankings_b")
    if scenes != others:
        raise SchemaError(f"rankings_b are of {others} scenes; expected {scenes} as rankings_a (the same scenes?)")
    a, b = [_Walk(r) for r in rankings_a], [_Walk(r) for r in rankings_b]
    return resample(lambda w: _mean_ap(a, w) - _mean_ap(b, w), scenes, replicates, seed, level)


def rank_probabilities(
    rankings: Sequence[Sequence[Ranking]], *, replicates: int = REPLICATES, seed: int = 0
) -> RankProbabilities:
    """Ranks of methods by mean AP over resampled scenes; rankings: those of each method, all of the same scenes."""
    if not rankings or not all(rankings):
        raise SchemaError("rankings hold no method, or nothing of one; expected one ranking or more of each method")
    scenes = _scenes([r for of_method in rankings for r in of_method], "rankings")
    methods = [[_Walk(r) for r in of_method] for of_method in rankings]

    def values(weights: IntArray) -> FloatArray:
        return np.stack([_mean_ap(walks, weights) for walks in methods])

    return ranks.resample(values, len(methods), scenes, True, replicates, seed)


def replicate_ap(ranking: Ranking, weights: IntArray) -> FloatArray:
    """(B, S) how often each replicate draws each scene -> (B,) AP, NaN without truth."""
    if weights.ndim != 2 or weights.shape[1] != len(ranking.truths_per_scene):
        raise SchemaError(f"weights have shape {weights.shape}; expected (B, {len(ranking.truths_per_scene)})")
    return _Walk(ranking).ap(weights)


class _Walk:
    """A ranking in the order of the walk: from the lowest score up, detections that do not count left out."""

    def __init__(self, ranking: Ranking) -> None:
        counts = (ranking.outcome == HIT) | (ranking.outcome == FALSE)
        hit, scene, scenes = ranking.outcome[counts] == HIT, ranking.scene[counts], len(ranking.truths_per_scene)
        end = _ends(hit, ranking.scores[counts] if ranking.blocks else None)
        self._truths = ranking.truths_per_scene
        self._hits, self._false = (np.bincount(scene[of], minlength=scenes) for of in (hit, ~hit))
        self._scene, self._hit, self._end = scene[::-1].astype(np.int32), hit[::-1].copy(), end[::-1].copy()

    def ap(self, weights: IntArray) -> FloatArray:
        """(B, S) weights -> (B,) AP, NaN without truth."""
        truths, hits, false = (weights @ per_scene for per_scene in (self._truths, self._hits, self._false))
        out = np.empty(len(weights))
        for first in range(0, len(weights), SIDE_BY_SIDE):
            here = slice(first, first + SIDE_BY_SIDE)
            n = len(out[here])
            # short of a full set, zeros stand in: a replicate's value does not depend on its neighbours
            lanes = np.zeros((weights.shape[1] + 2, SIDE_BY_SIDE), dtype=np.int32)
            lanes[:, :n] = np.vstack([weights[here].T, hits[here], false[here]])
            out[here] = _areas(self._scene, self._hit, self._end, lanes[:-2], lanes[-2], lanes[-1])[:n]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(truths > 0, out / truths, np.nan)


def _ends(hit: BoolArray, scores: FloatArray | None) -> BoolArray:
    """(n,) where the envelope of precision can step: at the last of consecutive hits, since precision rises along
    them; with scores, at the end of a block of equal ones that holds a hit.
    """
    if not len(hit):
        return np.zeros(0, dtype=np.bool_)
    if scores is None:
        return hit & ~np.append(hit[1:], False)
    end = np.zeros(len(hit), dtype=np.bool_)
    starts = np.flatnonzero(np.append(True, np.diff(scores) != 0))
    end[np.append(starts[1:], len(hit)) - 1] = np.logical_or.reduceat(hit, starts)
    return end


def _mean_ap(walks: Sequence[_Walk], weights: IntArray) -> FloatArray:
    """(B,) mean over the classes that have truth in a replicate, NaN where none has."""
    values = np.stack([walk.ap(weights) for walk in walks])
    defined = ~np.isnan(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(defined, values, 0.0).sum(axis=0) / np.where(defined.any(axis=0), defined.sum(axis=0), np.nan)


@numba.njit(cache=True)
def _areas(
    scene: NDArray[np.int32],
    hit: BoolArray,
    end: BoolArray,
    weights: NDArray[np.int32],
    hits: NDArray[np.int32],
    false: NDArray[np.int32],
) -> FloatArray:
    """Envelope precision summed over the hits of every replicate: the area, times the number of truths.

    scene, hit, end: (n,) from the lowest score up. weights: (S, SIDE_BY_SIDE). hits, false: (SIDE_BY_SIDE,) of all
    detections, counted down to 0 on the way.
    """
    best, total = np.zeros(SIDE_BY_SIDE), np.zeros(SIDE_BY_SIDE)
    beyond = hits.copy()
    for i in range(len(scene)):
        s = scene[i]
        if end[i]:
            for b in range(SIDE_BY_SIDE):
                total[b] += (beyond[b] - hits[b]) * best[b]
                beyond[b] = hits[b]
                best[b] = max(best[b], hits[b] / max(hits[b] + false[b], 1))
        if hit[i]:
            for b in range(SIDE_BY_SIDE):
                hits[b] -= weights[s, b]
        else:
            for b in range(SIDE_BY_SIDE):
                false[b] -= weights[s, b]
    return total + beyond * best


def _scenes(rankings: Sequence[Ranking], name: str) -> int:
    sizes = {len(r.truths_per_scene) for r in rankings}
    if len(sizes) != 1:
        raise SchemaError(f"{name} are of {sorted(sizes) or 'no'} scenes; expected one or more, all of the same scenes")
    return sizes.pop()
