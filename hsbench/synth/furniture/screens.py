"""Screens and an instrument: television, monitor, laptop, keyboard, upright piano."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    draw,
    front_shape,
    leaning,
    pick,
    pole,
    shade,
    side_shape,
    slab,
    turned,
    wood,
)
from hsbench.synth.furniture.shapes import rounded_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

CASE = Finish((28, 30, 34))
SCREEN = Finish((46, 52, 62))
SILVER = Finish((168, 171, 176))
KEYS = Finish((244, 242, 236))


def television(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A television to stand on a cabinet, 16:9, on a central stand or two feet; the screen faces -y."""
    width = draw(rng, size("television").width_m, fit)
    depth, foot = draw(rng, size("television").depth_m), 0.055
    x, top = width / 2, foot + width * 9 / 16
    parts = _panel(x, foot, top, CASE)
    if rng.random() < 0.5:
        parts.append(slab("base", CASE, (-x * 0.4, -depth / 2, x * 0.4, depth / 2), 0.0, 0.014, None, 0.05))
        parts.append(block("stand", CASE, (-0.06, 0.008, 0.012), (0.06, 0.03, foot + 0.02)))
    else:
        for s in (-1, 1):
            at = s * x * 0.72
            foot_shape = np.array([[-depth / 2, 0.0], [depth / 2, 0.0], [0.012, foot + 0.006], [-0.012, foot + 0.006]])
            parts.append(side_shape("foot", CASE, foot_shape, at - 0.011, at + 0.011))
    return centred(parts)


def monitor(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A computer screen on a stand with a round or square foot, to stand on a desk."""
    width = draw(rng, size("monitor").width_m, fit)
    case = pick(rng, (CASE, SILVER))
    x, foot, depth = width / 2, 0.11, 0.18
    top = foot + width * 0.6
    radius = depth / 2 if rng.random() < 0.5 else 0.02
    neck = (foot + top) / 2
    return centred([
        *_panel(x, foot, top, CASE),
        slab("base", case, (-depth * 0.62, -depth / 2, depth * 0.62, depth / 2), 0.0, 0.014, None, radius),
        block("stand", case, (-0.022, 0.034, 0.012), (0.022, 0.052, neck + 0.04)),
        block("mount", case, (-0.05, 0.026, neck - 0.04), (0.05, 0.036, neck + 0.04)),
    ])  # fmt: skip


def _panel(x: float, z0: float, z1: float, case: Finish) -> list[Part]:
    """A thin case with a bulge behind, and the screen in front of it."""
    outline = rounded_outline((-x, z0, x, z1), 0.012, 1)
    field = rounded_outline((-x + 0.012, z0 + 0.016, x - 0.012, z1 - 0.012), 0.004, 1)
    bulge = rounded_outline((-x * 0.6, z0 + 0.04, x * 0.6, z0 + (z1 - z0) * 0.6), 0.03, 1)
    return [
        front_shape("case", case, outline, -0.012, 0.012),
        front_shape("screen", SCREEN, field, -0.014, -0.004, "screen"),
        front_shape("back", shade(case, 1.15), bulge, 0.01, 0.034),
    ]


def laptop(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """An open laptop: base with keys and a pad, a lid that leans back, the screen on its inner side."""
    room = size("laptop")
    case = pick(rng, (SILVER, Finish((72, 75, 80)), Finish((226, 226, 224))))
    width = draw(rng, room.width_m, fit)
    x, depth, lean = width / 2, width * 0.68, 0.06
    y = depth / 2
    tall = width * 0.69
    lid = front_shape("lid", case, rounded_outline((-x, 0.012, x, tall), 0.01, 1), y - 0.012, y)
    screen = front_shape(
        "screen",
        SCREEN,
        rounded_outline((-x + 0.01, 0.026, x - 0.01, tall - 0.01), 0.004, 1),
        y - 0.0145,
        y - 0.003,
        "screen",
    )
    return centred([
        slab("base", case, (-x, -y, x, y), 0.0, 0.018, None, 0.012, 0.004),
        slab("keys", CASE, (-x + 0.02, -y + 0.09, x - 0.02, y - 0.03), 0.0095, 0.0195, None, 0.004),
        slab("pad", shade(case, 0.9), (-0.05, -y + 0.015, 0.05, -y + 0.08), 0.009, 0.019, None, 0.004),
        leaning(lid, lean),
        leaning(screen, lean, 0.012, tall),
    ])  # fmt: skip


def keyboard(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A keyboard of blocks of keys on a wedge."""
    room = size("keyboard")
    case = pick(rng, (CASE, SILVER, Finish((232, 232, 230))))
    keys = shade(case, 1.0, 26) if case == CASE else shade(case, 0.8)
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m)
    x, y = width / 2, depth / 2
    wedge = np.array([[-y, 0.0], [y, 0.0], [y, 0.024], [-y, 0.014]])
    parts = [side_shape("base", case, wedge, -x, x)]
    for a, b in ((-x + 0.01, x * 0.42), (x * 0.46, x * 0.66), (x * 0.7, x - 0.01)):
        outline = np.array([[-y + 0.012, 0.0085], [y - 0.012, 0.0175], [y - 0.012, 0.0285], [-y + 0.012, 0.0195]])
        parts.append(side_shape("keys", keys, outline, a, b))
    return centred(parts)


