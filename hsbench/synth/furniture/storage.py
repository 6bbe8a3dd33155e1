"""Storage: closed bodies with doors and drawers (solid), and open shelves (free inside, with books).

Wardrobe, bookshelf, sideboard, dresser, TV stand, wall shelf. The wall shelf hangs: its parts begin above the floor.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import Rect, block, centred, doors, draw, drawers, four_legs, pick, shade, tone
from hsbench.synth.furniture.style import Rgb, Style

BOARD_M = 0.022
BOOK_CLUSTER = (2, 5)  # fewest and most books that stand together
BOOKS_FILL = 0.7  # share of half boards that carry books


def wardrobe(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A closed wardrobe of two to four doors, 1.85-2.15 m high."""
    colour, metal = tone(rng, pick(rng, (*style.woods, *style.paints))), pick(rng, style.metals)
    columns = 2 + round(2 * fit * float(rng.random()))
    width, depth = columns * draw(rng, (0.44, 0.52), fit), draw(rng, (0.54, 0.62))
    height = draw(rng, (1.85, 2.15))
    x, y = width / 2, depth / 2
    parts = [
        block("plinth", shade(colour, 0.85), (-x + 0.01, -y + 0.03, 0.0), (x - 0.01, y, 0.07)),
        block("body", colour, (-x, -y, 0.07), (x, y, height)),
        block("cornice", colour, (-x - 0.01, -y - 0.028, height), (x + 0.01, y, height + 0.03)),
    ]
    if rng.random() < 0.4:
        parts += drawers(style, colour, metal, (-x, 0.08, x, 0.4), -y, 1, max(1, columns // 2))
        parts += doors(style, colour, metal, (-x, 0.4, x, height - 0.01), -y, columns)
    else:
        parts += doors(style, colour, metal, (-x, 0.08, x, height - 0.01), -y, columns)
    return centred(parts)


def bookshelf(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """An open shelf with sides, back and boards, partly filled with books."""
    wood = tone(rng, pick(rng, (*style.woods, *style.paints)))
    width, depth = draw(rng, (0.7, 1.1), fit), draw(rng, (0.28, 0.34))
    shelves = int(rng.integers(4, 6))
    pitch = draw(rng, (0.33, 0.38))
    height = 0.06 + shelves * pitch + BOARD_M
    x, y = width / 2, depth / 2
    parts = [
        block("side", wood, (-x, -y, 0.0), (-x + BOARD_M, y, height)),
        block("side", wood, (x - BOARD_M, -y, 0.0), (x, y, height)),
        block("back", shade(wood, 0.9), (-x, y - 0.012, 0.06), (x, y, height)),
        block("plinth", wood, (-x + BOARD_M, -y + 0.02, 0.0), (x - BOARD_M, -y + 0.04, 0.06)),
        block("top", wood, (-x, -y, height - BOARD_M), (x, y, height), "top" if height < 1.4 else None),
    ]
    inner = (-x + BOARD_M, -y, x - BOARD_M, y - 0.012)
    for i in range(shelves):
        z = 0.06 + i * pitch
        parts.append(block("shelf", wood, (inner[0], inner[1], z), (inner[2], inner[3], z + BOARD_M), "shelf"))
        parts += _books(rng, style, inner, z + BOARD_M, pitch - BOARD_M)
    return tuple(parts)


def _books(rng: np.random.Generator, style: Style, shelf: Rect, z: float, clear: float) -> list[Part]:
    """Clusters of upright books on one shelf: some at the left end, some at the right, some nowhere."""
    x0, _, x1, y1 = shelf
    parts: list[Part] = []
    for from_left in (True, False):
        if rng.random() >= BOOKS_FILL:
            continue
        x = x0 + 0.005 if from_left else x1 - 0.005
        for _ in range(int(rng.integers(*BOOK_CLUSTER, endpoint=True))):
            thick, tall = draw(rng, (0.025, 0.065)), clear * draw(rng, (0.6, 0.88))
            colour = tone(rng, pick(rng, (*style.accents, *style.fabrics)))
            low, high = (x, x + thick) if from_left else (x - thick, x)
            if low < (x0 + x1) / 2 < high:
                break
            parts.append(block("book", colour, (low, y1 - draw(rng, (0.17, 0.23)), z), (high, y1, z + tall)))
            x = high if from_left else low
    return parts


def sideboard(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A long low cupboard: drawers above doors, .75-.9 m high."""
    colour, metal = tone(rng, pick(rng, (*style.woods, *style.paints))), pick(rng, style.metals)
    width, depth, height = draw(rng, (1.1, 1.7), fit), draw(rng, (0.4, 0.46)), draw(rng, (0.74, 0.88))
    columns = 2 if width < 1.35 else 3
    parts, foot = _carcass(rng, style, colour, (width, depth), height)
    x, y = width / 2, depth / 2
    parts += drawers(style, colour, metal, (-x, height - 0.22, x, height - 0.025), -y, 1, columns)
    parts += doors(style, colour, metal, (-x, foot + 0.01, x, height - 0.22), -y, columns)
    return centred(parts)


def dresser(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A chest of drawers, three or four rows, one or two columns."""
    colour, metal = tone(rng, pick(rng, (*style.woods, *style.paints))), pick(rng, style.metals)
    width, depth, height = draw(rng, (0.8, 1.3), fit), draw(rng, (0.42, 0.48)), draw(rng, (0.78, 1.0))
    parts, foot = _carcass(rng, style, colour, (width, depth), height)
    x, y = width / 2, depth / 2
    columns = 1 if width < 1.0 else 2
    parts += drawers(style, colour, metal, (-x, foot + 0.01, x, height - 0.025), -y, int(rng.integers(3, 5)), columns)
    return centred(parts)


def tv_stand(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A low cupboard for a television, .4-.52 m high."""
    colour, metal = tone(rng, pick(rng, (*style.woods, *style.paints))), pick(rng, style.metals)
    width, depth, height = draw(rng, (1.1, 1.7), fit), draw(rng, (0.38, 0.44)), draw(rng, (0.42, 0.52))
    parts, foot = _carcass(rng, style, colour, (width, depth), height)
    x, y = width / 2, depth / 2
    third = width / 6
    parts += drawers(style, colour, metal, (-third, foot + 0.01, third, height - 0.025), -y, 2, 1)
    parts += doors(style, colour, metal, (-x, foot + 0.01, -third, height - 0.025), -y, 1)
    parts += doors(style, colour, metal, (third, foot + 0.01, x, height - 0.025), -y, 1)
    return centred(parts)


def shelf(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A board on two brackets that hangs on the wall behind it (+y), 1.25-1.45 m above the floor, with books."""
    wood, metal = tone(rng, pick(rng, style.woods)), pick(rng, style.metals)
    width, depth, z = draw(rng, (0.7, 1.2), fit), draw(rng, (0.2, 0.25)), draw(rng, (1.25, 1.38))
    x, y = width / 2, depth / 2
    parts = [block("shelf", wood, (-x, -y, z), (x, y, z + 0.025), "shelf")]
    for at in (-x + 0.12, x - 0.12):
        parts.append(block("bracket", metal, (at - 0.01, y - 0.15, z - 0.02), (at + 0.01, y, z)))
        parts.append(block("bracket", metal, (at - 0.01, y - 0.015, z - 0.12), (at + 0.01, y, z - 0.02)))
    parts += _books(rng, style, (-x, -y, x, y - 0.005), z + 0.025, 0.3)
    return centred(parts)


def _carcass(
    rng: np.random.Generator, style: Style, colour: Rgb, size: tuple[float, float], height: float
) -> tuple[list[Part], float]:
    """Base, body and top board of a cabinet; second: height of the base."""
    x, y = size[0] / 2, size[1] / 2
    foot = draw(rng, (0.12, 0.18)) if style.base == "legs" else draw(rng, (0.05, 0.08))
    parts = (
        four_legs(style, colour, (-x + 0.03, -y + 0.02, x - 0.03, y - 0.02), 0.04, foot, 0.5)
        if style.base == "legs"
        else [block("plinth", shade(colour, 0.8), (-x + 0.02, -y + 0.03, 0.0), (x - 0.02, y, foot))]
    )
    parts.append(block("body", shade(colour, 0.94), (-x, -y, foot), (x, y, height - 0.022)))
    parts.append(block("top", colour, (-x - 0.01, -y - 0.025, height - 0.022), (x + 0.01, y, height), "top"))
    return parts, foot
