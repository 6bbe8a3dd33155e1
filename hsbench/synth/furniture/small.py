"""Small things on tops and boards: books, vase, bowl, cup, plate, bottle, pot, kettle, microwave, and mixed clutter."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    draw,
    front_shape,
    pick,
    pole,
    rod,
    shade,
    slab,
    staves,
    strip,
    tone,
    turned,
)
from hsbench.synth.furniture.plants import LEAVES
from hsbench.synth.furniture.shapes import oval_outline, rounded_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Rgb, Style

CHINA: tuple[Rgb, ...] = ((242, 240, 234), (226, 222, 210), (198, 208, 212))
BOTTLES: tuple[Rgb, ...] = ((60, 84, 58), (96, 62, 40), (168, 188, 190), (44, 62, 84))
STEEL = Finish((186, 189, 192))
BLACK = Finish((38, 38, 42))
DISPLAY = Finish((96, 150, 140))
PAGES = Finish((236, 230, 214))
FLOWERS: tuple[Rgb, ...] = ((214, 122, 110), (232, 196, 110), (188, 140, 180), (238, 232, 222))
CLUTTER_KINDS = ("books", "bowl", "vase", "cup", "bottle", "box", "tray")


def _glazed(rng: np.random.Generator, style: Style) -> Finish:
    """Pottery: white or cream, or in a colour of the room."""
    return tone(rng, Finish(pick(rng, CHINA if rng.random() < 0.5 else style.accents)))


def books(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A pile of two to four books, each with covers and pages, the upper ones smaller."""
    room = size("books")
    parts, z = [], 0.0
    x, y = draw(rng, (0.1, 0.14), fit), draw(rng, (0.13, room.depth_m[1] / 2), fit)
    for _ in range(int(rng.integers(2, 5))):
        thick = draw(rng, (0.02, 0.038))
        cover = tone(rng, Finish(pick(rng, (*style.accents, *style.fabrics))))
        dx, dy = draw(rng, (-0.008, 0.008)), draw(rng, (-0.008, 0.008))
        rect = (dx - x, dy - y, dx + x, dy + y)
        parts.append(block("book", cover, (rect[0], rect[1], z), (rect[2], rect[3], z + thick)))
        pages = (rect[0] + 0.008, rect[1] - 0.002, z + 0.004), (rect[2] + 0.002, rect[3] + 0.002, z + thick - 0.004)
        parts.append(block("pages", PAGES, *pages))
        z += thick
        x, y = x * 0.95, y * 0.95
    return centred(parts)


