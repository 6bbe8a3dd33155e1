"""Candidate poses: along walls, in corners, free in the room; ordered by preference with some chance in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.synth.furniture import Style, build
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.placing import Item, Layout, Piece, Pose
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
        rng = self.seeds.rng(f"shape-{category_name}{name}")
        return Piece(category_name, build(category_name, rng, self.style, self.fit if fit is None else fit))

    def rng(self, name: str) -> np.random.Generator:
        """The stream for choices of one kind."""
        return self.seeds.rng(name)


def at_wall(wall: Wall, piece: Piece, along_m: float, gap_m: float = WALL_GAP_M, turn: float = 0.0) -> Pose:
    """Pose with the back (turn 0) or a side (quarter turns) of a piece at a wall, its middle at a place along it."""
    off = (piece.depth if turn == 0.0 else piece.width) / 2 + gap_m
    x, y = wall.point(along_m, off)
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
        for place in places:
            to_end = min(place - low, high - place) / max(high - low, 1e-6) * 2  # 0 at an end, 1 in the middle
            wish = {"corner": 1 - to_end, "middle": to_end, "any": 0.3 * (to_end < 1e-6)}[prefer]
            found.append((wish + bonus + CHANCE * rng.random(), wall, float(place)))
    found.sort(key=lambda f: -f[0])
    for _, wall, place in found:
        yield wall, place, at_wall(wall, piece, place, gap_m, turn)


def in_corners(ctx: Context, piece: Piece, rng: np.random.Generator, gap_m: float = 0.06) -> Iterator[Pose]:
    """Poses in the four corners, the front towards the middle of the room along a diagonal."""
    w, d, _ = ctx.layout.shell.size_m
    # Turned by a diagonal a square reaches further; small round things (lamps, plants) do not.
    turned = math.sqrt(2) if piece.width * piece.depth > ROUND_THINGS_M2 else 1.0
    half = max(piece.width, piece.depth) / 2 * turned
    corners = [(x, y) for x in (half + gap_m, w - half - gap_m) for y in (half + gap_m, d - half - gap_m)]
    for i in rng.permutation(4):
        x, y = corners[int(i)]
        yield Pose(x, y, facing(x, y, w / 2, d / 2))


def in_room(ctx: Context, rng: np.random.Generator, margin_m: float, central: float = 1.0) -> Iterator[Pose]:
    """Poses on a grid away from the walls, both ways round, those near the middle of the room first."""
    w, d, _ = ctx.layout.shell.size_m
    if w < 2 * margin_m or d < 2 * margin_m:
        return
    found = []
    for x in np.arange(margin_m, w - margin_m + 1e-9, GRID_M):
        for y in np.arange(margin_m, d - margin_m + 1e-9, GRID_M):
            off = math.hypot(2 * x / w - 1, 2 * y / d - 1)
            for turn in range(2):
                lengthwise = 0.2 * ((turn == 0) == (w >= d))
                found.append((central * off - lengthwise + CHANCE * rng.random(), float(x), float(y), turn))
    found.sort()
    for _, px, py, turn in found:
        yield Pose(px, py, turn * QUARTER + (math.pi if rng.random() < 0.5 else 0.0))


def facing(x: float, y: float, target_x: float, target_y: float) -> float:
    """Yaw with which an object at (x, y) looks at a target: its front is -y."""
    return math.atan2(target_x - x, -(target_y - y))


def jitter(rng: np.random.Generator, degrees: float) -> float:
    """A yaw of up to so many degrees either way, in radians."""
    return math.radians(degrees) * (2.0 * rng.random() - 1.0)
