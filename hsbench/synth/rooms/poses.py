"""Candidate poses: along walls, in corners, free in the room; ordered by preference with some chance in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.geometry.polygons import contains, outline_distance
from hsbench.synth.furniture import Style, build
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.shell import Wall
from hsbench.synth.seeds import Seeds

WALL_GAP_M = 0.02  # behind furniture at a wall: the skirting and a finger
STEP_M = 0.1  # between candidate places along a wall
GRID_M = 0.2  # between candidate places in the room
ROUND_THINGS_M2 = 0.25  # footprints below this are of lamps, plants and the like
CHANCE = 0.35  # weight of chance against preference, both of order 1

Proposal = Sequence[Item]
QUARTER = math.pi / 2


@dataclass(frozen=True, eq=False)
class Context:
    """What a group needs to make proposals: the layout so far, the room's style, its own seeds, the asked size."""

    layout: Layout
    style: Style
    seeds: Seeds
    config: RoomConfig
    fit: float = 1.0

    def piece(self, category_name: str, name: str = "", fit: float | None = None) -> Piece:
        """A built object; the stream is named by category and ``name``, so siblings may share or differ."""
        key = (category_name, name, self.fit if fit is None else fit)
        if key not in self._pieces:
            rng = self.seeds.rng(f"shape-{category_name}{name}")
            self._pieces[key] = Piece(category_name, build(category_name, rng, self.style, key[2]))
        return self._pieces[key]

    @cached_property
    def _pieces(self) -> dict[tuple[str, str, float], Piece]:
        return {}

    def rng(self, name: str) -> np.random.Generator:
        """The stream for choices of one kind."""
        return self.seeds.rng(name)


def at_wall(wall: Wall, piece: Piece, along_m: float, gap_m: float = WALL_GAP_M, turn: float = 0.0) -> Pose:
    """Pose with the back (turn 0) or a side (quarter turns) of a piece at a wall, its middle at a place along it."""
    off = (piece.depth if turn == 0.0 else piece.width) / 2 + gap_m
    x, y = wall.place(along_m, off)
    return Pose(x, y, wall.yaw + turn)


def along_walls(
    ctx: Context,
    piece: Piece,
    rng: np.random.Generator,
    prefer: str = "any",
    gap_m: float = WALL_GAP_M,
    half_m: float | None = None,
    turn: float = 0.0,
) -> Iterator[tuple[Wall, float, Pose]]:
    """(wall, place along it, pose), best first. prefer: ``corner`` (ends), ``middle`` or ``any``.

    ``half_m``: half of the space needed along the wall where it is not half the piece.
    """
    half = half_m if half_m is not None else (piece.width if turn == 0.0 else piece.depth) / 2
    found = []
    for wall in ctx.layout.shell.walls:
        low, high = half + WALL_GAP_M, wall.length_m - half - WALL_GAP_M
        if high < low:
            continue
        places = np.unique(np.append(np.arange(low, high, STEP_M), high).round(4))
        bonus = 0.3 * rng.random()  # walls differ, so that not every group crowds at the same one
        for place in places.tolist():
            to_end = min(place - low, high - place) / max(high - low, 1e-6) * 2  # 0 at an end, 1 in the middle
            wish = {"corner": 1 - to_end, "middle": to_end, "any": 0.3 * (to_end < 1e-6)}[prefer]
            found.append((wish + bonus + CHANCE * rng.random(), wall, place))
    found.sort(key=lambda f: -f[0])
    for _, wall, place in found:
        yield wall, place, at_wall(wall, piece, place, gap_m, turn)


def in_corners(ctx: Context, piece: Piece, rng: np.random.Generator, gap_m: float = 0.06) -> Iterator[Pose]:
    """Poses in the corners of the room, the front towards its middle, or diagonal where that lies round a corner."""
    # Turned by a diagonal a square reaches further; small round things (lamps, plants) do not.
    turned = math.sqrt(2) if piece.width * piece.depth > ROUND_THINGS_M2 else 1.0
    off = max(piece.width, piece.depth) / 2 * turned + gap_m
    shell = ctx.layout.shell
    corners = [(shell.walls[i - 1], wall) for i, wall in enumerate(shell.walls)]
    # Two walls meet in a corner, rather than around one, where the second leads into the room.
    inner = [(before, wall) for before, wall in corners if wall.along @ before.inward > 0]
    for i in rng.permutation(len(inner)):
        before, wall = inner[int(i)]
        x, y = wall.start + off * (before.inward + wall.inward)
        to_middle = shell.middle_xy - (x, y)
        if min(to_middle @ before.inward, to_middle @ wall.inward) <= 0:
            to_middle = before.inward + wall.inward
        yield Pose(x, y, facing(x, y, x + to_middle[0], y + to_middle[1]))


def in_room(ctx: Context, rng: np.random.Generator, margin_m: float, central: float = 1.0) -> Iterator[Pose]:
    """Poses on a grid away from the walls, both ways round, those near the middle of the room first."""
    shell = ctx.layout.shell
    w, d, _ = shell.size_m
    if w < 2 * margin_m or d < 2 * margin_m:
        return
    axes = (np.arange(margin_m, size - margin_m + 1e-9, GRID_M) for size in (w, d))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    far = outline_distance(shell.outline_xy, points) >= margin_m - 1e-9
    points = points[far & contains(shell.outline_xy, points)]
    off = np.hypot(*(2 * (points - shell.middle_xy) / (w, d)).T)
    found = []
    for (x, y), away in zip(points.tolist(), off.round(9).tolist(), strict=True):
        for turn in range(2):
            lengthwise = 0.2 * ((turn == 0) == (w >= d))
            found.append((central * away - lengthwise + CHANCE * rng.random(), x, y, turn))
    found.sort()
    for _, x, y, turn in found:
        yield Pose(x, y, turn * QUARTER + (math.pi if rng.random() < 0.5 else 0.0))


def facing(x: float, y: float, target_x: float, target_y: float) -> float:
    """Yaw with which an object at (x, y) looks at a target: its front is -y."""
    return math.atan2(target_x - x, -(target_y - y))


def jitter(rng: np.random.Generator, degrees: float) -> float:
    """A yaw of up to so many degrees either way, in radians."""
    return math.radians(degrees) * (2.0 * rng.random() - 1.0)
