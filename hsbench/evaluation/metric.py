"""Metrics of a split as functions of its episodes' rows: what can be summed, or ranked, without scoring again.

A metric first lays rows out by group (their scenes, or each row its own), then gives a value for each way of counting
the groups: once each for the split, as drawn for an interval, one alone for the value of an episode.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.report import EpisodeRow
from hsbench.metrics.bootstrap import Statistic
from hsbench.typing import AnyArray, FloatArray, IntArray

Weighted: TypeAlias = Callable[[IntArray], FloatArray]
"""(B, G) how often each group counts -> (B,) values, NaN where undefined."""


class Metric(Protocol):
    """A number of a split."""

    def weighted(self, rows: Sequence[EpisodeRow], group: IntArray, groups: int) -> Weighted:
        """group: (E,) which of the groups 0 .. groups - 1 each row belongs to. Raises SchemaError for lacking rows."""
        ...


@dataclass(frozen=True)
class PooledMetric:
    """A function of summed statistics.

    statistics: their name in a row; columns: how many there are, k; value: (..., k) -> (...), NaN where undefined.
    """

    statistics: str
    columns: int
    value: Statistic

    def weighted(self, rows: Sequence[EpisodeRow], group: IntArray, groups: int) -> Weighted:
        """Sums first, then one ratio."""
        summed = np.zeros((groups, self.columns), dtype=np.int64)
        np.add.at(summed, group, statistics_of(rows, self.statistics, self.columns))
        return lambda weights: self.value(weights @ summed)


def share(part: Sequence[int], whole: Sequence[int]) -> Statistic:
    """The sum of some columns over the sum of others, a column named twice counting twice; NaN where that is 0."""

    def value(counts: AnyArray) -> FloatArray:
        of = counts[..., list(whole)].sum(axis=-1)
        return np.asarray(np.where(of > 0, counts[..., list(part)].sum(axis=-1) / np.maximum(of, 1), np.nan))

    return value


def mean_of(statistics: Sequence[Statistic]) -> Statistic:
    """The mean of those values of the same counts that are defined, NaN where none is."""

    def value(counts: AnyArray) -> FloatArray:
        return mean_defined(np.stack([statistic(counts) for statistic in statistics]))

    return value


def mean_defined(values: FloatArray) -> FloatArray:
    """(n, ...) -> (...) mean of the values that are not NaN, NaN where all are."""
    defined = ~np.isnan(values)
    number = defined.sum(axis=0)
    return np.asarray(np.where(number > 0, np.where(defined, values, 0.0).sum(axis=0) / np.maximum(number, 1), np.nan))


def statistics_of(rows: Sequence[EpisodeRow], name: str, columns: int) -> IntArray:
    """(E, k) int64 statistics of each row. Raises SchemaError for a row without them."""
    for row in rows:
        if len(row.statistics.get(name, ())) != columns:
            raise SchemaError(f"episode {row.episode_id} lacks {columns} statistics {name!r}")
    return np.array([row.statistics[name] for row in rows], dtype=np.int64).reshape(len(rows), columns)
