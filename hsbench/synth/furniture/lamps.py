"""Lamps: floor lamp, table lamp, ceiling lamp. The ceiling lamp hangs from its origin: its parts reach below z = 0."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, draw, pick, pole, rod, shade, tone, turned, wood
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Rgb, Style

SHADES: tuple[Rgb, ...] = ((240, 228, 200), (232, 218, 190), (244, 238, 222))
BULB = Finish((252, 244, 220))
CEILING_LAMPS = ("dish", "pendant", "arms")
"""Kinds of lamps under a ceiling: a flat dish, a pendant with a shade, arms with bulbs."""
SWITCH_SHARE = 0.4  # of the height of the body of a table lamp
TRIPOD = tuple(2 * math.pi * k / 3 + math.pi / 2 for k in range(3))


def _cloth(rng: np.random.Generator, style: Style) -> Finish:
    """A lampshade: mostly pale, sometimes in the colour of the room."""
    if rng.random() < 0.3:
        return tone(rng, Finish(pick(rng, style.accents)))
    return tone(rng, Finish(pick(rng, SHADES)))


def floor_lamp(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A floor lamp: pole on a round foot, tripod, or an arm with a small shade; conical or drum shade, switch."""
    room = size("floor_lamp")
    metal, cloth, timber = Finish(pick(rng, style.metals)), _cloth(rng, style), wood(rng, style)
    height, radius = draw(rng, (1.48, 1.8)), draw(rng, (room.width_m[0] / 2, 0.24), fit)
    tall = draw(rng, (0.24, 0.34))
    kind = pick(rng, ("pole", "pole", "tripod"))
    top = radius * (0.6 if style.lamp == "cone" else 0.95)
    low = height - tall
    parts = [rod("shade", cloth, (0, 0), radius, low, height, top, 20)]
    if kind == "pole":
        parts += [
            rod("base", metal, (0, 0), draw(rng, (0.13, 0.15)), 0.0, 0.025, 0.12, 16),
            *turned("pole", metal, (0, 0), ((0.03, 0.025), (0.012, 0.07), (0.012, low + 0.008)), 8),
            block("switch", shade(metal, 0.6), (-0.014, -0.03, 1.1), (0.014, -0.004, 1.14), "switch"),
        ]
        return centred(parts)
    spread, joint = radius * 0.92, low - 0.06
    for angle in TRIPOD:
        c, s = cos_sin(angle)
        parts.append(pole("leg", timber, (spread * c, spread * s, 0.012), (0.038 * c, 0.038 * s, joint + 0.03), 0.014))
        parts.append(rod("foot", shade(timber, 0.5), (spread * c, spread * s), 0.02, 0.0, 0.016, sides=8))
    parts += [
        rod("hub", metal, (0, 0), 0.035, joint, joint + 0.05, 0.03, 8),
        rod("pole", metal, (0, 0), 0.012, joint + 0.05, low + 0.008, sides=8),
        block("switch", shade(metal, 0.6), (-0.012, -0.052, joint + 0.01), (0.012, -0.03, joint + 0.04), "switch"),
    ]
    return centred(parts)


