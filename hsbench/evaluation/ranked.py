"""Average precision of a split: detections of all episodes joined in one ranking, without matching again.

A row holds a ranking under its name as three lists: ``<name>/truths`` (one number: how many count), ``<name>/scores``
and ``<name>/hits`` (one entry a detection that counts; 1 = hit, 0 = false). A score is written as the bits of its
32-bit float, which for numbers >= 0 are integers in the same order: exact, and a report holds nothing but integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.metric import Weighted, mean_defined, statistics_of
from hsbench.evaluation.report import EpisodeRow
from hsbench.metrics.bootstrap_ap import replicate_ap
from hsbench.metrics.detection import Ranking
from hsbench.metrics.detection_matching import FALSE, HIT
from hsbench.typing import FloatArray, IntArray


@dataclass(frozen=True)
class RankedMetric:
    """Mean AP (area) over the rankings that have truth.

    names: of rankings; a row without one has neither truth nor detections of it. blocks: whether precision and recall
    are taken at the ends of equal-score blocks only; else equal scores are in the order of episodes.
    """

    names: tuple[str, ...]
    blocks: bool = True

    def weighted(self, rows: Sequence[EpisodeRow], group: IntArray, groups: int) -> Weighted:
        """Joins each ranking once; only weights change afterwards."""
        rankings = [joined(rows, name, group, groups, self.blocks) for name in self.names]

        def value(weights: IntArray) -> FloatArray:
            return mean_defined(np.stack([replicate_ap(ranking, weights) for ranking in rankings]))

        return value


def ranking_statistics(name: str, ranking: Ranking) -> dict[str, tuple[int, ...]]:
    """The three lists of one episode's ranking; its scores are 32-bit floats >= 0."""
    counts = (ranking.outcome == HIT) | (ranking.outcome == FALSE)
    scores = ranking.scores[counts].astype(np.float32) + np.float32(0.0)  # -0.0 has other bits than 0.0
    return {
        f"{name}/truths": (ranking.truths,),
        f"{name}/scores": tuple(scores.view(np.uint32).tolist()),
        f"{name}/hits": tuple((ranking.outcome[counts] == HIT).astype(np.int64).tolist()),
    }


def joined(rows: Sequence[EpisodeRow], name: str, group: IntArray, groups: int, blocks: bool) -> Ranking:
    """One ranking of the rows' detections, groups in place of scenes. Raises SchemaError where lists do not fit."""
    here = [(row, g) for row, g in zip(rows, group.tolist(), strict=True) if f"{name}/truths" in row.statistics]
    of = np.array([g for _, g in here], dtype=np.int64)
    truths = np.zeros(groups, dtype=np.int64)
    np.add.at(truths, of, statistics_of([row for row, _ in here], f"{name}/truths", 1)[:, 0])
    bits = [row.statistics.get(f"{name}/scores", ()) for row, _ in here]
    hits = [row.statistics.get(f"{name}/hits", ()) for row, _ in here]
    for (row, _), scored, hit in zip(here, bits, hits, strict=True):
        if len(scored) != len(hit) or not set(hit) <= {0, 1} or max(scored, default=0) >= 2**32:
            raise SchemaError(f"episode {row.episode_id}: ranking {name!r} is none; expected 32-bit scores and 0 or 1")
    scores = np.array([b for scored in bits for b in scored], dtype=np.uint32).view(np.float32).astype(np.float64)
    if not np.isfinite(scores).all():
        raise SchemaError(f"ranking {name!r} holds scores that are not finite")
    outcome = np.where(np.array([h for hit in hits for h in hit], dtype=np.int64) == 1, HIT, FALSE).astype(np.int8)
    scene = np.repeat(of, [len(hit) for hit in hits])
    order = np.argsort(-scores, kind="stable")
    return Ranking(scores[order], outcome[order], scene[order], truths, blocks)
