"""Beds: frame, mattress, duvet, pillows, headboard. The head is at +y, the foot (front) at -y."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, cushion, draw, four_legs, pick, shade, tapered, tone
from hsbench.synth.furniture.style import Style

MATTRESS_WIDTHS_M = (0.9, 1.2, 1.4, 1.6, 1.8)
DOUBLE_M = 1.4  # from this width on there are two pillows
LINEN = (236, 232, 224)


def bed(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bed .9 to 1.8 m wide; duvet and bare mattress carry the role, for both are sat and lain upon."""
    wood, cloth = tone(rng, pick(rng, style.woods)), tone(rng, pick(rng, (*style.fabrics, *style.accents)))
    linen = tone(rng, LINEN)
    last = max(1, round(len(MATTRESS_WIDTHS_M) * fit))
    width = MATTRESS_WIDTHS_M[int(rng.integers(last // 2, last))]
    length, thick = draw(rng, (1.96, 2.04)), draw(rng, (0.16, 0.22))
    frame_z = draw(rng, (0.26, 0.31))
    rim = draw(rng, (0.03, 0.05))
    x, y = width / 2, length / 2
    parts: list[Part] = []
    if rng.random() < 0.7:
        parts += four_legs(style, wood, (-x - rim, -y - rim, x + rim, y + rim), 0.07, frame_z - 0.16, 0.3)
        parts.append(block("frame", wood, (-x - rim, -y - rim, frame_z - 0.16), (x + rim, y + rim, frame_z)))
    else:  # a divan reaches the floor
        parts.append(block("frame", wood, (-x - rim, -y - rim, 0.0), (x + rim, y + rim, frame_z)))
    top = frame_z + thick
    parts += cushion("mattress", linen, (-x, -y, x, y), frame_z, top, "mattress", 0.02)
    pillow_y = y - 0.5
    cover = top + 0.035
    fold = pillow_y - draw(rng, (0.05, 0.2))
    parts += cushion("duvet", cloth, (-x - 0.01, -y - 0.01, x + 0.01, fold), top - 0.01, cover, "mattress", 0.015)
    parts.append(block("duvet", shade(cloth, 1.08, 8), (-x - 0.01, fold - 0.22, top), (x + 0.01, fold, cover + 0.01)))
    for s in (-1, 1):  # the duvet hangs over the sides
        x0, x1 = sorted((s * (x + 0.005), s * (x + 0.02)))
        parts.append(block("duvet", cloth, (x0, -y - 0.01, top - 0.12), (x1, fold, cover - 0.015)))
    pillows = 2 if width >= DOUBLE_M else 1
    half = min(0.34, width / pillows / 2 - 0.03)
    for i in range(pillows):
        middle = -x + width * (i + 0.5) / pillows
        low = (middle - half, pillow_y, middle + half, y - 0.02)
        high = (middle - half + 0.06, pillow_y + 0.08, middle + half - 0.06, y - 0.05)
        parts.append(tapered("pillow", shade(linen, 1.03), low, high, top, top + 0.1))
    head = draw(rng, (0.9, 1.15))
    board = cloth if rng.random() < 0.4 else wood
    parts.append(block("headboard", board, (-x - rim, y + rim, 0.0), (x + rim, y + rim + 0.06, head)))
    return centred(parts)
