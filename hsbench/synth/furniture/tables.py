"""Tables: dining, coffee, side and meeting table, desk and night stand. The space under a top is free."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import FRONT_M, carcass, drawers, four_legs, leg_half, leg_middles
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    draw,
    painted,
    part,
    pick,
    rod,
    shade,
    slab,
    strip,
    tapered,
    turned,
    wood,
)
from hsbench.synth.furniture.shapes import Rect, loft, superellipse_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Range, Style

APRON_M = (0.06, 0.018)  # height, thickness of the frame under a top
PEDESTAL_TURNED = ((0.75, 0.0), (1.25, 0.18), (0.7, 0.3), (0.85, 0.85), (1.3, 1.0))  # radius and height, as shares


def dining_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A dining table: a rectangle on four legs, trestles or a frame, or a round or oval top on a pedestal."""
    room = size("dining_table")
    timber = wood(rng, style)
    height, thick = draw(rng, room.height_m), draw(rng, style.top_m)
    if pick(rng, style.table_shapes) == "round":
        radius = draw(rng, (0.45, 0.58), fit)
        return _pedestal(rng, timber, (radius, radius), height, thick)
    width, depth = draw(rng, (1.22, room.width_m[1]), fit), draw(rng, (0.78, 0.95), fit)
    kind = pick(rng, ("legs", "legs", "trestle"))
    if kind == "trestle":
        return _trestle(style, timber, (width, depth), height, thick)
    return _four_legged(style, timber, (width, depth), height, thick, draw(rng, (0.055, 0.08)))


def coffee_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A low table: round on a drum or pedestal, or a rectangle with round corners, a shelf below now and then."""
    room = size("coffee_table")
    timber = wood(rng, style)
    height, thick = draw(rng, (0.36, 0.45)), draw(rng, style.top_m)
    if pick(rng, style.table_shapes) == "round":
        radius = draw(rng, (0.35, 0.42), fit)
        if rng.random() < 0.5:
            return _drum(timber, radius, height, thick)
        return _three_legged(style, timber, radius, height, thick)
    width, depth = draw(rng, (0.75, room.width_m[1]), fit), draw(rng, (0.46, 0.62), fit)
    parts = list(_four_legged(style, timber, (width, depth), height, thick, 0.045, apron=False))
    if rng.random() < 0.5:
        feet: Rect = (-width / 2 + 0.02, -depth / 2 + 0.02, width / 2 - 0.02, depth / 2 - 0.02)
        x0, y0, x1, y1 = leg_middles(style, feet, 0.045, height - thick, 0.14)
        inset = leg_half(style, 0.045, height - thick, 0.14) - 0.008
        board = (x0 + inset, y0 + inset, x1 - inset, y1 - inset)
        parts.append(block("board", shade(timber, 0.95), (*board[:2], 0.13), (*board[2:], 0.15)))
    return centred(parts)


def side_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A small table beside a seat: a tray on a foot, three legs, or a square one."""
    timber = wood(rng, style)
    width, height = draw(rng, size("side_table").width_m, fit), draw(rng, (0.48, 0.58))
    kind = pick(rng, ("pedestal", "three", "four"))
    if kind == "pedestal":
        return _pedestal(rng, timber, (width / 2, width / 2), height, 0.022)
    if kind == "three":
        return _three_legged(style, timber, width / 2, height, 0.022)
    return _four_legged(style, timber, (width, width), height, 0.025, 0.035, apron=False)


