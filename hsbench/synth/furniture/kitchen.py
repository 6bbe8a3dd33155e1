"""Kitchen: fridge, counter with sink, hob and oven (and wall cupboards), free-standing island. Closed, hence solid."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, doors, draw, drawers, handle, pick, rod, shade, tone
from hsbench.synth.furniture.style import Rgb, Style

WORKTOP_M = 0.035
MODULE_M = 0.6  # width of an oven and of the cupboards beside it
BLACK: Rgb = (34, 34, 38)
STEEL: Rgb = (188, 190, 192)


def fridge(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A fridge with a freezer below: two fronts with upright handles."""
    colour = tone(rng, pick(rng, ((238, 238, 236), (196, 198, 200), style.paints[0])))
    metal = shade(pick(rng, style.metals), 0.9)
    width, depth, height = draw(rng, (0.56, 0.62), fit), draw(rng, (0.56, 0.62), fit), draw(rng, (1.6, 1.9))
    x, y, split = width / 2, depth / 2, draw(rng, (0.6, 0.75))
    parts = [
        block("plinth", BLACK, (-x + 0.02, -y + 0.03, 0.0), (x - 0.02, y, 0.05)),
        block("body", shade(colour, 0.93), (-x, -y, 0.05), (x, y, height)),
    ]
    for z0, z1 in ((0.06, split), (split + 0.006, height)):
        parts.append(block("front", colour, (-x, -y - 0.04, z0), (x, -y, z1), "front"))
        parts.append(handle(style, metal, (-x, z0, x, z1), -y - 0.04, upright=True, at=0.1))
    return centred(parts)


def kitchen_counter(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A counter for a wall: cupboards, drawers, an oven under a hob, a sink with a tap; cupboards above at fit 1."""
    paint, metal = tone(rng, pick(rng, style.paints)), pick(rng, style.metals)
    stone = tone(rng, pick(rng, style.woods))
    width, depth = draw(rng, (1.8, 2.7), fit), 0.6
    height = draw(rng, (0.88, 0.92))
    x, y = width / 2, depth / 2
    under = height - WORKTOP_M
    oven = -x + 0.02 + (x * 0.15 if width > 2.2 else 0.0)
    end = oven + MODULE_M
    parts = [
        block("plinth", BLACK, (-x, -y + 0.06, 0.0), (x, y, 0.09)),
        block("base", shade(paint, 0.92), (-x, -y + 0.02, 0.09), (x, y, under)),
        block("top", stone, (-x - 0.01, -y - 0.01, under), (x + 0.01, y, height), "top"),
        block("front", BLACK, (oven, -y, 0.12), (end, -y + 0.02, under - 0.01), "front"),
        block("handle", STEEL, (oven + 0.06, -y - 0.03, under - 0.12), (end - 0.06, -y, under - 0.1), "handle"),
        block("hob", BLACK, (oven + 0.02, -y + 0.07, height), (end - 0.02, y - 0.06, height + 0.012), "front"),
    ]
    left, right = oven - (-x), x - end
    if left > 0.15:
        parts += doors(style, paint, metal, (-x, 0.1, oven, under), -y + 0.02, 1)
    columns = max(2, round(right / 0.5))
    step = right / columns
    parts += drawers(style, paint, metal, (x - right, 0.1, x - right + step, under), -y + 0.02, 3, 1)
    parts += doors(style, paint, metal, (x - right + step, 0.1, x, under), -y + 0.02, columns - 1)
    sink = x - 0.12 - 0.5
    parts.append(block("sink", STEEL, (sink, -y + 0.08, height), (sink + 0.5, y - 0.12, height + 0.012)))
    basin = ((sink + 0.05, -y + 0.12, height), (sink + 0.45, y - 0.16, height + 0.014))
    parts.append(block("sink", shade(STEEL, 0.72), *basin))
    parts += _tap(sink + 0.25, y - 0.08, height)
    if fit >= 1.0 and rng.random() < 0.6:
        parts += _wall_cupboards(rng, style, paint, metal, x, y)
    return centred(parts)


def _tap(x: float, y: float, z: float) -> list[Part]:
    return [
        rod("tap", STEEL, (x, y), 0.016, z, z + 0.26, sides=8, role="tap"),
        block("tap", STEEL, (x - 0.011, y - 0.18, z + 0.24), (x + 0.011, y, z + 0.262), "tap"),
        block("tap", STEEL, (x - 0.009, y - 0.18, z + 0.2), (x + 0.009, y - 0.16, z + 0.24), "tap"),
    ]


def _wall_cupboards(rng: np.random.Generator, style: Style, paint: Rgb, metal: Rgb, x: float, y: float) -> list[Part]:
    z0 = draw(rng, (1.42, 1.48))
    z1, front = z0 + draw(rng, (0.6, 0.68)), y - 0.33
    parts = [block("cupboard", shade(paint, 0.92), (-x, front, z0), (x, y, z1))]
    return parts + doors(style, paint, metal, (-x, z0, x, z1), front, max(2, round(2 * x / 0.5)))


def kitchen_island(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A free-standing block with a worktop that overhangs at the back (+y), drawers and doors at the front."""
    paint, metal = tone(rng, pick(rng, style.paints)), pick(rng, style.metals)
    stone = tone(rng, pick(rng, style.woods))
    width, depth, height = draw(rng, (1.1, 1.7), fit), draw(rng, (0.6, 0.75), fit), draw(rng, (0.88, 0.92))
    x, y = width / 2, depth / 2
    under = height - WORKTOP_M
    parts = [
        block("plinth", BLACK, (-x + 0.05, -y + 0.06, 0.0), (x - 0.05, y - 0.15, 0.09)),
        block("base", shade(paint, 0.94), (-x + 0.03, -y + 0.02, 0.09), (x - 0.03, y - 0.12, under)),
        block("top", stone, (-x, -y - 0.01, under), (x, y, height), "top"),
    ]
    parts += drawers(style, paint, metal, (-x + 0.03, 0.1, 0.0, under), -y + 0.02, 3, 1)
    parts += doors(style, paint, metal, (0.0, 0.1, x - 0.03, under), -y + 0.02, 2)
    return centred(parts)
