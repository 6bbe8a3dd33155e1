"""The empty room: floor of planks, ceiling, four walls around their openings, a closed door and windows.

Room frame: inner corner at the origin, walls along x and y, floor z = 0. The shell is closed: no ray leaves it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, SceneObject
from hsbench.synth.furniture.openings import CASING_M, door, window
from hsbench.synth.furniture.pieces import block, draw, tone
from hsbench.synth.furniture.style import Rgb, Style
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray

SLAB_M = 0.1
PLANK_M = (0.18, 0.3)
SKIRTING_M = (0.07, 0.012)  # height, thickness
CORNER_M = 0.3  # an opening keeps this far from a corner
BETWEEN_M = 0.3  # and from another opening
DOOR_WIDTH_M, DOOR_HEIGHT_M = (0.84, 0.98), (2.02, 2.1)  # openings, with the frame
WINDOW_WIDTH_M, WINDOW_SILL_M, WINDOW_HEIGHT_M = (0.8, 1.6), (0.85, 1.0), (1.05, 1.3)
WHITE: Rgb = (242, 241, 238)
SWITCH_M = (0.08, 0.012, 1.1)  # side, thickness, height above the floor of a light switch


@dataclass(frozen=True, eq=False)
class Wall:
    """One inner wall face: (2,) start corner, unit vectors along it (counter-clockwise) and into the room, length."""

    start: FloatArray
    along: FloatArray
    inward: FloatArray
    length_m: float

    @property
    def yaw(self) -> float:
        """Yaw of an object that stands with its back to the wall and looks into the room."""
        return math.atan2(self.inward[0], -self.inward[1])

    def point(self, along_m: float, inward_m: float) -> FloatArray:
        """(2,) point at a place along the wall and a distance from it."""
        return np.asarray(self.start + along_m * self.along + inward_m * self.inward)


@dataclass(frozen=True)
class Opening:
    """A hole in wall number ``wall``: middle along it, width, lower and upper edge."""

    kind: str
    wall: int
    middle_m: float
    width_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, eq=False)
class Shell:
    """Inner size, walls (south, east, north, west) and openings; the door is the first opening."""

    size_m: tuple[float, float, float]
    thickness_m: float
    walls: tuple[Wall, ...]
    openings: tuple[Opening, ...]

    @property
    def outline_xy(self) -> FloatArray:
        """(4, 2) inner outline, counter-clockwise."""
        w, d, _ = self.size_m
        return np.array([[0.0, 0.0], [w, 0.0], [w, d], [0.0, d]])


def draw_shell(seeds: Seeds, config: RoomConfig) -> Shell:
    """Sizes and openings of a room: one door, then windows where walls have space for them."""
    rng = seeds.rng("shell")
    w, d, h = draw(rng, config.width_m), draw(rng, config.depth_m), draw(rng, config.ceiling_m)
    thickness = draw(rng, config.wall_m)
    corners = np.array([[0.0, 0.0], [w, 0.0], [w, d], [0.0, d]])
    walls = []
    for i, length in enumerate((w, d, w, d)):
        along = np.round((corners[(i + 1) % 4] - corners[i]) / length)
        walls.append(Wall(corners[i], along, np.array([-along[1], along[0]]), length))
    width, height = draw(rng, DOOR_WIDTH_M), draw(rng, DOOR_HEIGHT_M)
    wall = int(rng.integers(4))
    openings = [Opening("door", wall, _door_middle(rng, walls[wall].length_m, width), width, 0.0, height)]
    order = [(wall + k) % 4 for k in (2, 1, 3, 0)]  # opposite the door first, then beside it
    if rng.random() < 0.5:
        order[1:3] = order[2:0:-1]
    if rng.random() < 0.4:
        order[:2] = order[1::-1]
    wanted = int(rng.integers(config.windows[0], config.windows[1], endpoint=True))
    for side in order:
        if len(openings) > wanted:
            break
        found = _window(rng, side, walls[side].length_m, h, openings)
        if found is not None:
            openings.append(found)
    return Shell((w, d, h), thickness, tuple(walls), tuple(openings))


def _door_middle(rng: np.random.Generator, length: float, width: float) -> float:
    """Doors mostly stand near an end of their wall."""
    low, high = CORNER_M + width / 2, length - CORNER_M - width / 2
    share = rng.random()
    near = 0.25 * share if rng.random() < 0.75 else share
    place = near if rng.random() < 0.5 else 1 - near
    return float(quantise_m(low + (high - low) * place))


def _window(rng: np.random.Generator, wall: int, length: float, ceiling: float, taken: list[Opening]) -> Opening | None:
    width, sill = draw(rng, WINDOW_WIDTH_M), draw(rng, WINDOW_SILL_M)
    height = min(draw(rng, WINDOW_HEIGHT_M), float(quantise_m(ceiling - sill - 0.25)))
    middle = draw(rng, (CORNER_M + width / 2, length - CORNER_M - width / 2))
    for other in taken:
        apart = abs(middle - other.middle_m) - (width + other.width_m) / 2
        if other.wall == wall and apart < BETWEEN_M:
            return None
    return Opening("window", wall, middle, width, sill, float(quantise_m(sill + height)))


def shell_objects(shell: Shell, seeds: Seeds, style: Style) -> list[SceneObject]:
    """Floor, ceiling, walls, door and windows, in this order, with ids from 1."""
    rng = seeds.rng("surfaces")
    w, d, h = shell.size_m
    t = shell.thickness_m
    middle = planar(w / 2, d / 2, 0.0)
    slab = block("slab", WHITE, (-w / 2 - t, -d / 2 - t, h), (w / 2 + t, d / 2 + t, h + SLAB_M))
    found = [("floor", middle, _planks(rng, style, w + 2 * t, d + 2 * t)), ("ceiling", middle, (slab,))]
    colour = tone(rng, style.walls[0])
    skirting = tone(rng, style.paints[0])
    for i, wall in enumerate(shell.walls):
        x, y = wall.point(wall.length_m / 2, 0.0)
        holes = [o for o in shell.openings if o.wall == i]
        parts = _wall_parts(wall, holes, (h, t), colour, skirting, reach=t if i % 2 == 0 else 0.0)
        found.append(("wall", planar(x, y, wall.yaw), parts))
    for i, hole in enumerate(shell.openings):
        wall = shell.walls[hole.wall]
        x, y = wall.point(hole.middle_m, 0.0)
        own = seeds.rng(f"opening-{i}")
        parts = (
            door(own, style, hole.width_m, hole.high_m, t)
            if hole.kind == "door"
            else window(own, style, hole.width_m, hole.low_m, hole.high_m - hole.low_m, t)
        )
        found.append((hole.kind, planar(x, y, wall.yaw), parts))
    return [SceneObject(i, kind, pose, parts) for i, (kind, pose, parts) in enumerate(found, start=1)]


def _planks(rng: np.random.Generator, style: Style, width: float, depth: float) -> tuple[Part, ...]:
    """Floor boards along the longer side, each of its own shade."""
    base, board = style.floors[0], draw(rng, PLANK_M)
    across = min(width, depth)
    edges = np.append(np.arange(-across / 2, across / 2 - board / 2, board), across / 2)
    parts = []
    for a, b in pairwise(edges):
        low, high = ((-width / 2, a), (width / 2, b)) if width >= depth else ((a, -depth / 2), (b, depth / 2))
        parts.append(block("plank", tone(rng, base), (*low, -SLAB_M), (*high, 0.0)))
    return tuple(parts)


def _wall_parts(
    wall: Wall, holes: list[Opening], size: tuple[float, float], colour: Rgb, skirting: Rgb, reach: float
) -> tuple[Part, ...]:
    """Convex pieces around the openings, in the frame of the wall's middle (x against ``along``, y outwards).

    ``reach``: how far the wall goes on beyond its ends, to close the corners.
    """
    height, thick = size
    half = wall.length_m / 2
    parts: list[Part] = []
    at = -half - reach
    # Where x grows the place along the wall falls: sort by x.
    for hole in sorted(holes, key=lambda o: -o.middle_m):
        x = half - hole.middle_m
        x0, x1 = x - hole.width_m / 2, x + hole.width_m / 2
        parts.append(block("wall", colour, (at, 0.0, 0.0), (x0, thick, height)))
        parts.append(block("wall", colour, (x0, 0.0, hole.high_m), (x1, thick, height)))
        if hole.low_m > 0:
            parts.append(block("wall", colour, (x0, 0.0, 0.0), (x1, thick, hole.low_m)))
        at = x1
    parts.append(block("wall", colour, (at, 0.0, 0.0), (half + reach, thick, height)))
    tall, deep = SKIRTING_M
    at = -half + (0.0 if reach else deep)  # two walls' boards do not share a corner
    end = half - (0.0 if reach else deep)
    for hole in (o for o in holes if o.kind == "door"):
        x, clear = half - hole.middle_m, hole.width_m / 2 + CASING_M[0]
        parts.append(block("skirting", skirting, (at, -deep, 0.0), (x - clear, 0.0, tall)))
        parts.append(_light_switch(x, clear, half))
        at = x + clear
    parts.append(block("skirting", skirting, (at, -deep, 0.0), (end, 0.0, tall)))
    return tuple(parts)


def _light_switch(x: float, clear: float, half: float) -> Part:
    """A switch on the side of the door where the wall is longer."""
    side, thick, z = SWITCH_M
    middle = x - clear - 0.1 if x > 0 else x + clear + 0.1
    middle = min(max(middle, -half + side), half - side)
    return block("switch", WHITE, (middle - side / 2, -thick, z), (middle + side / 2, 0.0, z + side), "switch")
