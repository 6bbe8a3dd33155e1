"""What many pieces share: legs, handles, fronts of drawers and doors, the body of a cabinet, a tap."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import Part
from hsbench.synth.furniture.pieces import block, draw, front_shape, part, pole, rod, shade, slab
from hsbench.synth.furniture.shapes import Rect, loft, oval_outline, rectangle_outline
from hsbench.synth.furniture.style import Finish, Rgb, Style

GAP_M = 0.004  # the slit between cabinet fronts
FRONT_M = 0.018  # thickness of a cabinet front
HANDLE_DEPTH_M = 0.025
HANDLE_BAR_M = (0.14, 0.014)  # length, thickness
KNOB_M = 0.03
FINEST_LEG_M = 0.018
RECESS_M = 0.03  # a plinth stands back from its fronts
STEEL = Finish((188, 190, 192))


def leg(
    style: Style, colour: Rgb | Finish, xy: Sequence[float], thickness_m: float, z1_m: float,
    outward: Sequence[float] = (0, 0), splay: float = 1.0,
) -> Part:  # fmt: skip
    """A leg from the floor to ``z1_m`` whose top middle is at ``xy``; its foot stands out along ``outward`` (signs)."""
    share = max(FINEST_LEG_M, thickness_m * style.leg_taper) / thickness_m
    top = np.asarray(quantise_m(np.asarray(xy, dtype=np.float64)))
    foot = quantise_m(top + style.leg_splay_m * splay * np.asarray(outward))
    half = thickness_m / 2
    outline = oval_outline(half, half, 8) if style.leg == "round" else rectangle_outline((-half, -half, half, half))
    return part("leg", colour, loft([outline * min(1.0, share) + foot, outline + top], [0.0, z1_m]))


def four_legs(
    style: Style, colour: Rgb | Finish, rect: Rect, thickness_m: float, z1_m: float, splay: float = 1.0
) -> list[Part]:
    """A leg at each corner of a rectangle; neither tops nor splayed feet reach beyond it."""
    inset = thickness_m / 2 + style.leg_splay_m * splay
    x0, y0, x1, y1 = rect
    return [
        leg(style, colour, (x, y), thickness_m, z1_m, (sx, sy), splay)
        for x, sx in ((x0 + inset, -1), (x1 - inset, 1))
        for y, sy in ((y0 + inset, -1), (y1 - inset, 1))
    ]


def leg_middles(style: Style, rect: Rect, thickness_m: float, z1_m: float, z_m: float, splay: float = 1.0) -> Rect:
    """Where the legs of ``four_legs`` have their middle at a height: what stretchers between them need."""
    inset = thickness_m / 2 + style.leg_splay_m * splay * z_m / z1_m
    x0, y0, x1, y1 = rect
    return x0 + inset, y0 + inset, x1 - inset, y1 - inset


def leg_half(style: Style, thickness_m: float, z1_m: float, z_m: float) -> float:
    """Half the thickness of a leg at a height."""
    share = min(1.0, max(FINEST_LEG_M, thickness_m * style.leg_taper) / thickness_m)
    return thickness_m / 2 * (share + (1 - share) * z_m / z1_m)


def handle(style: Style, metal: Rgb | Finish, front: Rect, y_m: float, upright: bool = False, at: float = 0.5) -> Part:
    """A handle on a front given as x0, z0, x1, z1 at depth ``y_m``; ``at`` is its place across the front (0..1)."""
    x0, z0, x1, z1 = front
    x, z = x0 + (x1 - x0) * at, (z0 + z1) / 2
    if style.handle == "knob":
        outline = oval_outline(KNOB_M / 2, KNOB_M / 2, 8) + quantise_m(np.array([x, z]))
        return front_shape("handle", metal, outline, y_m - HANDLE_DEPTH_M, y_m, "handle", front_scale=0.8)
    if style.handle == "rail":
        half_x, half_z = (0.011, 0.4 * (z1 - z0)) if upright else (0.42 * (x1 - x0), 0.011)
        z = z if upright else z1 - 0.02
    else:
        length, thick = HANDLE_BAR_M
        length = min(length, 0.7 * (z1 - z0 if upright else x1 - x0))
        half_x, half_z = (thick / 2, length / 2) if upright else (length / 2, thick / 2)
    low, high = (x - half_x, y_m - HANDLE_DEPTH_M, z - half_z), (x + half_x, y_m, z + half_z)
    return block("handle", metal, low, high, "handle")


def drawers(
    style: Style, colour: Rgb | Finish, metal: Rgb | Finish, front: Rect, y_m: float, rows: int, columns: int
) -> list[Part]:
    """Rows x columns of drawer fronts with handles over x0, z0, x1, z1, standing out from depth ``y_m``."""
    parts = []
    for cell in cells(front, rows, columns):
        x0, z0, x1, z1 = cell
        parts.append(block("drawer", colour, (x0, y_m - FRONT_M, z0), (x1, y_m, z1), "drawer"))
        parts.append(handle(style, metal, cell, y_m - FRONT_M))
    return parts


def doors(
    style: Style, colour: Rgb | Finish, metal: Rgb | Finish, front: Rect, y_m: float, columns: int,
    hinged_left: bool = True,
) -> list[Part]:  # fmt: skip
    """A row of door fronts, the first hinged left or right, the next the other way, so that handles meet in pairs."""
    parts = []
    for i, cell in enumerate(cells(front, 1, columns)):
        x0, z0, x1, z1 = cell
        inset = 0.05 / (x1 - x0)
        at = 1 - inset if (i % 2 == 0) == hinged_left else inset
        parts.append(block("door", colour, (x0, y_m - FRONT_M, z0), (x1, y_m, z1), "door"))
        parts.append(handle(style, metal, cell, y_m - FRONT_M, upright=True, at=at))
    return parts


def cells(front: Rect, rows: int, columns: int) -> list[Rect]:
    """The fields of a front, row by row from below, with slits between them."""
    x0, z0, x1, z1 = front
    width, height = (x1 - x0) / columns, (z1 - z0) / rows
    half = GAP_M / 2
    return [
        (x0 + c * width + half, z0 + r * height + half, x0 + (c + 1) * width - half, z0 + (r + 1) * height - half)
        for r in range(rows)
        for c in range(columns)
    ]


def carcass(
    rng: np.random.Generator, style: Style, colour: Finish, rect: Rect, height_m: float
) -> tuple[list[Part], Rect, float]:
    """Legs or plinth, body and top of a cabinet on a footprint; then where its fronts go: x0, z0, x1, z1, and depth.

    The top reaches over the fronts.
    """
    x0, y0, x1, y1 = rect
    face = y0 + FRONT_M + 0.007
    if style.base == "legs":
        foot = draw(rng, (0.12, 0.18))
        parts = four_legs(style, colour, (x0 + 0.02, face, x1 - 0.02, y1 - 0.01), 0.042, foot, 0.5)
    else:
        foot = draw(rng, (0.05, 0.08))
        plinth = shade(colour, 0.75)
        parts = [block("plinth", plinth, (x0 + 0.02, face + RECESS_M, 0.0), (x1 - 0.02, y1 - 0.01, foot))]
    under = height_m - 0.024
    parts.append(block("body", shade(colour, 0.92), (x0 + 0.006, face, foot), (x1 - 0.006, y1 - 0.004, under)))
    parts.append(slab("top", colour, rect, under, height_m, "top", 0.012, 0.005, 1))
    return parts, (x0 + 0.008, foot + 0.006, x1 - 0.008, under - GAP_M), face


def tap(
    x: float, y: float, z: float, reach_m: float, height_m: float = 0.24, towards: tuple[int, int] = (0, -1)
) -> list[Part]:
    """An arched tap whose spout ends ``reach_m`` from its column, and a lever at its side.

    towards: direction of the spout along an axis. The hand goes to the spout's end: it has the role.
    """
    top = z + height_m
    dx, dy = towards
    arch = [(0.0, top - 0.06), (0.25, top), (0.75, top), (1.0, top - 0.06)]
    points = [(x + dx * reach_m * share, y + dy * reach_m * share, height) for share, height in arch]
    *bend, end = pairwise(points)
    inner, outer = ((x - dy * r, y + dx * r, z + h) for r, h in ((0.01, 0.06), (0.075, 0.085)))
    return [
        rod("column", STEEL, (x, y), 0.024, z, z + 0.02, sides=10),
        rod("stem", STEEL, (x, y), 0.013, z + 0.02, top - 0.06, sides=8),
        *(pole("spout", STEEL, a, b, 0.012, sides=6) for a, b in bend),
        pole("tap", STEEL, *end, 0.012, sides=6, role="tap"),
        pole("lever", STEEL, inner, outer, 0.008, 0.8, 6),
    ]
