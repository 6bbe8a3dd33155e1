"""Shapes and words in metres on a page with y up, put down as SVG text or as pixels. No library draws the SVG."""

from __future__ import annotations

import html
from dataclasses import dataclass

import cv2
import numpy as np

from hsbench.typing import FloatArray, UInt8Array

PX_PER_M = 100.0  # of the SVG's view box
DASH_M = (0.05, 0.035)  # drawn, left out
HALO = 0.24  # width of the white around letters over their height
FINER = 2  # the raster is drawn so many times larger and shrunk
SHIFT = 4  # bits of a pixel that lines are placed by
FONT = cv2.FONT_HERSHEY_SIMPLEX
CAPITAL_PX = 21.0  # height of a capital of that font at scale 1
FAMILY = "'DejaVu Sans', 'Helvetica Neue', Helvetica, Arial, sans-serif"


@dataclass(frozen=True, eq=False)
class Shape:
    """A polygon, or an open line: (n, 2) points, colours ``#rrggbb``, width of its line."""

    points: FloatArray
    fill: str | None = None
    stroke: str | None = None
    width_m: float = 0.0
    dashed: bool = False
    closed: bool = True


@dataclass(frozen=True, eq=False)
class Label:
    """Lines of text about a point (``anchor`` middle) or to the right of it (start); 90 degrees reads upwards."""

    at: FloatArray
    lines: tuple[str, ...]
    size_m: float
    colour: str
    angle_deg: float = 0.0
    anchor: str = "middle"
    bold: bool = False


@dataclass(frozen=True, eq=False)
class Drawing:
    """Shapes, then words, on the page between two corners (2,)."""

    low: FloatArray
    high: FloatArray
    shapes: tuple[Shape, ...]
    labels: tuple[Label, ...]
    title: str


def svg(drawing: Drawing) -> str:
    """The drawing as an SVG document; all text is escaped."""
    width, height = (drawing.high - drawing.low) * PX_PER_M
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.1f} {height:.1f}" width="{width:.0f}"'
        f' height="{height:.0f}" role="img" font-family="{FAMILY}" stroke-linejoin="round">'
    )
    title = f"<title>{_text(drawing.title)}</title>"
    paper = '<rect width="100%" height="100%" fill="#ffffff"/>'
    body = [
        *(_svg_shape(drawing, shape) for shape in drawing.shapes),
        *(_svg_label(drawing, label) for label in drawing.labels),
    ]
    return "\n".join((head, title, paper, *body, "</svg>", ""))


def raster(drawing: Drawing, width_px: int) -> UInt8Array:
    """The drawing as (h, width_px, 3) uint8 rgb."""
    width_m, height_m = drawing.high - drawing.low
    scale = FINER * width_px / float(width_m)
    size = (round(scale * float(height_m) / FINER), width_px)
    canvas = np.full((FINER * size[0], FINER * size[1], 3), 255, dtype=np.uint8)
    for shape in drawing.shapes:
        _draw_shape(canvas, _pixels(drawing, shape.points, scale), shape, scale)
    for label in drawing.labels:
        _draw_label(canvas, _pixels(drawing, label.at, scale), label, scale)
    shrunk = cv2.resize(canvas, (size[1], size[0]), interpolation=cv2.INTER_AREA)
    return np.asarray(shrunk, dtype=np.uint8)


def _pixels(drawing: Drawing, points: FloatArray, scale: float) -> FloatArray:
    """Points on the page in pixels, y down."""
    return np.stack([points[..., 0] - drawing.low[0], drawing.high[1] - points[..., 1]], axis=-1) * scale


# ---------------------------------------------------------------- SVG


def _svg_shape(drawing: Drawing, shape: Shape) -> str:
    points = " ".join(f"{x:.2f},{y:.2f}" for x, y in _pixels(drawing, shape.points, PX_PER_M))
    style = f' fill="{shape.fill or "none"}"'
    if shape.stroke:
        style += f' stroke="{shape.stroke}" stroke-width="{shape.width_m * PX_PER_M:.2f}"'
    if shape.dashed:
        style += f' stroke-dasharray="{DASH_M[0] * PX_PER_M:g} {DASH_M[1] * PX_PER_M:g}"'
    return f'<{"polygon" if shape.closed else "polyline"} points="{points}"{style}/>'