def meeting_table(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A table for a meeting room: long with round corners, or boat-shaped, on two slabs or columns; a cable lid."""
    room = size("meeting_table")
    timber, metal = wood(rng, style), Finish(pick(rng, style.metals))
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit)
    height, thick = draw(rng, room.height_m), 0.03
    x, y, under = width / 2, depth / 2, height - thick
    boat, columns = rng.random() < 0.4, rng.random() < 0.5
    if boat:
        outline = superellipse_outline(x, y)
        top = part("top", timber, loft([outline, outline], [under, height]), "top")
    else:
        top = slab("top", timber, (-x, -y, x, y), under, height, "top", 0.12, 0.006, 3)
    parts = [top]
    for s in (-1, 1):
        at = s * x * 0.58
        if columns:
            parts.append(slab("base", metal, (at - 0.22, -y * 0.62, at + 0.22, y * 0.62), 0.0, 0.02, None, 0.1))
            parts.append(rod("leg", metal, (at, 0), 0.06, 0.02, under, 0.05))
        else:
            foot: Rect = (at - 0.03, -y * 0.7, at + 0.03, y * 0.7)
            parts.append(tapered("leg", timber, foot, (at - 0.03, -y * 0.55, at + 0.03, y * 0.55), 0.0, under))
    beam = x * 0.58 - (0.05 if columns else 0.03)
    parts.append(strip("rail", metal, (-beam, 0.0, under - 0.06), (beam, 0.0, under - 0.06), 0.04, 0.06))
    parts.append(slab("lid", metal, (-0.14, -0.06, 0.14, 0.06), height - 0.007, height + 0.003, None, 0.015))
    return centred(parts)


def desk(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A desk: top, legs on one side, a block of drawers on the other (which side varies), a modesty panel."""
    room = size("desk")
    timber, metal = wood(rng, style), Finish(pick(rng, style.metals))
    paint = painted(rng, style)
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit)
    height, thick = draw(rng, room.height_m), draw(rng, style.top_m)
    x, y, under = width / 2, depth / 2, height - thick
    side, wide = pick(rng, (-1, 1)), 0.36
    panelled, slab_side = rng.random() < 0.6, rng.random() < 0.3
    parts = [slab("top", timber, (-x, -y, x, y), under, height, "top", 0.015, 0.004)]
    x0, x1 = sorted((side * (x - 0.02), side * (x - 0.02 - wide)))
    front = -y + 0.045
    parts.append(block("chest", paint, (x0, front, 0.05), (x1, y - 0.02, under)))
    parts.append(block("plinth", shade(paint, 0.75), (x0 + 0.02, front + 0.03, 0.0), (x1 - 0.02, y - 0.04, 0.05)))
    parts += drawers(style, paint, metal, (x0, 0.06, x1, under - 0.004), front, 3, 1)
    if slab_side:
        a, b = sorted((-side * (x - 0.015), -side * (x - 0.043)))
        parts.append(block("leg", timber, (a, -y + 0.03, 0.0), (b, y - 0.02, under)))
    else:
        outer = (-side * (x - 0.01), -side * (x - 0.14))
        foot = (min(outer), -y + 0.02, max(outer), y - 0.02)
        legs = four_legs(style, timber if style.leg == "round" else metal, foot, 0.05, under)
        parts += legs[2:] if side < 0 else legs[:2]
    inset = 0.038 if slab_side else 0.054 + style.leg_splay_m
    a, b = sorted((side * (x - 0.014 - wide), -side * (x - inset)))
    if panelled:
        parts.append(block("panel", timber, (a, y - 0.04, under - 0.3), (b, y - 0.022, under - 0.001)))
    else:
        parts.append(block("apron", timber, (a, y - 0.06, under - 0.07), (b, y - 0.042, under - 0.001)))
    return centred(parts)