def piano(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """An upright piano: case, key bed with white and black keys, music desk, turned or square legs, pedals."""
    room = size("piano")
    colour = pick(rng, (Finish((32, 30, 30)), wood(rng, style), wood(rng, style)))
    width, height, depth = draw(rng, room.width_m, fit), draw(rng, room.height_m), draw(rng, room.depth_m, fit)
    x, y = width / 2, depth / 2
    case, bed = y - 0.34, 0.6
    brass = Finish((176, 148, 88))
    parts = [
        block("plinth", shade(colour, 0.8), (-x + 0.03, case + 0.02, 0.0), (x - 0.03, y - 0.02, 0.08)),
        block("body", colour, (-x + 0.025, case, 0.08), (x - 0.025, y - 0.005, height - 0.03)),
        *(block("side", colour, (a, case - 0.02, 0.0), (a + 0.025, y, height - 0.03)) for a in (-x, x - 0.025)),
        slab("lid", colour, (-x - 0.005, case - 0.03, x + 0.005, y), height - 0.03, height, None, 0.01, 0.006),
        block("base", colour, (-x + 0.055, -y + 0.004, bed), (x - 0.055, case, bed + 0.055)),
        *(block("arm", colour, (a, -y, bed - 0.02), (a + 0.06, case - 0.02, bed + 0.16)) for a in (-x, x - 0.06)),
        block("front", KEYS, (-x + 0.07, -y + 0.03, bed + 0.05), (x - 0.07, -y + 0.18, bed + 0.075), "front"),
        block("rail", colour, (-x + 0.06, -y, bed + 0.05), (x - 0.06, -y + 0.026, bed + 0.07)),
        block("fall", colour, (-x + 0.06, -y + 0.18, bed + 0.05), (x - 0.06, case, bed + 0.11)),
    ]
    count = 10  # groups of black keys, of two and three in turn
    for k in range(count):
        wide = 0.035 if k % 2 else 0.055
        at = -x + 0.07 + (2 * x - 0.14) * (k + 0.5) / count
        parts.append(
            block("key", CASE, (at - wide / 2, -y + 0.085, bed + 0.071), (at + wide / 2, -y + 0.179, bed + 0.083))
        )
    desk = front_shape(
        "desk",
        shade(colour, 1.1, 6),
        rounded_outline((-0.32, bed + 0.2, 0.32, bed + 0.42), 0.02),
        case - 0.06,
        case - 0.045,
    )
    parts += [leaning(desk, 0.052), block("ledge", colour, (-0.34, case - 0.07, bed + 0.185), (0.34, case, bed + 0.2))]
    for s in (-1, 1):
        at = s * (x - 0.05)
        profile = ((0.025, 0.0), (0.035, 0.06), (0.02, 0.1), (0.034, 0.35), (0.04, bed - 0.02))
        parts += turned("leg", colour, (at, -y + 0.05), profile, 8)
    for at in (-0.08, 0.0, 0.08):
        parts.append(pole("pedal", brass, (at, case + 0.026, 0.05), (at, case - 0.09, 0.035), 0.009, 1.3, 6))
    return centred(parts)
