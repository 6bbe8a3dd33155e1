"""Living groups: sofa before a television, two sofas face to face, an armchair to read in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.synth.furniture import decor
from hsbench.synth.furniture.pieces import draw, pick, shade
from hsbench.synth.furniture.style import Range
from hsbench.synth.rooms.placing import Item, Piece, Pose
from hsbench.synth.rooms.poses import (
    QUARTER,
    WALL_GAP_M,
    Context,
    Proposal,
    along_walls,
    in_corners,
    in_room,
    jitter,
)

TABLE_GAP_M = (0.55, 0.64)  # sofa to coffee table: a person passes
PASS_M = 0.6  # least way between coffee table and television
VIEW_M = (1.5, 3.3)  # television to sofa front
BEHIND_M = 0.75  # least way behind a sofa that divides the room
BESIDE_SOFA_M, BESIDE_TABLE_M = 0.12, 0.72  # least space between an armchair and these, sideways
NEARER_TV_M, ARMCHAIR_TO_TV = 0.35, 0.3  # armchairs stand ahead of the coffee table, turned (radians) to the television
SECOND_ARMCHAIR_SHARE = 0.4
RUG_SHARE = 0.75
DEEPEST_RUG_M = 1.7
RUG_AROUND_M = 0.5  # a rug is at least so much wider and deeper than the coffee table on it
HALF_TURN = 2 * QUARTER


def media(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Television on its stand at a wall; sofa facing it, at the opposite wall or (``divider``) free in the room."""
    rng = ctx.rng("media")
    stand, tv, sofa = ctx.piece("tv_stand"), ctx.piece("television"), ctx.piece("sofa")
    table, chair = ctx.piece("coffee_table"), ctx.piece("armchair")
    gap = draw(rng, TABLE_GAP_M)
    side = pick(rng, (-1, 1))
    with_rug = rng.random() < RUG_SHARE
    w, d, _ = ctx.layout.shell.size_m
    for wall, _, pose in along_walls(ctx, stand, rng, "middle"):
        across = w if wall.along[0] == 0 else d
        to_wall = across - stand.depth - sofa.depth - 2 * WALL_GAP_M
        for view in _views(mode, to_wall, gap + table.depth + PASS_M, rng):
            sofa_y = -(stand.depth / 2 + view + sofa.depth / 2)
            front = sofa_y + sofa.depth / 2
            table_y = front + gap + table.depth / 2
            items = [
                Item(stand, pose),
                Item(tv, pose.then(0.0, 0.02, 0.0, stand.height)),
                Item(sofa, pose.then(0.0, sofa_y, HALF_TURN)),
            ]
            rug_z = 0.0
            if with_rug and view > gap + table.depth + RUG_AROUND_M:
                least = (table.width + RUG_AROUND_M, table.depth + RUG_AROUND_M)
                rug = _rug(ctx, least, (sofa.width, view - 0.25))
                items.append(Item(rug, pose.then(0.0, front + 0.03 + rug.depth / 2)))
                rug_z = rug.height
            items.append(Item(table, pose.then(0.0, table_y, 0.0, rug_z)))
            for s in (side, -side)[: 1 + int(rng.random() < SECOND_ARMCHAIR_SHARE)]:
                x = s * (max(sofa.width / 2 + BESIDE_SOFA_M, table.width / 2 + BESIDE_TABLE_M) + chair.depth / 2)
                turn = HALF_TURN - s * (QUARTER - ARMCHAIR_TO_TV) + jitter(rng, ctx.config.armchair_yaw_deg)
                items.append(Item(chair, pose.then(x, table_y + NEARER_TV_M, turn), optional=True))
            items += _beside(ctx, pose.then(0.0, sofa_y, HALF_TURN), sofa, -side)
            yield items


