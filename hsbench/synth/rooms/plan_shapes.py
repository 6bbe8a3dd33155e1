"""Outlines of single rooms: rectangle, L, T, or a rectangle with a niche or a pier; drawn in whole centimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hsbench.synth.rooms.regions import Rect
from hsbench.synth.rooms.room_kinds import ROOM_KINDS, Range

CM = 10  # plans are drawn in whole centimetres, given in millimetres
SHAPES = ("rectangle", "l", "t", "niche")
L_SHARE, T_SHARE = (0.28, 0.45), (0.2, 0.3)  # of a side, cut off by the corner of an L, by each of a T
CUT_DEPTH_SHARE = (0.28, 0.42)
LEAST_CUT_MM, LEAST_LIMB_MM = 600, 1500  # a smaller cut is not worth a corner; what is left must hold furniture
NICHE_M, PIER_M = ((1.3, 2.2), (0.4, 0.9)), ((0.5, 1.1), (0.25, 0.5))  # width, depth
NICHE_SIDE_MM = 400  # least wall on either side of a niche
NICHE_RATHER_THAN_PIER = 0.6
CORNER_PIER_SHARE, PIER_PLACE = 0.4, (0.3, 0.7)  # of piers in a corner; where along the wall the others stand


@dataclass(frozen=True)
class Shape:
    """A room as rectangles without cuts, and the rectangles that its building follows, millimetres."""

    rects: tuple[Rect, ...]
    cuts: tuple[Rect, ...]
    body: tuple[Rect, ...]


def draw_size(rng: np.random.Generator, room_type: str, width_m: Range | None, depth_m: Range | None) -> Range:
    """Width and depth in metres for a room of a type; given ranges replace what is usual for it."""
    kind = ROOM_KINDS[room_type]
    area, ratio = _between(rng, kind.area_m2), _between(rng, (1.0, kind.slender))
    depth = max(kind.side_m, math.sqrt(area / ratio))
    width = area / depth
    if rng.random() < 0.5:
        width, depth = depth, width
    if width_m is not None:
        width = _between(rng, width_m)
    if depth_m is not None:
        depth = _between(rng, depth_m)
    return width, depth


def draw_shape(rng: np.random.Generator, kind: str, width_m: float, depth_m: float) -> Shape:
    """A room of a shape about as large as width x depth, turned at random; a rectangle where it is too small."""
    w, d = _mm(width_m), _mm(depth_m)
    if kind == "niche":
        shape = _niche(rng, w, d) if rng.random() < NICHE_RATHER_THAN_PIER else _pier(rng, w, d)
    else:
        shape = _cut(rng, w, d, corners={"l": 1, "t": 2}.get(kind, 0))
    return _turned(rng, shape)


def _cut(rng: np.random.Generator, w: int, d: int, corners: int) -> Shape:
    """A rectangle without one corner (L) or both of a side (T), grown so that its area stays about the same."""
    if not corners:
        return _plain(w, d)
    share = _between(rng, L_SHARE if corners == 1 else T_SHARE)
    deep = _between(rng, CUT_DEPTH_SHARE)
    grown = math.sqrt(1 / (1 - corners * share * deep))
    w, d = _mm(w * grown / 1000), _mm(d * grown / 1000)
    across = min(_mm(share * w / 1000), (w - LEAST_LIMB_MM) // corners // CM * CM)
    depth = min(_mm(deep * d / 1000), d - LEAST_LIMB_MM)
    if min(across, depth) < LEAST_CUT_MM:
        return _plain(w, d)
    cuts: tuple[Rect, ...] = ((w - across, d - depth, w, d), (0, d - depth, across, d))[:corners]
    left = across if corners == 2 else 0
    body: tuple[Rect, ...] = ((0, 0, w, d - depth), (left, 0, w - across, d))
    return Shape(body, cuts, body)


def _niche(rng: np.random.Generator, w: int, d: int) -> Shape:
    """An alcove in the far wall."""
    wide, deep = (_mm(_between(rng, sizes)) for sizes in NICHE_M)
    if wide + 2 * NICHE_SIDE_MM > w:
        return _plain(w, d)
    x = NICHE_SIDE_MM + _mm((w - wide - 2 * NICHE_SIDE_MM) / 1000 * rng.random())
    return Shape(((0, 0, w, d), (x, d, x + wide, d + deep)), (), ((0, 0, w, d + deep),))


def _pier(rng: np.random.Generator, w: int, d: int) -> Shape:
    """A chimney or shaft that stands out of the far wall or fills its corner."""
    wide, deep = (_mm(_between(rng, sizes)) for sizes in PIER_M)
    x = 0 if rng.random() < CORNER_PIER_SHARE else _mm((w - wide) / 1000 * _between(rng, PIER_PLACE))
    return Shape(((0, 0, w, d),), ((x, d - deep, x + wide, d),), ((0, 0, w, d),))


def _plain(w: int, d: int) -> Shape:
    return Shape(((0, 0, w, d),), (), ((0, 0, w, d),))


def _turned(rng: np.random.Generator, shape: Shape) -> Shape:
    swap, flip_x, flip_y = (bool(b) for b in rng.random(3) < 0.5)

    def turned(rects: tuple[Rect, ...]) -> tuple[Rect, ...]:
        return tuple(turn(r, swap, flip_x, flip_y) for r in rects)

    return Shape(turned(shape.rects), turned(shape.cuts), turned(shape.body))


def turn(rect: Rect, swap: bool, flip_x: bool, flip_y: bool) -> Rect:
    """A rectangle mirrored at the axes and at the diagonal."""
    x0, y0, x1, y1 = rect
    if flip_x:
        x0, x1 = -x1, -x0
    if flip_y:
        y0, y1 = -y1, -y0
    return (y0, x0, y1, x1) if swap else (x0, y0, x1, y1)


def _mm(metres: float) -> int:
    """Whole centimetres, in millimetres."""
    return round(metres * 100) * CM


def _between(rng: np.random.Generator, sizes: Range) -> float:
    return float(sizes[0] + (sizes[1] - sizes[0]) * rng.random())
