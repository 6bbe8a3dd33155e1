"""Chairs and stools: chair, office chair, stool, bar stool, bench. Seats are level, .40-.48 m high, and face -y."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import four_legs, leg_half, leg_middles
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    cushion,
    draw,
    fabric,
    front_pad,
    leaning,
    pick,
    pole,
    rod,
    shade,
    slab,
    strip,
    tapered,
    turned,
    wood,
)
from hsbench.synth.furniture.shapes import Point, Rect
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

STAR_ARMS = 5
BENCH_PLACE_M = 0.55  # width of one place on a bench
SLAT_M = 0.02  # thickness of the slats of a back


def chair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A chair: tapered legs, wooden or padded seat, a leaning back of slats, rails, bars, a panel, or a moulded one."""
    room = size("chair")
    timber, cloth = wood(rng, style), fabric(rng, style)
    width, depth = draw(rng, room.width_m, fit), draw(rng, (0.42, 0.46), fit)
    seat_z, back_z = draw(rng, (0.44, 0.47)), draw(rng, (0.82, 0.96))
    thick, post, lean = draw(rng, (0.036, 0.045)), draw(rng, (0.03, 0.038)), draw(rng, style.back_lean_m)
    padded, stretched = bool(rng.random() < 0.5), bool(rng.random() < 0.5)
    kind = pick(rng, style.chair_backs)
    x, y = width / 2, depth / 2
    under = seat_z - thick
    feet: Rect = (-x + 0.01, -y + 0.01, x - 0.01, y - 0.005)
    parts = four_legs(style, timber, feet, post, under, 0.5)
    if kind == "shell":
        colour = cloth if padded else Finish(pick(rng, style.paints))
        parts.append(slab("seat", colour, (-x, -y, x, y), under, seat_z, "seat", 0.09, 0.014))
        shell = front_pad("back", colour, (-x + 0.02, seat_z - 0.004, x - 0.02, back_z - 0.06), y - 0.03, y, None, 0.09)
        return centred([*parts, leaning(shell, lean)])
    if padded:
        parts.append(slab("frame", timber, (-x, -y, x, y), under, under + 0.018, None, 0.03))
        parts.append(
            cushion("seat", cloth, (-x + 0.006, -y + 0.006, x - 0.006, y - post), under + 0.018, seat_z, "seat")
        )
    else:
        parts.append(slab("seat", timber, (-x, -y, x, y), under, seat_z, "seat", 0.04, 0.008))
    foot = under + 0.018 if padded else seat_z
    for x0 in (-x + 0.006, x - 0.006 - post):
        upright = block("post", timber, (x0, y - post, foot), (x0 + post, y, back_z))
        parts.append(leaning(upright, lean))
    parts += _back(rng, kind, cloth if padded else timber, timber, (x - post, y - post / 2, lean), seat_z, back_z)
    if stretched:
        x0, y0, x1, y1 = leg_middles(style, feet, post, under, 0.2, 0.5)
        reach = leg_half(style, post, under, 0.2) - 0.005
        for side in (x0, x1):
            parts.append(strip("rail", timber, (side, y0 + reach, 0.2), (side, y1 - reach, 0.2), 0.014, 0.022))
    return centred(parts)


def _back(
    rng: np.random.Generator, kind: str, pad: Finish, timber: Finish, place: tuple[float, float, float], z0: float,
    z1: float,
) -> list[Part]:  # fmt: skip
    """What stands between leaning posts; place: half the clear width, middle of the posts at the seat, their lean."""
    x, y, lean = place

    def piece(name: str, colour: Finish, x0: float, x1: float, low: float, high: float, thick: float = SLAT_M) -> Part:
        y0, y1 = (y + lean * (z - z0) / (z1 - z0) for z in (low, high))
        half = thick / 2
        return tapered(name, colour, (x0, y0 - half, x1, y0 + half), (x0, y1 - half, x1, y1 + half), low, high)

    if kind == "panel":
        return [piece("back", pad, -x, x, z0 + 0.12, z1 - 0.02, 0.03)]
    if kind == "ladder":
        rails = int(rng.integers(3, 5))
        pitch = (z1 - z0 - 0.1) / rails
        lows = [z0 + 0.1 + i * pitch + 0.04 for i in range(rails)]
        return [piece("slat", timber, -x, x, low, low + pitch - 0.05) for low in lows]
    count = int(rng.integers(3, 5)) if kind == "slats" else 6
    half = 0.021 if kind == "slats" else 0.007
    parts = [piece("back", timber, -x, x, z1 - 0.075, z1 - 0.01, 0.024)]
    for i in range(count):
        middle = -x + 2 * x * (i + 0.5) / count
        parts.append(piece("slat", timber, middle - half, middle + half, z0, z1 - 0.075, 0.014))
    return parts


