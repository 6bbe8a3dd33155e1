"""Office and hall: whiteboard, filing cabinet, water cooler, waste bin, coat rack, shoe cabinet."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import FRONT_M, carcass, cells, doors, drawers, handle
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    draw,
    painted,
    pick,
    pole,
    rod,
    shade,
    slab,
    staves,
    tapered,
    tone,
    turned,
    wood,
)
from hsbench.synth.furniture.shapes import Rect, oval_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

WHITE = Finish((246, 247, 247))
STEEL = Finish((190, 193, 196))
WATER = Finish((150, 190, 214))
BOARD_LOW_M = (0.86, 0.98)  # lower edge of a whiteboard


def whiteboard(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A writing surface on the wall behind it, in a frame of metal or wood, with a pen tray and two pens."""
    room = size("whiteboard")
    width, height = draw(rng, room.width_m, fit), draw(rng, room.height_m)
    z = draw(rng, BOARD_LOW_M)
    metal = STEEL if rng.random() < 0.6 else wood(rng, style)
    x, y, rim = width / 2, 0.025, 0.022
    parts = [
        block("board", WHITE, (-x + rim, -y + 0.006, z + rim), (x - rim, y - 0.004, z + height - rim), "board"),
        block("frame", metal, (-x, -y, z), (-x + rim, y, z + height)),
        block("frame", metal, (x - rim, -y, z), (x, y, z + height)),
        block("frame", metal, (-x + rim, -y, z), (x - rim, y, z + rim)),
        block("frame", metal, (-x + rim, -y, z + height - rim), (x - rim, y, z + height)),
        block("tray", metal, (-x * 0.4, -y - 0.05, z - 0.012), (x * 0.4, -y, z + 0.003)),
    ]
    for at, ink in ((-0.1, (40, 70, 150)), (0.08, (170, 50, 46))):
        parts.append(block("pen", ink, (at, -y - 0.034, z + 0.003), (at + 0.12, -y - 0.018, z + 0.017)))
    return centred(parts)


