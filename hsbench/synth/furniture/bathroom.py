"""Bathroom: toilet, bathtub, shower, washbasin, cabinet, washing machine, laundry basket, towel rail.

Baths and basins are hollow.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import FRONT_M, carcass, doors, drawers, four_legs, tap
from hsbench.synth.furniture.kitchen import DEPTH_M, OVERHANG_M
from hsbench.synth.furniture.pieces import (
    accent,
    block,
    centred,
    cushion,
    draw,
    fabric,
    front_shape,
    painted,
    part,
    pick,
    pole,
    ring,
    rod,
    shade,
    slab,
    staves,
    tapered,
    tone,
    turned,
    wood,
)
from hsbench.synth.furniture.shapes import Rect, loft, oval_outline, rounded_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

CERAMIC = Finish((244, 244, 242))
CHROME = Finish((196, 199, 202))
SOAP = Finish((236, 214, 190))
DARK = Finish((52, 56, 62))
BATH_FLOOR_M = 0.14
TRAY_M = 0.016  # low enough to be walked on
ENTRY_M = 0.66  # open part of a shower's front
SHOWER_RAIL_M, SHOWER_FOLD_M, LEAST_FOLDS = 2.0, 0.05, 3  # of its curtain
CURTAIN_HALF_M, HALF_WALL_M = 0.04, 0.08  # half depth of a curtain's folds, thickness of a low wall
BOWL_LOW = 0.7  # how large the foot of a bowl is, of its rim
BOWL_SEGMENTS = 12  # of the oval wall of a bowl
WALL_M = 0.025  # thickness of ceramic


def toilet(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A toilet with its cistern at the wall: foot, bowl, seat, the cover leaning at it, flush button."""
    room = size("toilet")
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.76, 0.92))
    seat_z, boxy = draw(rng, (0.41, 0.44)), rng.random() < 0.5
    x, y = width / 2, depth / 2
    tank = y - 0.18
    rim = seat_z - 0.022
    middle, half = (tank - y) / 2, (tank + y) / 2
    oval = oval_outline(x, half, 16) if not boxy else rounded_outline((-x, -half, x, half), x * 0.7, 4)
    shift = np.array([0.0, round(middle, 4)])
    parts = [
        part("base", CERAMIC, loft([oval * 0.66 + shift * 1.3, oval * 0.6 + shift * 1.3], [0.0, rim - 0.18])),
        part("bowl", CERAMIC, loft([oval * 0.62 + shift * 1.2, oval * 0.9 + shift], [rim - 0.18, rim - 0.02])),
        part("bowl", CERAMIC, loft([oval * 0.95 + shift, oval * 0.97 + shift], [rim - 0.02, rim])),
        part("seat", shade(CERAMIC, 0.97), loft([oval * 0.985 + shift, oval + shift], [rim, seat_z]), "seat"),
        slab("cistern", CERAMIC, (-x, tank, x, y), rim - 0.06, height - 0.03, None, 0.03),
        slab("lid", CERAMIC, (-x - 0.005, tank - 0.006, x + 0.005, y), height - 0.032, height, None, 0.03, 0.008),
        block("support", CERAMIC, (-x * 0.55, tank - 0.03, 0.0), (x * 0.55, y - 0.01, rim - 0.06)),
        block("handle", CHROME, (-0.025, tank + 0.06, height - 0.004), (0.025, tank + 0.11, height + 0.008), "handle"),
    ]
    field = rounded_outline((-x * 0.86, seat_z + 0.004, x * 0.86, height - 0.05), x * 0.6, 3)
    cover = front_shape("cover", shade(CERAMIC, 0.97), field, tank - 0.022, tank - 0.002)
    return centred([*parts, cover])


