"""Detections of one class in order of score, each a hit, false or neither: what precision, recall and AP are made of.

A ranking is the sufficient statistic of AP: ``bootstrap_ap`` resamples its scenes without matching again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hsbench.errors import SchemaError
from hsbench.metrics import average_precision
from hsbench.metrics.detection_matching import FALSE, HIT, NEITHER
from hsbench.typing import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Curve:
    """Recall, precision and the lowest score included, (n,) each, at the places where the protocol takes them."""

    recall: FloatArray
    precision: FloatArray
    score: FloatArray


@dataclass(frozen=True, eq=False)
class Ranking:
    """Matched detections of one class at one IoU threshold.

    scores: (n,) descending. outcome: (n,) int8 of HIT, FALSE, NEITHER. scene: (n,) int64. truths_per_scene: (S,)
    int64, those that count. blocks: whether precision and recall are taken at the ends of equal-score blocks only.
    """

    scores: FloatArray
    outcome: NDArray[np.int8]
    scene: IntArray
    truths_per_scene: IntArray
    blocks: bool

    def __post_init__(self) -> None:
        n = len(self.scores)
        if self.outcome.shape != (n,) or self.scene.shape != (n,):
            raise SchemaError(
                f"ranking has {n} scores, {len(self.outcome)} outcomes and {len(self.scene)} scenes; expected one each"
            )
        if n > 1 and (self.scores[1:] > self.scores[:-1]).any():
            raise SchemaError("ranking.scores rise; expected them descending (sort all arrays by -score first)")
        if n and (self.scene.min() < 0 or self.scene.max() >= len(self.truths_per_scene)):
            raise SchemaError(f"ranking.scene leaves 0..{len(self.truths_per_scene) - 1}")
        if n and (self.outcome.min() < NEITHER or self.outcome.max() > HIT):
            raise SchemaError("ranking.outcome holds other values than HIT, FALSE and NEITHER")

    @property
    def truths(self) -> int:
        """Truths that count."""
        return int(self.truths_per_scene.sum())

    @property
    def hits(self) -> int:
        """Truths that are hit."""
        return int((self.outcome == HIT).sum())

    @property
    def false(self) -> int:
        """Detections that hit nothing."""
        return int((self.outcome == FALSE).sum())

    @property
    def neither(self) -> int:
        """Detections that do not count."""
        return int((self.outcome == NEITHER).sum())

    @property
    def recall(self) -> float | None:
        """Hits over truths with all detections, None without truth."""
        return self.hits / self.truths if self.truths else None

    @property
    def precision(self) -> float | None:
        """Hits over detections that count, with all of them, None without any."""
        return self.hits / (self.hits + self.false) if self.hits + self.false else None

    def curve(self) -> Curve | None:
        """Precision and recall from the highest score down; None without truth.

        Precision before the first detection that counts is 0 (it is 0/0, NaN in the SUN RGB-D toolbox).
        """
        if not self.truths:
            return None
        tp, fp = np.cumsum(self.outcome == HIT), np.cumsum(self.outcome == FALSE)
        at = self.block_ends() if self.blocks else np.arange(len(self.scores))
        tp, fp = tp[at], fp[at]
        return Curve(tp / self.truths, tp / np.maximum(tp + fp, 1), self.scores[at])

    def ap(self, rule: Callable[[FloatArray, FloatArray], float] = average_precision.area) -> float | None:
        """Average precision by a rule of ``average_precision``; None without truth."""
        curve = self.curve()
        return None if curve is None else rule(curve.recall, curve.precision)

    def block_ends(self) -> IntArray:
        """The last index of every block of equal scores."""
        if not len(self.scores):
            return np.zeros(0, dtype=np.int64)
        return np.append(np.flatnonzero(np.diff(self.scores)), len(self.scores) - 1)