def office_chair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A swivel chair: star foot on castors, gas lift, padded seat, back on an upright, armrests now and then."""
    cloth, metal = fabric(rng, style), Finish(pick(rng, style.metals))
    dark = shade(metal, 0.6)
    width, depth = draw(rng, (0.46, 0.5), fit), draw(rng, (0.44, 0.48), fit)
    seat_z, back_z = draw(rng, (0.44, 0.48)), draw(rng, (0.9, 1.06))
    reach, armed, low_back = draw(rng, (0.27, 0.31)), bool(rng.random() < 0.6), bool(rng.random() < 0.4)
    parts = []
    for i in range(STAR_ARMS):
        c, s = cos_sin(2 * math.pi * i / STAR_ARMS + math.pi / 2)
        parts.append(
            strip("foot", metal, (0.03 * c, 0.03 * s, 0.088), (reach * c, reach * s, 0.066), 0.042, 0.022, 0.7)
        )
        parts.append(rod("castor", dark, (reach * 0.95 * c, reach * 0.95 * s), 0.026, 0.0, 0.058, sides=8))
    parts += turned(
        "lift", dark, (0, 0), ((0.035, 0.078), (0.03, 0.24), (0.018, 0.24 + 0.01), (0.018, seat_z - 0.09)), 8
    )
    x, y = width / 2, depth / 2
    parts.append(block("frame", dark, (-0.1, -0.12, seat_z - 0.095), (0.1, y - 0.04, seat_z - 0.07)))
    parts.append(cushion("seat", cloth, (-x, -y, x, y), seat_z - 0.075, seat_z, "seat", 0.03))
    parts.append(block("upright", dark, (-0.035, y - 0.045, seat_z - 0.095), (0.035, y + 0.09, seat_z - 0.073)))
    parts.append(block("upright", dark, (-0.035, y + 0.064, seat_z - 0.073), (0.035, y + 0.09, seat_z + 0.32)))
    top = back_z if not low_back else seat_z + 0.42
    back = front_pad("back", cloth, (-x + 0.02, seat_z + 0.12, x - 0.02, top), y + 0.002, y + 0.066, None, 0.07, 0.03)
    parts.append(leaning(back, 0.006))
    if armed:
        for s in (-1, 1):
            x0, x1 = sorted((s * (x + 0.004), s * (x + 0.03)))
            parts.append(block("post", dark, (x0, 0.04, seat_z - 0.095), (x1, 0.085, seat_z + 0.19)))
            inner = sorted((s * 0.09, s * (x + 0.004)))
            parts.append(block("post", dark, (inner[0], 0.045, seat_z - 0.094), (inner[1], 0.08, seat_z - 0.074)))
            pad = (x0 - 0.012, -0.1, x1 + 0.012, 0.15)
            parts.append(slab("armrest", dark, pad, seat_z + 0.19, seat_z + 0.218, None, 0.02, 0.008))
    return centred(parts)


def stool(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A stool: a round or square seat on four legs, or an upholstered drum."""
    timber, cloth = wood(rng, style), fabric(rng, style)
    width, seat_z = draw(rng, size("stool").width_m, fit), draw(rng, (0.42, 0.47))
    half = width / 2
    kind = pick(rng, ("round", "square", "drum"))
    rect = (-half, -half, half, half)
    if kind == "drum":
        return centred([
            rod("base", timber, (0, 0), half - 0.03, 0.0, 0.03, sides=16),
            rod("body", cloth, (0, 0), half - 0.012, 0.03, seat_z - 0.06, sides=16),
            slab("seat", shade(cloth, 1.05, 3), rect, seat_z - 0.06, seat_z, "seat", half, 0.02, 4),
        ])  # fmt: skip
    inner = half * 0.72
    feet: Rect = (-inner, -inner, inner, inner)
    parts = four_legs(style, timber, feet, 0.036, seat_z - 0.036, 0.5)
    radius = half if kind == "round" else 0.05
    parts.append(slab("seat", timber, rect, seat_z - 0.036, seat_z, "seat", radius, 0.01, 4 if kind == "round" else 2))
    x0, y0, x1, y1 = leg_middles(style, feet, 0.036, seat_z - 0.036, 0.17, 0.5)
    reach = leg_half(style, 0.036, seat_z - 0.036, 0.17) - 0.005
    for y in (y0, y1):
        parts.append(strip("rail", timber, (x0 + reach, y, 0.17), (x1 - reach, y, 0.17), 0.012, 0.02))
    return centred(parts)


