"""A report as one HTML file: pictures inlined, no network, light and dark, readable on a phone. All text is escaped."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

from hsbench.io.images import encode_jpeg, encode_png
from hsbench.typing import UInt8Array

STYLE = """
:root { color-scheme: light dark; --line: color-mix(in srgb, currentColor 18%, transparent);
  --faint: color-mix(in srgb, currentColor 62%, transparent); }
body { font: 16px/1.55 system-ui, sans-serif; max-width: 72rem; margin: 2.5rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.9rem; margin-bottom: .2rem; }
h2 { margin-top: 2.6rem; border-top: 1px solid var(--line); padding-top: 1.2rem; }
p { max-width: 46rem; } .lead, figcaption, .note { color: var(--faint); }
figure { margin: 0; } figcaption { font-size: .87rem; margin-top: .3rem; }
img { max-width: 100%; height: auto; border-radius: 5px; display: block; }
.row { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 15.5rem), 1fr));
  gap: 1rem; margin: 1rem 0 1.6rem; }
.wide { grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr)); align-items: start; }
.note { max-width: none; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; margin: .8rem 0; }
th, td { text-align: left; padding: .38rem .7rem; border-bottom: 1px solid var(--line); }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
svg text { fill: currentColor; font: 12px system-ui, sans-serif; }
pre { overflow-x: auto; padding: .8rem 1rem; border: 1px solid var(--line); border-radius: 5px; font-size: .87rem; }
.entry { display: inline-block; max-width: 100%; }
h3 { margin: 1.8rem 0 .2rem; font-size: 1.02rem; }
.figure strong { font-size: 2.6rem; font-variant-numeric: tabular-nums; margin-right: .5rem; }
th[scope=row] { font-weight: 400; } .none { color: var(--faint); } .breaking td + td { overflow-wrap: anywhere; }
.breaking td:first-child, .sortable td { white-space: nowrap; }
.bars { width: auto; } .bars th + th, .bars td { min-width: 5.5rem; text-align: right; }
.bar { display: block; height: 4px; margin-top: 3px; border-radius: 2px; background: var(--line); }
.bar span { display: block; height: 100%; border-radius: 2px; background: #2678be; }
summary { cursor: pointer; } th button { font: inherit; font-weight: 600; color: inherit; background: none; border: 0;
  padding: 0; cursor: pointer; text-align: inherit; }
th button::after { content: " \\2195"; color: var(--faint); }
th[aria-sort=ascending] button::after { content: " \\2191"; }
th[aria-sort=descending] button::after { content: " \\2193"; }
.swatch { display: inline-block; width: .8em; height: .8em; border-radius: 2px; margin: 0 .3em 0 .9em; }
"""


SORT = """
for (const button of document.querySelectorAll("th button")) button.onclick = () => {
  const head = button.closest("th"), body = head.closest("table").tBodies[0], k = head.cellIndex;
  const down = head.getAttribute("aria-sort") === "descending";
  for (const other of head.parentNode.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "ascending" : "descending");
  const text = row => row.cells[k].textContent, sign = down ? 1 : -1;
  const differ = (a, b) => isNaN(a) || isNaN(b) ? a.localeCompare(b) : a - b;
  const order = (a, b) => a === "-" ? 1 : b === "-" ? -1 : sign * differ(a, b);
  body.append(...[...body.rows].sort((a, b) => order(text(a), text(b))));
};
"""
"""Makes the heads of sortable tables sort: first the largest, then the smallest; undefined values stay last."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A picture (h, w, 3) uint8 rgb with its caption. photo: encode as JPEG, else lossless."""

    picture: UInt8Array
    caption: str
    photo: bool = False


@dataclass(frozen=True)
class Link:
    """A cell that leads elsewhere; an address that is none of the web is left out."""

    text: str
    address: str


def page(title: str, lead: str, body: Sequence[str], script: str = "") -> str:
    """A whole page from HTML pieces made by the functions below; ``script`` is ours, never a reader's text."""
    end = f"\n<script>{script}</script>" if script else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f'<h1>{html.escape(title)}</h1>\n<p class="lead">{html.escape(lead)}</p>\n'
        + "\n".join(body)
        + end
        + "\n</body>\n</html>\n"
    )


def heading(text: str) -> str:
    """A section's heading."""
    return f"<h2>{html.escape(text)}</h2>"


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def code(text: str) -> str:
    """Preformatted text."""
    return f"<pre>{html.escape(text)}</pre>"


