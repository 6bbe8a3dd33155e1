"""Storage: closed bodies with doors and drawers (solid), and open shelves (free inside, with books).

Wardrobe, bookshelf, sideboard, dresser, TV stand, wall shelf, storage box. The wall shelf hangs: its parts begin above
the floor.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import FRONT_M, RECESS_M, carcass, cells, doors, drawers
from hsbench.synth.furniture.pieces import (
    accent,
    block,
    centred,
    draw,
    front_shape,
    painted,
    pick,
    shade,
    slab,
    staves,
    strip,
    tone,
    wood,
)
from hsbench.synth.furniture.shapes import Rect, oval_outline, rectangle_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

BOARD_M = 0.022
BOOK_CLUSTER = (2, 5)  # fewest and most books that stand together
BOOKS_FILL = 0.6  # share of half boards that carry books
PANEL_INSET_M = 0.09  # from the edge of a door to the raised field on it


def wardrobe(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A closed wardrobe of two to four doors, flat or with panels, over drawers now and then."""
    room = size("wardrobe")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    columns = 2 + round(2 * fit * float(rng.random()))
    width, depth = columns * draw(rng, (0.46, 0.51), fit), draw(rng, (0.56, 0.64))
    height = draw(rng, (1.87, room.height_m[1]))
    panelled = rng.random() < 0.5
    drawered = rng.random() < 0.4
    x, y = width / 2, depth / 2
    face = -y + FRONT_M + 0.012
    crown = height - 0.03
    parts = [
        block("plinth", shade(colour, 0.75), (-x + 0.02, face + RECESS_M, 0.0), (x - 0.02, y - 0.005, 0.07)),
        block("body", shade(colour, 0.92), (-x + 0.01, face, 0.07), (x - 0.01, y, crown)),
        slab("cornice", colour, (-x, -y, x, y), crown, height, None, 0.012, 0.006, 1),
    ]
    low = 0.08
    if drawered:
        parts += drawers(style, colour, metal, (-x + 0.012, low, x - 0.012, 0.4), face, 1, max(1, columns // 2))
        low = 0.4
    front = (-x + 0.012, low, x - 0.012, crown - 0.006)
    parts += doors(style, colour, metal, front, face, columns)
    if panelled:
        parts += _panels(shade(colour, 0.94), cells(front, 1, columns), face - FRONT_M)
    return centred(parts)


def _panels(colour: Finish, fields: list[Rect], y: float) -> list[Part]:
    """A raised field on each door."""
    parts = []
    for x0, z0, x1, z1 in fields:
        outline = rectangle_outline((x0 + PANEL_INSET_M, z0 + PANEL_INSET_M, x1 - PANEL_INSET_M, z1 - PANEL_INSET_M))
        parts.append(front_shape("panel", colour, outline, y - 0.006, y + 0.006, front_scale=1.0))
    return parts


def bookshelf(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """An open shelf with sides, back and boards, or of two ladder frames without a back, partly filled with books."""
    room = size("bookshelf")
    timber, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth = draw(rng, (0.7, 1.1), fit), draw(rng, room.depth_m)
    shelves, pitch = int(rng.integers(4, 6)), draw(rng, (0.33, 0.38))
    x, y = width / 2, depth / 2
    framed = rng.random() < 0.35
    height = 0.06 + shelves * pitch + BOARD_M
    if framed:
        parts = []
        for sx in (-1, 1):
            for sy in (-1, 1):
                ax, ay = sx * (x - 0.0125), sy * (y - 0.0125)
                parts.append(block("post", metal, (ax - 0.0125, ay - 0.0125, 0.0), (ax + 0.0125, ay + 0.0125, height)))
        parts.append(
            strip("brace", metal, (-x + 0.02, y - 0.012, 0.2), (x - 0.02, y - 0.012, height - 0.3), 0.012, 0.012)
        )
        inner: Rect = (-x + 0.02, -y + 0.002, x - 0.02, y - 0.026)
    else:
        parts = [
            block("side", timber, (-x, -y, 0.0), (-x + BOARD_M, y, height)),
            block("side", timber, (x - BOARD_M, -y, 0.0), (x, y, height)),
            block(
                "back", shade(timber, 0.9), (-x + BOARD_M, y - 0.014, 0.06), (x - BOARD_M, y - 0.002, height - BOARD_M)
            ),
            block("plinth", shade(timber, 0.9), (-x + BOARD_M, -y + 0.02, 0.0), (x - BOARD_M, -y + 0.04, 0.06)),
        ]
        inner = (-x + BOARD_M, -y + 0.004, x - BOARD_M, y - 0.014)
    top = "shelf" if height < 1.4 else None
    parts.append(
        block("top", timber, (inner[0], inner[1], height - BOARD_M), (inner[2], inner[3], height - 0.001), top)
    )
    for i in range(shelves):
        z = 0.06 + i * pitch
        parts.append(block("shelf", timber, (inner[0], inner[1], z), (inner[2], inner[3], z + BOARD_M), "shelf"))
        parts += _books(rng, style, inner, z + BOARD_M, pitch - BOARD_M)
    return centred(parts)


def _books(rng: np.random.Generator, style: Style, board: Rect, z: float, clear: float) -> list[Part]:
    """Clusters of upright books on one board: some at the left end, some at the right, some nowhere."""
    x0, _, x1, y1 = board
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
            parts.append(block("book", colour, (low, y1 - draw(rng, (0.17, 0.23)), z), (high, y1 - 0.002, z + tall)))
            x = high if from_left else low
    return parts


def sideboard(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A long low cupboard: drawers above doors, or beside them, .75-.9 m high."""
    room = size("sideboard")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m)
    height = draw(rng, (0.76, 0.88))
    columns = 2 if width < 1.35 else 3
    stacked = rng.random() < 0.5
    x, y = width / 2, depth / 2
    parts, (left, low, right, high), face = carcass(rng, style, colour, (-x, -y, x, y), height)
    if stacked:
        parts += drawers(style, colour, metal, (left, high - 0.18, right, high), face, 1, columns)
        parts += doors(style, colour, metal, (left, low, right, high - 0.18), face, columns)
    else:
        step = (right - left) / columns
        parts += drawers(style, colour, metal, (left, low, left + step, high), face, 3, 1)
        parts += doors(style, colour, metal, (left + step, low, right, high), face, columns - 1)
    return centred(parts)


def dresser(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A chest of drawers, three or four rows, one or two columns."""
    room = size("dresser")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m), draw(rng, (0.8, 1.05))
    x, y = width / 2, depth / 2
    parts, front, face = carcass(rng, style, colour, (-x, -y, x, y), height)
    columns = 1 if width < 1.0 else 2
    parts += drawers(style, colour, metal, front, face, int(rng.integers(3, 5)), columns)
    return centred(parts)


def tv_stand(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A low cupboard for a television, .44-.54 m high: drawers in the middle between doors, or below them."""
    room = size("tv_stand")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m), draw(rng, (0.44, 0.54))
    x, y = width / 2, depth / 2
    parts, (left, low, right, high), face = carcass(rng, style, colour, (-x, -y, x, y), height)
    if rng.random() < 0.5:
        side = width / 6
        parts += drawers(style, colour, metal, (-side, low, side, high), face, 2, 1)
    else:
        side, split = 0.0, low + 0.12
        parts += drawers(style, colour, metal, (left, low, right, split), face, 1, 2)
        low = split
    parts += doors(style, colour, metal, (left, low, -side, high), face, 1)
    parts += doors(style, colour, metal, (side, low, right, high), face, 1, hinged_left=False)
    return centred(parts)


def shelf(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """One or two boards on brackets that hang on the wall behind them (+y), 1.25-1.4 m above the floor, with books."""
    room = size("shelf")
    timber, metal = wood(rng, style), Finish(pick(rng, style.metals))
    width, depth, z = draw(rng, (0.7, 1.2), fit), draw(rng, room.depth_m), draw(rng, (1.25, 1.35))
    x, y = width / 2, depth / 2
    levels = (z, z + 0.32)[: int(rng.integers(1, 3))]
    rear, ends = y - 0.014, (-x + 0.12, x - 0.12)
    parts = [block("rail", metal, (at - 0.01, rear, z - 0.12), (at + 0.01, y, levels[-1] + 0.02)) for at in ends]
    for level in levels:
        parts.append(block("shelf", timber, (-x, -y, level), (x, rear, level + 0.025), "shelf"))
        parts += [
            block("bracket", metal, (at - 0.01, rear - 0.14, level - 0.02), (at + 0.01, rear, level)) for at in ends
        ]
        parts += _books(rng, style, (-x + 0.02, -y, x - 0.02, rear), level + 0.025, 0.26)
    return centred(parts)


def storage_box(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A box for a shelf: a lidded carton, a fabric cube with a grip, or a woven basket with sloping sides."""
    room = size("storage_box")
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, room.height_m)
    x, y = width / 2, depth / 2
    colour, timber = accent(rng, style), wood(rng, style)
    kind = pick(rng, ("carton", "cube", "basket"))
    if kind == "carton":
        return centred([
            block("box", colour, (-x + 0.006, -y + 0.006, 0.0), (x - 0.006, y - 0.006, height - 0.04)),
            block("lid", shade(colour, 0.88), (-x, -y, height - 0.05), (x, y, height)),
            block("label", Finish((240, 238, 230)), (-0.04, -y - 0.002, 0.05), (0.04, -y + 0.012, 0.09)),
        ])  # fmt: skip
    if kind == "cube":
        grip = oval_outline(0.03, 0.016, 8) + np.array([0.0, round(height * 0.7, 4)])
        return centred([
            slab("box", colour, (-x, -y, x, y), 0.0, height, None, 0.02, 0.006),
            front_shape("grip", shade(colour, 0.5), grip, -y - 0.002, -y + 0.008),
        ])  # fmt: skip
    low = 0.9
    bottom = rectangle_outline((-x, -y, x, y))
    inner = [v * low - 0.008 for v in (x, y)]
    base = block("base", timber, (-inner[0], -inner[1], 0.0), (inner[0], inner[1], 0.014))
    return centred([base, *staves("side", timber, bottom, low, 0.014, 0.0, height)])