def filing_cabinet(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A steel cabinet of two to four deep drawers with label holders."""
    room = size("filing_cabinet")
    paint = tone(rng, Finish(pick(rng, (*style.paints, STEEL.colour))))
    metal = Finish(pick(rng, style.metals))
    rows = int(rng.integers(2, 5))
    width, depth = draw(rng, room.width_m, fit), draw(rng, (0.5, 0.62), fit)
    height = 0.05 + rows * 0.315 + 0.02
    x, y = width / 2, depth / 2
    face = -y + FRONT_M + 0.004
    parts = [
        block("plinth", shade(paint, 0.6), (-x + 0.015, face + 0.02, 0.0), (x - 0.015, y - 0.01, 0.05)),
        block("body", shade(paint, 0.94), (-x + 0.004, face, 0.05), (x - 0.004, y, height - 0.02)),
        slab("top", paint, (-x, -y, x, y), height - 0.02, height, "top", 0.01, 0.004, 1),
    ]
    front: Rect = (-x + 0.008, 0.055, x - 0.008, height - 0.024)
    parts += drawers(style, paint, metal, front, face, rows, 1)
    for x0, _, x1, z1 in cells(front, rows, 1):
        middle = (x0 + x1) / 2
        low, high = (
            (middle - 0.04, face - FRONT_M - 0.003, z1 - 0.08),
            (middle + 0.04, face - FRONT_M + 0.009, z1 - 0.05),
        )
        parts.append(block("label", WHITE, low, high))
    return centred(parts)


def water_cooler(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A water dispenser: cabinet with a bay and two taps, a bottle upside down on top, or a closed tower."""
    room = size("water_cooler")
    width, height = draw(rng, (0.3, 0.36), fit), draw(rng, (0.92, 1.0))
    colour = tone(rng, Finish(pick(rng, ((236, 238, 238), (60, 63, 66), (200, 202, 204)))))
    dark = shade(colour, 0.55)
    bottled = rng.random() < 0.7
    x = width / 2
    rect: Rect = (-x, -x, x, x)
    bay_low, bay_high = height - 0.36, height - 0.08
    parts = [
        slab("body", colour, rect, 0.0, bay_low, None, 0.03),
        slab("back", shade(colour, 0.9), (-x, 0.0, x, x), bay_low, bay_high, None, 0.02),
        slab("head", colour, rect, bay_high, height, None, 0.03),
        block("tray", dark, (-x * 0.6, -x + 0.015, bay_low - 0.006), (x * 0.6, -0.01, bay_low + 0.012)),
    ]
    for at, ink in ((-0.06, (60, 100, 180)), (0.06, (190, 60, 50))):
        tap = block(
            "tap", Finish(ink), (at - 0.016, -0.07, bay_high - 0.08), (at + 0.016, 0.004, bay_high - 0.045), "tap"
        )
        parts.append(tap)
    if bottled:
        top = min(height + 0.4, room.height_m[1])
        profile = ((0.05, height), (0.12, height + 0.06), (0.128, height + 0.1), (0.128, top - 0.03), (0.1, top))
        parts += turned("bottle", WATER, (0, 0), profile, 12)
    else:
        parts.append(
            slab("tower", dark, (-x + 0.02, -x + 0.02, x - 0.02, x - 0.02), height, height + 0.26, None, 0.04, 0.02)
        )
    return centred(parts)


def waste_bin(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bin: an open tapered basket, or a pedal bin with a lid."""
    room = size("waste_bin")
    metal, paint = Finish(pick(rng, style.metals)), tone(rng, Finish(pick(rng, style.paints)))
    colour = metal if rng.random() < 0.5 else paint
    width = draw(rng, (0.25, 0.38), fit)
    x = width / 2
    if rng.random() < 0.5:
        height = draw(rng, (0.3, 0.38))
        return centred(_basket(colour, x, height))
    height = draw(rng, (0.4, room.height_m[1] - 0.02))
    lid = ((x, height - 0.058), (x * 0.96, height - 0.03), (x * 0.6, height))
    return centred([
        rod("base", shade(colour, 0.5), (0, 0), x, 0.0, 0.03, x, 16),
        rod("body", colour, (0, 0), x * 0.94, 0.03, height - 0.06, x, 16),
        *turned("lid", shade(colour, 0.85), (0, 0), lid, 16),
        block("pedal", shade(colour, 0.4), (-0.03, -x - 0.03, 0.008), (0.03, -x + 0.01, 0.022)),
    ])  # fmt: skip


def _basket(colour: Finish, x: float, height: float) -> list[Part]:
    """An open round bin: a floor and staves that lean outwards."""
    low, wall = 0.78, 0.014
    base = rod("base", colour, (0, 0), x * low - wall + 0.003, 0.0, 0.012, sides=12)
    return [base, *staves("side", colour, oval_outline(x, x, 12), low, wall, 0.0, height)]


def coat_rack(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A free-standing rack: a pole with hooks on a round foot, or a rail between two frames above a board for shoes."""
    room = size("coat_rack")
    timber, metal = wood(rng, style), Finish(pick(rng, style.metals))
    height = draw(rng, room.height_m)
    if fit <= 0.0 or rng.random() < 0.5:
        return centred(_coat_tree(timber, metal, height))
    width, depth = draw(rng, (0.6, 0.9), fit), draw(rng, (0.38, 0.46))
    x, y = width / 2, depth / 2
    cloth = [tone(rng, Finish(pick(rng, style.fabrics))) for _ in range(2)]
    parts = []
    for s in (-1, 1):
        at = s * (x - 0.015)
        for t in (-1, 1):
            foot: Rect = (at - 0.012, t * (y - 0.015) - 0.015, at + 0.012, t * (y - 0.015) + 0.015)
            top: Rect = (at - 0.012, t * 0.015 - 0.015, at + 0.012, t * 0.015 + 0.015)
            parts.append(tapered("leg", metal, foot, top, 0.0, height - 0.04))
    parts.append(pole("rail", metal, (-x, 0.0, height - 0.03), (x, 0.0, height - 0.03), 0.016))
    parts.append(block("shelf", timber, (-x + 0.02, -y + 0.05, 0.16), (x - 0.02, y - 0.05, 0.182), "shelf"))
    for at, finish in zip((-0.1, 0.12), cloth, strict=True):
        parts.append(_coat(finish, at, height - 0.035))
    return centred(parts)


def _coat_tree(timber: Finish, metal: Finish, height: float) -> list[Part]:
    """A pole with four hooks at the top on a round foot."""
    parts = [
        rod("base", timber, (0, 0), 0.21, 0.0, 0.025, 0.2, 16),
        *turned("pole", timber, (0, 0), ((0.04, 0.025), (0.024, 0.12), (0.022, height - 0.04), (0.03, height)), 10),
    ]
    for k in range(4):
        c, s = cos_sin(math.pi / 4 + k * math.pi / 2)
        low, tip = height - 0.16, height - 0.06
        parts.append(pole("hook", metal, (0.021 * c, 0.021 * s, low), (0.11 * c, 0.11 * s, tip), 0.009, 0.8, 6))
    return parts


def _coat(cloth: Finish, x: float, top: float) -> Part:
    """A coat on a hanger, seen as one hanging shape: narrow at the shoulders, wider at the hem."""
    bottom: Rect = (x - 0.07, -0.16, x + 0.07, 0.16)
    upper: Rect = (x - 0.02, -0.09, x + 0.02, 0.09)
    return tapered("coat", cloth, bottom, upper, top - 0.85, top)


def shoe_cabinet(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A shallow cabinet of one or two columns of tilting doors."""
    room = size("shoe_cabinet")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.78, 1.08))
    x, y = width / 2, depth / 2
    parts, front, face = carcass(rng, style, colour, (-x, -y, x, y), height)
    if rng.random() < 0.5:
        for cell in cells(front, 2, 1 if width < 0.72 else 2):
            x0, z0, x1, z1 = cell
            parts.append(block("door", colour, (x0, face - FRONT_M, z0), (x1, face, z1), "door"))
            parts.append(handle(style, metal, (x0, z1 - 0.1, x1, z1), face - FRONT_M))
    else:
        parts += doors(style, colour, metal, front, face, 2)
    return centred(parts)
