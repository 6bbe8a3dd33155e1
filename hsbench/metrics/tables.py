"""Two-by-two tables: Counts, and the one pass over two bool arrays that fills them.

A ratio without a denominator is None: precision where nothing is predicted, recall where nothing is true, IoU where
neither. Counts are Python integers: exact at any size (float32 counters stop at 2^24).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hsbench.typing import AnyArray, BoolArray


@dataclass(frozen=True)
class Counts:
    """Sufficient statistics of one mask: elements that are true and predicted, only predicted, only true, neither."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.tp + other.tp, self.fp + other.fp, self.fn + other.fn, self.tn + other.tn)

    @property
    def total(self) -> int:
        """Number of elements counted."""
        return self.tp + self.fp + self.fn + self.tn

    @property
    def precision(self) -> float | None:
        """TP / (TP + FP), None where nothing is predicted."""
        return ratio(self.tp, self.tp + self.fp)

    @property
    def recall(self) -> float | None:
        """TP / (TP + FN), None where nothing is true."""
        return ratio(self.tp, self.tp + self.fn)

    @property
    def iou(self) -> float | None:
        """TP / (TP + FP + FN), None where nothing is true or predicted."""
        return ratio(self.tp, self.tp + self.fp + self.fn)


def count(truth: BoolArray, prediction: BoolArray, mask: BoolArray | None = None) -> Counts:
    """Count two bool arrays of one shape, within a mask where one is given; the caller has checked them.

    Eight bools are one 64-bit word and bytes are added word by word, which runs at the speed of memory.
    """
    from hsbench.metrics.kernels import count_three, count_two

    given = (truth, prediction) if mask is None else (truth, prediction, mask)
    arrays = [array.reshape(-1, order=_order(given)) for array in given]
    whole = arrays[0].size // 8 * 8
    words = [_words(array[:whole]) for array in arrays]
    tails = [array[whole:] for array in arrays]
    inside = tails[2] if mask is not None else np.ones(len(tails[0]), dtype=bool)
    solid, claimed = tails[0] & inside, tails[1] & inside
    both, truths, predictions = (int(np.count_nonzero(tail)) for tail in (solid & claimed, solid, claimed))
    total = int(np.count_nonzero(inside))
    if mask is None:
        word_both, word_truths, word_predictions = count_two(*words)
        word_total = whole
    else:
        word_both, word_truths, word_predictions, word_total = count_three(*words)
    both, truths, predictions = both + word_both, truths + word_truths, predictions + word_predictions
    return Counts(both, predictions - both, truths - both, total + word_total - truths - predictions + both)


def ratio(numerator: int, denominator: int) -> float | None:
    """Numerator / denominator, None without a denominator."""
    return numerator / denominator if denominator else None


def _order(arrays: tuple[AnyArray, ...]) -> Literal["C", "F"]:
    """Fortran order where all arrays lie so in memory: counting does not care, and no copy is made."""
    return "F" if all(array.flags.f_contiguous for array in arrays) else "C"


def _words(part: BoolArray) -> AnyArray:
    return np.ascontiguousarray(part).view(np.uint64)
