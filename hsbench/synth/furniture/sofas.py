"""Upholstered seats: sofa, armchair, ottoman. A seat part for each place, .40-.46 m high, facing -y."""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import four_legs
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    cushion,
    draw,
    fabric,
    front_pad,
    front_shape,
    leaning,
    part,
    pick,
    shade,
    slab,
    strip,
    wood,
)
from hsbench.synth.furniture.shapes import along_x, loft, rounded_outline
from hsbench.synth.furniture.sizes import Size, size
from hsbench.synth.furniture.style import Finish, Style

THREE_SEATS_M = 1.95  # a sofa this wide has three places
LEAST_SEAT_M = 0.46  # width of a place
BACK_PAD_M = 0.14  # thickness of the back cushions


def sofa(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A sofa of two or three seats: base, a cushion a seat, leaning back cushions, round, square or open arms."""
    width = draw(rng, size("sofa").width_m, fit)
    return _upholstered(rng, style, size("sofa"), width, 2 if width < THREE_SEATS_M else 3, fit)


def armchair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A seat for one, built like the sofas of its style."""
    width = draw(rng, size("armchair").width_m, fit)
    return _upholstered(rng, style, size("armchair"), width, 1, fit)


def _upholstered(
    rng: np.random.Generator, style: Style, room: Size, width: float, places: int, fit: float
) -> tuple[Part, ...]:
    cloth, timber = fabric(rng, style), wood(rng, style)
    light = shade(cloth, 1.06, 3)
    depth = draw(rng, (room.depth_m[0] + 0.02, room.depth_m[1]), fit)
    back_z = draw(rng, (max(0.76, room.height_m[0]), room.height_m[1]))
    seat_z, feet = draw(rng, (0.41, 0.45)), draw(rng, (0.06, 0.14))
    kind = pick(rng, style.sofa_arms)
    arm = min(draw(rng, style.arm_width_m), (width - places * LEAST_SEAT_M) / 2) if kind != "open" else 0.06
    arm_z = seat_z + draw(rng, style.arm_height_m)
    base_z = seat_z - draw(rng, (0.13, 0.17))
    lean = min(draw(rng, style.back_lean_m), 0.1)
    frame = draw(rng, (0.08, 0.12))
    x, front, rear = width / 2, -depth / 2, depth / 2
    half = x - arm
    y_back = rear - lean - frame - BACK_PAD_M + 0.008
    parts = four_legs(style, timber, (-x + 0.005, front + 0.02, x - 0.005, rear - lean), 0.05, feet, 0.3)
    parts.append(block("base", shade(cloth, 0.94), (-half, front + 0.015, feet), (half, rear - lean, base_z)))
    wide = 2 * half / places
    for i in range(places):
        x0, x1 = -half + i * wide + 0.003, -half + (i + 1) * wide - 0.003
        parts.append(cushion("seat", light, (x0, front, x1, y_back + 0.008), base_z, seat_z, "seat", 0.03))
        pad = front_pad("back_cushion", light, (x0, seat_z - 0.006, x1, back_z), y_back, y_back + BACK_PAD_M, None,
                        0.06, 0.04)  # fmt: skip
        parts.append(leaning(pad, lean, seat_z, back_z))
    top = back_z - draw(rng, (0.02, 0.06))
    back = front_shape(
        "back", cloth, rounded_outline((-half, base_z, half, top), 0.05), rear - lean - frame, rear - lean
    )
    parts.append(leaning(back, lean, seat_z, back_z))
    for s in (-1, 1):
        parts += _arm(kind, cloth, timber, (s, half, x), (front, rear - lean), (feet, arm_z))
    return centred(parts)


def _arm(
    kind: str, cloth: Finish, timber: Finish, across: tuple[float, float, float], along: tuple[float, float],
    upright: tuple[float, float],
) -> list[Part]:  # fmt: skip
    """One arm: across (side, inner, outer), along (front, rear), upright (underside, top)."""
    s, inner, outer = across
    (front, rear), (low, high) = along, upright
    x0, x1 = sorted((s * inner, s * outer))
    if kind == "round":
        radius = min(0.06, (x1 - x0) / 2)
        roll = rounded_outline((x0, high - 0.2, x1, high), radius, 3)
        foot = np.array([[x0 + 0.012, low], [x1 - 0.012, low]])
        outline = np.concatenate([foot, roll[roll[:, 1] > high - radius - 1e-3]])
        return [front_shape("armrest", cloth, outline, front, rear)]
    if kind == "slab":
        outline = rounded_outline((front, low, rear, high), 0.04)
        return [part("armrest", cloth, along_x(loft([outline, outline], [x0, x1])))]
    middle = (x0 + x1) / 2
    posts = [
        strip("post", timber, (middle, y, low - 0.008), (middle, y, high - 0.025), 0.036, 0.036)
        for y in (front + 0.06, rear - 0.1)
    ]
    ends = (front + 0.072, rear - 0.112)
    side = strip("rail", timber, (middle, ends[0], low + 0.05), (middle, ends[1], low + 0.05), 0.05, 0.06)
    return [*posts, side, slab("armrest", timber, (x0, front, x1, rear - 0.04), high - 0.03, high, None, 0.025, 0.008)]


def ottoman(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A footstool without a back: a padded block on short legs, or a round pouf."""
    room = size("ottoman")
    cloth, timber = fabric(rng, style), wood(rng, style)
    width, depth, seat_z = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.4, 0.45))
    light = shade(cloth, 1.06, 3)
    x, y = width / 2, depth / 2
    if rng.random() < 0.4:
        x = y
        rect = (-x, -y, x, y)
        return centred([
            slab("base", cloth, (-x + 0.01, -y + 0.01, x - 0.01, y - 0.01), 0.0, seat_z - 0.1, None, x, 0.0, 4),
            slab("seat", light, rect, seat_z - 0.1, seat_z, "seat", x, 0.03, 4),
        ])  # fmt: skip
    parts = four_legs(style, timber, (-x + 0.01, -y + 0.01, x - 0.01, y - 0.01), 0.045, 0.1, 0.3)
    parts.append(slab("base", cloth, (-x + 0.008, -y + 0.008, x - 0.008, y - 0.008), 0.1, seat_z - 0.1, None, 0.04))
    parts.append(cushion("seat", light, (-x, -y, x, y), seat_z - 0.1, seat_z, "seat", 0.03))
    return centred(parts)
