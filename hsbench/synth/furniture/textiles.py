"""Rugs, curtains and cushions. A rug is thin enough to step on; a curtain hangs in folds from a rail at the wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import (
    accent,
    block,
    centred,
    draw,
    fabric,
    named_apart,
    part,
    pick,
    pole,
    shade,
    slab,
    tone,
)
from hsbench.synth.furniture.shapes import loft, oval_outline, rounded_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Rgb, Style

RUG_M = 0.012  # thin enough to step on, thick enough for the sub-samples of occupancy
FOLD_M = 0.06  # width of one fold of a curtain
CURTAIN_M = (0.3, 0.6)  # width of a curtain drawn aside
CURTAIN_LOW_M = 0.03  # a curtain ends so far above the floor
PUFF = (
    (0.55, 0.0),
    (0.85, 0.2),
    (0.97, 0.4),
    (1.0, 0.5),
    (0.97, 0.6),
    (0.85, 0.8),
    (0.55, 1.0),
)  # outline share and height share of a cushion


def rug(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A rug with end borders, a framed one, or an oval one; thin enough to step on."""
    room = size("rug")
    cloth, edge = accent(rng, style), shade(fabric(rng, style), 0.9)
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit)
    kind = pick(rng, ("ends", "frame", "oval"))
    if kind == "ends":
        return rug_of(cloth, edge, width, depth)
    x, y, band = width / 2, depth / 2, min(0.12, depth / 8)
    if kind == "frame":
        parts = [block("field", cloth, (-x + band, -y + band, 0.0), (x - band, y - band, RUG_M))]
        for s in (-1, 1):
            y0, y1 = sorted((s * y, s * (y - band)))
            x0, x1 = sorted((s * x, s * (x - band)))
            parts.append(block("border", edge, (-x, y0, 0.0), (x, y1, RUG_M)))
            parts.append(block("border", edge, (x0, -y + band, 0.0), (x1, y - band, RUG_M)))
        return centred(parts)
    outline = oval_outline(x, y, 24)
    return centred([
        part("border", edge, loft([outline, outline], [0.0, RUG_M - 0.002])),
        part("field", cloth, loft([outline * 0.86, outline * 0.86], [0.002, RUG_M])),
    ])  # fmt: skip


def rug_of(cloth: Rgb | Finish, edge: Rgb | Finish, width: float, depth: float) -> tuple[Part, ...]:
    """A rug of a given size: a field between two end borders."""
    x, y, band = width / 2, depth / 2, min(0.12, width / 8)
    return named_apart([
        block("field", cloth, (-x + band, -y, 0.0), (x - band, y, RUG_M)),
        block("border", edge, (-x, -y, 0.0), (-x + band, y, RUG_M)),
        block("border", edge, (x - band, -y, 0.0), (x, y, RUG_M)),
    ])  # fmt: skip


def curtain(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A gathered curtain on a rail with finials, from near the ceiling to just above the floor, in many folds."""
    return curtain_of(rng, style, draw(rng, CURTAIN_M))


def curtain_of(rng: np.random.Generator, style: Style, width: float) -> tuple[Part, ...]:
    """A curtain of a width, to the next fold within what a gathered one may be wide."""
    cloth = fabric(rng, style)
    metal = Finish(pick(rng, style.metals))
    folds, top = round(min(max(width, CURTAIN_M[0]), CURTAIN_M[1]) / FOLD_M), draw(rng, (2.18, 2.26))
    banded = bool(rng.random() < 0.3)
    tint = tone(rng, Finish(pick(rng, style.accents)))
    half = folds * FOLD_M / 2
    parts = []
    for i in range(folds):
        x = -half + (i + 0.5) * FOLD_M
        depth = draw(rng, (0.026, 0.036))
        shift = np.array([round(x, 4), 0.016 if i % 2 else -0.016])
        wave = oval_outline(FOLD_M / 2 + 0.004, depth, 8)
        light = shade(cloth, 1.0 if i % 2 else 0.93)
        hem = 0.32 if banded else CURTAIN_LOW_M
        parts.append(part("fold", light, loft([wave + shift, wave * 0.9 + shift], [hem, top - 0.02])))
        if banded:
            parts.append(part("hem", tint, loft([wave * 1.02 + shift, wave * 1.02 + shift], [CURTAIN_LOW_M, hem])))
    parts.append(pole("rail", metal, (-half - 0.02, 0.0, top), (half + 0.02, 0.0, top), 0.012))
    for s in (-1, 1):
        parts.append(pole("finial", metal, (s * (half + 0.016), 0.0, top), (s * (half + 0.045), 0.0, top), 0.02, 0.5))
    parts.append(block("bracket", metal, (-0.012, 0.004, top - 0.006), (0.012, 0.06, top + 0.006)))
    return centred(parts)


def cushion_piece(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A loose cushion that stands on its edge: square, oblong, or round with a button."""
    room = size("cushion")
    cloth = accent(rng, style)
    width, thick = draw(rng, room.width_m, fit), draw(rng, room.depth_m)
    kind = pick(rng, ("square", "oblong", "round"))
    x = width / 2
    y = max(room.height_m[0] / 2, x * 0.76) if kind == "oblong" else x
    outline = oval_outline(x, y, 16) if kind == "round" else rounded_outline((-x, -y, x, y), 0.06)
    parts = [part("cushion", cloth, loft([outline * share for share, _ in PUFF], [thick * z for _, z in PUFF]))]
    if kind == "round":
        parts.append(
            slab("button", shade(cloth, 0.7), (-0.02, -0.02, 0.02, 0.02), thick - 0.006, thick + 0.004, None, 0.015)
        )
    lowest = min(float(p.vertices[:, 1].min()) for p in parts)
    return centred([_on_edge(p, lowest) for p in parts])


def _on_edge(flat: Part, lowest_m: float) -> Part:
    """A part of a cushion that lies flat, turned about x so that its smallest y is the floor, its top in front."""
    assert flat.solid is not None
    x, y, z = flat.solid.vertices.T
    return replace(flat, solid=ConvexSolid(np.column_stack([x, -z, y - lowest_m]), flat.solid.triangles))
