"""Small charts of a page as inline SVG; lines and texts take the page's colour, so they are right in light and dark."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

COLOURS = ("#2678be", "#d1632d", "#3f9455", "#9a5fc0", "#b0892a", "#4f8a98")
"""Of the curves of one chart, in order; readable on white and on black."""

ACCENT = COLOURS[0]

LABEL_PX = 34.0
"""A time stands below the axis where the one before it leaves so much room."""

Point = tuple[float, float, float | None, float | None]
"""(x, value, low or None, high or None)"""


def time_curve(points: Sequence[Point], label: str) -> str:
    """Values with their intervals over log time, from 0 up. points: (seconds, value, low, high), ascending."""
    return time_curves([points], label)


def time_curves(curves: Sequence[Sequence[Point]], label: str) -> str:
    """Up to ``len(COLOURS)`` curves over log time, each in its colour; one alone with its interval.

    curves: of (seconds, value, low, high), ascending; each has one or more.
    """
    left, right, top, bottom = 56.0, 664.0, 14.0, 254.0
    times = sorted({seconds for points in curves for seconds, _, _, _ in points})
    first, last = math.log(times[0]), math.log(times[-1])
    alone = len(curves) == 1
    highest = _round_up(
        max(max(value, (high or 0.0) if alone else 0.0) for points in curves for _, value, _, high in points)
    )

    def x(seconds: float) -> float:
        return left + (right - left) * (math.log(seconds) - first) / ((last - first) or 1.0)

    def y(value: float) -> float:
        return bottom - (bottom - top) * max(value, 0.0) / highest

    parts = []
    for tick in range(5):
        value = highest * tick / 4
        parts.append(
            f'<line x1="{left}" x2="{right}" y1="{y(value):.1f}" y2="{y(value):.1f}" stroke="currentColor" '
            f'stroke-opacity=".15"/><text x="{left - 8}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.3g}</text>'
        )
    free = 0.0
    for seconds in times:
        if x(seconds) >= free:
            free = x(seconds) + LABEL_PX
            parts.append(
                f'<text x="{x(seconds):.1f}" y="{bottom + 18}" text-anchor="middle">{duration(seconds)}</text>'
            )
    known = [(seconds, low, high) for seconds, _, low, high in curves[0] if low is not None and high is not None]
    if alone and len(known) > 1:
        edge = [f"{x(s):.1f},{y(high):.1f}" for s, _, high in known] + [
            f"{x(s):.1f},{y(low):.1f}" for s, low, _ in known[::-1]
        ]
        parts.append(f'<polygon points="{" ".join(edge)}" fill="{ACCENT}" fill-opacity=".16"/>')
    for points, colour in zip(curves, COLOURS, strict=False):
        line = " ".join(f"{x(seconds):.1f},{y(value):.1f}" for seconds, value, _, _ in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2.5"/>')
        parts += [f'<circle cx="{x(s):.1f}" cy="{y(value):.1f}" r="4.5" fill="{colour}"/>' for s, value, _, _ in points]
    text = html.escape(label, quote=True)
    size = f'viewBox="0 0 {right + 36:.0f} {bottom + 28:.0f}" width="{right + 36:.0f}"'
    return f'<div class="scroll"><svg {size} role="img" aria-label="{text}">{"".join(parts)}</svg></div>'


def bar(value: float | None) -> str:
    """A share of 0..1 as a number above a bar that fills the width of its cell; a dash where undefined."""
    if value is None:
        return '<span class="none">-</span>'
    width = 100 * min(max(value, 0.0), 1.0)
    return f'<span>{value:.3f}</span><span class="bar"><span style="width: {width:.1f}%"></span></span>'


def duration(seconds: float) -> str:
    """Seconds as people say them: 30 s, 5 min, 4 h."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size or seconds == size:
            return f"{seconds / size:g} {unit}"
    return f"{seconds:g} s"


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, ... times a power of ten."""
    if value <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value * (1 - 1e-9))
