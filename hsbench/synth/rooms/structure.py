"""The objects of an empty building: floors, ceiling, walls with skirting and switches, doors, passages and windows.

The frame of a wall object: origin on the floor in the middle of its inner face, y outwards, x against the direction of
the outline. The frame of a door, passage or window: origin on the floor below the middle of its opening, on the face of
the wall in the room in front of it; x along the wall, y through it away from that room. A leaf opens towards -y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.furniture.openings import CASING_M, door, passage, window
from hsbench.synth.furniture.pieces import block, named_apart, shade, tone
from hsbench.synth.furniture.style import Finish, Rgb, Style, family
from hsbench.synth.rooms.plan import FloorPlan, PlanOpening
from hsbench.synth.rooms.regions import MM_PER_M, Rect
from hsbench.synth.rooms.shell import SKIRTING_M, SWITCH_M, Shell, Wall
from hsbench.synth.rooms.walls import WallBox, masonry
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray

SLAB_M = 0.1
WHITE: Rgb = (242, 241, 238)
TILE_SHADE = 0.85  # of the colour of the walls
WET_ROOMS = frozenset(("bathroom", "kitchen"))
"""Rooms with a tiled floor."""
TILED_ROOMS = frozenset(("bathroom",))
"""Rooms with tiled walls, without skirting."""


def room_style(home: Style, room_type: str, rng: np.random.Generator) -> Style:
    """A style for one room of a home: its own colours of the family, the floor, paint and metal of the whole home."""
    own = family(home.name).for_room(rng)
    floors, textures = home.floors, home.floor_textures
    if room_type in WET_ROOMS:
        floors, textures = (shade(own.walls[0], TILE_SHADE),), own.wet_floor_textures
    walls = own.wet_floor_textures if room_type in TILED_ROOMS else own.wall_textures
    return replace(
        own, floors=floors, floor_textures=textures, wall_textures=walls, paints=home.paints, metals=home.metals
    )


def structure(plan: FloorPlan, seeds: Seeds, home: Style, styles: Sequence[Style]) -> list[SceneObject]:
    """The objects of the building in the scene frame, ids from 1: floors, ceiling, walls room by room, openings.

    home: style of doors and windows; styles: of each room, already narrowed.
    """
    built = masonry(plan)
    found: list[tuple[str, FloatArray, tuple[Part, ...]]] = []
    for i, style in enumerate(styles):
        finish = tone(seeds.rng("floor"), Finish(style.floors[0], style.floor_textures[0]))
        found.append(_slabs("floor", finish, plan.rooms[i].outline_xy, built.territories[i], -SLAB_M))
    found.append(_slabs("ceiling", Finish(WHITE), plan.outline_xy, built.footprint, plan.height_m))
    for i, style in enumerate(styles):
        rng = seeds.rng(f"walls-{i}")
        finish, skirting = tone(rng, Finish(style.walls[0], style.wall_textures[0])), tone(rng, style.paints[0])
        shell = plan.shell(i)
        for k, wall in enumerate(plan.walls[i]):
            boxes = [b for b in built.boxes if (b.room, b.wall) == (i, k)]
            parts = _bricks(wall, boxes, finish)
            # A wall whose bricks are all its neighbours' still has something of its own.
            if plan.rooms[i].room_type not in TILED_ROOMS or not parts:
                parts += _skirting(shell, k, skirting)
            parts += [_switch(wall, place) for at, place in shell.switches if at == k]
            x, y = wall.point(wall.length_m / 2, 0.0)
            found.append(("wall", planar(x, y, wall.yaw), named_apart(parts)))
    for i, hole in enumerate(plan.openings):
        wall = plan.walls[hole.front][hole.wall]
        x, y = wall.point(hole.middle_m, 0.0)
        # One stream for all of a kind: the doors of a home are alike, and so are its windows.
        own = seeds.rng("entrance" if i == 0 else hole.kind)
        found.append((hole.kind, planar(x, y, wall.yaw), _filling(hole, own, home)))
    return [SceneObject(i, kind, pose, parts) for i, (kind, pose, parts) in enumerate(found, start=1)]


def _filling(hole: PlanOpening, rng: np.random.Generator, style: Style) -> tuple[Part, ...]:
    if hole.kind == "window":
        return window(rng, style, hole.width_m, hole.low_m, hole.high_m - hole.low_m, hole.thickness_m)
    if hole.kind == "passage":
        return passage(rng, style, hole.width_m, hole.high_m, hole.thickness_m)
    return door(rng, style, hole.width_m, hole.high_m, hole.thickness_m, hole.open_rad, hole.hinge)


def _slabs(
    name: str, finish: Finish, outline_xy: FloatArray, rects: Sequence[Rect], z: float
) -> tuple[str, FloatArray, tuple[Part, ...]]:
    """(name, pose, parts) of slabs from z upwards over rectangles, the origin in the middle of an outline."""
    x, y = quantise_m((outline_xy.min(axis=0) + outline_xy.max(axis=0)) / 2).tolist()
    parts = []
    for x0, y0, x1, y1 in (np.array(rect) / MM_PER_M for rect in rects):
        parts.append(block(name, finish, (x0 - x, y0 - y, z), (x1 - x, y1 - y, z + SLAB_M)))
    return name, planar(x, y, 0.0), named_apart(parts)


def _bricks(wall: Wall, boxes: Sequence[WallBox], finish: Finish) -> list[Part]:
    """Boxes of wall in the frame of the wall object."""
    middle = wall.point(wall.length_m / 2, 0.0)
    axes = np.stack([-wall.along, -wall.inward])
    parts = []
    for box in boxes:
        ends = (np.array(box.rect).reshape(2, 2) / MM_PER_M - middle) @ axes.T
        low, high = ends.min(axis=0), ends.max(axis=0)
        parts.append(block("wall", finish, (*low, box.low / MM_PER_M), (*high, box.high / MM_PER_M)))
    return parts


def _skirting(shell: Shell, index: int, colour: Rgb) -> list[Part]:
    """Boards along a wall, broken at doors; where two walls meet, one board goes into the corner or around it."""
    tall, deep = SKIRTING_M
    wall, before = shell.walls[index], shell.walls[index - 1]
    turn = before.along[0] * wall.along[1] - before.along[1] * wall.along[0]  # 1 in a corner, -1 around one
    half = wall.length_m / 2
    gaps = [
        (o.middle_m - o.width_m / 2 - CASING_M[0], o.middle_m + o.width_m / 2 + CASING_M[0])
        for o in shell.openings
        if o.wall == index and o.is_way
    ]
    at, parts = deep * turn, []
    for low, high in [*sorted(gaps), (wall.length_m, wall.length_m)]:
        if low - at > 2 * deep:
            # x of the object runs against the wall's direction.
            parts.append(block("skirting", colour, (half - low, -deep, 0.0), (half - at, 0.0, tall)))
        at = high
    return parts


def _switch(wall: Wall, place: float) -> Part:
    side, thick, z = SWITCH_M
    x = wall.length_m / 2 - place
    return block("switch", WHITE, (x - side / 2, -thick, z), (x + side / 2, 0.0, z + side), "switch")


def around_room(objects: Sequence[SceneObject], plan: FloorPlan, room: int) -> list[SceneObject]:
    """The objects of ``structure`` that bound one room: its walls, and all openings in them."""
    walls = sum(len(w) for w in plan.walls[:room])
    first = len(plan.rooms) + 1
    last = first + sum(len(w) for w in plan.walls)
    own = objects[first + walls : first + walls + len(plan.walls[room])]
    holes = [objects[last + i] for i, o in enumerate(plan.openings) if room in (o.front, o.back)]
    return [*own, *holes]
