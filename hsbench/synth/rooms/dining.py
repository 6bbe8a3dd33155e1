"""Dining and kitchen groups: a table with chairs, a counter with a fridge, an island."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hsbench.synth.furniture.pieces import draw, pick
from hsbench.synth.rooms.placing import Item, Piece, Pose
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls, in_room, jitter

SEAT_PITCH_M = 0.56  # along a table, a person
SEAT_GAP_M = (0.02, 0.07)  # table edge to seat front
TURNED_GAP_M = 0.16  # what a turned chair needs more
END_SEAT_M = 1.35  # a table this long has seats at its ends
WALK_BEHIND_M = 0.55
AISLE_M = (0.95, 1.2)  # counter to island
HALF_TURN = 2 * QUARTER
WALL_END = -1  # sign of x of the table's end that stands at the wall after a quarter turn


def dining(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A table with chairs: ``middle`` of the room, an end at a ``wall``, or with a ``bench`` between table and wall."""
    rng = ctx.rng("dining")
    table, chair = ctx.piece("dining_table"), ctx.piece("chair")
    if mode == "bench":
        yield from _with_bench(ctx, table, chair, rng)
    elif mode == "wall":
        for _, _, pose in along_walls(ctx, table, rng, "any", 0.03, turn=QUARTER):
            chairs = _chairs(ctx, table, chair, pose, rng, open_end=pick(rng, (True, False)), closed=WALL_END)
            yield [Item(table, pose), *chairs]
    margin = min(table.width, table.depth) / 2 + chair.depth + WALK_BEHIND_M
    for pose in in_room(ctx, rng, margin):
        yield [Item(table, pose), *_chairs(ctx, table, chair, pose, rng, open_end=True)]


def _chairs(
    ctx: Context, table: Piece, chair: Piece, pose: Pose, rng: np.random.Generator, open_end: bool, closed: int = 0
) -> list[Item]:
    """Chairs round a table; the first two must fit. ``closed``: the sign of x of an end that stands at a wall."""
    places = _round_places(table, chair, rng) if _is_round(table) else _long_places(table, chair, open_end, closed)
    items = []
    for i, (x, y, yaw) in enumerate(places):
        gap = draw(rng, SEAT_GAP_M)
        turn = 0.0
        if rng.random() < ctx.config.turned_chair_share:
            gap += TURNED_GAP_M
            turn = jitter(rng, ctx.config.turned_chair_deg)
        else:
            turn = jitter(rng, 3.0)
            gap += 0.015
        # The front (-y) of a chair looks at the table; back off along it.
        off_x, off_y = -math.sin(yaw) * gap, math.cos(yaw) * gap
        items.append(Item(chair, pose.then(x + off_x, y + off_y, yaw + turn), optional=i >= 2))
    return items


def _is_round(table: Piece) -> bool:
    return len(table.parts) == 3  # top, pedestal, foot


def _long_places(table: Piece, chair: Piece, open_end: bool, closed: int) -> list[tuple[float, float, float]]:
    """Seats along both long sides of a table, then at its free ends: x, y, yaw in the table's frame."""
    count = max(1, int((table.width - 0.08) / SEAT_PITCH_M))
    out = table.depth / 2 + chair.depth / 2
    places = []
    for i in range(count):
        x = (i + 0.5) * table.width / count - table.width / 2
        places += [(x, out, 0.0), (x, -out, HALF_TURN)]
    if open_end and table.width >= END_SEAT_M:
        end = table.width / 2 + chair.depth / 2
        places += [(s * end, 0.0, -s * QUARTER) for s in (1, -1) if s != closed]
    return places


def _round_places(table: Piece, chair: Piece, rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Seats around a round table, the first two opposite each other."""
    count = 4 if table.width > 0.98 else pick(rng, (2, 3))
    radius = table.width / 2 + chair.depth / 2
    order = (0, 2, 1, 3) if count == 4 else tuple(range(count))
    angles = [2 * math.pi * k / count for k in order]
    return [(-radius * math.sin(a), radius * math.cos(a), a) for a in angles]


def _with_bench(ctx: Context, table: Piece, chair: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    """Bench with its back to a wall, table before it, chairs on the other long side."""
    bench = ctx.piece("bench")
    out = bench.depth / 2 + table.depth / 2 + 0.04
    count = max(1, int((table.width - 0.08) / SEAT_PITCH_M))
    for _, _, pose in along_walls(ctx, bench, rng, "middle", 0.05, half_m=max(bench.width, table.width) / 2):
        at = pose.then(0.0, -out)
        far = -(table.depth / 2 + chair.depth / 2 + 0.05)
        xs = [(i + 0.5) * table.width / count - table.width / 2 for i in range(count)]
        seats = [Item(chair, at.then(x, far, HALF_TURN + jitter(rng, 4.0)), optional=i > 0) for i, x in enumerate(xs)]
        yield [Item(bench, pose), Item(table, at), *seats]


def kitchen(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A counter along a wall with a fridge beside it; an ``island`` before it where the mode asks and space allows."""
    rng = ctx.rng("kitchen")
    counter, fridge = ctx.piece("kitchen_counter"), ctx.piece("fridge")
    island = ctx.piece("kitchen_island")
    side = pick(rng, (-1, 1))
    aisle = draw(rng, AISLE_M)
    y = (counter.depth - fridge.depth) / 2
    for _, _, pose in along_walls(ctx, counter, rng, "corner", half_m=counter.width / 2):
        for s in (side, -side):
            x = s * (counter.width / 2 + fridge.width / 2 + 0.02)
            items = [Item(counter, pose), Item(fridge, pose.then(x, y))]
            if mode == "island":
                away = -(counter.depth / 2 + aisle + island.depth / 2)
                items.append(Item(island, pose.then(-s * 0.1, away, HALF_TURN)))
            yield items
