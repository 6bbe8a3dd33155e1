"""Beds: bed and bunk bed. Head at +y, foot (front) at -y; the duvet of each lying place carries the role mattress."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import four_legs
from hsbench.synth.furniture.pieces import (
    accent,
    block,
    centred,
    cushion,
    draw,
    fabric,
    front_pad,
    front_shape,
    painted,
    pick,
    pole,
    shade,
    strip,
    tone,
    wood,
)
from hsbench.synth.furniture.shapes import Rect, rounded_outline
from hsbench.synth.furniture.style import Finish, Rgb, Style

MATTRESS_WIDTHS_M = (0.9, 1.2, 1.4, 1.6, 1.8)
DOUBLE_M = 1.4  # from this width on there are two duvets and two pillows
LINEN: Rgb = (236, 232, 224)
PILLOW_M = 0.42  # length along the bed
DUVET_M = 0.045


def bed(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bed .9 to 1.8 m wide: frame on legs or a divan, headboard of boards, posts or upholstery, made up."""
    timber, cloth = wood(rng, style), fabric(rng, style)
    last = max(1, round(len(MATTRESS_WIDTHS_M) * fit))
    width = MATTRESS_WIDTHS_M[int(rng.integers(last // 2, last))]
    length, thick = draw(rng, (1.96, 2.04)), draw(rng, (0.16, 0.2))
    frame_z, rim = draw(rng, (0.26, 0.3)), draw(rng, (0.03, 0.05))
    divan, head_kind = rng.random() < 0.3, pick(rng, ("boards", "padded", "posts"))
    x, y = width / 2, length / 2
    rect: Rect = (-x - rim, -y - rim, x + rim, y + rim)
    if divan:
        parts = [block("frame", cloth, (rect[0], rect[1], 0.02), (rect[2], rect[3], frame_z)),
                 block("base", shade(timber, 0.6), (-x, -y, 0.0), (x, y, 0.02))]  # fmt: skip
    else:
        parts = four_legs(style, timber, rect, 0.07, frame_z - 0.15, 0.3)
        parts.append(block("frame", timber, (rect[0], rect[1], frame_z - 0.15), (rect[2], rect[3], frame_z)))
    parts += _made_up(rng, style, (-x, -y, x, y), frame_z, frame_z + thick)
    parts += _headboard(head_kind, timber, cloth, x + rim, y + rim, frame_z - 0.1, draw(rng, (0.9, 1.15)))
    return centred(parts)


def _made_up(rng: np.random.Generator, style: Style, rect: Rect, z0: float, z1: float) -> list[Part]:
    """Mattress from z0 to z1, duvets that end below the pillows, and a pillow each."""
    x0, y0, x1, y1 = rect
    linen, cover = tone(rng, Finish(LINEN)), accent(rng, style) if rng.random() < 0.5 else fabric(rng, style)
    places = 2 if x1 - x0 >= DOUBLE_M else 1
    wide = (x1 - x0) / places
    fold = y1 - PILLOW_M - draw(rng, (0.04, 0.16))
    parts = [cushion("mattress", linen, (x0 + 0.004, y0 + 0.004, x1 - 0.004, y1 - 0.004), z0, z1, None, 0.03)]
    for i in range(places):
        a, b = x0 + i * wide, x0 + (i + 1) * wide
        outer = 0.012
        low, high = a - (outer if i == 0 else -0.003), b + (outer if i == places - 1 else -0.003)
        parts.append(cushion("duvet", cover, (low, y0 - outer, high, fold), z1 - 0.005, z1 + DUVET_M, "mattress", 0.02))
        band = (low + 0.004, fold - 0.16, high - 0.004, fold + 0.012)
        parts.append(cushion("sheet", linen, band, z1 + DUVET_M - 0.006, z1 + DUVET_M + 0.012, None, 0.006))
        half = min(0.36, wide / 2 - 0.03)
        middle = (a + b) / 2
        pillow = (middle - half, y1 - PILLOW_M, middle + half, y1 - 0.03)
        parts.append(cushion("pillow", shade(linen, 1.03), pillow, z1 - 0.004, z1 + 0.11, None, 0.05))
    for a, b in ((x0 - 0.018, x0 - 0.006), (x1 + 0.006, x1 + 0.018)):  # the duvets hang over the sides
        parts.append(block("overhang", cover, (a, y0 + 0.02, z1 - 0.11), (b, fold - 0.03, z1 + DUVET_M - 0.022)))
    return parts


def _headboard(kind: str, timber: Finish, cloth: Finish, x: float, y: float, z0: float, z1: float) -> list[Part]:
    """What stands behind the pillows, from y on: boards, upholstered panels, or a rail on posts with slats."""
    if kind == "padded":
        panels = 3
        edges = np.linspace(-x, x, panels + 1).tolist()
        back = block("headboard", timber, (-x + 0.005, y + 0.055, 0.0), (x - 0.005, y + 0.075, z1 - 0.01))
        pads = [
            front_pad("headboard", cloth, (a + 0.001, z0, b - 0.001, z1), y, y + 0.06, None, 0.04, 0.02)
            for a, b in pairwise(edges)
        ]
        return [back, *pads]
    if kind == "boards":
        board = front_shape("headboard", timber, rounded_outline((-x, 0.0, x, z1), 0.06), y, y + 0.04)
        return [board]
    posts = [
        block("post", timber, (s * (x - 0.025) - 0.025, y, 0.0), (s * (x - 0.025) + 0.025, y + 0.05, z1))
        for s in (-1, 1)
    ]
    rails = [
        strip("rail", timber, (-x + 0.045, y + 0.025, z), (x - 0.045, y + 0.025, z), 0.03, 0.07)
        for z in (z0, z1 - 0.06)
    ]
    count = max(4, round(2 * x / 0.22))
    slats = [
        strip("slat", timber, (at, y + 0.025, z0 + 0.03), (at, y + 0.025, z1 - 0.09), 0.04, 0.016)
        for at in np.linspace(-x + 0.16, x - 0.16, count).tolist()
    ]
    return [*posts, *rails, *slats]


def bunk_bed(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """Two single beds, one above the other, between four posts, with guard rails and a ladder at the front."""
    timber = painted(rng, style)
    linen, cover = tone(rng, Finish(LINEN)), accent(rng, style)
    width, length = draw(rng, (0.9, 0.96), fit), draw(rng, (1.94, 2.0))
    top, low, high = draw(rng, (1.58, 1.72)), draw(rng, (0.24, 0.3)), draw(rng, (1.12, 1.2))
    x, y, post = width / 2 + 0.05, length / 2 + 0.05, 0.05
    parts = [
        block("post", timber, (sx * x - 0.025 - sx * 0.025, sy * y - 0.025 - sy * 0.025, 0.0),
              (sx * x + 0.025 - sx * 0.025, sy * y + 0.025 - sy * 0.025, top))
        for sx in (-1, 1) for sy in (-1, 1)
    ]  # fmt: skip
    inner_x, inner_y = x - post, y - post
    for z in (low, high):
        parts.append(block("frame", timber, (-inner_x, -y + 0.01, z), (inner_x, y - 0.01, z + 0.03)))
        for s in (-1, 1):
            side = s * (x - 0.015)
            parts.append(strip("rail", timber, (side, -inner_y, z + 0.015), (side, inner_y, z + 0.015), 0.025, 0.12))
        bed_rect = (-inner_x + 0.005, -inner_y + 0.005, inner_x - 0.005, inner_y - 0.005)
        parts.append(cushion("mattress", linen, bed_rect, z + 0.03, z + 0.15, None, 0.02))
        over = (bed_rect[0] - 0.003, bed_rect[1] + 0.005, bed_rect[2] + 0.003, inner_y - PILLOW_M - 0.02)
        parts.append(cushion("duvet", cover, over, z + 0.145, z + 0.18, "mattress", 0.015))
        pillow = (-0.32, inner_y - PILLOW_M + 0.02, 0.32, inner_y - 0.03)
        parts.append(cushion("pillow", shade(linen, 1.03), pillow, z + 0.146, z + 0.24, None, 0.04))
    for z in (high + 0.3, top - 0.04):
        for s in (-1, 1):
            side = s * (x - 0.025)
            start = -inner_y if s > 0 else -inner_y + 0.5
            parts.append(strip("guard", timber, (side, start, z), (side, inner_y, z), 0.022, 0.07))
    for s, z in ((1, high + 0.3), (1, top - 0.04), (1, low + 0.32), (-1, high + 0.3), (-1, top - 0.04)):
        parts.append(strip("board", timber, (-inner_x, s * (y - 0.025), z), (inner_x, s * (y - 0.025), z), 0.022, 0.09))
    return centred([*parts, *_ladder(timber, -x, -inner_y, high + 0.2)])


def _ladder(timber: Finish, x: float, y: float, top: float) -> list[Part]:
    """A ladder flat against the side at x, in the gap of the guard rail that begins at y."""
    parts = [
        pole("ladder", timber, (x - 0.014, y + at, 0.0), (x - 0.014, y + at, top), 0.016, sides=6)
        for at in (0.06, 0.44)
    ]
    for z in np.arange(0.25, top - 0.1, 0.25).round(2).tolist():
        parts.append(pole("rung", timber, (x - 0.014, y + 0.07, z), (x - 0.014, y + 0.43, z), 0.013, sides=6))
    return parts
