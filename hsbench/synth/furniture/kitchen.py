"""The kitchen line: counter, wall cabinet, island, stove, dishwasher, fridge, hood. Closed, hence solid, but for sinks.

All units of one room share front colour, worktop, height (``Style.worktop_m``) and depth, so that they can stand side
by side with flush fronts and tops: the worktop reaches ``OVERHANG_M`` over the fronts.
"""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import Part
from hsbench.synth.furniture.fittings import FRONT_M, STEEL, doors, drawers, handle, tap
from hsbench.synth.furniture.pieces import (
    block,
    centred,
    draw,
    front_shape,
    pick,
    ring,
    rod,
    shade,
    slab,
    tapered,
)
from hsbench.synth.furniture.shapes import Rect, oval_outline, rectangle_outline, rounded_outline
from hsbench.synth.furniture.sizes import size
from hsbench.synth.furniture.style import Finish, Style

DEPTH_M = 0.62  # of a unit with its worktop (60 cm module of EN 1116 and the overhang)
OVERHANG_M = 0.02
WORKTOP_M = 0.035
PLINTH_M = 0.1
MODULE_M = 0.6  # width of an oven or a sink
CUPBOARD_M, LEAST_CUPBOARD_M = 0.5, 0.3  # about, and at least, the width of a cupboard between them
MOST_CUPBOARDS = 4  # wider counters have wider ones
SINK_DEPTH_M = 0.16
SINK_WALL_M = 0.012
OVER_WORKTOP_M = 0.5  # from worktop to wall cabinets
HOOD_OVER_WORKTOP_M = 0.62
BLACK = Finish((34, 34, 38))
GLASS, FROSTED = Finish((58, 62, 68)), Finish((172, 184, 188))
WHITE = Finish((240, 240, 238))
FACE_Y_M = -DEPTH_M / 2 + OVERHANG_M + FRONT_M  # where bodies end and fronts begin


