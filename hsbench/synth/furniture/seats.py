"""Things to sit on: sofa, armchair, chair, office chair, stool, bench. Seats are .40-.48 m high and face -y."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.convex import regular_outline
from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    cushion,
    draw,
    four_legs,
    pick,
    prism,
    rod,
    shade,
    tapered,
    tone,
)
from hsbench.synth.furniture.style import Rgb, Style

SOFA_SEATS = (2, 3)
STAR_ARMS = 5
SLAT_M = 0.03


def sofa(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A sofa of two or three seats: upholstered base, a cushion a seat, leaning back cushions, arms and feet."""
    seats = SOFA_SEATS[0] if fit < 1.0 else pick(rng, SOFA_SEATS)
    return _upholstered(rng, style, seats, draw(rng, (0.58, 0.7), fit), fit)


def armchair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A one-seat sofa."""
    return _upholstered(rng, style, 1, draw(rng, (0.52, 0.62), fit), fit)


def _upholstered(rng: np.random.Generator, style: Style, seats: int, seat_width: float, fit: float) -> tuple[Part, ...]:
    colour = tone(rng, pick(rng, style.fabrics))
    light = shade(colour, 1.06, 4)
    wood = tone(rng, pick(rng, style.woods))
    arm = draw(rng, style.arm_width_m)
    feet = draw(rng, (0.08, 0.13))
    seat_z = draw(rng, (0.42, 0.46))
    seat_depth = draw(rng, (0.52, 0.58))
    back = draw(rng, (0.2, 0.25))
    back_z = draw(rng, (0.78, 0.9))
    arm_z = seat_z + draw(rng, style.arm_height_m)
    lean = min(draw(rng, style.back_lean_m), back - 0.1)
    base_z = seat_z - draw(rng, (0.13, 0.16))
    half, front, rear = seats * seat_width / 2, -(seat_depth + back) / 2, (seat_depth + back) / 2
    y_back = rear - back
    parts = four_legs(style, wood, (-half - arm, front, half + arm, rear), 0.05, feet, 0.3)
    parts.append(block("base", shade(colour, 0.94), (-half, front, feet), (half, rear, base_z)))
    for i in range(seats):
        x0, x1 = -half + i * seat_width, -half + (i + 1) * seat_width
        parts += cushion("seat", light, (x0 + 0.003, front, x1 - 0.003, y_back), base_z, seat_z, "seat")
        bottom, top = (x0 + 0.004, y_back, x1 - 0.004, rear - 0.06), (x0 + 0.02, y_back + lean, x1 - 0.02, rear - 0.05)
        parts.append(tapered("back_cushion", light, bottom, top, seat_z, back_z - 0.01))
    frame = (-half, rear - 0.08, half, rear)
    parts.append(tapered("back", colour, frame, (-half, rear - 0.05, half, rear), base_z, back_z))
    for x0, x1 in ((-half - arm, -half), (half, half + arm)):
        parts.append(block("armrest", colour, (x0, front, feet), (x1, rear, arm_z - 0.02)))
        inner = (x0 + 0.012, front + 0.012, x1 - 0.012, rear - 0.012)
        parts.append(tapered("armrest", colour, (x0, front, x1, rear), inner, arm_z - 0.02, arm_z))
    return centred(parts)


def chair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A chair: tapered legs, wooden or padded seat, leaning rear posts, a back of slats, rails, bars or a panel."""
    wood = tone(rng, pick(rng, style.woods))
    width, depth = draw(rng, (0.42, 0.47), fit), draw(rng, (0.42, 0.46), fit)
    seat_z, back_z = draw(rng, (0.44, 0.47)), draw(rng, (0.82, 0.95))
    thick, post = draw(rng, (0.04, 0.05)), draw(rng, (0.03, 0.04))
    lean = draw(rng, style.back_lean_m)
    padded = bool(rng.random() < 0.5)
    pad = tone(rng, pick(rng, style.fabrics))
    x, y = width / 2, depth / 2
    parts = four_legs(style, wood, (-x, -y, x, y), post, seat_z - thick, 0.5)
    if padded:
        parts.append(block("seat_frame", wood, (-x, -y, seat_z - thick), (x, y, seat_z - thick + 0.015)))
        parts += cushion("seat", pad, (-x, -y, x, y), seat_z - thick + 0.015, seat_z, "seat", 0.012)
    else:
        parts.append(block("seat", wood, (-x, -y, seat_z - thick), (x, y, seat_z), "seat"))
    for x0 in (-x, x - post):
        bottom = (x0, y - post, x0 + post, y)
        top = (x0, y - post + lean, x0 + post, y + lean)
        parts.append(tapered("post", wood, bottom, top, seat_z, back_z))
    parts += _back(rng, style, pad if padded else wood, (x - post, y, lean), seat_z, back_z)
    return centred(parts)


