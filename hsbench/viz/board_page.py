"""A board as one page: a table a track, and below it the curves over observation of its best entries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from hsbench.evaluation.report import DatasetRef, Report
from hsbench.tasks import TaskSpec
from hsbench.viz import page
from hsbench.viz.charts import COLOURS, Point, time_curves
from hsbench.viz.report_page import curve_points

NUMBERS = (0, 3, 4, 5, 6)
"""Columns of numbers: rank, year, score, interval, mean."""

METHOD = 1
"""The column whose text leads to the paper, or else to the code."""


class BoardEntry(Protocol):
    """What a page shows of an entry; ``hsbench.leaderboard.Entry`` is one."""

    @property
    def name(self) -> str:
        """Short, unique on the board."""
        ...

    @property
    def report(self) -> Report:
        """What it claims."""
        ...


class BoardRow(Protocol):
    """An entry in its place; ``hsbench.leaderboard.Ranked`` is one."""

    @property
    def entry(self) -> BoardEntry:
        """The entry."""
        ...

    @property
    def cells(self) -> tuple[str, ...]:
        """Its texts, a column each."""
        ...


class BoardTable(Protocol):
    """The entries of a track, best first; ``hsbench.leaderboard.Table`` is one."""

    @property
    def dataset(self) -> DatasetRef:
        """The data they were scored on."""
        ...

    @property
    def split(self) -> str:
        """The split they were scored on."""
        ...

    @property
    def track(self) -> str:
        """What they used."""
        ...

    @property
    def rows(self) -> Sequence[BoardRow]:
        """The entries."""
        ...


def board_page(tables: Sequence[BoardTable], spec: TaskSpec, columns: Sequence[str]) -> str:
    """The whole page of a task's board as HTML, which needs nothing from elsewhere."""
    body = [part for table in tables for part in _table(table, columns)] or [page.paragraph("No entries yet.")]
    lead = (
        f"Scores are percent of {spec.primary_metric}, {spec.direction} is better. Entries whose intervals overlap "
        "share a rank. Results on open truth are self-reported."
    )
    return page.page(spec.title, lead, body)


def _table(table: BoardTable, columns: Sequence[str]) -> list[str]:
    rows: list[list[str | page.Link]] = []
    for row in table.rows:
        cells: list[str | page.Link] = list(row.cells)
        method = row.entry.report.method
        if link := method.paper or method.code:
            cells[METHOD] = page.Link(row.cells[METHOD], link)
        rows.append(cells)
    place = f"{table.dataset.name} {table.dataset.version}, split {table.split}, track {table.track}"
    return [page.heading(place), page.table(columns, rows, numbers=NUMBERS), *_curves(table)]


def _curves(table: BoardTable) -> list[str]:
    """A chart of the best entries that answer at earlier times too; nothing where none does."""
    drawn = [(row.entry, points) for row in table.rows if (points := curve_points(row.entry.report))]
    if not drawn:
        return []
    left_out = len(drawn) - len(COLOURS)
    drawn = drawn[: len(COLOURS)]
    name = drawn[0][0].report.primary.name
    note = f" Drawn are the best {len(COLOURS)}; {left_out} more have a curve." if left_out > 0 else ""
    return [
        page.paragraph(f"Answers given after less watching, on the same truth.{note}"),
        time_curves([_percents(points) for _, points in drawn], f"percent of {name} over the length of observation"),
        page.legend([(colour, _area(entry)) for colour, (entry, _) in zip(COLOURS, drawn, strict=False)]),
    ]


def _percents(points: Sequence[Point]) -> list[Point]:
    return [(seconds, 100 * value, _times_100(low), _times_100(high)) for seconds, value, low, high in points]


def _times_100(value: float | None) -> float | None:
    return None if value is None else 100 * value


def _area(entry: BoardEntry) -> str:
    curve = entry.report.curve
    assert curve is not None  # it has points
    area = curve.area
    between = "" if area.low is None or area.high is None else f" ({100 * area.low:.2f} .. {100 * area.high:.2f})"
    return f"{entry.name}, {'-' if area.value is None else f'{100 * area.value:.2f}'} over log time{between}"