def bathtub(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A hollow bath: built in behind panels with a tap on its rim, or free-standing and oval with one at its end."""
    room = size("bathtub")
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.53, 0.62))
    if rng.random() < 0.6:
        panel = pick(rng, (CERAMIC, CERAMIC, wood(rng, style)))
        return _built_in_bath(panel, width / 2, depth / 2, height, end=pick(rng, (-1, 1)))
    return _oval_bath(width / 2, depth / 2, height)


def _built_in_bath(panel: Finish, x: float, y: float, height: float, end: int) -> tuple[Part, ...]:
    rim, edge = 0.07, height - 0.04
    inner: Rect = (-x + rim + 0.02, -y + rim, x - rim - 0.02, y - rim)
    shell: Rect = (inner[0] - 0.02, inner[1] - 0.02, inner[2] + 0.02, inner[3] + 0.02)
    return centred([
        *ring("panel", panel, (-x + 0.015, -y + 0.015, x - 0.015, y - 0.004), shell, 0.0, edge),
        *ring("side", CERAMIC, shell, inner, 0.0, edge),
        *ring("rim", CERAMIC, (-x, -y, x, y), inner, edge, height),
        block("basin", shade(CERAMIC, 0.96), (*inner[:2], 0.0), (*inner[2:], BATH_FLOOR_M)),
        _slope(inner, end, BATH_FLOOR_M, height - 0.06),
        *tap(-end * (x - 0.035), 0.0, height, 0.13, 0.16, (end, 0)),
    ])  # fmt: skip


def _oval_bath(x: float, y: float, height: float) -> tuple[Part, ...]:
    oval, at = oval_outline(x, y, 16), x + 0.03
    return centred([
        part("base", shade(CERAMIC, 0.96), loft([oval * 0.72, oval * 0.8], [0.0, BATH_FLOOR_M])),
        *staves("side", CERAMIC, oval, 0.8, 0.04, BATH_FLOOR_M - 0.008, height),
        rod("column", CHROME, (at, 0), 0.03, 0.0, 0.02),
        block("mount", CHROME, (x - 0.025, -0.01, height - 0.05), (x + 0.02, 0.01, height - 0.03)),
        rod("pipe", CHROME, (at, 0), 0.014, 0.02, height + 0.2, sides=8),
        pole("tap", CHROME, (x + 0.022, 0, height + 0.19), (x - 0.14, 0, height + 0.17), 0.012, sides=6, role="tap"),
        pole("lever", CHROME, (at, -0.01, height + 0.1), (at, -0.08, height + 0.12), 0.009, 0.8, 6),
    ])  # fmt: skip


def _slope(inner: Rect, end: int, z0: float, z1: float) -> Part:
    """The leaning back at one end of a built-in bath."""
    x0, y0, x1, y1 = inner
    a, b = (x0, x0 + 0.22) if end < 0 else (x1 - 0.22, x1)
    c, d = (x0, x0 + 0.015) if end < 0 else (x1 - 0.015, x1)
    return tapered("basin", shade(CERAMIC, 0.97), (a, y0, b, y1), (c, y0, d, y1), z0, z1)


def shower(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A walk-in shower: a flat tray, head and tap on a pipe, bottles on a board; open, with a curtain half drawn on its
    rail, or with a low tiled wall at one side.
    """
    room = size("shower")
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit)
    metal = pick(rng, (CHROME, Finish((50, 52, 54))))
    x, y, side = width / 2, depth / 2, pick(rng, (-1, 1))
    screen = pick(rng, (_shower_curtain, _half_wall, _no_screen))
    top, tray = draw(rng, (1.98, 2.08)), TRAY_M
    at, low = -side * x * 0.3, 1.05
    return centred([
        slab("tray", shade(CERAMIC, 0.93), (-x, -y, x, y), 0.0, tray, None, 0.03, 0.004),
        rod("drain", shade(CHROME, 0.7), (0, 0), 0.05, tray - 0.008, tray + 0.002, sides=10),
        *screen(rng, style, x, y, side),
        block("mixer", metal, (at - 0.09, y - 0.062, low), (at + 0.09, y - 0.024, low + 0.06)),
        *(rod("wheel", metal, (at + s * 0.07, y - 0.085), 0.026, low + 0.012, low + 0.05, sides=10) for s in (-1, 1)),
        pole("tap", metal, (at, y - 0.056, low + 0.025), (at, y - 0.13, low + 0.015), 0.016, 0.8, 6, "tap"),
        pole("pipe", metal, (at, y - 0.02, tray - 0.004), (at, y - 0.02, top), 0.013, sides=6),
        pole("arm", metal, (at, y - 0.02, top - 0.01), (at, y - 0.3, top - 0.01), 0.013, sides=6),
        rod("head", metal, (at, y - 0.3), 0.125, top - 0.035, top - 0.012, 0.07, 14),
        *_bottles(rng, style, at, y),
    ])  # fmt: skip