def _svg_label(drawing: Drawing, label: Label) -> str:
    x, y = _pixels(drawing, label.at, PX_PER_M)
    size = label.size_m * PX_PER_M
    turn = f' transform="rotate({-label.angle_deg:g} {x:.2f} {y:.2f})"' if label.angle_deg else ""
    first = y - (len(label.lines) - 1) / 2 * 1.15 * size + 0.36 * size
    lines = "".join(
        f'<tspan x="{x:.2f}" y="{first + k * 1.15 * size:.2f}">{_text(line)}</tspan>'
        for k, line in enumerate(label.lines)
    )
    return (
        f'<text font-size="{size:.1f}" fill="{label.colour}" text-anchor="{label.anchor}"'
        f'{" font-weight=" + chr(34) + "600" + chr(34) if label.bold else ""} stroke="#ffffff" stroke-opacity="0.85"'
        f' stroke-width="{HALO * size:.1f}" paint-order="stroke"{turn}>{lines}</text>'
    )


def _text(text: str) -> str:
    """Escaped, without the control characters that XML forbids."""
    return html.escape("".join(c if c.isprintable() else " " for c in text))


# ---------------------------------------------------------------- pixels


def _draw_shape(canvas: UInt8Array, pixels: FloatArray, shape: Shape, scale: float) -> None:
    fixed = np.round(pixels * (1 << SHIFT)).astype(np.int32)
    if shape.fill:
        cv2.fillPoly(canvas, [fixed], _rgb(shape.fill), cv2.LINE_AA, SHIFT)
    if shape.stroke:
        width = max(1, round(shape.width_m * scale))
        lines = [fixed]
        closed = shape.closed
        if shape.dashed:
            lines = [np.round(d * (1 << SHIFT)).astype(np.int32) for d in _dashes(pixels, scale, shape.closed)]
            closed = False
        cv2.polylines(canvas, lines, closed, _rgb(shape.stroke), width, cv2.LINE_AA, SHIFT)


def _dashes(pixels: FloatArray, scale: float, closed: bool) -> list[FloatArray]:
    """(n, 2) line -> the dashes along it, around its corners."""
    ends = np.concatenate([pixels, pixels[:1]]) if closed else pixels
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ends, axis=0), axis=1))])
    dashes = []
    for start in np.arange(0.0, along[-1], sum(DASH_M) * scale):
        stop = min(start + DASH_M[0] * scale, along[-1])
        at = np.concatenate([[start], along[(along > start) & (along < stop)], [stop]])
        dashes.append(np.column_stack([np.interp(at, along, ends[:, k]) for k in range(2)]))
    return dashes


def _draw_label(canvas: UInt8Array, at: FloatArray, label: Label, scale: float) -> None:
    """Letters on a patch of their own, with a halo, turned if need be, then laid on the canvas."""
    size = label.size_m * scale
    thickness = max(1, round(size * (0.13 if label.bold else 0.085)))
    factor = 0.72 * size / CAPITAL_PX
    lines = [line.replace("²", "2").encode("ascii", "replace").decode() for line in label.lines]
    widths = [cv2.getTextSize(line, FONT, factor, thickness)[0][0] for line in lines]
    pad = round(size)
    ink = np.zeros((round(1.15 * size * len(lines)) + 2 * pad, max(widths) + 2 * pad), dtype=np.uint8)
    for k, (line, width) in enumerate(zip(lines, widths, strict=True)):
        x = (ink.shape[1] - width) // 2 if label.anchor == "middle" else pad
        y = round(pad + (k + 0.5) * 1.15 * size + 0.36 * size)
        cv2.putText(ink, line, (x, y), FONT, factor, 255, thickness, cv2.LINE_AA)
    if label.angle_deg:
        ink = np.ascontiguousarray(np.rot90(ink))
    reach = 2 * round(HALO * size / 2) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    halo = np.asarray(cv2.dilate(ink, disc), dtype=np.uint8)
    corner_x = at[0] - (ink.shape[1] / 2 if label.anchor == "middle" else pad)
    corner = np.round([corner_x, at[1] - ink.shape[0] / 2]).astype(int)
    _lay(canvas, halo, corner[0], corner[1], (255, 255, 255), 0.85)
    _lay(canvas, ink, corner[0], corner[1], _rgb(label.colour), 1.0)


def _lay(canvas: UInt8Array, mask: UInt8Array, x: int, y: int, colour: tuple[int, int, int], opacity: float) -> None:
    """Blend a colour into the canvas where the mask says, what sticks out cut off."""
    x0, y0 = max(0, x), max(0, y)
    x1, y1 = min(canvas.shape[1], x + mask.shape[1]), min(canvas.shape[0], y + mask.shape[0])
    if x1 <= x0 or y1 <= y0:
        return
    weight = mask[y0 - y : y1 - y, x0 - x : x1 - x, None] / 255.0 * opacity
    window = canvas[y0:y1, x0:x1]
    window[:] = np.round(window * (1 - weight) + np.array(colour) * weight).astype(np.uint8)


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
