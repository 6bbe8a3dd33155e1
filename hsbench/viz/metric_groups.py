"""Metrics of a report laid out as tables by class, label, region, visibility, evidence and size, from their names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

RATIOS = ("iou", "precision", "recall", "f1")
"""Last words of names ``<what>/<ratio>``, of which each makes a column."""


@dataclass(frozen=True)
class Group:
    """A table of metrics. names: by row and column, None where there is no such metric."""

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    names: tuple[tuple[str | None, ...], ...]


def groups(names: Iterable[str]) -> list[Group]:
    """The tables of all metrics that belong into one, in the order of the first of each."""
    found: dict[str, dict[tuple[str, str], str]] = {}
    for name in names:
        if place := _place(name):
            title, row, column = place
            found.setdefault(title, {})[row, column] = name
    return [_group(title, cells) for title, cells in found.items()]


def headline(names: Sequence[str], primary: str) -> list[str]:
    """The metrics to show of each episode: the primary one, those beside it, and what a mean is made of."""
    stem, _, last = primary.rpartition("/")
    part = last.removeprefix("mean-").removeprefix("macro-")
    parts = [name for name in names if part != last and name.count("/") == 1 and name.endswith(f"/{part}")]
    beside = [name for name in names if name.rpartition("/")[0] == stem]
    exclusive = {name for name in parts if name.split("/")[0] in ("exclusive", "scale-free", "occupancy")}
    return list(dict.fromkeys([primary, *beside, *(name for name in parts if name not in exclusive)]))


def _place(name: str) -> tuple[str, str, str] | None:
    """(title, row, column) of a metric; None for one that stands alone."""
    words = name.split("/")
    operating = ", from the operating score on" if words[0] == "operating" else ""
    rest = words[1:] if operating else words
    if rest[0] == "recall" and len(rest) == 3:
        if rest[1] == "size":
            return f"Recall by size{operating}", rest[2], "recall"
        return f"Recall by visibility and evidence{operating}", rest[1], rest[2]
    if words[0] == "confusion":
        return "Confusion: share of each true label", words[1], words[2]
    if len(words) == 2 and words[0].startswith("ap-"):
        return "By class", words[1], words[0]
    if words[-1] in RATIOS and len(words) > 1 and not operating:
        of = f", {' '.join(words[:-2])}" if len(words) > 2 else ""
        return f"By label or region{of}", words[-2], words[-1]
    return None


def _group(title: str, cells: dict[tuple[str, str], str]) -> Group:
    rows = tuple(dict.fromkeys(row for row, _ in cells))
    columns = tuple(dict.fromkeys(column for _, column in cells))
    return Group(title, rows, columns, tuple(tuple(cells.get((row, column)) for column in columns) for row in rows))