def _shower_curtain(rng: np.random.Generator, style: Style, x: float, y: float, side: int) -> list[Part]:
    """Cloth in folds over one part of the front, hung from a rail between two posts."""
    cloth, rail, face = fabric(rng, style), SHOWER_RAIL_M, -y + CURTAIN_HALF_M
    count = max(LEAST_FOLDS, int((2 * x - ENTRY_M) / SHOWER_FOLD_M))
    wave = oval_outline(SHOWER_FOLD_M / 2 + 0.004, CURTAIN_HALF_M - 0.012, 8)
    parts = [rod("post", CHROME, (s * (x - 0.014), face), 0.013, TRAY_M - 0.004, rail, sides=8) for s in (-1, 1)]
    parts.append(pole("rail", CHROME, (-x, face, rail), (x, face, rail), 0.012))
    for k in range(count):
        at = np.array([round(side * (x - 0.03 - (k + 0.5) * SHOWER_FOLD_M), 4), face + (0.012 if k % 2 else -0.012)])
        light = shade(cloth, 0.92 + 0.08 * (k % 2))
        parts.append(part("fold", light, loft([wave + at, wave * 0.9 + at], [0.06, rail - 0.012])))
        parts.append(rod("ring", CHROME, at.tolist(), 0.01, rail - 0.02, rail - 0.002, sides=6))
    return parts


def _half_wall(rng: np.random.Generator, style: Style, x: float, y: float, side: int) -> list[Part]:
    """A low tiled wall with a board on it."""
    tiles = Finish(shade(pick(rng, style.walls), 0.9), style.wet_floor_textures[0])
    height = draw(rng, (0.95, 1.2))
    a, b = sorted((side * x, side * (x - HALF_WALL_M)))
    return [
        block("wall", tiles, (a, -y, TRAY_M - 0.004), (b, y, height - 0.02)),
        block("board", shade(CERAMIC, 0.97), (a, -y, height - 0.02), (b, y, height)),
    ]


def _no_screen(rng: np.random.Generator, style: Style, x: float, y: float, side: int) -> list[Part]:
    """Nothing: the floor of the room runs on into the corner."""
    return []


def _bottles(rng: np.random.Generator, style: Style, x: float, y: float) -> list[Part]:
    """Two bottles and a soap on a small board at the pipe of a shower."""
    x0, z, row = x - 0.12, 1.3, y - 0.085
    parts = [block("board", CHROME, (x0, y - 0.14, z - 0.01), (x0 + 0.24, y - 0.028, z))]
    for k in range(2):
        at, height = (x0 + 0.05 + 0.07 * k, row), draw(rng, (0.15, 0.22))
        tint = tone(rng, Finish(pick(rng, style.accents)))
        parts.append(rod("bottle", tint, at, 0.028, z - 0.001, z + height - 0.03, 0.026, 10))
        parts.append(rod("cap", shade(tint, 0.6), at, 0.014, z + height - 0.032, z + height, sides=8))
    return [*parts, slab("soap", SOAP, (x0 + 0.17, row - 0.025, x0 + 0.23, row + 0.025), z - 0.001, z + 0.025)]


