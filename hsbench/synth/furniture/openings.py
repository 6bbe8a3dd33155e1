"""What fills an opening of a wall: door and window, built to its size. Frame: -y faces into the room.

y = 0 is the inner face of the wall and the wall reaches to y = thickness. Both close their opening: the boards of the
casing lie on the inner face and cover the seam, so that no ray slips out of the room. The origin's z is the floor.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, draw, pick, shade, tone
from hsbench.synth.furniture.style import Rgb, Style

CASING_M = (0.07, 0.015)  # width, thickness of the boards around an opening
CASING_OVERLAP_M = 0.015  # how far a casing covers the frame inside the opening
JAMB_M = 0.035
LEAF_M = 0.042
PANE_M = 0.02
GLASS: Rgb = (196, 216, 226)


def door(rng: np.random.Generator, style: Style, width: float, height: float, thickness: float) -> tuple[Part, ...]:
    """A closed door in an opening of width x height: jambs, head, casing, leaf with two panels, handle."""
    paint, metal = tone(rng, pick(rng, (*style.paints, *style.woods))), pick(rng, style.metals)
    frame = shade(paint, 0.95)
    x, inner = width / 2, width / 2 - JAMB_M
    side = pick(rng, (-1, 1))
    parts = [
        block("jamb", frame, (-x, 0.0, 0.0), (-inner, thickness, height)),
        block("jamb", frame, (inner, 0.0, 0.0), (x, thickness, height)),
        block("head", frame, (-inner, 0.0, height - JAMB_M), (inner, thickness, height)),
        *_casing(frame, x, 0.0, height, sill=False),
        block("door", paint, (-inner, 0.01, 0.0), (inner, 0.01 + LEAF_M, height - JAMB_M), "door"),
    ]
    for z0, z1 in ((0.2, 0.85), (1.1, height - JAMB_M - 0.18)):
        parts.append(block("panel", shade(paint, 0.93), (-inner + 0.14, 0.0, z0), (inner - 0.14, 0.01, z1)))
    grip = side * (inner - 0.07)
    x0, x1 = sorted((grip + side * 0.015, grip - side * 0.11))
    parts.append(block("handle", metal, (grip - 0.02, -0.005, 0.96), (grip + 0.02, 0.01, 1.14)))
    parts.append(block("handle", metal, (grip - 0.01, -0.05, 1.04), (grip + 0.01, -0.005, 1.06)))
    parts.append(block("handle", metal, (x0, -0.06, 1.04), (x1, -0.045, 1.06), "handle"))
    return tuple(parts)


def window(
    rng: np.random.Generator, style: Style, width: float, sill: float, height: float, thickness: float
) -> tuple[Part, ...]:
    """A closed window of width x height above ``sill``: frame, casing, sill board, pane, mullion, handle."""
    paint, metal = tone(rng, style.paints[0]), pick(rng, style.metals)
    x, z0, z1 = width / 2, sill, sill + height
    bar = draw(rng, (0.05, 0.07))
    deep = thickness * 0.55
    parts = [
        block("frame", paint, (-x, 0.0, z0), (-x + bar, thickness, z1)),
        block("frame", paint, (x - bar, 0.0, z0), (x, thickness, z1)),
        block("frame", paint, (-x + bar, 0.0, z0), (x - bar, thickness, z0 + bar)),
        block("frame", paint, (-x + bar, 0.0, z1 - bar), (x - bar, thickness, z1)),
        *_casing(paint, x, z0, z1, sill=True),
        block("pane", GLASS, (-x + bar / 2, deep, z0 + bar / 2), (x - bar / 2, deep + PANE_M, z1 - bar / 2)),
    ]
    if width > 0.9:
        parts.append(block("mullion", paint, (-0.025, deep - 0.02, z0 + bar), (0.025, deep, z1 - bar)))
        middle = z0 + height * 0.45
        parts.append(block("handle", metal, (-0.01, deep - 0.05, middle), (0.01, deep - 0.02, middle + 0.12), "handle"))
    return tuple(parts)


def _casing(colour: Rgb, x: float, z0: float, z1: float, sill: bool) -> list[Part]:
    """Boards on the inner face of the wall around an opening from -x to x and z0 to z1."""
    wide, thick = CASING_M
    lap = CASING_OVERLAP_M
    low = z0 if not sill else z0 - 0.02
    parts = [
        block("casing", colour, (-x - wide, -thick, low), (-x + lap, 0.0, z1 + wide)),
        block("casing", colour, (x - lap, -thick, low), (x + wide, 0.0, z1 + wide)),
        block("casing", colour, (-x + lap, -thick, z1 - lap), (x - lap, 0.0, z1 + wide)),
    ]
    if sill:
        parts.append(block("sill", colour, (-x - wide, -0.08, z0 - 0.02), (x + wide, 0.0, z0 + lap)))
    return parts
