"""The ratios of one class as functions of a flattened confusion matrix [truth, answer]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hsbench.evaluation.metric import share
from hsbench.metrics.bootstrap import Statistic


@dataclass(frozen=True)
class ClassCells:
    """Where a class stands in a flattened matrix: its hits, its row (true) and its column (answered)."""

    hits: int
    row: Sequence[int]
    column: Sequence[int]

    @property
    def iou(self) -> Statistic:
        """Hits over what is true or answered."""
        return share([self.hits], sorted({*self.row, *self.column}))

    @property
    def precision(self) -> Statistic:
        """Hits over what is answered."""
        return share([self.hits], self.column)

    @property
    def recall(self) -> Statistic:
        """Hits over what is true."""
        return share([self.hits], self.row)

    @property
    def f1(self) -> Statistic:
        """Twice the hits over true and answered together."""
        return share([self.hits, self.hits], [*self.row, *self.column])


def class_cells(k: int, rows: int, columns: int) -> ClassCells:
    """Of class k in a matrix of rows by columns; a column beyond the rows holds what has no answer."""
    return ClassCells(k * columns + k, range(k * columns, (k + 1) * columns), range(k, rows * columns, columns))
