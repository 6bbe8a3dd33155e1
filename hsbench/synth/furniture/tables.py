"""Tables: dining, coffee, side table, desk and night stand. The space under a top is free."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.convex import regular_outline
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, draw, drawers, four_legs, pick, prism, rod, tone
from hsbench.synth.furniture.style import Range, Rgb, Style

APRON_M = (0.06, 0.018)  # height, thickness of the frame under a top


def dining_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A dining table: a rectangle on four legs with an apron, or a round top on a pedestal."""
    wood = tone(rng, pick(rng, style.woods))
    height, thick = draw(rng, (0.72, 0.76)), draw(rng, style.top_m)
    if pick(rng, style.table_shapes) == "round":
        return _pedestal(wood, draw(rng, (0.45, 0.58), fit), height, thick)
    width, depth = draw(rng, (1.22, 1.8), fit), draw(rng, (0.78, 0.92), fit)
    return _four_legged(style, wood, (width, depth), height, thick, draw(rng, (0.055, 0.08)))


def coffee_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A low table, with a shelf under the top now and then."""
    wood = tone(rng, pick(rng, style.woods))
    height, thick = draw(rng, (0.36, 0.45)), draw(rng, style.top_m)
    if pick(rng, style.table_shapes) == "round":
        return _pedestal(wood, draw(rng, (0.34, 0.42), fit), height, thick)
    width, depth = draw(rng, (0.75, 1.15), fit), draw(rng, (0.45, 0.6), fit)
    parts = list(_four_legged(style, wood, (width, depth), height, thick, 0.045, apron=False))
    if rng.random() < 0.4:
        x, y = width / 2 - 0.05 - style.leg_splay_m, depth / 2 - 0.05 - style.leg_splay_m
        parts.append(block("shelf", wood, (-x, -y, 0.1), (x, y, 0.12), "shelf"))
    return tuple(parts)


def side_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A small table beside a seat."""
    wood = tone(rng, pick(rng, style.woods))
    size, height = draw(rng, (0.4, 0.5), fit), draw(rng, (0.48, 0.58))
    if rng.random() < 0.5:
        return _pedestal(wood, size / 2, height, 0.02)
    return _four_legged(style, wood, (size, size), height, 0.025, 0.035, apron=False)


def desk(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A desk: top, legs on one side, a block of drawers on the other (which side varies), a modesty panel."""
    wood, metal = tone(rng, pick(rng, style.woods)), pick(rng, style.metals)
    paint = tone(rng, pick(rng, (*style.paints, wood)))
    width, depth = draw(rng, (1.15, 1.6), fit), draw(rng, (0.6, 0.74), fit)
    height, thick = draw(rng, (0.71, 0.75)), draw(rng, style.top_m)
    x, y, under = width / 2, depth / 2, height - thick
    side = pick(rng, (-1, 1))
    chest = 0.36
    parts = [block("top", wood, (-x, -y, under), (x, y, height), "top")]
    x0, x1 = sorted((side * (x - 0.02), side * (x - 0.02 - chest)))
    front = -y + 0.045
    parts.append(block("chest", paint, (x0, front, 0.05), (x1, y - 0.02, under)))
    parts.append(block("plinth", paint, (x0 + 0.02, front + 0.03, 0.0), (x1 - 0.02, y - 0.04, 0.05)))
    parts += drawers(style, paint, metal, (x0, 0.06, x1, under), front, 3, 1)
    outer = (-side * (x - 0.01), -side * (x - 0.12))
    foot = (min(outer), -y + 0.01, max(outer), y - 0.01)
    legs = four_legs(style, wood if style.leg == "round" else metal, foot, 0.05, under, 0.0)
    parts += legs[2:] if side < 0 else legs[:2]
    panel = sorted((side * (x - 0.02 - chest), -side * (x - 0.06)))
    parts.append(block("panel", wood, (panel[0], y - 0.04, under - 0.3), (panel[1], y - 0.02, under)))
    return centred(parts)


def night_stand(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bedside chest with one or two drawers, on legs or a plinth."""
    wood, metal = tone(rng, pick(rng, (*style.woods, *style.paints))), pick(rng, style.metals)
    width, depth, height = draw(rng, (0.4, 0.5), fit), draw(rng, (0.36, 0.42), fit), draw(rng, (0.46, 0.56))
    x, y = width / 2, depth / 2
    foot = 0.12 if style.base == "legs" else 0.05
    parts = (
        four_legs(style, wood, (-x, -y, x, y), 0.035, foot, 0.3)
        if style.base == "legs"
        else [block("plinth", wood, (-x + 0.02, -y + 0.03, 0.0), (x - 0.02, y, foot))]
    )
    parts.append(block("body", wood, (-x, -y, foot), (x, y, height - 0.02)))
    parts.append(block("top", wood, (-x, -y - 0.018, height - 0.02), (x, y, height), "top"))
    parts += drawers(style, wood, metal, (-x, foot + 0.01, x, height - 0.02), -y, int(rng.integers(1, 3)), 1)
    return centred(parts)


def _four_legged(
    style: Style, wood: Rgb, size: Range, height: float, thick: float, leg: float, apron: bool = True
) -> tuple[Part, ...]:
    x, y = size[0] / 2, size[1] / 2
    under = height - thick
    parts = [block("top", wood, (-x, -y, under), (x, y, height), "top")]
    parts += four_legs(style, wood, (-x + 0.02, -y + 0.02, x - 0.02, y - 0.02), leg, under)
    if apron:
        drop, wide = APRON_M
        ax, ay = x - 0.04 - style.leg_splay_m, y - 0.04 - style.leg_splay_m
        for s in (-1, 1):
            y0, y1 = sorted((s * ay, s * (ay - wide)))
            parts.append(block("apron", wood, (-ax, y0, under - drop), (ax, y1, under)))
            x0, x1 = sorted((s * ax, s * (ax - wide)))
            parts.append(block("apron", wood, (x0, -ay, under - drop), (x1, ay, under)))
    return tuple(parts)


def _pedestal(wood: Rgb, radius: float, height: float, thick: float) -> tuple[Part, ...]:
    return (
        prism("top", wood, regular_outline(radius, 20), height - thick, height, "top"),
        rod("pedestal", wood, (0, 0), max(0.03, radius * 0.12), 0.04, height - thick),
        rod("foot", wood, (0, 0), radius * 0.55, 0.0, 0.04, radius * 0.45, 16),
    )