def kitchen_counter(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A counter for a wall with a sink, and a hob over an oven where it is wide enough."""
    width = draw(rng, size("kitchen_counter").width_m, fit)
    return kitchen_counter_of(rng, style, width, sink=True, hob=width >= 3 * MODULE_M)


def kitchen_counter_of(
    rng: np.random.Generator, style: Style, width_m: float, sink: bool = False, hob: bool = False
) -> tuple[Part, ...]:
    """A run of base units of a given width under one worktop: cupboards and drawers, a sink, a hob over an oven.

    Raises SchemaError where the width holds fewer modules of .6 m than sink and hob need (.3 m without both).
    """
    need = max(LEAST_CUPBOARD_M, MODULE_M * (sink + hob))
    if width_m < need - 1e-9:
        raise SchemaError(f"kitchen counter is {width_m:.2f} m wide; expected at least {need:.2f} for sink and hob")
    paint, stone, metal = front_finish(style), worktop_finish(style), Finish(style.metals[0])
    height = draw(rng, style.worktop_m)
    x, y, under = width_m / 2, DEPTH_M / 2, height - WORKTOP_M
    order = _modules(rng, width_m, sink, hob)
    parts = [block("plinth", BLACK, (-x + 0.002, FACE_Y_M + 0.04, 0.0), (x - 0.002, y - 0.002, PLINTH_M))]
    at = solid_from = -x
    hole: Rect | None = None
    for kind, width in order:
        end = at + width
        front: Rect = (at, PLINTH_M + 0.01, end, under - 0.006)
        if kind == "sink":
            hole = (at + 0.07, -y + 0.09, end - 0.07, y - 0.12)
            parts += _sink(paint, (at, FACE_Y_M, end, y - 0.004), hole, height)
            if at > solid_from:
                parts.append(_body(paint, solid_from, at, under))
            solid_from = end
            parts += doors(style, paint, metal, front, FACE_Y_M, 2 if width > 0.5 else 1)
        elif kind == "hob":
            parts += _oven(front, FACE_Y_M)
            parts += _hob((at + 0.02, -y + 0.07, end - 0.02, y - 0.07), height)
        elif kind == "drawers":
            parts += drawers(style, paint, metal, front, FACE_Y_M, 3, 1)
        else:
            parts += doors(style, paint, metal, front, FACE_Y_M, 1 if width < 0.62 else 2)
        at = end
    if solid_from < x - 1e-9:
        parts.append(_body(paint, solid_from, x, under))
    return centred([*parts, *_worktop(stone, x, under, height, hole)])


def front_finish(style: Style) -> Finish:
    """Colour of the kitchen fronts of a room."""
    return Finish(style.paints[0])


def worktop_finish(style: Style) -> Finish:
    """Stone where the room's style has one, else its first wood."""
    if style.stone_textures[0]:
        return Finish(shade(style.walls[0], 0.8), style.stone_textures[0])
    return Finish(style.woods[0], style.wood_textures[0])


def _modules(rng: np.random.Generator, width: float, sink: bool, hob: bool) -> list[tuple[str, float]]:
    """(kind, width) from left to right: sink and hob apart from each other, drawers and cupboards in turn elsewhere."""
    fixed = [kind for kind, wanted in (("sink", sink), ("hob", hob)) if wanted]
    if rng.random() < 0.5:
        fixed.reverse()
    rest = width - MODULE_M * len(fixed)
    count = min(round(rest / CUPBOARD_M), MOST_CUPBOARDS) if rest >= LEAST_CUPBOARD_M else 0
    first = int(rng.integers(2))
    fillers = [(("drawers", "doors")[(i + first) % 2], rest / count) for i in range(count)]
    modules = [(kind, MODULE_M if count else width / len(fixed)) for kind in fixed]
    if len(modules) == 2:
        cut = count // 2 + 1
        return [modules[0], *fillers[:cut], modules[1], *fillers[cut:]]
    cut = int(rng.integers(count + 1))
    return [*fillers[:cut], *modules, *fillers[cut:]]


def _body(paint: Finish, x0: float, x1: float, under: float) -> Part:
    return block("body", shade(paint, 0.9), (x0, FACE_Y_M, PLINTH_M), (x1, DEPTH_M / 2 - 0.004, under))


def _worktop(stone: Finish, x: float, z0: float, z1: float, hole: Rect | None) -> list[Part]:
    """One board, or four around the hole of a sink; those beside it are to work on."""
    y = DEPTH_M / 2
    if hole is None:
        return [block("top", stone, (-x, -y, z0), (x, y, z1), "top")]
    a0, b0, a1, b1 = hole
    return [
        *(block("top", stone, (p, -y, z0), (q, y, z1), "top") for p, q in ((-x, a0), (a1, x))),
        *(block("edge", stone, (a0, p, z0), (a1, q, z1)) for p, q in ((-y, b0), (b1, y))),
    ]


def _sink(paint: Finish, body: Rect, hole: Rect, z: float) -> list[Part]:
    """A steel basin that hangs in the hole, a body around it, and a tap behind."""
    x0, y0, x1, y1 = hole
    floor = z - WORKTOP_M - SINK_DEPTH_M
    inner = (x0 + SINK_WALL_M, y0 + SINK_WALL_M, x1 - SINK_WALL_M, y1 - SINK_WALL_M)
    colour = shade(paint, 0.9)
    return [
        block("body", colour, (body[0], body[1], PLINTH_M), (body[2], body[3], floor)),
        *ring("body", colour, body, hole, floor, z - WORKTOP_M),
        *ring("basin", STEEL, hole, inner, floor, z + 0.004),
        block("basin", shade(STEEL, 0.85), (inner[0], inner[1], floor), (inner[2], inner[3], floor + SINK_WALL_M)),
        *tap((x0 + x1) / 2, y1 + 0.05, z, 0.17),
    ]


def _hob(rect: Rect, z: float) -> list[Part]:
    """A glass plate with four rings."""
    x0, y0, x1, y1 = rect
    parts = [slab("hob", BLACK, rect, z, z + 0.012, "front", 0.02)]
    for at, radius in (((0.27, 0.3), 0.085), ((0.73, 0.3), 0.07), ((0.27, 0.74), 0.07), ((0.73, 0.74), 0.085)):
        x, y = x0 + (x1 - x0) * at[0], y0 + (y1 - y0) * at[1]
        parts.append(rod("plate", shade(BLACK, 1.0, 34), (x, y), radius, z + 0.004, z + 0.0145, sides=16))
    return parts


def _oven(front: Rect, face: float) -> list[Part]:
    """A panel with four knobs above a glass door with a bar, and a drawer below."""
    x0, z0, x1, z1 = front
    a, b, y = x0 + 0.003, x1 - 0.003, face - FRONT_M
    split = z1 - 0.11
    pane = rounded_outline((a + 0.08, z0 + 0.19, b - 0.08, split - 0.13), 0.02)
    parts = [
        block("panel", STEEL, (a, y, split + 0.004), (b, face, z1)),
        block("front", BLACK, (a, y, z0 + 0.11), (b, face, split), "front"),
        front_shape("window", GLASS, pane, y - 0.002, y + 0.01),
        block("drawer", BLACK, (a, y, z0), (b, face, z0 + 0.106)),
        block("handle", STEEL, (a + 0.06, y - 0.04, split - 0.07), (b - 0.06, y - 0.026, split - 0.052), "handle"),
    ]
    for at in (a + 0.09, b - 0.1):
        parts.append(block("mount", STEEL, (at, y - 0.026, split - 0.068), (at + 0.012, y, split - 0.054)))
    for k in range(4):
        middle = quantise_m(np.array([x0 + (x1 - x0) * (k + 0.5) / 4, (split + z1) / 2]))
        parts.append(front_shape("knob", BLACK, oval_outline(0.018, 0.018, 8) + middle, y - 0.026, y, "switch", 0.85))
    return parts


def stove(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A free-standing cooker: oven door, four knobs, a hob of plates or burners under grates, a splash-back."""
    colour = pick(rng, (WHITE, STEEL, BLACK))
    width, height = draw(rng, (0.5, 0.6), fit), draw(rng, style.worktop_m)
    gas, splash = rng.random() < 0.5, rng.random() < 0.4
    x, y = width / 2, DEPTH_M / 2
    top = height - 0.012
    parts = [
        block("plinth", BLACK, (-x + 0.02, FACE_Y_M + 0.03, 0.0), (x - 0.02, y - 0.01, 0.05)),
        block("body", shade(colour, 0.93), (-x, FACE_Y_M, 0.05), (x, y - 0.004, top - 0.02)),
        slab("top", colour, (-x, -y + OVERHANG_M, x, y), top - 0.02, top, None, 0.012),
        *_oven((-x, 0.06, x, top - 0.024), FACE_Y_M),
    ]
    rect: Rect = (-x + 0.02, -y + 0.07, x - 0.02, y - 0.05)
    parts += _burners(rect, top) if gas else _hob(rect, top)
    if splash:
        parts.append(block("splash", colour, (-x, y - 0.03, top), (x, y, top + 0.06)))
    return centred(parts)


def _burners(rect: Rect, z: float) -> list[Part]:
    """Four gas burners, each below a cross of bars."""
    x0, y0, x1, y1 = rect
    parts = [slab("hob", BLACK, rect, z - 0.005, z + 0.005, "front", 0.02)]
    for sx in (0.27, 0.73):
        x = x0 + (x1 - x0) * sx
        for sy in (0.27, 0.73):
            y = y0 + (y1 - y0) * sy
            parts.append(rod("burner", shade(STEEL, 0.6), (x, y), 0.04, z + 0.005, z + 0.016, 0.03, 10))
            parts.append(block("grate", BLACK, (x - 0.1, y - 0.006, z + 0.016), (x + 0.1, y + 0.006, z + 0.028)))
        middle = (y0 + y1) / 2
        reach = (y1 - y0) / 2 - 0.02
        parts.append(
            block("grate", BLACK, (x - 0.006, middle - reach, z + 0.022), (x + 0.006, middle + reach, z + 0.034))
        )
    return parts


def dishwasher(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A dishwasher under its piece of worktop: a white or steel front, or one that matches the kitchen."""
    paint, stone = front_finish(style), worktop_finish(style)
    colour = pick(rng, (WHITE, STEEL, paint))
    width, height = 0.6 if fit > 0 else 0.45, draw(rng, style.worktop_m)
    x, y, under = width / 2, DEPTH_M / 2, height - WORKTOP_M
    split = under - 0.1
    face, front = FACE_Y_M, FACE_Y_M - FRONT_M
    return centred([
        block("plinth", BLACK, (-x + 0.002, face + 0.04, 0.0), (x - 0.002, y - 0.002, PLINTH_M)),
        _body(paint, -x, x, under),
        block("front", colour, (-x + 0.003, front, PLINTH_M + 0.01), (x - 0.003, face, split), "front"),
        block("panel", shade(colour, 0.82), (-x + 0.003, front, split + 0.004), (x - 0.003, face, under - 0.004)),
        block("display", BLACK, (-0.06, front - 0.002, split + 0.03), (0.06, front + 0.01, split + 0.06)),
        handle(style, Finish(style.metals[0]), (-x, split - 0.07, x, split), front),
        block("top", stone, (-x, -y, under), (x, y, height), "top"),
    ])  # fmt: skip


def wall_cabinet(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """Upper cabinets on the wall behind them, of one to three doors, .5 m above the worktop."""
    return wall_cabinet_of(rng, style, draw(rng, size("wall_cabinet").width_m, fit))


def wall_cabinet_of(rng: np.random.Generator, style: Style, width_m: float) -> tuple[Part, ...]:
    """Upper cabinets of a given width; all of a room's style hang at one height, a glass door among them at times."""
    paint, metal = front_finish(style), Finish(style.metals[0])
    low = draw(rng, style.worktop_m) + OVER_WORKTOP_M
    high = low + draw(rng, style.wall_unit_m)
    x, y = width_m / 2, 0.175
    face = -y + FRONT_M
    columns = max(1, round(width_m / 0.45))
    parts = [block("body", shade(paint, 0.9), (-x, face, low), (x, y, high))]
    parts += doors(style, paint, metal, (-x, low, x, high), face, columns)
    if rng.random() < 0.3:
        wide = width_m / columns
        field = rectangle_outline((-x + 0.06, low + 0.06, -x + wide - 0.06, high - 0.06))
        parts.append(front_shape("pane", FROSTED, field, -y - 0.002, -y + 0.01))
    return centred(parts)


def range_hood(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A hood over a stove: a sloping canopy under a chimney, or a flat blade."""
    room = size("range_hood")
    colour = pick(rng, (STEEL, BLACK, WHITE))
    width, low = 0.6 if fit < 1 else pick(rng, (0.6, 0.6, 0.9)), draw(rng, style.worktop_m) + HOOD_OVER_WORKTOP_M
    height, depth = draw(rng, room.height_m), draw(rng, room.depth_m)
    x, y, lip = width / 2, depth / 2, 0.05
    parts = [
        block("base", colour, (-x, -y, low), (x, y, low + lip)),
        block("filter", shade(STEEL, 0.6), (-x + 0.05, -y + 0.05, low - 0.004), (x - 0.05, y - 0.05, low + 0.006)),
        block("panel", BLACK, (-0.08, -y - 0.003, low + 0.012), (0.08, -y + 0.0075, low + 0.036)),
    ]
    neck = low + lip
    if rng.random() < 0.6:
        bottom, top = (-x + 0.004, -y + 0.004, x - 0.004, y), (-0.14, y - 0.26, 0.14, y)
        parts.append(tapered("canopy", shade(colour, 0.96), bottom, top, neck, neck + 0.22))
        neck += 0.22
    parts.append(block("chimney", colour, (-0.13, y - 0.25, neck), (0.13, y, low + height)))
    return centred(parts)


def fridge(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A fridge over a freezer, a freezer on top, or side by side if it is wide: fronts with upright handles."""
    room = size("fridge")
    colour = pick(rng, (WHITE, WHITE, STEEL, BLACK))
    metal = Finish(shade(pick(rng, style.metals), 0.9))
    width, depth = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit)
    height, split = draw(rng, (1.6, 1.95)), draw(rng, (0.32, 0.42))
    upper = rng.random() < 0.4
    x, y = width / 2, depth / 2
    face = -y + 0.05
    parts = [
        block("plinth", BLACK, (-x + 0.02, face + 0.03, 0.0), (x - 0.02, y - 0.01, 0.05)),
        block("body", shade(colour, 0.93), (-x, face, 0.05), (x, y, height)),
    ]
    if width > 0.75:
        fields = [(-x, 0.06, -0.003, height), (0.003, 0.06, x, height)]
    else:
        at = round(0.06 + (height - 0.06) * (1 - split if upper else split), 4)
        fields = [(-x, 0.06, x, at - 0.003), (-x, at + 0.003, x, height)]
    for i, (x0, z0, x1, z1) in enumerate(fields):
        outline = rounded_outline((x0 + 0.002, z0, x1 - 0.002, z1), 0.015)
        parts.append(front_shape("front", colour, outline, -y, face - 0.002, "front"))
        at = 0.93 if width > 0.75 and i == 0 else 0.07
        parts.append(
            handle(style, metal, (x0, z0 + (z1 - z0) * 0.25, x1, z1 - (z1 - z0) * 0.25), -y, upright=True, at=at)
        )
    return centred(parts)


def kitchen_island(rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """A free-standing block: drawers and doors at the front, a worktop that overhangs at the back (+y) for stools."""
    room = size("kitchen_island")
    paint, stone, metal = front_finish(style), worktop_finish(style), Finish(style.metals[0])
    width, depth, height = draw(rng, room.width_m, fit), draw(rng, room.depth_m, fit), draw(rng, style.worktop_m)
    x, y, under = width / 2, depth / 2, height - WORKTOP_M
    face, rear = -y + OVERHANG_M + FRONT_M, y - 0.22
    side = x - 0.03
    parts = [
        block("plinth", BLACK, (-side + 0.03, face + 0.04, 0.0), (side - 0.03, rear - 0.04, PLINTH_M)),
        block("body", shade(paint, 0.9), (-side, face, PLINTH_M), (side, rear, under)),
        slab("top", stone, (-x, -y, x, y), under, height, "top", 0.012, 0.004, 1),
    ]
    split = -side + 2 * side * pick(rng, (0.35, 0.5, 0.65))
    low, high = PLINTH_M + 0.01, under - 0.006
    parts += drawers(style, paint, metal, (-side, low, split, high), face, 3, 1)
    parts += doors(style, paint, metal, (split, low, side, high), face, 2)
    return centred(parts)
