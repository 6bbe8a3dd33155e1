"""The curves of a training run as one SVG picture: a panel a number, epochs to the right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

WIDTH_PX, HEIGHT_PX, MARGIN_PX = 320.0, 200.0, 48.0
COLOUR = "#2678be"


def curves_svg(curve: Sequence[Mapping[str, float]]) -> str:
    """Entries of one epoch each, ``epoch`` and numbers by name, the same in all -> SVG text, a panel a number."""
    names = sorted({*(curve[0] if curve else ())} - {"epoch"})
    epochs = [entry["epoch"] for entry in curve]
    panels = [_panel(name, epochs, [entry[name] for entry in curve], k) for k, name in enumerate(names)]
    size = f'width="{WIDTH_PX * max(len(names), 1):.0f}" height="{HEIGHT_PX:.0f}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="11">'
        f'<rect width="100%" height="100%" fill="#fff"/>{"".join(panels)}</svg>\n'
    )


def _panel(name: str, epochs: Sequence[float], values: Sequence[float], place: int) -> str:
    low, high = min(values), max(values)
    left, right = WIDTH_PX * place + MARGIN_PX, WIDTH_PX * (place + 1) - 14.0
    top, bottom = 26.0, HEIGHT_PX - 28.0
    across, up = (epochs[-1] - epochs[0]) or 1.0, (high - low) or 1.0
    points = [
        (left + (right - left) * (epoch - epochs[0]) / across, bottom - (bottom - top) * (value - low) / up)
        for epoch, value in zip(epochs, values, strict=True)
    ]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{COLOUR}"/>' for x, y in points)
    labels = "".join(
        f'<text x="{left - 5:.1f}" y="{y + 4:.1f}" text-anchor="end">{value:.3g}</text>'
        for value, y in {low: bottom, high: top}.items()
    )
    ends = "".join(
        f'<text x="{x:.1f}" y="{bottom + 17:.1f}" text-anchor="middle">{epoch:g}</text>'
        for epoch, x in {epochs[0]: points[0][0], epochs[-1]: points[-1][0]}.items()
    )
    title = f'<text x="{left:.1f}" y="14" font-weight="bold">{name}</text>'
    drawn = f'<polyline points="{line}" fill="none" stroke="{COLOUR}" stroke-width="1.5"/>'
    return title + labels + ends + drawn + dots
