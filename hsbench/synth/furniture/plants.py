"""Potted plants of four kinds: broad leaves on stalks, a small tree, arching palm fronds, sword-shaped blades."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import centred, draw, part, pick, pole, rod, shade, tone, turned, wood
from hsbench.synth.furniture.shapes import Point, bar, rectangle_outline
from hsbench.synth.furniture.style import Finish, Rgb, Style

LEAVES: tuple[Rgb, ...] = ((84, 118, 74), (98, 130, 86), (70, 104, 78), (112, 134, 78))
SOIL, BARK = Finish((84, 66, 52)), Finish((118, 96, 70))
GOLDEN_RAD = math.radians(137.5)  # the angle from one leaf of a plant to the next
BLADE_M = 0.011  # thickness of a leaf


def plant(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A plant in a tapered, round or straight pot: broad-leaved, a small tree, a palm, or blades."""
    clay = tone(rng, Finish(pick(rng, (*style.accents, *style.paints))))
    leaf = tone(rng, Finish(pick(rng, LEAVES), pick(rng, style.leaf_textures)))
    radius, pot = draw(rng, (0.14, 0.18), fit), draw(rng, (0.22, 0.32))
    grow = pick(rng, (_broad, _palm, _blades, _tree))
    reach = draw(rng, (0.26, 0.42), fit)
    height = draw(rng, (0.3, 0.9))
    parts = [*_pot(rng, style, clay, radius, pot), rod("soil", SOIL, (0, 0), radius * 0.86, pot - 0.008, pot + 0.004)]
    return centred([*parts, *grow(rng, leaf, pot, height, reach)])


def _pot(rng: np.random.Generator, style: Style, clay: Finish, radius: float, height: float) -> list[Part]:
    kind = pick(rng, ("tapered", "round", "straight"))
    if kind == "tapered":
        return [
            rod("pot", clay, (0, 0), radius * 0.68, 0.0, height - 0.05, radius * 0.93, 16),
            rod("pot", clay, (0, 0), radius, height - 0.05, height, sides=16),
        ]
    if kind == "round":
        low = height * 0.45
        profile = ((radius * 0.6, 0.0), (radius, low), (radius * 0.9, height))
        return turned("pot", clay, (0, 0), profile, 16)
    timber, foot = wood(rng, style), 0.06
    legs = [rod("leg", timber, (0.6 * radius * a, 0.6 * radius * b), 0.014, 0.0, foot + 0.01, sides=6)
            for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1))]  # fmt: skip
    return [*legs, rod("pot", clay, (0, 0), radius * 0.96, foot, height, radius, 16)]


def _blade(name: str, leaf: Finish, start: Point, end: Point, wide: float, narrow: float) -> Part:
    """A flat leaf between two points, broader at the start."""
    half = wide / 2
    outline = rectangle_outline((-half, -BLADE_M / 2, half, BLADE_M / 2))
    # Only the width narrows: a leaf is as thin at its tip as at its stalk.
    solid = bar(start, end, outline, np.array([narrow, 1.0]))
    return part(name, leaf, solid)


def _leaf(leaf: Finish, stalk: Point, middle: Point, tip: Point, wide: float) -> list[Part]:
    """A leaf bent in the middle, where it is broadest."""
    return [_blade("leaf", leaf, middle, stalk, wide, 0.3), _blade("leaf", leaf, middle, tip, wide, 0.12)]


def _broad(rng: np.random.Generator, leaf: Finish, pot: float, height: float, reach: float) -> list[Part]:
    """Large bent leaves on thin stalks that rise from the soil."""
    parts, count = [], int(rng.integers(7, 11))
    for k in range(count):
        c, s = cos_sin(round(k * GOLDEN_RAD, 4))
        share = (k + 1) / count
        out, top = reach * (1.0 - 0.5 * share), pot + height * (0.4 + 0.6 * share)
        stalk, middle, tip = (
            (out * far * c, out * far * s, top + z) for far, z in ((0.4, -0.04), (0.75, 0), (1, -0.1))
        )
        foot: Point = (0.03 * c, 0.03 * s, pot - 0.005)
        parts.append(pole("stem", shade(leaf, 0.8), foot, stalk, 0.007, sides=5))
        parts += _leaf(shade(leaf, 0.86 + 0.22 * share), stalk, middle, tip, draw(rng, (0.13, 0.19)))
    return parts


def _tree(rng: np.random.Generator, leaf: Finish, pot: float, height: float, reach: float) -> list[Part]:
    """A stem with bent leaves all round its upper half, shorter and steeper towards the top."""
    crown, count = pot + max(0.45, height), int(rng.integers(13, 17))
    parts = [pole("stem", BARK, (0.0, 0.0, pot - 0.005), (0.0, 0.0, crown), 0.016, 0.7, 8)]
    for k in range(count):
        c, s = cos_sin(round(k * GOLDEN_RAD, 4))
        share = (k + 0.5) / count
        z, out = pot + (crown - pot) * (0.35 + 0.65 * share), reach * (0.85 - 0.45 * share)
        rise = 0.04 + 0.14 * share
        stalk, middle, tip = (
            (out * far * c, out * far * s, z + up) for far, up in ((0.04, 0), (0.6, rise), (1, rise * 0.6))
        )
        green = shade(leaf, 0.82 + 0.3 * float(rng.random()))
        parts += _leaf(green, stalk, middle, tip, draw(rng, (0.09, 0.13)))
    return parts


def _palm(rng: np.random.Generator, leaf: Finish, pot: float, height: float, reach: float) -> list[Part]:
    """A stem, and fronds of three pieces each that rise, arch and hang."""
    stem = pot + height * 0.55
    parts = [pole("stem", BARK, (0.0, 0.0, pot - 0.005), (0.0, 0.0, stem + 0.02), 0.028, 0.7, 8)]
    count = int(rng.integers(9, 12))
    for k in range(count):
        c, s = cos_sin(round(k * GOLDEN_RAD, 4))
        lift, far = draw(rng, (0.14, 0.34)), reach * draw(rng, (0.85, 1.1))
        arch = ((0.01, 0.0), (0.35, lift), (0.72, lift * 0.9), (1.0, lift * 0.35))
        points = [(far * a * c, far * a * s, stem + z) for a, z in arch]
        green = shade(leaf, 0.86 + 0.26 * float(rng.random()))
        for (a, b), (wide, narrow) in zip(pairwise(points), ((0.03, 2.2), (0.066, 0.8), (0.053, 0.25)), strict=True):
            parts.append(_blade("leaf", green, a, b, wide, narrow))
    return parts


def _blades(rng: np.random.Generator, leaf: Finish, pot: float, height: float, reach: float) -> list[Part]:
    """Sword-shaped blades from the soil, the outer ones shorter and leaning out."""
    parts, count = [], int(rng.integers(12, 17))
    for k in range(count):
        c, s = cos_sin(round(k * GOLDEN_RAD, 4))
        share = math.sqrt((k + 0.5) / count)
        out, tall = reach * 0.55 * share, height * (1.05 - 0.4 * share)
        foot: Point = (0.055 * share * c, 0.055 * share * s, pot - 0.008)
        green = shade(leaf, 0.85 + 0.3 * float(rng.random()))
        parts.append(_blade("leaf", green, foot, (out * c, out * s, pot + tall), 0.055, 0.3))
    return parts
