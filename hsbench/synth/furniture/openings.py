"""What fills an opening of a wall: door, passage and window, built to its size. Frame: -y faces into the room.

The origin is on the floor at the middle of the opening; y = 0 is the inner face of the wall and the wall reaches to
y = thickness. A closed door and a window close their opening: the boards of the casing lie on the faces of the wall and
cover the seam, so that no ray slips out of the room.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, draw, named_apart, painted, pick, shade, swung, tone
from hsbench.synth.furniture.style import Finish, Rgb, Style

CASING_M = (0.07, 0.015)  # width, thickness of the boards around an opening
CASING_OVERLAP_M = 0.015  # how far a casing covers the frame inside the opening
JAMB_M = 0.035
LEAF_M = 0.042
PANEL_M = 0.01  # how far a panel stands out of its leaf
PANEL_GAP_M = 0.06  # half the rail between two panels
MAX_OPEN_RAD = math.radians(110)  # farther round, the leaf would cut into its casing
PANE_M = 0.02
HANDLE_FROM_M = 0.9  # wider windows open
DEEPEST_PANE_M = 0.1  # behind the inner face of a wall: a handle there is within reach over a worktop (our default)
HANDLE_SHARE = 0.25  # of the height of a window, below its handle: so low for the same reason (our default)
GLASS: Rgb = (196, 216, 226)


def door(
    rng: np.random.Generator, style: Style, width_m: float, height_m: float, thickness_m: float,
    open_rad: float = 0.0, hinge: int = 1,
) -> tuple[Part, ...]:  # fmt: skip
    """A door in an opening of width x height: jambs, head, casing, a leaf with panels, a handle on either side.

    hinge: the side the leaf hangs on, +1 at +x, -1 at -x. open_rad: how far it is turned into the room (towards -y).
    Raises SchemaError for another hinge or an angle that is not 0 to 110 degrees.
    """
    if hinge not in (-1, 1) or not 0.0 <= open_rad <= MAX_OPEN_RAD:
        raise SchemaError(
            f"door has hinge {hinge}, open_rad {open_rad:.3g}; expected +1 or -1, and 0 to {MAX_OPEN_RAD:.3g}"
        )
    paint, metal = painted(rng, style), pick(rng, style.metals)
    frame = shade(paint, 0.95)
    inner = width_m / 2 - JAMB_M
    leaf = _leaf(rng, paint, metal, inner, height_m - JAMB_M, hinge)
    turned = [swung(p, (hinge * inner, 0.0), hinge * open_rad) for p in leaf] if open_rad > 0 else leaf
    return named_apart([*_frame(frame, width_m, height_m, thickness_m), *turned])


def passage(
    rng: np.random.Generator, style: Style, width_m: float, height_m: float, thickness_m: float
) -> tuple[Part, ...]:
    """An open doorway without a leaf: jambs, head and casing."""
    frame = Finish(shade(tone(rng, pick(rng, style.paints)), 0.95))
    return named_apart(_frame(frame, width_m, height_m, thickness_m))


def _frame(colour: Finish, width: float, height: float, thickness: float) -> list[Part]:
    """Jambs and head inside the opening, casings on both faces of the wall."""
    x, inner = width / 2, width / 2 - JAMB_M
    return [
        block("jamb", colour, (-x, 0.0, 0.0), (-inner, thickness, height)),
        block("jamb", colour, (inner, 0.0, 0.0), (x, thickness, height)),
        block("head", colour, (-inner, 0.0, height - JAMB_M), (inner, thickness, height)),
        *_casing(colour, x, 0.0, height, -CASING_M[1], 0.0),
        *_casing(colour, x, 0.0, height, thickness, thickness + CASING_M[1]),
    ]


def _leaf(rng: np.random.Generator, paint: Finish, metal: Rgb, inner: float, top: float, hinge: int) -> list[Part]:
    """The closed leaf between -inner and inner, flush with the inner face of the wall."""
    parts = [block("door", paint, (-inner, 0.0, 0.0), (inner, LEAF_M, top), "door")]
    panel = shade(paint, 0.93)
    split = pick(rng, ((), (0.95,), (0.55, 1.1), (1.45,)))
    edges = (0.16, *split, top - 0.14)
    for z0, z1 in pairwise(edges):
        gaps = (PANEL_GAP_M * (z0 > edges[0]), PANEL_GAP_M * (z1 < edges[-1]))
        for y0, y1 in ((-PANEL_M, 0.0), (LEAF_M, LEAF_M + PANEL_M)):
            low, high = (-inner + 0.13, y0, z0 + gaps[0]), (inner - 0.13, y1, z1 - gaps[1])
            parts.append(block("panel", panel, low, high))
    grip = -hinge * (inner - 0.06)
    x0, x1 = sorted((grip - hinge * 0.012, grip + hinge * 0.12))
    for face, out in ((0.0, -1), (LEAF_M, 1)):
        for name, (a, b), (z0, z1), reach in (
            ("plate", (grip - 0.02, grip + 0.02), (0.94, 1.12), (0.0, 0.01)),
            ("neck", (grip - 0.01, grip + 0.01), (1.03, 1.05), (0.01, 0.045)),
            ("handle", (x0, x1), (1.03, 1.05), (0.045, 0.06)),
        ):
            y0, y1 = sorted(face + out * r for r in reach)
            parts.append(block(name, metal, (a, y0, z0), (b, y1, z1), "handle" if name == "handle" else None))
    return parts


def window(
    rng: np.random.Generator, style: Style, width: float, sill: float, height: float, thickness: float
) -> tuple[Part, ...]:
    """A closed window of width x height above ``sill``: frame, casing, sill board, pane, mullion, handle."""
    paint, metal = tone(rng, style.paints[0]), pick(rng, style.metals)
    frame = Finish(paint)
    x, z0, z1 = width / 2, sill, sill + height
    bar = draw(rng, (0.05, 0.07))
    deep, rim = min(thickness * 0.55, DEEPEST_PANE_M), bar - 0.008
    parts = [
        block("frame", paint, (-x, 0.0, z0), (-x + bar, thickness, z1)),
        block("frame", paint, (x - bar, 0.0, z0), (x, thickness, z1)),
        block("frame", paint, (-x + bar, 0.0, z0), (x - bar, thickness, z0 + bar)),
        block("frame", paint, (-x + bar, 0.0, z1 - bar), (x - bar, thickness, z1)),
        *_casing(frame, x, z0 + CASING_OVERLAP_M, z1, -CASING_M[1], 0.0),
        block("sill", paint, (-x - CASING_M[0], -0.08, z0 - 0.02), (x + CASING_M[0], 0.0, z0 + CASING_OVERLAP_M)),
        block("pane", GLASS, (-x + rim, deep, z0 + rim), (x - rim, deep + PANE_M, z1 - rim)),
    ]
    if width > HANDLE_FROM_M:
        parts.append(block("mullion", paint, (-0.025, deep - 0.02, z0 + bar), (0.025, deep, z1 - bar)))
        low = z0 + height * HANDLE_SHARE
        parts.append(block("handle", metal, (-0.01, deep - 0.05, low), (0.01, deep - 0.02, low + 0.12), "handle"))
    return named_apart(parts)


def _casing(colour: Finish, x: float, z0: float, z1: float, y0: float, y1: float) -> list[Part]:
    """Boards on a face of the wall, from y0 to y1, around an opening from -x to x and from z0 to z1."""
    wide, lap = CASING_M[0], CASING_OVERLAP_M
    return [
        block("casing", colour, (-x - wide, y0, z0), (-x + lap, y1, z1 + wide)),
        block("casing", colour, (x - lap, y0, z0), (x + wide, y1, z1 + wide)),
        block("casing", colour, (-x + lap, y0, z1 - lap), (x - lap, y1, z1 + wide)),
    ]
