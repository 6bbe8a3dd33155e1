"""The small vocabulary every builder speaks: drawn sizes, shades of a colour, blocks, posts, legs and cabinet fronts.

Object frame: origin on the middle of the footprint, z up, front towards -y, width along x. Metres, quantised to .1 mm
where they enter a solid, so that every machine builds the same vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from hsbench.geometry.convex import ConvexSolid, cylinder, frustum, regular_outline, span
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import Part
from hsbench.synth.furniture.style import Range, Rgb, Style
from hsbench.typing import FloatArray

T = TypeVar("T")
Rect = tuple[float, float, float, float]  # x0, y0, x1, y1
TONE_SPREAD = 7  # how far two objects of one colour may differ, in sRGB steps
ROUND_SIDES = 12
GAP_M = 0.004  # the slit between cabinet fronts
FRONT_M = 0.018  # thickness of a cabinet front
HANDLE_DEPTH_M = 0.025
HANDLE_BAR_M = (0.14, 0.014)  # length, thickness
KNOB_M = 0.03


def draw(rng: np.random.Generator, sizes: Range, fit: float = 1.0) -> float:
    """A length from a range, quantised; ``fit`` < 1 takes it from the lower part of the range only."""
    low, high = sizes
    return float(quantise_m(low + (high - low) * fit * rng.random()))


def pick(rng: np.random.Generator, options: Sequence[T]) -> T:
    """One of the options, all equally likely."""
    return options[int(rng.integers(len(options)))]


def tone(rng: np.random.Generator, colour: Rgb) -> Rgb:
    """A colour a little lighter or darker, so that no two things look painted from one pot."""
    shift = int(rng.integers(-TONE_SPREAD, TONE_SPREAD + 1))
    return shade(colour, 1.0, shift)


def shade(colour: Rgb, factor: float, shift: int = 0) -> Rgb:
    """A colour times a factor plus a shift, clipped to 0..255."""
    r, g, b = (min(255, max(0, round(c * factor) + shift)) for c in colour)
    return r, g, b


def block(name: str, colour: Rgb, low_m: Sequence[float], high_m: Sequence[float], role: str | None = None) -> Part:
    """A box between two corners."""
    low, high = quantise_m(np.asarray([low_m, high_m])).tolist()
    return Part(name, colour, role, span(low, high))


def rectangle_outline(rect: Rect) -> FloatArray:
    """(4, 2) counter-clockwise corners of x0, y0, x1, y1."""
    x0, y0, x1, y1 = (float(quantise_m(v)) for v in rect)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def tapered(name: str, colour: Rgb, bottom: Rect, top: Rect, z0_m: float, z1_m: float, role: str | None = None) -> Part:
    """A block whose outline changes from a bottom to a top rectangle: cushions, leaning backs, splayed legs."""
    z0, z1 = float(quantise_m(z0_m)), float(quantise_m(z1_m))
    return Part(name, colour, role, frustum(rectangle_outline(bottom), rectangle_outline(top), z0, z1))


def rod(
    name: str,
    colour: Rgb,
    xy: Sequence[float],
    radius_m: float,
    z0_m: float,
    z1_m: float,
    top_radius_m: float | None = None,
    sides: int = ROUND_SIDES,
    role: str | None = None,
) -> Part:
    """An upright cylinder, or a cone frustum with another radius at the top."""
    top = None if top_radius_m is None else float(quantise_m(top_radius_m))
    solid = cylinder(
        float(quantise_m(radius_m)), float(quantise_m(z0_m)), float(quantise_m(z1_m)),
        quantise_m(np.asarray(xy)).tolist(), sides, top,
    )  # fmt: skip
    return Part(name, colour, role, solid)


def prism(name: str, colour: Rgb, outline_xy: FloatArray, z0_m: float, z1_m: float, role: str | None = None) -> Part:
    """A prism over a convex counter-clockwise outline (n, 2)."""
    z0, z1 = float(quantise_m(z0_m)), float(quantise_m(z1_m))
    outline = quantise_m(outline_xy)
    return Part(name, colour, role, frustum(outline, outline, z0, z1))


def cushion(
    name: str, colour: Rgb, rect: Rect, z0_m: float, z1_m: float, role: str | None = None, round_m: float = 0.02
) -> tuple[Part, Part]:
    """A padded slab: a straight lower body and a bevelled top; the top carries the role."""
    x0, y0, x1, y1 = rect
    edge = z1_m - min(round_m, (z1_m - z0_m) / 2)
    inner = (x0 + round_m, y0 + round_m, x1 - round_m, y1 - round_m)
    return (
        block(name, colour, (x0, y0, z0_m), (x1, y1, edge), None),
        tapered(name, colour, rect, inner, edge, z1_m, role),
    )


def leg(
    style: Style, colour: Rgb, xy: Sequence[float], thickness_m: float, z1_m: float, outward: Sequence[float] = (0, 0),
    splay: float = 1.0,
) -> Part:  # fmt: skip
    """A leg from the floor to ``z1_m`` whose top middle is at ``xy``; its foot stands out along ``outward`` (signs)."""
    foot = max(0.012, thickness_m * style.leg_taper)
    x, y = xy
    fx, fy = (v + style.leg_splay_m * splay * o for v, o in zip(xy, outward, strict=True))
    if style.leg == "round":
        top = regular_outline(float(quantise_m(thickness_m / 2)), 8, quantise_m(np.array([x, y])).tolist())
        bottom = regular_outline(float(quantise_m(foot / 2)), 8, quantise_m(np.array([fx, fy])).tolist())
        return Part("leg", colour, None, frustum(bottom, top, 0.0, float(quantise_m(z1_m))))
    t, f = thickness_m / 2, foot / 2
    return tapered("leg", colour, (fx - f, fy - f, fx + f, fy + f), (x - t, y - t, x + t, y + t), 0.0, z1_m)


def four_legs(style: Style, colour: Rgb, rect: Rect, thickness_m: float, z1_m: float, splay: float = 1.0) -> list[Part]:
    """A leg at each corner of a rectangle; neither tops nor splayed feet reach beyond it."""
    inset = thickness_m / 2 + style.leg_splay_m * splay
    x0, y0, x1, y1 = rect
    return [
        leg(style, colour, (x, y), thickness_m, z1_m, (sx, sy), splay)
        for x, sx in ((x0 + inset, -1), (x1 - inset, 1))
        for y, sy in ((y0 + inset, -1), (y1 - inset, 1))
    ]


def handle(style: Style, metal: Rgb, front: Rect, y_m: float, upright: bool = False, at: float = 0.5) -> Part:
    """A handle on a front given as x0, z0, x1, z1 at depth ``y_m``; ``at`` is its place across the front (0..1)."""
    x0, z0, x1, z1 = front
    x, z = x0 + (x1 - x0) * at, (z0 + z1) / 2
    if style.handle == "rail":
        half_x, half_z = (0.011, 0.4 * (z1 - z0)) if upright else (0.42 * (x1 - x0), 0.011)
        z = z if upright else z1 - 0.02
    elif style.handle == "knob":
        half_x = half_z = KNOB_M / 2
    else:
        length, thick = HANDLE_BAR_M
        length = min(length, 0.7 * (z1 - z0 if upright else x1 - x0))
        half_x, half_z = (thick / 2, length / 2) if upright else (length / 2, thick / 2)
    low, high = (x - half_x, y_m - HANDLE_DEPTH_M, z - half_z), (x + half_x, y_m, z + half_z)
    return block("handle", metal, low, high, "handle")


def drawers(style: Style, colour: Rgb, metal: Rgb, front: Rect, y_m: float, rows: int, columns: int) -> list[Part]:
    """Rows x columns of drawer fronts with handles over x0, z0, x1, z1, standing out from depth ``y_m``."""
    parts = []
    for cell in _cells(front, rows, columns):
        x0, z0, x1, z1 = cell
        parts.append(block("drawer", colour, (x0, y_m - FRONT_M, z0), (x1, y_m, z1), "drawer"))
        parts.append(handle(style, metal, cell, y_m - FRONT_M))
    return parts


def doors(style: Style, colour: Rgb, metal: Rgb, front: Rect, y_m: float, columns: int) -> list[Part]:
    """A row of door fronts whose handles meet in pairs."""
    parts = []
    for i, cell in enumerate(_cells(front, 1, columns)):
        x0, z0, x1, z1 = cell
        inset = 0.05 / (x1 - x0)
        at = 1 - inset if i % 2 == 0 and columns > 1 else inset
        parts.append(block("door", colour, (x0, y_m - FRONT_M, z0), (x1, y_m, z1), "door"))
        parts.append(handle(style, metal, cell, y_m - FRONT_M, upright=True, at=at))
    return parts


def centred(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts moved so that the middle of their common footprint is the origin; heights stay."""
    points = np.concatenate([p.vertices for p in parts])
    shift = np.array([*quantise_m((points.min(axis=0) + points.max(axis=0))[:2] / 2), 0.0])
    if not shift.any():
        return tuple(parts)
    return tuple(Part(p.name, p.colour, p.role, ConvexSolid(p.vertices - shift, p.triangles)) for p in parts)


def _cells(front: Rect, rows: int, columns: int) -> list[Rect]:
    """The fields of a front, row by row from below, with slits between them."""
    x0, z0, x1, z1 = front
    width, height = (x1 - x0) / columns, (z1 - z0) / rows
    half = GAP_M / 2
    return [
        (x0 + c * width + half, z0 + r * height + half, x0 + (c + 1) * width - half, z0 + (r + 1) * height - half)
        for r in range(rows)
        for c in range(columns)
    ]