def table_lamp(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A lamp for a table: a turned or round body under a shade, or a desk lamp with a jointed arm."""
    room = size("table_lamp")
    metal, cloth = Finish(pick(rng, style.metals)), _cloth(rng, style)
    body = tone(rng, Finish(pick(rng, (*style.accents, *style.paints))))
    radius, height = draw(rng, (room.width_m[0] / 2, room.width_m[1] / 2), fit), draw(rng, (0.34, 0.52))
    kind = pick(rng, ("turned", "globe", "arm"))
    if kind == "arm":
        elbow, head = (0.0, 0.06, height * 0.72), (0.0, -0.07, height - 0.06)
        return centred([
            rod("base", metal, (0, 0), 0.09, 0.0, 0.02, 0.08, 16),
            pole("arm", metal, (0.0, 0.0, 0.016), elbow, 0.009, sides=6),
            pole("arm", metal, elbow, (0.0, head[1] + 0.026, head[2] + 0.05), 0.009, sides=6),
            pole("shade", body, (0.0, -0.056, head[2] + 0.05), (0.0, -0.12, head[2] - 0.05), 0.032, 2.0, 12),
            block("switch", shade(metal, 0.5), (-0.012, -0.062, 0.016), (0.012, -0.04, 0.028), "switch"),
        ])  # fmt: skip
    low = height * 0.55
    top = radius * (0.6 if style.lamp == "cone" else 0.9)
    if kind == "turned":
        profile = (
            (0.06, 0.0),
            (0.06, 0.02),
            (0.025, 0.05),
            (0.05, low * 0.5),
            (0.015, low * 0.82),
            (0.01, low + 0.008),
        )
    else:
        wide = min(0.085, radius * 0.8)
        profile = (
            (wide * 0.5, 0.0),
            (wide, low * 0.3),
            (wide, low * 0.55),
            (wide * 0.45, low * 0.8),
            (0.01, low * 0.9),
            (0.01, low + 0.008),
        )
    z = SWITCH_SHARE * low  # not so high that the shade is before it
    radii, heights = np.array(profile).T
    out = float(np.interp(z, heights, radii))
    return centred([
        *turned("base", body, (0, 0), profile, 12),
        rod("shade", cloth, (0, 0), radius, low, height, top, 16),
        block("switch", shade(metal, 0.6), (-0.007, -out - 0.012, z), (0.007, -out + 0.006, z + 0.02), "switch"),
    ])  # fmt: skip


def ceiling_lamp(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A lamp under the ceiling (z = 0 of its frame) of any kind; the smallest is a dish."""
    return ceiling_lamp_of(rng, style, CEILING_LAMPS if fit > 0 else CEILING_LAMPS[:1], fit)


def ceiling_lamp_of(
    rng: np.random.Generator, style: Style, kinds: tuple[str, ...], fit: float = 1.0
) -> tuple[Part, ...]:
    """A lamp of one of some ``CEILING_LAMPS``."""
    room = size("ceiling_lamp")
    metal, cloth = Finish(pick(rng, style.metals)), _cloth(rng, style)
    radius = draw(rng, (room.width_m[0] / 2, room.width_m[1] / 2), fit)
    kind = pick(rng, kinds)
    if kind == "dish":
        wide = min(radius, 0.24)
        return centred([
            rod("base", metal, (0, 0), wide * 0.9, -0.025, 0.0, sides=18),
            *turned("shade", BULB, (0, 0), ((wide * 0.6, -0.11), (wide * 0.92, -0.075), (wide, -0.02)), 20),
        ])  # fmt: skip
    drop = draw(rng, (0.38, 0.6))
    parts = [
        rod("base", metal, (0, 0), 0.05, -0.03, 0.0, 0.055, 12),
        rod("cable", shade(metal, 0.5), (0, 0), 0.006, -drop + 0.16, -0.03, sides=6),
    ]
    if kind == "pendant":
        wide = min(radius, 0.23)
        top = wide * (0.3 if style.lamp == "cone" else 0.92)
        parts.append(rod("shade", cloth, (0, 0), wide, -drop, -drop + 0.17, top, 20))
        parts.append(rod("bulb", BULB, (0, 0), 0.035, -drop - 0.02, -drop + 0.006, sides=10))
        return centred(parts)
    parts.append(rod("hub", metal, (0, 0), 0.03, -drop + 0.1, -drop + 0.17, sides=8))
    count, reach = 5, radius - 0.05
    for k in range(count):
        c, s = cos_sin(2 * math.pi * k / count)
        tip = (reach * c, reach * s, -drop + 0.07)
        parts.append(pole("arm", metal, (0.026 * c, 0.026 * s, -drop + 0.13), tip, 0.008, sides=6))
        parts.append(rod("bulb", BULB, tip[:2], 0.028, tip[2] - 0.05, tip[2] + 0.004, 0.045, 10))
    return centred(parts)