def _back(
    rng: np.random.Generator, style: Style, colour: Rgb, place: tuple[float, float, float], z0: float, z1: float
) -> list[Part]:
    """What stands between leaning posts; place: half the clear width, rear edge at the seat, lean over the height."""
    x, y, lean = place
    kind = pick(rng, style.chair_backs)
    thick = 0.02

    def piece(name: str, x0: float, x1: float, low: float, high: float) -> Part:
        y0, y1 = (y - 0.006 + lean * (z - z0) / (z1 - z0) for z in (low, high))
        return tapered(name, colour, (x0, y0 - thick, x1, y0), (x0, y1 - thick, x1, y1), low, high)

    if kind == "panel":
        return [piece("back", -x, x, z0 + 0.1, z1)]
    if kind == "ladder":
        rails = int(rng.integers(3, 5))
        pitch = (z1 - z0 - 0.1) / rails
        return [piece("slat", -x, x, z0 + 0.1 + i * pitch + 0.04, z0 + 0.1 + (i + 1) * pitch) for i in range(rails)]
    count = int(rng.integers(3, 5)) if kind == "slats" else 6
    slat = SLAT_M * 1.4 if kind == "slats" else 0.014
    rail = z1 - 0.06
    parts = [piece("rail", -x, x, rail, z1)]
    for i in range(count):
        middle = -x + 2 * x * (i + 0.5) / count
        parts.append(piece("slat", middle - slat / 2, middle + slat / 2, z0, rail))
    return parts


def office_chair(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A swivel chair: star foot on castors, gas lift, padded seat, back on an upright, armrests now and then."""
    fabric, metal = tone(rng, pick(rng, style.fabrics)), pick(rng, style.metals)
    dark = shade(metal, 0.7)
    width, depth = draw(rng, (0.45, 0.49), fit), draw(rng, (0.43, 0.47), fit)
    seat_z, back_z = draw(rng, (0.44, 0.48)), draw(rng, (0.9, 1.02))
    reach = draw(rng, (0.27, 0.3))
    parts = []
    for i in range(STAR_ARMS):
        c, s = cos_sin(2 * math.pi * i / STAR_ARMS + math.pi / 2)
        along, across = np.array([c, s]), np.array([-s, c])
        outline = [0.02 * along - 0.025 * across, reach * along - 0.016 * across,
                   reach * along + 0.016 * across, 0.02 * along + 0.025 * across]  # fmt: skip
        parts.append(prism("foot", metal, np.array(outline), 0.05, 0.085))
        parts.append(rod("castor", dark, (reach * 0.94 * along).tolist(), 0.025, 0.0, 0.055, sides=8))
    parts.append(rod("lift", metal, (0, 0), 0.028, 0.06, seat_z - 0.08))
    x, y = width / 2, depth / 2
    parts.append(block("seat_frame", dark, (-x + 0.05, -y + 0.05, seat_z - 0.1), (x - 0.05, y - 0.05, seat_z - 0.06)))
    parts += cushion("seat", fabric, (-x, -y, x, y), seat_z - 0.06, seat_z, "seat")
    parts.append(block("upright", dark, (-0.04, y - 0.06, seat_z - 0.09), (0.04, y + 0.07, seat_z - 0.06)))
    parts.append(block("upright", dark, (-0.04, y + 0.05, seat_z - 0.09), (0.04, y + 0.075, seat_z + 0.3)))
    lower, upper = (-x + 0.03, y, x - 0.03, y + 0.05), (-x + 0.06, y + 0.03, x - 0.06, y + 0.07)
    parts.append(tapered("back", fabric, lower, upper, seat_z + 0.12, back_z))
    if rng.random() < 0.5:
        for x0 in (-x - 0.03, x - 0.01):
            parts.append(block("armrest", dark, (x0, -0.08, seat_z + 0.19), (x0 + 0.04, 0.18, seat_z + 0.22)))
            parts.append(block("armrest", dark, (x0 + 0.005, 0.02, seat_z - 0.05), (x0 + 0.035, 0.07, seat_z + 0.19)))
    return centred(parts)


def stool(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A stool: a round or square seat on four legs, or a padded drum."""
    wood, fabric = tone(rng, pick(rng, style.woods)), tone(rng, pick(rng, style.fabrics))
    size, seat_z = draw(rng, (0.38, 0.44), fit), draw(rng, (0.42, 0.47))
    half = size / 2
    kind = pick(rng, ("round", "square", "drum"))
    if kind == "drum":
        return (
            rod("base", fabric, (0, 0), half, 0.0, seat_z - 0.05, sides=16),
            rod("seat", shade(fabric, 1.05, 3), (0, 0), half, seat_z - 0.05, seat_z, half - 0.015, 16, "seat"),
        )
    inner = half * 0.7
    parts = four_legs(style, wood, (-inner, -inner, inner, inner), 0.035, seat_z - 0.035, 0.5)
    if kind == "round":
        parts.append(prism("seat", wood, regular_outline(half, 16), seat_z - 0.035, seat_z, "seat"))
    else:
        parts.append(block("seat", wood, (-half, -half, seat_z - 0.035), (half, half, seat_z), "seat"))
    return centred(parts)


def bench(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A bench without a back, on two trestles, with a seat place for every .55 m."""
    wood = tone(rng, pick(rng, style.woods))
    width, depth, seat_z = draw(rng, (1.1, 1.5), fit), draw(rng, (0.36, 0.42), fit), draw(rng, (0.43, 0.47))
    x, y = width / 2, depth / 2
    parts = four_legs(style, wood, (-x + 0.06, -y + 0.02, x - 0.06, y - 0.02), 0.045, seat_z - 0.04, 0.3)
    places = int(width / 0.55)
    for i in range(places):
        x0, x1 = -x + width * i / places, -x + width * (i + 1) / places
        parts.append(block("seat", wood, (x0, -y, seat_z - 0.04), (x1, y, seat_z), "seat"))
    parts.append(block("rail", wood, (-x + 0.12, -0.02, seat_z - 0.1), (x - 0.12, 0.02, seat_z - 0.04)))
    return centred(parts)
