"""Boards as text: a Markdown table and one HTML page that needs nothing from elsewhere. All text is escaped."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from urllib.parse import urlsplit

from hsbench.leaderboard.ranking import Ranked, Table
from hsbench.tasks import task

_COLUMNS = ("Rank", "Method", "Authors", "Year", "Score", "95 % interval", "Mean over episodes", "Status")

_STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0 2rem; }
th, td { text-align: left; padding: .35rem .6rem; border-bottom: 1px solid #8886; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .4rem 0; }
"""


def markdown(tables: Sequence[Table]) -> str:
    """One Markdown table a track, each under a heading."""
    parts: list[str] = []
    for table in tables:
        rows = [_COLUMNS, ("---",) * len(_COLUMNS)]
        rows += [tuple(_markdown_text(cell) for cell in _cells(row)) for row in table.rows]
        parts.append(f"### {_markdown_text(_heading(table))}\n\n" + "\n".join(f"| {' | '.join(r)} |" for r in rows))
    return "\n\n".join(parts) + "\n" if parts else "No entries yet.\n"


def html_page(tables: Sequence[Table], title: str) -> str:
    """A whole page, light or dark as the reader's system is."""
    body = "\n".join(_html_table(table) for table in tables) or "<p>No entries yet.</p>"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n{body}\n"
        "<p>Entries whose intervals overlap share a rank. Results on open truth are self-reported.</p>\n"
        "</body>\n</html>\n"
    )


def _html_table(table: Table) -> str:
    head = "".join(f'<th scope="col">{html.escape(column)}</th>' for column in _COLUMNS)
    lines = [f"<table>\n<caption>{html.escape(_heading(table))}</caption>\n<thead><tr>{head}</tr></thead>\n<tbody>"]
    for row in table.rows:
        cells = [html.escape(cell) for cell in _cells(row)]
        link = row.entry.report.method.paper or row.entry.report.method.code
        if link and _is_web_address(link):
            cells[1] = f'<a href="{html.escape(link, quote=True)}" rel="nofollow noopener">{cells[1]}</a>'
        kinds = ["number", "", "", "number", "number", "number", "number", ""]
        lines.append(
            "<tr>"
            + "".join(
                f'<td class="{kind}">{cell}</td>' if kind else f"<td>{cell}</td>"
                for kind, cell in zip(kinds, cells, strict=True)
            )
            + "</tr>"
        )
    return "\n".join([*lines, "</tbody>\n</table>"])


def _heading(table: Table) -> str:
    spec = task(table.task)
    arrow = "higher is better" if spec.direction == "higher" else "lower is better"
    data = f"{table.dataset.name} {table.dataset.version}, {table.split}"
    return f"{spec.title} - {data} - track {table.track} - {spec.primary_metric}, {arrow}"


def _cells(row: Ranked) -> tuple[str, ...]:
    entry, primary = row.entry, row.entry.report.primary
    mean = entry.report.metrics[primary.name].mean_over_episodes
    return (
        "-" if row.rank is None else str(row.rank),
        entry.name,
        ", ".join(entry.authors),
        str(entry.year),
        _percent(primary.value),
        "-" if primary.low is None else f"{_percent(primary.low)} .. {_percent(primary.high)}",
        _percent(mean),
        entry.status,
    )


def _percent(value: float | None) -> str:
    """Rounded for reading only; files keep every digit."""
    return "-" if value is None else f"{100 * value:.2f}"


def _markdown_text(text: str) -> str:
    return re.sub(r"([\\`*_{}\[\]<>|#!&])", r"\\\1", " ".join(text.split()))


def _is_web_address(text: str) -> bool:
    try:
        parts = urlsplit(text)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and bool(parts.netloc)
