"""The small vocabulary every builder speaks: drawn sizes, colours of things, and parts of simple convex shapes.

Object frame: origin on the middle of the footprint, z up, front towards -y, width along x. Metres, quantised to .1 mm
where they enter a solid, so that every machine builds the same vertices.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.shapes import (
    CORNER_STEPS,
    Point,
    Rect,
    along_x,
    bar,
    loft,
    oval_outline,
    quantised,
    rectangle_outline,
    rounded_outline,
    towards_front,
)
from hsbench.synth.furniture.style import Finish, Range, Rgb, Style
from hsbench.typing import FloatArray

T = TypeVar("T")
Colour = TypeVar("Colour", Rgb, Finish)
TONE_SPREAD = 7  # how far two objects of one colour may differ, in sRGB steps
ROUND_SIDES = 12


def draw(rng: np.random.Generator, sizes: Range, fit: float = 1.0) -> float:
    """A length from a range, quantised; ``fit`` < 1 takes it from the lower part of the range only."""
    low, high = sizes
    return quantised(low + (high - low) * fit * rng.random())


def pick(rng: np.random.Generator, options: Sequence[T]) -> T:
    """One of the options, all equally likely."""
    return options[int(rng.integers(len(options)))]


def tone(rng: np.random.Generator, colour: Colour) -> Colour:
    """A colour a little lighter or darker, so that no two things look painted from one pot."""
    shift = int(rng.integers(-TONE_SPREAD, TONE_SPREAD + 1))
    return shade(colour, 1.0, shift)


def shade(colour: Colour, factor: float, shift: int = 0) -> Colour:
    """A colour times a factor plus a shift, clipped to 0..255; a finish keeps its texture."""
    if isinstance(colour, Finish):
        return replace(colour, colour=shade(colour.colour, factor, shift))
    r, g, b = (min(255, max(0, round(c * factor) + shift)) for c in colour)
    return r, g, b


def wood(rng: np.random.Generator, style: Style) -> Finish:
    """A wood of the style."""
    return tone(rng, Finish(pick(rng, style.woods), pick(rng, style.wood_textures)))


def painted(rng: np.random.Generator, style: Style) -> Finish:
    """What cabinets are made of: half of them a wood, half of them painted."""
    return wood(rng, style) if rng.random() < 0.5 else tone(rng, Finish(pick(rng, style.paints)))


def fabric(rng: np.random.Generator, style: Style) -> Finish:
    """A fabric of the style for upholstery."""
    return tone(rng, Finish(pick(rng, style.fabrics), pick(rng, style.fabric_textures)))


def accent(rng: np.random.Generator, style: Style) -> Finish:
    """A strong colour of the style, plain or patterned, for small textiles."""
    return tone(rng, Finish(pick(rng, style.accents), pick(rng, style.accent_textures)))


def part(name: str, colour: Rgb | Finish, solid: ConvexSolid, role: str | None = None) -> Part:
    """A part of a solid with a plain colour or a finish."""
    if isinstance(colour, Finish):
        return Part(name, colour.colour, role, solid, texture=colour.texture)
    return Part(name, colour, role, solid)


def block(
    name: str, colour: Rgb | Finish, low_m: Sequence[float], high_m: Sequence[float], role: str | None = None
) -> Part:
    """A box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low_m, high_m
    outline = rectangle_outline((x0, y0, x1, y1))
    return part(name, colour, loft([outline, outline], [z0, z1]), role)


def tapered(
    name: str, colour: Rgb | Finish, bottom: Rect, top: Rect, z0_m: float, z1_m: float, role: str | None = None
) -> Part:
    """A block whose outline changes from a bottom to a top rectangle: leaning backs, splayed legs."""
    return part(name, colour, loft([rectangle_outline(bottom), rectangle_outline(top)], [z0_m, z1_m]), role)


def rod(
    name: str,
    colour: Rgb | Finish,
    xy: Sequence[float],
    radius_m: float,
    z0_m: float,
    z1_m: float,
    top_radius_m: float | None = None,
    sides: int = ROUND_SIDES,
    role: str | None = None,
) -> Part:
    """An upright cylinder, or a cone frustum with another radius at the top."""
    middle = quantise_m(np.asarray(xy))
    rings = [oval_outline(r, r, sides) + middle for r in (radius_m, radius_m if top_radius_m is None else top_radius_m)]
    return part(name, colour, loft(rings, [z0_m, z1_m]), role)


