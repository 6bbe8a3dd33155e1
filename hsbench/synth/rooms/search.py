"""What groups ask of an unfinished room: how deep it is, where a wall is free, and how several pieces fit together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import numpy as np

from hsbench.geometry.convex import span
from hsbench.schema.scene import Part
from hsbench.synth.rooms.clearance import CLEAR_FRONT_M, CLEAR_SIDE_M, TIGHT_FRONT_M
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.placing import APART_M
from hsbench.synth.rooms.poses import WALL_GAP_M, Context, Proposal, at_wall
from hsbench.synth.rooms.shell import Shell, Wall
from hsbench.typing import BoolArray, FloatArray

HANG_GAP_M = 0.002  # behind what hangs on a wall
WAY_M = 0.9  # between what stands at a wall and the wall across, in halls also what stands there (our default)
BEFORE_WAY_M = 1.8  # plants and lamps stand aside from the line through a door up to here
PROBE_M = 0.1  # width of the probe that looks for free wall
ALTERNATIVES = 40  # places of one piece that a joint search knows
PER_FIRST = 3  # joint proposals with the same alternative of the first step


def fits(ctx: Context, piece: Piece, pose: Pose) -> bool:
    """Whether a piece alone could stand at a pose: asked before what goes with it is built."""
    return ctx.layout.free_of(Item(piece, pose), ())


def standing(wall: Wall, along_m: float, out_m: float, turn: float = 0.0) -> Pose:
    """Pose of what stands at a place along a wall and a distance from it, with its back to the wall or turned."""
    x, y = wall.point(along_m, out_m)
    return Pose(x, y, wall.yaw + turn)


def top_m(piece: Piece) -> float:
    """Height of the highest surface that carries things."""
    return max(float(p.vertices[:, 2].max()) for p in piece.parts if p.role == "top")


def across_m(shell: Shell, wall: Wall, along_m: float) -> float:
    """Free depth of the empty room before a place on a wall, metres."""
    start = wall.point(along_m, 0.0)
    a = shell.outline_xy - start
    b = np.roll(a, -1, axis=0)
    # Corners in the frame of the wall: u along it, v into the room.
    (ua, va), (ub, vb) = ((p @ wall.along, p @ wall.inward) for p in (a, b))
    crossing = (ua < 0) != (ub < 0)
    v = va[crossing] - ua[crossing] * (vb - va)[crossing] / (ub - ua)[crossing]
    return float(v[v > 1e-6].min())


def leaves_way(ctx: Context, wall: Wall, along_m: float, out_m: float) -> bool:
    """Whether people pass between what reaches so far from a place on a wall and the wall across."""
    return across_m(ctx.layout.shell, wall, along_m) - out_m >= WAY_M


def way_before_m(ctx: Context) -> float | None:
    """Depth of the floor before what stands at a wall that all other things leave free: in a hall people pass there."""
    return WAY_M if ctx.layout.room_type == "corridor" else None


def beside_ways(ctx: Context, pose: Pose, half_m: float) -> bool:
    """Whether what reaches ``half_m`` to all sides of a pose is not straight before a door or passage."""
    shell = ctx.layout.shell
    for hole in (o for o in shell.openings if o.is_way):
        wall = shell.walls[hole.wall]
        to = np.array([pose.x, pose.y]) - wall.start
        aside, out = abs(float(to @ wall.along) - hole.middle_m), float(to @ wall.inward)
        if aside < hole.width_m / 2 + half_m and out < BEFORE_WAY_M:
            return False
    return True


def below_window(ctx: Context, item: Item) -> bool:
    """Whether the footprint of an item is before a window."""
    low, high = item.corners.min(axis=0), item.corners.max(axis=0)
    zones = (o.zone(ctx.layout.shell.walls[o.wall], 0.0)[0] for o in ctx.layout.shell.openings if not o.is_way)
    return any((np.minimum(high, z.max(axis=0)) > np.maximum(low, z.min(axis=0))).all() for z in zones)


def stretches(ctx: Context, category_name: str, depth_m: float, height_m: float) -> list[tuple[Wall, float, float]]:
    """(wall, from, to) along each wall where pieces of a category, depth and height could stand side by side."""
    half = PROBE_M / 2
    solid = span((-half, -depth_m / 2, 0.0), (half, depth_m / 2, height_m))
    probe = Piece(category_name, (Part("probe", (0, 0, 0), None, solid),))
    found = []
    for wall in ctx.layout.shell.walls:
        places = np.append(np.arange(half + WALL_GAP_M, wall.length_m - half - WALL_GAP_M, PROBE_M / 2),
                           wall.length_m - half - WALL_GAP_M)  # fmt: skip
        free = [ctx.layout.free_of(Item(probe, at_wall(wall, probe, float(p))), ()) for p in places]
        edges = np.flatnonzero(np.diff(np.array([False, *free, False], dtype=np.int8)))
        found += [(wall, places[i] - half, places[j - 1] + half) for i, j in zip(edges[::2], edges[1::2], strict=True)]
    return [(wall, float(low), float(high)) for wall, low, high in found]


def together(ctx: Context, steps: Sequence[Sequence[Proposal]]) -> Iterator[Proposal]:
    """Joint proposals: one alternative of each step, such that none takes another's place or front.

    Depth first in the order of preference; each step's alternatives are first checked against the room alone. In the
    smallest size come last those where the pieces leave each other no more than ``TIGHT_FRONT_M``.
    """
    fitting = [_first_that_fit(ctx, step) for step in steps]
    bodies = [_boxes(step, {}) for step in fitting]
    for front_m in (CLEAR_FRONT_M, TIGHT_FRONT_M) if ctx.fit == 0.0 else (CLEAR_FRONT_M,):
        fronts = [_boxes(step, front_m) for step in fitting]
        apart = {
            (a, b): _apart(fronts[a], bodies[b]) & _apart(fronts[b], bodies[a]).T
            for b in range(len(steps))
            for a in range(b)
        }
        for chosen in _joined(apart, [len(step) for step in fitting], ()):
            items = [item for step, i in zip(fitting, chosen, strict=True) for item in step[i]]
            yield sorted(items, key=lambda item: item.optional)


def _joined(
    apart: Mapping[tuple[int, int], BoolArray], counts: Sequence[int], chosen: tuple[int, ...]
) -> Iterator[tuple[int, ...]]:
    """Choices of one alternative a step that begin with ``chosen``; apart[a, b]: which of steps a and b go together."""
    level = len(chosen)
    if level == len(counts):
        yield chosen
        return
    good = np.ones(counts[level], dtype=np.bool_)
    for before, choice in enumerate(chosen):
        good &= apart[before, level][choice]
    found = 0
    for i in np.flatnonzero(good).tolist():
        for whole in islice(_joined(apart, counts, (*chosen, i)), 1 if level else PER_FIRST):
            yield whole
            found += 1
        if level and found >= PER_FIRST:
            return


def _first_that_fit(ctx: Context, step: Sequence[Proposal]) -> list[Proposal]:
    fitting: list[Proposal] = []
    for proposal in step:
        if len(fitting) == ALTERNATIVES:
            break
        if all(item.optional or ctx.layout.free_of(item, ()) for item in proposal):
            fitting.append(proposal)
    return fitting


def _boxes(step: Sequence[Proposal], front_m: Mapping[str, float]) -> FloatArray:
    """(n, 4) x0, y0, x1, y1 about the required items of each proposal and the floor that they need in front."""
    boxes = []
    for proposal in step:
        corners = np.concatenate([_floor(item, front_m) for item in proposal if not item.optional])
        boxes.append([*corners.min(axis=0), *corners.max(axis=0)])
    return np.array(boxes).reshape(-1, 4)


def _floor(item: Item, front_m: Mapping[str, float]) -> FloatArray:
    """(4, 2) footprint and the floor in front of it and at its sides, none where ``front_m`` is empty."""
    (x0, y0, _), (x1, y1, _) = item.piece.bounds.tolist()
    name = item.piece.category_name
    side = CLEAR_SIDE_M.get(name, 0.0) if front_m else 0.0
    return item.rectangle(x0 - side, y0 - front_m.get(name, 0.0), x1 + side, y1)


def _apart(first: FloatArray, second: FloatArray) -> BoolArray:
    """(n, m) whether each of (n, 4) rectangles keeps as far from each of (m, 4) as two bodies must."""
    a, b = first[:, None], second[None]
    gap = np.maximum(a[..., :2], b[..., :2]) - np.minimum(a[..., 2:], b[..., 2:])
    return np.asarray((gap >= APART_M - 1e-9).any(axis=-1))
