"""Ranks that the intervals support.

Entries are ranked within a track, on the same data and split. An entry's rank is one more than the number of entries
that are better beyond doubt: whose interval lies wholly on the better side of its own. Entries whose intervals
overlap the leader's therefore share rank 1. An entry without interval counts as a point; one whose value is undefined
has no rank and stands last.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hsbench.evaluation.report import DatasetRef
from hsbench.leaderboard.entry import Entry
from hsbench.tasks import task

COLUMNS = ("Rank", "Method", "Authors", "Year", "Score", "95 % interval", "Mean over episodes", "Status")
"""Of a table of ranks."""


@dataclass(frozen=True)
class Ranked:
    """An entry and its rank, None where its value is undefined."""

    rank: int | None
    entry: Entry

    @property
    def cells(self) -> tuple[str, ...]:
        """Its texts in the columns ``COLUMNS``."""
        entry, primary = self.entry, self.entry.report.primary
        return (
            "-" if self.rank is None else str(self.rank),
            entry.name,
            ", ".join(entry.authors),
            str(entry.year),
            _percent(primary.value),
            "-" if primary.low is None else f"{_percent(primary.low)} .. {_percent(primary.high)}",
            _percent(entry.report.metrics[primary.name].mean_over_episodes),
            entry.status,
        )


@dataclass(frozen=True)
class Table:
    """The ranks of one track on one split, best value first."""

    task: str
    dataset: DatasetRef
    split: str
    track: str
    rows: tuple[Ranked, ...]


def rank(entries: Iterable[Entry]) -> list[Table]:
    """One table for each (task, data, split, track) among the entries, in ascending order of these."""
    groups: dict[tuple[str, str, str, str, str, str], list[Entry]] = {}
    for entry in entries:
        report = entry.report
        data = report.dataset
        key = (report.task, data.name, data.version, data.manifest_sha256, report.split, report.method.track)
        groups.setdefault(key, []).append(entry)
    return [
        Table(key[0], group[0].report.dataset, key[4], key[5], _ranked(key[0], group))
        for key, group in sorted(groups.items())
    ]


def _ranked(task_name: str, entries: list[Entry]) -> tuple[Ranked, ...]:
    sign = 1.0 if task(task_name).direction == "higher" else -1.0
    bounds = {entry.name: _bounds(entry, sign) for entry in entries}

    def order(entry: Entry) -> tuple[bool, float, str]:
        value = entry.report.primary.value
        return (value is None, 0.0 if value is None else -sign * value, entry.name)

    rows: list[Ranked] = []
    for entry in sorted(entries, key=order):
        own = bounds[entry.name]
        better = None if own is None else sum(1 for other in bounds.values() if other is not None and other[0] > own[1])
        rows.append(Ranked(None if better is None else 1 + better, entry))
    return tuple(rows)


def _bounds(entry: Entry, sign: float) -> tuple[float, float] | None:
    """(worst, best) end of an entry's interval, on a scale where more is better."""
    primary = entry.report.primary
    if primary.value is None:
        return None
    if primary.low is None or primary.high is None:
        return (sign * primary.value, sign * primary.value)
    low, high = sorted((sign * primary.low, sign * primary.high))
    return low, high


def _percent(value: float | None) -> str:
    """Rounded for reading only; files keep every digit."""
    return "-" if value is None else f"{100 * value:.2f}"