def turned(
    name: str, colour: Rgb | Finish, xy: Sequence[float], profile: Sequence[tuple[float, float]], sides: int = 10
) -> list[Part]:
    """A turned shape from (radius, height) pairs, from below upwards: stacked frusta, one part each."""
    return [rod(name, colour, xy, r0, z0, z1, r1, sides) for (r0, z0), (r1, z1) in pairwise(profile)]


def slab(
    name: str, colour: Rgb | Finish, rect: Rect, z0_m: float, z1_m: float, role: str | None = None,
    radius_m: float = 0.03, bevel_m: float = 0.0, steps: int = CORNER_STEPS,
) -> Part:  # fmt: skip
    """A board or pad with round corners; a bevel smaller than the radius runs around its top edge."""
    x0, y0, x1, y1 = rect
    outer = rounded_outline(rect, radius_m, steps)
    if bevel_m <= 0:
        return part(name, colour, loft([outer, outer], [z0_m, z1_m]), role)
    inner = rounded_outline((x0 + bevel_m, y0 + bevel_m, x1 - bevel_m, y1 - bevel_m), radius_m - bevel_m, steps)
    return part(name, colour, loft([outer, outer, inner], [z0_m, z1_m - bevel_m, z1_m]), role)


def cushion(
    name: str, colour: Rgb | Finish, rect: Rect, z0_m: float, z1_m: float, role: str | None = None,
    round_m: float = 0.025,
) -> Part:  # fmt: skip
    """A padded slab: corners rounded, edges bevelled above and below."""
    x0, y0, x1, y1 = rect
    half = min(round_m, (z1_m - z0_m) / 2 - 0.004)
    wide, inner = (
        rounded_outline((x0 + d, y0 + d, x1 - d, y1 - d), 2 * round_m - d, CORNER_STEPS) for d in (0.0, half)
    )
    return part(name, colour, loft([inner, wide, wide, inner], [z0_m, z0_m + half, z1_m - half, z1_m]), role)


def front_pad(
    name: str, colour: Rgb | Finish, front: Rect, y0_m: float, y1_m: float, role: str | None = None,
    radius_m: float = 0.05, bevel_m: float = 0.025,
) -> Part:  # fmt: skip
    """An upright padded slab over x0, z0, x1, z1 whose front edges (at y0) are bevelled by less than the radius."""
    x0, z0, x1, z1 = front
    outer = rounded_outline(front, radius_m)
    inner = rounded_outline((x0 + bevel_m, z0 + bevel_m, x1 - bevel_m, z1 - bevel_m), radius_m - bevel_m)
    solid = loft([outer, outer, inner], [-y1_m, -y0_m - min(bevel_m, (y1_m - y0_m) / 2), -y0_m])
    return part(name, colour, towards_front(solid), role)


def leaning(item: Part, lean_m: float, z0_m: float | None = None, z1_m: float | None = None) -> Part:
    """A part sheared backwards (+y): not at height z0, ``lean_m`` at z1; these are its foot and its top by default."""
    assert item.solid is not None
    points = item.solid.vertices.copy()
    z0 = points[:, 2].min() if z0_m is None else z0_m
    z1 = points[:, 2].max() if z1_m is None else z1_m
    points[:, 1] += lean_m * (points[:, 2] - z0) / (z1 - z0)
    return replace(item, solid=ConvexSolid(points, item.solid.triangles))


def front_shape(
    name: str, colour: Rgb | Finish, outline_xz: FloatArray, y0_m: float, y1_m: float, role: str | None = None,
    front_scale: float = 1.0,
) -> Part:  # fmt: skip
    """A prism seen from the front: outline (n, 2) in x and z, from depth y0 (front) to y1; the front may be smaller."""
    middle = quantise_m(outline_xz.mean(axis=0))
    small = middle + (outline_xz - middle) * front_scale
    return part(name, colour, towards_front(loft([outline_xz, small], [-y1_m, -y0_m])), role)


