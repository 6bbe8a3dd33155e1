"""Lamps, plants, screens and soft things: floor lamp, plant, television, monitor, rug, curtain, and clutter on tops."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.convex import regular_outline
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, draw, pick, prism, rod, shade, tapered, tone
from hsbench.synth.furniture.style import Rgb, Style

SCREEN: Rgb = (26, 28, 32)
GLASS: Rgb = (48, 54, 64)
LEAVES: tuple[Rgb, ...] = ((84, 118, 74), (98, 130, 86), (70, 104, 78), (112, 134, 78))
SHADES: tuple[Rgb, ...] = ((240, 228, 200), (232, 218, 190), (244, 238, 222))
RUG_M = 0.012  # thin enough to step on, thick enough for the sub-samples of occupancy
CLUTTER_KINDS = ("books", "bowl", "vase", "box", "laptop", "mug")
FOLD_M = 0.12  # width of one fold of a curtain


def floor_lamp(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A floor lamp: round foot, pole with a switch, conical or drum shade."""
    metal, cloth = pick(rng, style.metals), tone(rng, pick(rng, SHADES))
    height, radius = draw(rng, (1.45, 1.7)), draw(rng, (0.17, 0.22), fit)
    tall = draw(rng, (0.24, 0.32))
    top = radius * (0.55 if style.lamp == "cone" else 0.95)
    return (
        rod("foot", metal, (0, 0), draw(rng, (0.13, 0.16)), 0.0, 0.025, sides=16),
        rod("pole", metal, (0, 0), 0.012, 0.025, height - tall + 0.02, sides=8),
        block("switch", shade(metal, 0.6), (-0.016, -0.03, 1.1), (0.016, -0.006, 1.15), "switch"),
        rod("shade", cloth, (0, 0), radius, height - tall, height, top, 16),
    )