def night_stand(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bedside chest with one or two drawers, or an open one with a drawer over a shelf, on legs or a plinth."""
    room = size("night_stand")
    colour, metal = painted(rng, style), Finish(pick(rng, style.metals))
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.46, 0.58))
    x, y = width / 2, depth / 2
    rect: Rect = (-x, -y, x, y)
    if rng.random() < 0.3:
        return _open_stand(style, colour, metal, rect, height)
    parts, front, face = carcass(rng, style, colour, rect, height)
    parts += drawers(style, colour, metal, front, face, int(rng.integers(1, 3)), 1)
    return centred(parts)


def _open_stand(style: Style, colour: Finish, metal: Finish, rect: Rect, height: float) -> tuple[Part, ...]:
    """Sides, a back, a board near the floor and one drawer under the top."""
    x0, y0, x1, y1 = rect
    face, split = y0 + FRONT_M + 0.007, height - 0.19
    parts = [
        block("side", colour, (x0, face, 0.0), (x0 + 0.02, y1, height - 0.022)),
        block("side", colour, (x1 - 0.02, face, 0.0), (x1, y1, height - 0.022)),
        block("back", shade(colour, 0.9), (x0 + 0.02, y1 - 0.014, 0.06), (x1 - 0.02, y1 - 0.002, split)),
        block("board", colour, (x0 + 0.02, face + 0.004, 0.08), (x1 - 0.02, y1 - 0.014, 0.1)),
        block("body", shade(colour, 0.94), (x0 + 0.02, face, split), (x1 - 0.02, y1 - 0.002, height - 0.022)),
        slab("top", colour, rect, height - 0.022, height, "top", 0.012, 0.004, 1),
    ]
    return centred([*parts, *drawers(style, colour, metal, (x0 + 0.02, split, x1 - 0.02, height - 0.024), face, 1, 1)])


def _four_legged(
    style: Style, timber: Finish, area: Range, height: float, thick: float, leg: float, apron: bool = True
) -> tuple[Part, ...]:
    x, y = area[0] / 2, area[1] / 2
    under = height - thick
    radius = 0.05 if style.leg == "round" else 0.012
    parts = [slab("top", timber, (-x, -y, x, y), under, height, "top", radius, 0.004)]
    parts += four_legs(style, timber, (-x + 0.02, -y + 0.02, x - 0.02, y - 0.02), leg, under)
    if apron:
        drop, wide = APRON_M
        inset = 0.02 + style.leg_splay_m
        ax, ay = x - inset - 0.006, y - inset - 0.006
        for s in (-1, 1):
            y0, y1 = sorted((s * ay, s * (ay - wide)))
            parts.append(block("apron", timber, (-ax + leg - 0.008, y0, under - drop), (ax - leg + 0.008, y1, under)))
            x0, x1 = sorted((s * ax, s * (ax - wide)))
            parts.append(block("apron", timber, (x0, -ay + leg - 0.008, under - drop), (x1, ay - leg + 0.008, under)))
    return centred(parts)


def _trestle(style: Style, timber: Finish, area: Range, height: float, thick: float) -> tuple[Part, ...]:
    """Two pairs of leaning legs with a foot and a head each, joined by a rail."""
    x, y, under = area[0] / 2, area[1] / 2, height - thick
    parts = [slab("top", timber, (-x, -y, x, y), under, height, "top", 0.012, 0.004)]
    for s in (-1, 1):
        at = s * (x - 0.22)
        parts.append(block("frame", timber, (at - 0.04, -y + 0.06, under - 0.05), (at + 0.04, y - 0.06, under)))
        for t in (-1, 1):
            foot: Rect = (at - 0.03, t * (y - 0.09) - 0.035, at + 0.03, t * (y - 0.09) + 0.035)
            top: Rect = (at - 0.03, t * (y - 0.2) - 0.035, at + 0.03, t * (y - 0.2) + 0.035)
            parts.append(tapered("leg", timber, foot, top, 0.0, under - 0.05))
        reach = y - 0.09 - 0.11 * 0.27 / (under - 0.05) - 0.031
        parts.append(block("frame", timber, (at - 0.02, -reach, 0.24), (at + 0.02, reach, 0.3)))
    end = x - 0.234
    parts.append(block("rail", timber, (-end, -0.02, 0.22), (end, 0.02, 0.28)))
    return centred(parts)


def _pedestal(rng: np.random.Generator, timber: Finish, radii: Range, height: float, thick: float) -> tuple[Part, ...]:
    """A round top on a turned or plain column with a round foot."""
    rx, ry = radii
    column = max(0.03, rx * 0.12)
    under = height - thick
    top = slab("top", timber, (-rx, -ry, rx, ry), under, height, "top", max(radii), 0.005, 6)
    foot = rod("foot", timber, (0, 0), rx * 0.55, 0.0, 0.035, rx * 0.42, 16)
    if rng.random() < 0.5:
        profile = [(column * r, 0.035 + (under - 0.035) * z) for r, z in PEDESTAL_TURNED]
    else:
        profile = [(column * 1.6, 0.035), (column * 0.9, 0.1), (column * 0.9, under)]
    return centred([top, *turned("leg", timber, (0, 0), profile), foot])


def _three_legged(style: Style, timber: Finish, radius: float, height: float, thick: float) -> tuple[Part, ...]:
    """A round top on three legs that spread towards the floor."""
    under = height - thick
    parts = [slab("top", timber, (-radius, -radius, radius, radius), under, height, "top", radius, 0.005, 6)]
    for c, s in ((0.0, -1.0), (0.866, 0.5), (-0.866, 0.5)):
        foot, top = 0.82 * radius, 0.5 * radius
        parts.append(
            tapered(
                "leg", timber, (foot * c - 0.012, foot * s - 0.012, foot * c + 0.012, foot * s + 0.012),
                (top * c - 0.02, top * s - 0.02, top * c + 0.02, top * s + 0.02), 0.0, under,
            )
        )  # fmt: skip
    return centred(parts)


def _drum(timber: Finish, radius: float, height: float, thick: float) -> tuple[Part, ...]:
    """A round top on a slightly narrower drum of staves."""
    rect: Rect = (-radius, -radius, radius, radius)
    return centred([
        slab("top", timber, rect, height - thick, height, "top", radius, 0.006, 6),
        rod("base", shade(timber, 0.93), (0, 0), radius * 0.7, 0.0, height - thick, radius * 0.84, 20),
    ])  # fmt: skip