def washbasin(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A basin on a pedestal, in a vanity unit with doors or drawers, or a bowl on a board over drawers."""
    room = size("washbasin")
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.83, 0.88))
    x, y = width / 2, depth / 2
    make = pick(rng, (_pedestal, _vanity, _bowl_on_board))
    return centred(make(rng, style, x, y, height))


def _pedestal(rng: np.random.Generator, style: Style, x: float, y: float, height: float) -> list[Part]:
    under = height - 0.17
    profile = ((0.11, 0.0), (0.075, 0.12), (0.08, under - 0.08), (0.12, under))
    column = turned("pedestal", CERAMIC, (0, y - 0.15), profile, 12)
    trough = _trough((-x, -y, x, y), under, height, 0.035)
    return [*trough, *column, *tap(0.0, y - 0.045, height, 0.13, 0.16), *_at_basin(rng, style, x, y, height)]


def _vanity(rng: np.random.Generator, style: Style, x: float, y: float, height: float) -> list[Part]:
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    face, under, foot = -y + FRONT_M + 0.012, height - 0.13, 0.16
    front: Rect = (-x + 0.012, foot + 0.01, x - 0.012, under - 0.006)
    doored = doors(style, colour, metal, front, face, 2)
    return [
        *four_legs(style, colour, (-x + 0.02, face, x - 0.02, y - 0.02), 0.04, foot, 0.3),
        block("body", shade(colour, 0.92), (-x + 0.01, face, foot), (x - 0.01, y - 0.004, under)),
        *(doored if rng.random() < 0.5 else drawers(style, colour, metal, front, face, 2, 1)),
        *_trough((-x, -y, x, y), under, height, 0.045),
        *tap(0.0, y - 0.045, height, 0.13, 0.16),
        *_at_basin(rng, style, x, y, height),
    ]


def _bowl_on_board(rng: np.random.Generator, style: Style, x: float, y: float, height: float) -> list[Part]:
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    face, board, foot = -y + FRONT_M + 0.012, height - 0.13, 0.22
    oval, middle = oval_outline(min(x - 0.03, 0.21), y - 0.07, BOWL_SEGMENTS), np.array([0.0, -0.03])
    return [
        *four_legs(style, colour, (-x + 0.02, face, x - 0.02, y - 0.02), 0.04, foot, 0.3),
        block("body", shade(colour, 0.92), (-x + 0.01, face, foot), (x - 0.01, y - 0.004, board - 0.03)),
        slab("top", wood(rng, style), (-x, -y, x, y), board - 0.03, board, "top", 0.012, 0.004),
        *drawers(style, colour, metal, (-x + 0.012, foot + 0.01, x - 0.012, board - 0.036), face, 2, 1),
        *staves("basin", CERAMIC, oval, BOWL_LOW, WALL_M, board, height, middle.tolist()),
        part("basin", CERAMIC, loft([oval * 0.58 + middle, oval * 0.6 + middle], [board, board + 0.02])),
        *tap(0.0, y - 0.035, board, 0.13, 0.26),
        *_at_basin(rng, style, x, y, board),
    ]


def _at_basin(rng: np.random.Generator, style: Style, x: float, y: float, z: float) -> list[Part]:
    """A soap dispenser and a tumbler with a toothbrush behind a basin, right and left of its tap, at height z."""
    tint, clay, back = tone(rng, Finish(pick(rng, style.accents))), shade(CERAMIC, 0.9), y - 0.05
    right, left = x * 0.7, -x * 0.7
    return [
        rod("soap", tint, (right, back), 0.03, z - 0.001, z + 0.11, 0.026, 12),
        rod("pump", CHROME, (right, back), 0.008, z + 0.108, z + 0.15, sides=8),
        block("pump", CHROME, (right - 0.007, back - 0.045, z + 0.14), (right + 0.007, back + 0.008, z + 0.152)),
        rod("tumbler", clay, (left, back), 0.03, z - 0.001, z + 0.095, 0.034, 12),
        pole("brush", tint, (left, back, z + 0.09), (left + 0.03, back, z + 0.15), 0.006, sides=6),
    ]


def _trough(rect: Rect, z0: float, z1: float, wall: float) -> list[Part]:
    """A hollow ceramic basin: walls, wider at the back, and a floor."""
    x0, y0, x1, y1 = rect
    inner: Rect = (x0 + wall + 0.02, y0 + wall, x1 - wall - 0.02, y1 - 0.1)
    floor = block("basin", shade(CERAMIC, 0.96), (inner[0], inner[1], z0), (inner[2], inner[3], z0 + 0.03))
    return [*ring("rim", CERAMIC, rect, inner, z0, z1), floor]


def bathroom_cabinet(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A low cabinet with a door and a drawer, or a tall narrow one with open boards between doors and drawers."""
    room = size("bathroom_cabinet")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    depth, tall = draw(rng, room.depth_m, fit), rng.random() < 0.5
    if not tall:
        width, height = draw(rng, (0.38, 0.6), fit), draw(rng, (0.76, 0.86))
        x, y = width / 2, depth / 2
        parts, (left, low, right, high), face = carcass(rng, style, colour, (-x, -y, x, y), height)
        parts += drawers(style, colour, metal, (left, high - 0.16, right, high), face, 1, 1)
        parts += doors(style, colour, metal, (left, low, right, high - 0.16), face, 1 if width < 0.45 else 2)
        return centred(parts)
    width, height = draw(rng, (0.33, 0.42), fit), draw(rng, (1.5, 1.74))
    x, y = width / 2, depth / 2
    face, wall = -y + FRONT_M, 0.018
    low, high = 0.72, 1.2
    parts = [
        block("plinth", shade(colour, 0.75), (-x + 0.01, face + 0.03, 0.0), (x - 0.01, y - 0.01, 0.06)),
        block("body", shade(colour, 0.92), (-x, face, 0.06), (x, y, low)),
        block("body", shade(colour, 0.92), (-x, face, high), (x, y, height)),
        *(block("side", shade(colour, 0.92), (a, face, low), (a + wall, y, high)) for a in (-x, x - wall)),
        block("back", shade(colour, 0.88), (-x + wall, y - 0.014, low), (x - wall, y - 0.002, high)),
        block("shelf", colour, (-x + wall, face + 0.004, 0.94), (x - wall, y - 0.014, 0.958), "shelf"),
        cushion("towel", accent(rng, style), (-x + 0.04, face + 0.03, x - 0.04, y - 0.04), low, low + 0.1, None, 0.02),
        *drawers(style, colour, metal, (-x, 0.07, x, low - 0.002), face, 3, 1),
        *doors(style, colour, metal, (-x, high + 0.002, x, height), face, 1),
    ]
    return centred(parts)


def washing_machine(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A front loader as high as the worktops of its style: round door, panel with a knob, soap drawer."""
    colour = pick(rng, (CERAMIC, CERAMIC, Finish((120, 124, 128))))
    height, width = draw(rng, style.worktop_m), 0.6
    x, y = width / 2, DEPTH_M / 2
    face, top = -y + OVERHANG_M + 0.004, height - 0.025
    split = top - 0.11
    dark_ring = rng.random() < 0.5
    middle = np.array([0.0, round(0.06 + (split - 0.06) * 0.5, 4)])
    rim, pane = CHROME if not dark_ring else DARK, Finish((84, 94, 104))
    knob = oval_outline(0.028, 0.028, 12) + np.array([0.0, round((split + top) / 2, 4)])
    return centred([
        block("plinth", DARK, (-x + 0.03, face + 0.03, 0.0), (x - 0.03, y - 0.03, 0.02)),
        block("body", colour, (-x, face, 0.02), (x, y - 0.004, top)),
        slab("top", shade(colour, 0.97), (-x, -y + OVERHANG_M, x, y), top, height, "top", 0.015, 0.006),
        front_shape("front", rim, oval_outline(0.19, 0.19, 20) + middle, face - 0.03, face, "front", 0.92),
        front_shape("window", pane, oval_outline(0.13, 0.13, 20) + middle, face - 0.036, face - 0.026, None, 0.9),
        block("panel", shade(colour, 0.88), (-x + 0.005, face - 0.008, split), (x - 0.005, face + 0.002, top - 0.006)),
        block("drawer", shade(colour, 0.8), (0.02 - x, face - 0.012, split + 0.015), (-0.11, face - 0.002, top - 0.02)),
        block("display", DARK, (0.06, face - 0.011, split + 0.03), (0.2, face - 0.001, top - 0.035)),
        front_shape("knob", CHROME, knob, face - 0.03, face - 0.008),
    ])  # fmt: skip


def laundry_basket(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A basket with a lid, wider above, round or square, of wood or fabric with a lining."""
    room = size("laundry_basket")
    colour = wood(rng, style) if rng.random() < 0.5 else fabric(rng, style)
    lining = Finish((232, 226, 214))
    width, height = draw(rng, (0.38, room.width_m[1]), fit), draw(rng, (0.53, 0.66))
    x = width / 2
    y = min(x, room.depth_m[1] / 2)
    round_one = rng.random() < 0.5
    outline = oval_outline(y, y, 16) if round_one else rounded_outline((-x, -y, x, y), 0.05)
    top = height - 0.05
    return centred([
        part("body", colour, loft([outline * 0.86, outline * 0.97], [0.0, top])),
        part("lining", lining, loft([outline * 0.985, outline * 0.985], [top, top + 0.012])),
        part("lid", shade(colour, 0.9), loft([outline, outline, outline * 0.94], [top + 0.012, height - 0.01, height])),
        slab("grip", shade(colour, 0.6), (-0.05, -0.018, 0.05, 0.018), height - 0.002, height + 0.014, None, 0.015),
    ])  # fmt: skip


def towel_rail(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A rail on the wall behind it with a towel over it, or a heated ladder of rails with a smaller towel."""
    metal, cloth = pick(rng, (CHROME, Finish(pick(rng, style.metals)), CERAMIC)), accent(rng, style)
    x, wall = draw(rng, size("towel_rail").width_m, fit) / 2, 0.04
    if rng.random() < 0.5:
        return _towel_ladder(metal, cloth, x, wall, draw(rng, (0.55, 0.7)), draw(rng, (1.45, 1.65)))
    z, half = draw(rng, (1.05, 1.25)), min(0.17, x - 0.06)
    parts = [
        pole("rail", metal, (-x, -0.03, z), (x, -0.03, z), 0.011),
        block("towel", cloth, (-half, -0.055, z - 0.49), (half, -0.041, z + 0.01)),
        block("towel", cloth, (-half, -0.022, z - 0.39), (half, -0.008, z + 0.01)),
        block("towel", cloth, (-half, -0.055, z + 0.008), (half, -0.008, z + 0.02)),
    ]
    for at in (0.02 - x, x - 0.02):
        parts.append(block("mount", metal, (at - 0.012, -0.024, z - 0.012), (at + 0.012, wall, z + 0.012)))
    return centred(parts)


def _towel_ladder(metal: Finish, cloth: Finish, x: float, wall: float, low: float, high: float) -> tuple[Part, ...]:
    """Two posts, rails .115 m apart, four mounts; a towel over a rail near the top."""
    ends, top = (0.018 - x, x - 0.018), high - 0.16
    parts = [pole("post", metal, (at, 0.0, low), (at, 0.0, high), 0.018) for at in ends]
    for z in np.arange(low + 0.06, high - 0.02, 0.115).round(3).tolist():
        parts.append(pole("rail", metal, (-x + 0.028, -0.006, z), (x - 0.028, -0.006, z), 0.011, sides=6))
    for at, z in product(ends, (low + 0.1, high - 0.1)):
        parts.append(block("mount", metal, (at - 0.01, 0.012, z), (at + 0.01, wall, z + 0.02)))
    half = min(0.16, x - 0.05)
    return centred([*parts, block("towel", cloth, (-half, -0.034, top - 0.42), (half, -0.02, top))])