def plant(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A potted plant: a bush of stacked cones, or a tree with a stem and a crown."""
    clay, leaf = tone(rng, pick(rng, (*style.accents, *style.paints))), tone(rng, pick(rng, LEAVES))
    radius, pot = draw(rng, (0.14, 0.19), fit), draw(rng, (0.24, 0.34))
    crown = radius * draw(rng, (1.2, 1.6))
    parts = [
        rod("pot", clay, (0, 0), radius * 0.72, 0.0, pot, radius),
        rod("soil", (84, 66, 52), (0, 0), radius * 0.88, pot - 0.02, pot + 0.01),
    ]
    if rng.random() < 0.5:
        z, size = pot + 0.02, draw(rng, (0.25, 0.34))
        parts.append(rod("stem", (104, 84, 62), (0, 0), 0.02, pot, z + 0.2, sides=8))
        for i in range(3):
            lower, upper = crown * (1 - 0.2 * i), crown * (0.45 - 0.13 * i)
            parts.append(rod("leaves", shade(leaf, 0.9 + 0.08 * i), (0, 0), lower, z + 0.08, z + 0.08 + size, upper))
            z += size * 0.6
    else:
        stem = draw(rng, (0.45, 0.75))
        parts.append(rod("stem", (112, 90, 66), (0, 0), 0.018, pot, pot + stem, sides=8))
        z = pot + stem - 0.1
        parts.append(rod("leaves", shade(leaf, 0.9), (0, 0), crown * 0.55, z, z + 0.18, crown))
        parts.append(rod("leaves", leaf, (0, 0), crown, z + 0.18, z + 0.32))
        parts.append(rod("leaves", shade(leaf, 1.06), (0, 0), crown, z + 0.32, z + 0.52, crown * 0.45))
    return tuple(parts)


def television(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A television on its foot, 16:9, to stand on a cabinet; the screen faces -y."""
    width = draw(rng, (0.95, 1.3), fit)
    return _display(width, width * 9 / 16, 0.06, 0.2)


def monitor(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A computer screen on its foot, to stand on a desk."""
    width = draw(rng, (0.5, 0.62), fit)
    return _display(width, width * 0.58, 0.12, 0.18)


def _display(width: float, height: float, foot: float, depth: float) -> tuple[Part, ...]:
    x, top = width / 2, foot + height
    return (
        block("foot", SCREEN, (-width * 0.2, -depth / 2, 0.0), (width * 0.2, depth / 2, 0.012)),
        block("stand", SCREEN, (-0.04, 0.0, 0.012), (0.04, 0.02, foot + 0.05)),
        block("case", SCREEN, (-x, -0.012, foot), (x, 0.03, top)),
        block("screen", GLASS, (-x + 0.012, -0.022, foot + 0.012), (x - 0.012, -0.012, top - 0.012), "screen"),
    )


def rug(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A rug with a border, or a round one; thin enough to step on."""
    cloth, edge = tone(rng, pick(rng, (*style.fabrics, *style.accents))), tone(rng, pick(rng, style.fabrics))
    width, depth = draw(rng, (1.5, 2.2), fit), draw(rng, (1.1, 1.5), fit)
    return rug_of(cloth, shade(edge, 0.9), width, depth)


def rug_of(cloth: Rgb, edge: Rgb, width: float, depth: float) -> tuple[Part, ...]:
    """A rug of a given size: a field between two end borders."""
    x, y, band = width / 2, depth / 2, min(0.12, width / 8)
    return (
        block("field", cloth, (-x + band, -y, 0.0), (x - band, y, RUG_M)),
        block("border", edge, (-x, -y, 0.0), (-x + band, y, RUG_M)),
        block("border", edge, (x - band, -y, 0.0), (x, y, RUG_M)),
    )


def curtain(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A gathered curtain that hangs from near the ceiling to just above the floor, in folds of two depths."""
    cloth = tone(rng, pick(rng, style.fabrics))
    folds, top = 2 + int(rng.integers(0, 2)), draw(rng, (2.18, 2.28))
    parts = []
    for i in range(folds):
        x0, depth = (i - folds / 2) * FOLD_M, 0.05 if i % 2 else 0.035
        low, high = (x0, 0.03 - depth, x0 + FOLD_M, 0.03), (x0 + 0.01, 0.03 - depth, x0 + FOLD_M - 0.01, 0.03)
        parts.append(tapered("fold", shade(cloth, 1.0 if i % 2 else 0.92), low, high, 0.04, top))
    return centred(parts)


def clutter(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A small thing for a table or a board: books, bowl, vase, box, laptop or mug."""
    colour = tone(rng, pick(rng, (*style.accents, *style.paints)))
    kind = pick(rng, CLUTTER_KINDS)
    if kind == "books":
        parts, z = [], 0.0
        for i in range(int(rng.integers(2, 4))):
            thick, x, y = draw(rng, (0.02, 0.04)), draw(rng, (0.09, 0.12)), draw(rng, (0.12, 0.15))
            cover = tone(rng, style.accents[i % len(style.accents)])
            parts.append(block("book", cover, (-x, -y, z), (x, y, z + thick)))
            z += thick
        return centred(parts)
    if kind == "bowl":
        radius = draw(rng, (0.09, 0.13))
        return (rod("bowl", colour, (0, 0), radius * 0.5, 0.0, 0.07, radius),)
    if kind == "vase":
        height = draw(rng, (0.18, 0.26))
        return (
            rod("vase", colour, (0, 0), 0.04, 0.0, height * 0.5, 0.065),
            rod("vase", colour, (0, 0), 0.065, height * 0.5, height, 0.035),
            rod("leaves", pick(rng, LEAVES), (0, 0), 0.05, height, height + 0.14, 0.09, 8),
        )
    if kind == "laptop":
        return (
            block("base", (92, 94, 98), (-0.16, -0.14, 0.0), (0.16, 0.09, 0.016)),
            tapered("lid", SCREEN, (-0.16, 0.078, 0.16, 0.09), (-0.16, 0.128, 0.16, 0.14), 0.016, 0.22),
        )
    if kind == "mug":
        return (rod("mug", colour, (0, 0), 0.04, 0.0, 0.09, 0.042, 10),)
    x, y, z = draw(rng, (0.08, 0.13)), draw(rng, (0.06, 0.1)), draw(rng, (0.08, 0.16))
    return (
        block("box", colour, (-x, -y, 0.0), (x, y, z)),
        prism("lid", shade(colour, 0.85), regular_outline(min(x, y) * 0.5, 8), z, z + 0.015),
    )