def _views(mode: str, to_wall: float, least: float, rng: np.random.Generator) -> list[float]:
    """Distances from television stand to sofa front to try, best first."""
    low, high = max(VIEW_M[0], least), VIEW_M[1]
    free = [v for v in np.arange(low, high, 0.2).tolist() if v <= to_wall - BEHIND_M]
    backed = [to_wall] if low <= to_wall <= high + 0.5 else []
    if mode == "divider":
        return free[::-1][:4] + backed
    if mode == "any" and rng.random() < 0.5:
        return free[:3] + backed
    return backed + free[:2]


def _rug(ctx: Context, least: Range, wanted: Range) -> Piece:
    """A rug that carries the coffee table and ends before the sofa; both sizes are width and depth."""
    rng = ctx.rng("rug")
    cloth, edge = pick(rng, (*ctx.style.fabrics, *ctx.style.accents)), pick(rng, ctx.style.fabrics)
    wide, deep = max(least[0], wanted[0]), max(least[1], min(wanted[1], DEEPEST_RUG_M))
    return Piece("rug", decor.rug_of(cloth, shade(edge, 0.9), float(round(wide, 2)), float(round(deep, 2))))


def _beside(ctx: Context, sofa_pose: Pose, sofa: Piece, side: int) -> list[Item]:
    """Lamp on one side of a seat and a side table on the other, where there is space."""
    lamp, small = ctx.piece("floor_lamp"), ctx.piece("side_table")
    y = sofa.depth / 2
    lamp_x, small_x = side * (sofa.width / 2 + lamp.width / 2 + 0.06), -side * (sofa.width / 2 + small.width / 2 + 0.05)
    return [
        Item(lamp, sofa_pose.then(lamp_x, y - lamp.depth / 2), optional=True),
        Item(small, sofa_pose.then(small_x, y - small.depth / 2 - 0.1), optional=True),
    ]


def facing_sofas(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Two sofas face to face with a coffee table on a rug between them."""
    rng = ctx.rng("facing")
    sofa, table = ctx.piece("sofa"), ctx.piece("coffee_table")
    gap = draw(rng, TABLE_GAP_M)
    apart = table.depth / 2 + gap + sofa.depth / 2
    half = apart + sofa.depth / 2
    least = (table.width + RUG_AROUND_M, table.depth + RUG_AROUND_M)
    rug = _rug(ctx, least, (sofa.width, 2 * (apart - sofa.depth / 2) - 0.1))
    for pose in in_room(ctx, rng, min(half, sofa.width / 2) + 0.1):
        yield [
            Item(rug, pose),
            Item(table, pose.then(0.0, 0.0, 0.0, rug.height)),
            Item(sofa, pose.then(0.0, apart)),
            Item(sofa, pose.then(0.0, -apart, HALF_TURN)),
            *_beside(ctx, pose.then(0.0, apart), sofa, 1),
        ]


def reading(ctx: Context, mode: str) -> Iterator[Proposal]:
    """An armchair in a corner or at a wall, turned into the room, with a lamp and a side table."""
    rng = ctx.rng("reading")
    chair = ctx.piece("armchair")
    lamp, small = ctx.piece("floor_lamp"), ctx.piece("side_table")
    side = pick(rng, (-1, 1))

    def with_company(pose: Pose) -> Proposal:
        x = chair.width / 2
        return [
            Item(chair, pose),
            Item(lamp, pose.then(side * (x + lamp.width / 2 + 0.04), chair.depth / 2 - 0.12), optional=True),
            Item(small, pose.then(-side * (x + small.width / 2 + 0.05), 0.0), optional=True),
        ]

    for pose in in_corners(ctx, chair, rng, 0.02):
        yield with_company(pose.then(0.0, 0.0, jitter(rng, ctx.config.armchair_yaw_deg)))
    for _, _, pose in along_walls(ctx, chair, rng, "any", 0.1):
        yield with_company(pose.then(0.0, 0.0, jitter(rng, ctx.config.armchair_yaw_deg / 2)))
