"""Boards as Markdown. Texts of entries cannot become markup. ``hsbench.viz.board_page`` makes the page."""

from __future__ import annotations

import re
from collections.abc import Sequence

from hsbench.leaderboard.ranking import COLUMNS, Table
from hsbench.tasks import task


def markdown(tables: Sequence[Table]) -> str:
    """One Markdown table a track, each under a heading."""
    parts: list[str] = []
    for table in tables:
        rows = [COLUMNS, ("---",) * len(COLUMNS)]
        rows += [tuple(_markdown_text(cell) for cell in row.cells) for row in table.rows]
        parts.append(f"### {_markdown_text(_heading(table))}\n\n" + "\n".join(f"| {' | '.join(r)} |" for r in rows))
    return "\n\n".join(parts) + "\n" if parts else "No entries yet.\n"


def _heading(table: Table) -> str:
    spec = task(table.task)
    data = f"{table.dataset.name} {table.dataset.version}, {table.split}"
    return f"{spec.title} - {data} - track {table.track} - {spec.primary_metric}, {spec.direction} is better"


def _markdown_text(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>|#!&])", r"\\\1", " ".join(text.split()))
