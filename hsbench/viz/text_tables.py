"""Tables as Markdown and as CSV. A cell without data is empty."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

from hsbench.evaluation.tables import Cell, Table


def markdown(tables: Sequence[Table]) -> str:
    """Each table under a heading, with three digits; texts cannot become markup."""
    return "\n".join(_markdown_table(table) for table in tables)


def csv_text(table: Table) -> str:
    """One table with every digit."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([["" if cell is None else cell for cell in row] for row in table.rows])
    return out.getvalue()


def _markdown_table(table: Table) -> str:
    counted = [any(isinstance(row[k], int | float) for row in table.rows) for k in range(len(table.columns))]
    lines = [table.columns, tuple("---:" if number else "---" for number in counted)]
    lines += [tuple(_shown(cell) for cell in row) for row in table.rows]
    return f"### {table.number} {table.title}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _shown(cell: Cell) -> str:
    if isinstance(cell, float):
        return f"{cell:.3f}"
    return "" if cell is None else re.sub(r"([\\`*_{}\[\]<>|#!&])", r"\\\1", " ".join(str(cell).split()))