def side_shape(
    name: str, colour: Rgb | Finish, outline_yz: FloatArray, x0_m: float, x1_m: float, role: str | None = None
) -> Part:
    """A prism seen from the side: outline (n, 2) in y and z, from x0 to x1."""
    return part(name, colour, along_x(loft([outline_yz, outline_yz], [x0_m, x1_m])), role)


def pole(
    name: str, colour: Rgb | Finish, start: Point, end: Point, radius_m: float, end_scale: float = 1.0,
    sides: int = 8, role: str | None = None,
) -> Part:  # fmt: skip
    """A round bar between two points."""
    return part(name, colour, bar(start, end, oval_outline(radius_m, radius_m, sides), end_scale), role)


def strip(
    name: str, colour: Rgb | Finish, start: Point, end: Point, width_m: float, thick_m: float, end_scale: float = 1.0
) -> Part:
    """A flat bar between two points, its width horizontal."""
    half, thin = width_m / 2, thick_m / 2
    return part(name, colour, bar(start, end, rectangle_outline((-half, -thin, half, thin)), end_scale))


def ring(
    name: str, colour: Rgb | Finish, outer: Rect, inner: Rect, z0_m: float, z1_m: float, role: str | None = None
) -> list[Part]:
    """Four blocks around a hole: front, back, left, right."""
    x0, y0, x1, y1 = outer
    a0, b0, a1, b1 = inner
    rects = ((x0, y0, x1, b0), (x0, b1, x1, y1), (x0, b0, a0, b1), (a1, b0, x1, b1))
    return [block(name, colour, (p, q, z0_m), (r, s, z1_m), role) for p, q, r, s in rects]


def staves(
    name: str, colour: Rgb | Finish, outline: FloatArray, low: float, wall_m: float, z0_m: float, z1_m: float,
    centre_xy: Sequence[float] = (0.0, 0.0),
) -> list[Part]:  # fmt: skip
    """The wall of a hollow vessel over an outline (n, 2) about the origin: one part a side.

    At the foot the outline is ``low`` times as large; the wall is about ``wall_m`` thick throughout.
    """
    shift = quantise_m(np.asarray(centre_xy))
    radius = float(quantise_m(np.abs(outline).max(axis=0).min()))
    inner_low, inner = (share - wall_m / radius for share in (low, 1.0))
    parts = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        rings = [
            np.array([a * out, b * out, b * inside, a * inside]) + shift
            for out, inside in ((low, inner_low), (1.0, inner))
        ]
        parts.append(part(name, colour, loft(rings, [z0_m, z1_m])))
    return parts


def swung(item: Part, pivot_xy: Sequence[float], angle_rad: float) -> Part:
    """An upright prism turned about a vertical line, counter-clockwise seen from above; corners quantised."""
    assert item.solid is not None
    c, s = cos_sin(quantise_angle(angle_rad))
    pivot = np.asarray(pivot_xy)
    xy = quantise_m((item.solid.vertices[:, :2] - pivot) @ np.array([[c, s], [-s, c]]) + pivot)
    return replace(item, solid=ConvexSolid(np.column_stack([xy, item.solid.vertices[:, 2]]), item.solid.triangles))


def centred(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts moved so that the middle of their common footprint is the origin, and named apart; heights stay."""
    points = np.concatenate([p.vertices for p in parts])
    shift = np.array([*quantise_m((points.min(axis=0) + points.max(axis=0))[:2] / 2), 0.0])
    if not shift.any():
        return named_apart(parts)
    names = _names_apart(parts)
    return tuple(
        replace(p, name=name, solid=ConvexSolid(p.vertices - shift, p.triangles))
        for p, name in zip(parts, names, strict=True)
    )


def named_apart(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts with a number behind names that occur again: seat, seat_2, seat_3."""
    names = _names_apart(parts)
    return tuple(p if p.name == name else replace(p, name=name) for p, name in zip(parts, names, strict=True))


def _names_apart(parts: Sequence[Part]) -> list[str]:
    seen: Counter[str] = Counter()
    names = []
    for item in parts:
        seen[item.name] += 1
        number = seen[item.name]
        names.append(item.name if number == 1 else f"{item.name}_{number}")
    return names