def legend(entries: Sequence[tuple[tuple[int, int, int] | str, str]]) -> str:
    """Colour swatches with their meaning; a colour is rgb, or as CSS writes it."""
    return (
        '<p class="note">'
        + "".join(
            f'<span class="entry"><span class="swatch" style="background: {_colour(colour)}"></span>'
            f"{html.escape(text)}</span> "
            for colour, text in entries
        )
        + "</p>"
    )


def _colour(colour: tuple[int, int, int] | str) -> str:
    return colour if isinstance(colour, str) else f"rgb{colour}"


def figures(items: Sequence[Figure], wide: bool = False) -> str:
    """Pictures in a row that wraps; ``wide`` gives each more room."""
    kind = "row wide" if wide else "row"
    return f'<div class="{kind}">' + "".join(_figure(item) for item in items) + "</div>"


def _figure(item: Figure) -> str:
    kind, data = ("jpeg", encode_jpeg(item.picture)) if item.photo else ("png", encode_png(item.picture))
    text = html.escape(item.caption, quote=True)
    source = f"data:image/{kind};base64,{base64.b64encode(data).decode()}"
    height, width = item.picture.shape[:2]
    return (
        f'<figure><img src="{source}" width="{width}" height="{height}" alt="{text}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def details(summary: str, content: str) -> str:
    """A piece of the page that opens on a click."""
    return f"<details><summary>{html.escape(summary)}</summary>{content}</details>"


def table(
    columns: Sequence[str],
    rows: Sequence[Sequence[str | Link]],
    numbers: Sequence[int] = (),
    sortable: bool = False,
    breaking: bool = False,
) -> str:
    """A table; ``numbers`` are the columns aligned to the right.

    sortable: heads are buttons, which need the script ``SORT``. breaking: long words may be broken.
    """

    def head(k: int, text: str) -> str:
        kind = ' class="number"' if k in numbers else ""
        inner = f'<button type="button">{html.escape(text)}</button>' if sortable and text else html.escape(text)
        return f'<th scope="col"{kind}>{inner}</th>'

    heads = "".join(head(k, text) for k, text in enumerate(columns))
    body = "".join(
        "<tr>"
        + "".join(
            f'<td class="number">{_cell(cell)}</td>' if k in numbers else f"<td>{_cell(cell)}</td>"
            for k, cell in enumerate(row)
        )
        + "</tr>"
        for row in rows
    )
    kinds = [kind for kind, on in (("sortable", sortable), ("breaking", breaking)) if on]
    kind = f' class="{" ".join(kinds)}"' if kinds else ""
    return f'<div class="scroll"><table{kind}><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(cell: str | Link) -> str:
    if isinstance(cell, str):
        return html.escape(cell)
    text = html.escape(cell.text)
    if not _is_web_address(cell.address):
        return text
    return f'<a href="{html.escape(cell.address, quote=True)}" rel="nofollow noopener">{text}</a>'


def _is_web_address(text: str) -> bool:
    try:
        parts = urlsplit(text)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and bool(parts.netloc)


def interval_bars(
    rows: Sequence[tuple[str, float, float | None, float | None]], low: float = 0.0, high: float = 1.0
) -> str:
    """Values with their intervals on one axis, as inline SVG. rows: (name, value, low or None, high or None)."""
    left, width, line, top = 150, 560, 26, 8
    bottom = top + line * len(rows)

    def x(value: float) -> float:
        return left + width * (min(max(value, low), high) - low) / (high - low)

    parts = []
    for tick in range(6):
        value = low + (high - low) * tick / 5
        parts.append(
            f'<line x1="{x(value):.1f}" x2="{x(value):.1f}" y1="{top}" y2="{bottom}" '
            'stroke="currentColor" stroke-opacity=".15"/>'
            f'<text x="{x(value):.1f}" y="{bottom + 16}" text-anchor="middle">{value:g}</text>'
        )
    for k, (name, value, a, b) in enumerate(rows):
        y = top + line * (k + 0.5)
        parts.append(f'<text x="{left - 10}" y="{y + 4:.1f}" text-anchor="end">{html.escape(name)}</text>')
        if a is not None and b is not None:
            parts.append(
                f'<line x1="{x(a):.1f}" x2="{x(b):.1f}" y1="{y:.1f}" y2="{y:.1f}" stroke="#2678be" stroke-width="5" '
                'stroke-opacity=".45" stroke-linecap="round"/>'
            )
        parts.append(f'<circle cx="{x(value):.1f}" cy="{y:.1f}" r="5" fill="#2678be"/>')
    size = f'viewBox="0 0 {left + width + 30} {bottom + 24}" width="{left + width + 30}"'
    return f'<div class="scroll"><svg {size} role="img" aria-label="values with intervals">{"".join(parts)}</svg></div>'
