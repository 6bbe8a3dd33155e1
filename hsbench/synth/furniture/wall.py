"""What hangs on the wall behind it (+y): mirror, picture, wall clock, radiator."""

from __future__ import annotations

import math

import numpy as np

from hsbench.geometry.transforms import cos_sin
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, centred, draw, front_shape, part, pick, rod, shade, strip, tone, wood
from hsbench.synth.furniture.shapes import Rect, loft, oval_outline, rectangle_outline, rounded_outline, towards_front
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Rgb, Style

EYE_M = 1.52  # middle of a picture above the floor
MIRROR = Finish((208, 218, 222))
PAPER = Finish((244, 241, 234))
DARK = Finish((40, 40, 44))
SKIES: tuple[Rgb, ...] = ((150, 180, 206), (214, 190, 160), (188, 200, 196), (226, 206, 190))
LANDS: tuple[Rgb, ...] = ((92, 120, 88), (150, 124, 88), (84, 100, 116), (170, 140, 110))


def mirror(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A mirror in a frame: rectangular, with round corners, or round; its middle at eye height."""
    room = size("mirror")
    timber, metal = wood(rng, style), Finish(pick(rng, style.metals))
    frame = timber if rng.random() < 0.5 else metal
    width, height = draw(rng, room.width_m, fit), draw(rng, (0.56, 0.9), fit)
    kind = pick(rng, ("rectangle", "rounded", "round"))
    if kind == "round":
        height = width = max(width, room.height_m[0])
    x, half = width / 2, height / 2
    middle = np.array([0.0, EYE_M])
    outer: Rect = (-x, EYE_M - half, x, EYE_M + half)
    rim = draw(rng, (0.018, 0.03))
    inner: Rect = (-x + rim, EYE_M - half + rim, x - rim, EYE_M + half - rim)
    if kind == "round":
        outlines = (oval_outline(x, half, 24) + middle, oval_outline(x - rim, half - rim, 24) + middle)
    elif kind == "rounded":
        outlines = (rounded_outline(outer, 0.12, 3), rounded_outline(inner, 0.12 - rim, 3))
    else:
        outlines = (rectangle_outline(outer), rectangle_outline(inner))
    return centred([
        front_shape("frame", frame, outlines[0], -0.004, 0.02),
        front_shape("glass", MIRROR, outlines[1], -0.008, 0.004),
    ])  # fmt: skip


def picture(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A framed picture with a mount: a landscape of three bands, blocks of colour, or a disc over a field."""
    room = size("picture")
    return picture_of(rng, rng, style, draw(rng, room.width_m, fit), draw(rng, room.height_m, fit))


def picture_of(
    frame_rng: np.random.Generator, rng: np.random.Generator, style: Style, width: float, height: float
) -> tuple[Part, ...]:
    """A picture of a size; ``frame_rng`` draws its frame and mount, ``rng`` what is painted."""
    frame = wood(frame_rng, style) if frame_rng.random() < 0.6 else pick(frame_rng, (DARK, PAPER))
    rim, mount = 0.02, draw(frame_rng, (0.0, 0.08)) * min(width, height) / 0.6
    x, half = width / 2, height / 2
    z0, z1 = EYE_M - half, EYE_M + half
    field: Rect = (-x + rim + mount, z0 + rim + mount, x - rim - mount, z1 - rim - mount)
    parts = [
        front_shape("frame", frame, rectangle_outline((-x, z0, x, z1)), -0.004, 0.018),
        front_shape("mount", PAPER, rectangle_outline((-x + rim, z0 + rim, x - rim, z1 - rim)), -0.007, 0.004),
    ]
    return centred([*parts, *_image(rng, style, field)])


def _image(rng: np.random.Generator, style: Style, field: Rect) -> list[Part]:
    """What is painted, in thin layers before the mount."""
    x0, z0, x1, z1 = field
    high = z1 - z0
    kind = pick(rng, ("landscape", "blocks", "disc"))
    colours = [tone(rng, Finish(pick(rng, style.accents))) for _ in range(3)]

    def layer(colour: Finish, rect: Rect, out: int) -> Part:
        return front_shape("image", colour, rectangle_outline(rect), -0.007 - 0.0015 * out, 0.004 - 0.0015 * out)

    if kind == "landscape":
        sky, land = Finish(pick(rng, SKIES)), tone(rng, Finish(pick(rng, LANDS)))
        split = z0 + high * draw(rng, (0.3, 0.55))
        hill = np.array(
            [[x0, split - 0.004], [x0 + (x1 - x0) * 0.7, split - 0.004], [x0 + (x1 - x0) * 0.34, split + high * 0.24]]
        )
        return [
            layer(sky, (x0, split, x1, z1), 1),
            layer(land, (x0, z0, x1, split), 1),
            part("image", shade(land, 0.82), towards_front(loft([hill, hill], [-0.001, 0.0105]))),
        ]
    if kind == "blocks":
        cut, level = x0 + (x1 - x0) * draw(rng, (0.3, 0.7)), z0 + high * draw(rng, (0.3, 0.7))
        return [
            layer(colours[0], (x0, z0, cut, z1), 1),
            layer(colours[1], (cut, z0, x1, level), 1),
            layer(colours[2], (cut, level, x1, z1), 1),
        ]
    radius = min(x1 - x0, high) * 0.26
    disc = oval_outline(radius, radius, 20) + np.array([round((x0 + x1) / 2, 4), round(z0 + high * 0.58, 4)])
    return [
        layer(shade(colours[0], 1.1, 20), field, 1),
        part("image", colours[1], towards_front(loft([disc, disc], [-0.001, 0.0105]))),
    ]


def wall_clock(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A round or square clock: rim, face, four marks and two hands."""
    radius = draw(rng, size("wall_clock").width_m, fit) / 2
    rim_colour = pick(rng, (Finish(pick(rng, style.metals)), wood(rng, style), DARK))
    face, ink = (PAPER, DARK) if rng.random() < 0.7 else (DARK, PAPER)
    centre = np.array([0.0, 1.8])
    square = rng.random() < 0.3
    box: Rect = (-radius, 1.8 - radius, radius, 1.8 + radius)
    inset = 0.018
    small: Rect = (box[0] + inset, box[1] + inset, box[2] - inset, box[3] - inset)
    outer = rounded_outline(box, 0.04) if square else oval_outline(radius, radius, 24) + centre
    inner = rounded_outline(small, 0.022) if square else oval_outline(radius - inset, radius - inset, 24) + centre
    parts = [
        front_shape("frame", rim_colour, outer, -0.006, 0.028),
        front_shape("face", face, inner, -0.009, 0.002),
    ]
    hours, minutes = int(rng.integers(12)), int(rng.integers(12))
    y = -0.0075
    for k in range(4):
        c, s = cos_sin(k * math.pi / 2)
        a, b = 0.7 * radius, 0.84 * radius
        parts.append(strip("mark", ink, (a * s, y, 1.8 + a * c), (b * s, y, 1.8 + b * c), 0.01, 0.01))
    for steps, reach, wide, out in ((hours + minutes / 12, 0.45, 0.014, 0.002), (minutes, 0.66, 0.01, 0.004)):
        c, s = cos_sin(2 * math.pi * steps / 12)
        tip = (reach * radius * s, y - out, 1.8 + reach * radius * c)
        parts.append(strip("hand", ink, (-0.02 * s, y - out, 1.8 - 0.02 * c), tip, wide, 0.01))
    return centred(parts)


def radiator(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A radiator before the wall: a flat panel with a grille, or a row of columns; a valve at one end."""
    room = size("radiator")
    colour = pick(rng, (Finish((242, 242, 240)), Finish((242, 242, 240)), Finish(pick(rng, style.paints))))
    width, height = draw(rng, room.width_m, fit), draw(rng, room.height_m)
    low, end = 0.12, pick(rng, (-1, 1))
    x, y = width / 2, 0.05
    z1 = low + height
    chrome = Finish((190, 193, 196))
    parts = [
        block("mount", colour, (s * x * 0.7 - 0.02, y - 0.03, low + 0.1), (s * x * 0.7 + 0.02, y, z1 - 0.1))
        for s in (-1, 1)
    ]
    if rng.random() < 0.5:
        parts.append(front_shape("panel", colour, rounded_outline((-x, low, x, z1), 0.015, 1), -y + 0.01, -y + 0.03))
        parts.append(
            block("fins", shade(colour, 0.85), (-x + 0.02, -y + 0.03, low + 0.02), (x - 0.02, y - 0.03, z1 - 0.012))
        )
        lines = max(3, round(width / 0.2))
        for k in range(1, lines):
            at = -x + width * k / lines
            parts.append(
                block(
                    "groove",
                    shade(colour, 0.93),
                    (at - 0.05, -y + 0.007, low + 0.05),
                    (at + 0.05, -y + 0.017, z1 - 0.05),
                )
            )
    else:
        count = max(6, round(width / 0.06))
        step = width / count
        for k in range(count):
            at = -x + step * (k + 0.5)
            outline = rounded_outline((at - step * 0.38, low, at + step * 0.38, z1), 0.018, 2)
            parts.append(front_shape("column", colour, outline, -y + 0.005, y - 0.028))
        for z in (low + 0.05, z1 - 0.09):
            parts.append(block("joint", shade(colour, 0.95), (-x + 0.02, 0.014, z), (x - 0.02, 0.034, z + 0.04)))
    at = end * (x + 0.02)
    parts.append(
        block(
            "pipe",
            chrome,
            (at - 0.025 - end * 0.006, -0.012, low + 0.06),
            (at + 0.025 - end * 0.006, 0.012, low + 0.084),
        )
    )
    parts.append(rod("valve", colour, (at, 0.0), 0.02, low + 0.082, low + 0.13, sides=10))
    return centred(parts)