def bar_stool(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A high stool with a foot rest: four long legs, or a pillar on a plate; a low back now and then."""
    timber, cloth, metal = wood(rng, style), fabric(rng, style), Finish(pick(rng, style.metals))
    width, seat_z = draw(rng, (0.39, 0.44), fit), draw(rng, (0.62, 0.72))
    half = width / 2
    pillar, backed, padded = rng.random() < 0.4, rng.random() < 0.5, rng.random() < 0.5
    rect, under = (-half, -half, half, half), seat_z - 0.045
    if pillar:
        parts = [
            rod("base", metal, (0, 0), half, 0.0, 0.02, half * 0.94, 16),
            *turned("pole", metal, (0, 0), ((0.05, 0.02), (0.025, 0.06), (0.025, under)), 10),
            *_foot_ring(metal, 0.28),
        ]
    else:
        parts = four_legs(style, timber, rect, 0.034, under, 0.7)
        x0, y0, x1, y1 = leg_middles(style, rect, 0.034, under, 0.28, 0.7)
        reach = leg_half(style, 0.034, under, 0.28) - 0.006
        for y in (y0, y1):
            parts.append(pole("foot_rest", metal, (x0 + reach, y, 0.28), (x1 - reach, y, 0.28), 0.009, sides=6))
    seat = cloth if padded else timber
    parts.append(slab("seat", seat, rect, under, seat_z, "seat", 0.07 if not pillar else half, 0.012, 3))
    if backed:
        for s in (-1, 1):
            low, high = (s * 0.06 - 0.01, half - 0.012, seat_z - 0.035), (s * 0.06 + 0.01, half + 0.006, seat_z + 0.2)
            parts.append(block("post", metal, low, high))
        # At the rear edge, so that the seat before it holds a body.
        field = (-half + 0.03, seat_z + 0.09, half - 0.03, seat_z + 0.27)
        parts.append(front_pad("back", seat, field, half - 0.022, half))
    return centred(parts)


def _foot_ring(metal: Finish, z: float) -> list[Part]:
    """A hexagonal foot rest around a pillar, on two spokes."""
    corners: list[Point] = [(0.14 * c, 0.14 * s, z) for c, s in (cos_sin(math.pi * k / 3) for k in range(6))]
    ring = [pole("foot_rest", metal, corners[k - 1], corners[k], 0.008, sides=6) for k in range(6)]
    spokes = [strip("spoke", metal, (s * 0.02, 0.0, z), (s * 0.135, 0.0, z), 0.014, 0.012) for s in (-1, 1)]
    return [*ring, *spokes]


def bench(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bench without a back, with a seat place for every .55 m: on four legs or two trestles, padded now and then."""
    room = size("bench")
    timber, cloth = wood(rng, style), fabric(rng, style)
    width, depth, seat_z = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, (0.43, 0.47))
    x, y = width / 2, depth / 2
    padded, trestle = rng.random() < 0.4, rng.random() < 0.5
    board = seat_z - 0.05 if padded else seat_z
    parts: list[Part] = []
    if trestle:
        for s in (-1, 1):
            foot: Rect = (s * (x - 0.14) - 0.025, -y + 0.03, s * (x - 0.14) + 0.025, y - 0.03)
            top: Rect = (foot[0], -y + 0.08, foot[2], y - 0.08)
            parts.append(tapered("leg", timber, foot, top, 0.0, board - 0.04))
    else:
        parts += four_legs(style, timber, (-x + 0.05, -y + 0.02, x - 0.05, y - 0.02), 0.045, board - 0.04, 0.3)
    end = x - (0.16 if trestle else 0.12)
    parts.append(block("rail", timber, (-end, -0.015, board - 0.11), (end, 0.015, board - 0.04)))
    if padded:
        parts.append(slab("frame", timber, (-x, -y, x, y), board - 0.04, board, None, 0.02))
    places = int(width / BENCH_PLACE_M)
    for i in range(places):
        x0, x1 = -x + width * i / places, -x + width * (i + 1) / places
        parts.append(
            cushion("seat", cloth, (x0 + 0.004, -y + 0.004, x1 - 0.004, y - 0.004), board, seat_z, "seat")
            if padded
            else block("seat", timber, (x0, -y, seat_z - 0.04), (x1, y, seat_z), "seat")
        )
    return centred(parts)