def vase(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A turned vase: bellied, tall or bottle-shaped, empty or with a few flowers."""
    room = size("vase")
    clay = _glazed(rng, style)
    radius, height = draw(rng, (0.055, 0.085), fit), draw(rng, (room.height_m[0], 0.26))
    kind = pick(rng, ("belly", "tall", "neck"))
    shares = {
        "belly": ((0.55, 0.0), (1.0, 0.4), (0.85, 0.7), (0.5, 0.9), (0.62, 1.0)),
        "tall": ((0.7, 0.0), (1.0, 0.75), (0.8, 1.0)),
        "neck": ((0.8, 0.0), (1.0, 0.3), (0.35, 0.62), (0.3, 0.9), (0.42, 1.0)),
    }[kind]
    parts = turned("vase", clay, (0, 0), [(radius * r, height * z) for r, z in shares], 16)
    if rng.random() < 0.5:
        parts += _flowers(rng, height, radius * 0.3)
    return centred(parts)


def _flowers(rng: np.random.Generator, z: float, spread: float) -> list[Part]:
    parts = []
    petals, green = Finish(pick(rng, FLOWERS)), Finish(pick(rng, LEAVES))
    for k in range(5):
        c, s = cos_sin(2 * math.pi * k / 5 + 0.3)
        out, top = draw(rng, (0.04, 0.075)), z + draw(rng, (0.12, 0.2))
        tip = (out * c, out * s, top)
        parts.append(pole("stem", green, (spread * 0.5 * c, spread * 0.5 * s, z - 0.008), tip, 0.006, sides=5))
        parts += turned(
            "flower", petals, tip[:2], ((0.012, top - 0.008), (0.026, top + 0.012), (0.012, top + 0.028)), 8
        )
    return parts


def bowl(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A hollow bowl on a small foot, empty or with fruit."""
    room = size("bowl")
    clay = _glazed(rng, style)
    radius, height = draw(rng, (room.width_m[0] / 2, 0.135), fit), draw(rng, (0.065, 0.085))
    sides, wall = 12, 0.0155
    foot = rod("foot", clay, (0, 0), radius * 0.45, 0.0, 0.016, radius * 0.5, sides)
    parts = [foot, *staves("bowl", clay, oval_outline(radius, radius, sides), 0.5, wall, 0.012, height)]
    if rng.random() < 0.5 and radius > 0.1:
        for k in range(3):
            c, s = cos_sin(2 * math.pi * k / 3)
            fruit = Finish(pick(rng, ((196, 64, 48), (222, 160, 60), (150, 170, 70))))
            at, size_m = (radius * 0.36 * c, radius * 0.36 * s), 0.034
            profile = ((0.014, 0.0), (size_m, 0.5), (0.014, 1.0))
            parts += turned("fruit", fruit, at, [(r, 0.014 + 0.066 * z) for r, z in profile], 8)
    return centred(parts)


def cup(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A mug with a handle, or a cup on a saucer."""
    clay = _glazed(rng, style)
    radius, height = draw(rng, (0.036, 0.042)), draw(rng, (0.08, 0.1))
    saucer = rng.random() < 0.3
    low = 0.012 if saucer else 0.0
    parts = [rod("saucer", shade(clay, 0.95), (0, 0), 0.05, 0.0, 0.012, 0.068, 16)] if saucer else []
    bottom = radius * (0.65 if saucer else 0.95)
    top = low + (height if not saucer else 0.068)
    parts.append(rod("cup", clay, (0, 0), bottom, low, top, radius, 12))
    inside = Finish((92, 62, 42)) if rng.random() < 0.5 else shade(clay, 0.75)
    parts.append(rod("inside", inside, (0, 0), radius * 0.82, top - 0.009, top + 0.001, sides=10))
    x0, z0, z1 = radius * 0.9, low + (top - low) * 0.3, low + (top - low) * 0.82
    out = radius + 0.026
    for a, b in (((x0, z0), (out, z0)), ((out, z0 - 0.004), (out, z1 + 0.004)), ((out, z1), (x0, z1))):
        parts.append(strip("handle", clay, (a[0], 0.0, a[1]), (b[0], 0.0, b[1]), 0.012, 0.01))
    return centred(parts)


def plate(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A plate: a foot, a wide rim, and a well in another tone."""
    clay = _glazed(rng, style)
    radius, height = draw(rng, size("plate").width_m, fit) / 2, draw(rng, (0.018, 0.024))
    return centred([
        rod("plate", clay, (0, 0), radius * 0.62, 0.0, height, radius, 20),
        rod("well", shade(clay, 0.9), (0, 0), radius * 0.6, height - 0.009, height + 0.001, sides=18),
    ])  # fmt: skip


def bottle(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bottle with shoulders, a neck, a cap and a label."""
    glass, label = tone(rng, Finish(pick(rng, BOTTLES))), tone(rng, Finish(pick(rng, (*CHINA, *style.accents))))
    radius, height = draw(rng, (0.034, 0.045)), draw(rng, (0.24, 0.32))
    slim = rng.random() < 0.5
    shoulder = height * (0.55 if slim else 0.68)
    low, high = shoulder * 0.3, shoulder * 0.8
    neck = ((radius, high), (radius, shoulder), (0.014, shoulder + height * 0.17), (0.013, height - 0.02))
    return centred([
        *turned("bottle", glass, (0, 0), ((radius * 0.95, 0.0), (radius, low)), 12),
        rod("label", label, (0, 0), radius + 0.0015, low, high, sides=12),
        *turned("bottle", glass, (0, 0), neck, 12),
        rod("cap", shade(label, 0.7), (0, 0), 0.015, height - 0.02, height, sides=10),
    ])  # fmt: skip


def pot(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A cooking pot with a lid and two grips, or a saucepan with a long handle."""
    colour = pick(rng, (STEEL, BLACK, tone(rng, Finish(pick(rng, style.accents)))))
    radius, height = draw(rng, (0.1, 0.125), fit), draw(rng, (0.09, 0.15))
    lid = ((radius * 1.03, height), (radius * 1.03, height + 0.01), (radius * 0.3, height + 0.03))
    parts = [
        *turned("pot", colour, (0, 0), ((radius * 0.93, 0.0), (radius, 0.015), (radius, height)), 16),
        *turned("lid", shade(colour, 0.9), (0, 0), lid, 16),
        rod("knob", BLACK, (0, 0), 0.012, height + 0.028, height + 0.048, 0.018, 8),
    ]  # fmt: skip
    if rng.random() < 0.5:
        for s in (-1, 1):
            x0, x1 = sorted((s * (radius - 0.006), s * (radius + 0.03)))
            parts.append(slab("grip", BLACK, (x0, -0.035, x1, 0.035), height - 0.04, height - 0.026, None, 0.015))
    else:
        parts.append(
            strip(
                "grip", BLACK, (radius - 0.008, 0.0, height - 0.03), (radius + 0.13, 0.0, height - 0.02), 0.022, 0.016
            )
        )
    return centred(parts)


def kettle(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """An electric kettle on its base, with a spout and a handle at the back."""
    colour = pick(rng, (STEEL, BLACK, tone(rng, Finish(pick(rng, style.accents)))))
    radius, height = draw(rng, (0.075, 0.085)), draw(rng, (0.19, 0.24))
    top = height - 0.025
    grip = radius + 0.045
    return centred([
        rod("base", BLACK, (0, 0), radius * 1.03, 0.0, 0.02, sides=16),
        rod("body", colour, (0, 0), radius, 0.02, top, radius * 0.76, 16),
        rod("lid", BLACK, (0, 0), radius * 0.74, top, top + 0.012, radius * 0.5, 16),
        rod("knob", BLACK, (0, 0), 0.014, top + 0.01, height, 0.012, 8),
        pole("spout", colour, (-radius * 0.88, 0.0, top - 0.05), (-radius - 0.022, 0.0, top - 0.012), 0.02, 0.7, 8),
        strip("grip", BLACK, (radius * 0.7, 0.0, top - 0.015), (grip, 0.0, top - 0.015), 0.022, 0.016),
        strip("grip", BLACK, (grip, 0.0, top - 0.008), (grip, 0.0, 0.06), 0.022, 0.016),
        strip("grip", BLACK, (grip + 0.006, 0.0, 0.06), (radius * 0.9, 0.0, 0.06), 0.022, 0.016),
    ])  # fmt: skip


def microwave(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A microwave oven: a door with a window and a bar, beside it a panel with a display and buttons."""
    room = size("microwave")
    colour = pick(rng, (STEEL, BLACK, Finish((240, 240, 238))))
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, room.height_m)
    x, y, foot = width / 2, depth / 2, 0.012
    split, face = x * 0.5, -y + 0.022
    z1 = height
    corners = [(a, b) for a in (-x + 0.03, x - 0.06) for b in (face + 0.02, y - 0.06)]
    pane = rounded_outline((-x + 0.04, foot + 0.045, split - 0.05, z1 - 0.045), 0.015)
    parts = [
        *(block("foot", BLACK, (a, b, 0.0), (a + 0.03, b + 0.03, foot)) for a, b in corners),
        block("body", colour, (-x, face, foot), (x, y, z1)),
        block("front", shade(colour, 0.92), (-x + 0.003, -y, foot + 0.004), (split, face, z1 - 0.004), "front"),
        front_shape("window", Finish((54, 58, 64)), pane, -y - 0.002, -y + 0.01),
        block("handle", STEEL, (split - 0.032, -y - 0.026, foot + 0.05), (split - 0.018, -y, z1 - 0.05)),
        block("panel", shade(BLACK, 1.0, 12), (split + 0.004, -y + 0.004, foot + 0.004), (x - 0.003, face, z1 - 0.004)),
        block("display", DISPLAY, (split + 0.02, -y + 0.002, z1 - 0.07), (x - 0.02, -y + 0.012, z1 - 0.035)),
    ]
    for k in range(3):
        z = foot + 0.04 + k * 0.045
        parts.append(block("button", STEEL, (split + 0.025, -y + 0.001, z), (x - 0.025, -y + 0.011, z + 0.022)))
    return centred(parts)


def clutter(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """Any small thing for a table or a board: books, bowl, vase, cup, bottle, a little box or a tray."""
    kind = pick(rng, CLUTTER_KINDS)
    makers = {"books": books, "bowl": bowl, "vase": vase, "cup": cup, "bottle": bottle}
    if kind in makers:
        return makers[kind](rng, style, fit)
    colour = tone(rng, Finish(pick(rng, (*style.accents, *style.paints))))
    if kind == "tray":
        x, y = draw(rng, (0.14, 0.18), fit), draw(rng, (0.09, 0.12), fit)
        return centred([
            slab("tray", colour, (-x, -y, x, y), 0.0, 0.018, None, 0.04, 0.006),
            rod("candle", Finish((240, 232, 210)), (-x * 0.4, 0.0), 0.025, 0.018, 0.1, sides=10),
            rod("candle", Finish((226, 200, 170)), (x * 0.2, y * 0.2), 0.03, 0.018, 0.07, sides=10),
        ])  # fmt: skip
    x, y, z = draw(rng, (0.08, 0.13), fit), draw(rng, (0.06, 0.1), fit), draw(rng, (0.08, 0.14))
    return centred([
        slab("box", colour, (-x + 0.003, -y + 0.003, x - 0.003, y - 0.003), 0.0, z - 0.03, None, 0.012),
        slab("lid", shade(colour, 0.85), (-x, -y, x, y), z - 0.03, z, None, 0.014, 0.006),
        rod("knob", shade(colour, 0.6), (0, 0), 0.01, z, z + 0.014, 0.014, 8),
    ])  # fmt: skip
