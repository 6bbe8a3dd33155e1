"""Living groups: sofa before a television, two sofas face to face, an armchair to read in, a piano."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from hsbench.synth.furniture.pieces import accent, draw, fabric, pick, shade
from hsbench.synth.furniture.textiles import rug_of
from hsbench.synth.rooms.items import Item, Piece, Pose
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
from hsbench.synth.rooms.search import across_m, fits, top_m

TABLE_GAP_M = (0.55, 0.64)  # sofa to coffee table: a person passes
TV_BACK_M = 0.05  # television to the rear edge of its stand
PASS_M = 0.6  # least way between coffee table and television
VIEW_M, VIEW_STEP_M = (1.5, 3.3), 0.2  # television to the front of a sofa that stands free
FARTHEST_M = 3.8  # television to the front of a sofa at the opposite wall
FREE_SHARE = 0.5  # of sofas in rooms where both would do
BEHIND_M = 0.75  # least way behind a sofa that divides the room
BESIDE_SOFA_M, BESIDE_TABLE_M = 0.12, 0.72  # least space between an armchair and these, sideways
NEARER_TV_M, ARMCHAIR_TO_TV = 0.35, 0.3  # armchairs stand ahead of the coffee table, turned (radians) to the television
SECOND_ARMCHAIR_SHARE = 0.4
FOOT_REST_SHARE, FOOT_REST_M = 0.3, 0.42  # and the way between armchair and foot rest
PIANO_STOOL_M = 0.08
BESIDE_SEAT_M = 0.05  # a seat to the lamp or table beside it
SMALL_TABLE_M = 0.1  # rear edge of a seat to that of the small table beside it
BEHIND_CHAIR_M, BEHIND_SOFAS_M = 0.1, 0.1  # to the wall
RUG_SHARE = 0.75
BEHIND_SHARE = 0.5  # of sofas that stand free: a low sideboard behind, back to back
BACKS_GAP_M = 0.03
DEEPEST_RUG_M = 1.7
RUG_GAP_M, TO_STAND_M = 0.03, 0.25  # sofa to rug, rug to television stand
RUG_AROUND_M = 0.5  # a rug is at least so much wider and deeper than the coffee table on it
HALF_TURN = 2 * QUARTER


def media(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Television on its stand at a wall; sofa facing it, at the opposite wall or (``free``) free in the room."""
    rng = ctx.rng("media")
    stand, sofa, table = (ctx.piece(name) for name in ("tv_stand", "sofa", "coffee_table"))
    gap = draw(rng, TABLE_GAP_M)
    rugged, backed = rng.random() < RUG_SHARE, rng.random() < BEHIND_SHARE
    for wall, along, pose in along_walls(ctx, stand, rng, "middle"):
        if not fits(ctx, stand, pose):
            continue
        to_wall = across_m(ctx.layout.shell, wall, along) - stand.depth - sofa.depth - 2 * WALL_GAP_M
        for view in _views(mode, to_wall, gap + table.depth + PASS_M, rng):
            at = pose.then(0.0, -(stand.depth / 2 + view + sofa.depth / 2), HALF_TURN)
            if fits(ctx, sofa, at):
                rug_m = view - TO_STAND_M if rugged and view > gap + table.depth + RUG_AROUND_M else None
                items = _seating(ctx, sofa, table, at, gap, rug_m, rng)
                if backed and view < to_wall - BEHIND_M:
                    low = ctx.piece("sideboard", "-behind", fit=0.0)
                    y = sofa.depth / 2 + BACKS_GAP_M + low.depth / 2
                    items.append(Item(low, at.then(0.0, y, HALF_TURN), optional=True))
                yield [Item(stand, pose, front_m=view), television_on(ctx, stand, pose), *items]
    if ctx.fit == 0.0:
        yield from _seat_and_table(ctx, sofa, table, gap, rng)


def _seating(
    ctx: Context, sofa: Piece, table: Piece, at: Pose, gap: float, rug_m: float | None, rng: np.random.Generator
) -> list[Item]:
    """A sofa at a pose, a coffee table before it, on a rug of some depth or none, armchairs, lamp and side table."""
    front = -sofa.depth / 2
    table_y = front - gap - table.depth / 2
    items = [Item(sofa, at)]
    rug_z = 0.0
    if rug_m is not None:
        under = _rug_under(ctx, table, sofa.width, rug_m)
        items.append(Item(under, at.then(0.0, front - RUG_GAP_M - under.depth / 2)))
        rug_z = under.height
    items.append(Item(table, at.then(0.0, table_y, 0.0, rug_z)))
    chair = ctx.piece("armchair")
    x = max(sofa.width / 2 + BESIDE_SOFA_M, table.width / 2 + BESIDE_TABLE_M) + chair.depth / 2
    side = pick(rng, (-1, 1))
    for s in (side, -side)[: 1 + int(rng.random() < SECOND_ARMCHAIR_SHARE)]:
        turn = -s * (QUARTER - ARMCHAIR_TO_TV) + jitter(rng, ctx.config.armchair_yaw_deg)
        items.append(Item(chair, at.then(s * x, table_y - NEARER_TV_M, turn), optional=True))
    return [*items, *_beside(ctx, at, sofa, side)]


def television_on(ctx: Context, stand: Piece, pose: Pose) -> Item:
    """A television on its stand, which is at a pose."""
    tv = ctx.piece("television")
    return Item(tv, pose.then(0.0, (stand.depth - tv.depth) / 2 - TV_BACK_M, 0.0, top_m(stand)))


def _seat_and_table(
    ctx: Context, sofa: Piece, table: Piece, gap: float, rng: np.random.Generator
) -> Iterator[Proposal]:
    """For a room without space for a television: a sofa at a wall with a table before it, or an armchair beside one."""
    y = -(sofa.depth / 2 + gap + table.depth / 2)
    for _, _, pose in along_walls(ctx, sofa, rng, "middle"):
        yield [Item(sofa, pose), Item(table, pose.then(0.0, y))]
    yield from reading(ctx, "")


def _views(mode: str, to_wall: float, least: float, rng: np.random.Generator) -> list[float]:
    """Distances from television stand to sofa front to try, best first."""
    low, high = max(VIEW_M[0], least), VIEW_M[1]
    free = [v for v in np.arange(low, high, VIEW_STEP_M).tolist() if v <= to_wall - BEHIND_M]
    backed = [to_wall] if low <= to_wall <= FARTHEST_M else []
    if mode == "free":
        return free[::-1][:4] + backed
    if mode == "any" and rng.random() < FREE_SHARE:
        return free[:3] + backed
    return backed + free[:2]


def rug(ctx: Context, width_m: float, depth_m: float) -> Piece:
    """A rug of a given size in the colours of the room, to the centimetre."""
    rng = ctx.rng("rug")
    cloth, edge = accent(rng, ctx.style), shade(fabric(rng, ctx.style), 0.9)
    return Piece("rug", rug_of(cloth, edge, round(width_m, 2), round(depth_m, 2)))


def _rug_under(ctx: Context, table: Piece, width_m: float, depth_m: float) -> Piece:
    """A rug that carries the coffee table, of a wanted size where that is enough."""
    wide = max(table.width + RUG_AROUND_M, width_m)
    return rug(ctx, wide, max(table.depth + RUG_AROUND_M, min(depth_m, DEEPEST_RUG_M)))


def _beside(ctx: Context, sofa_pose: Pose, sofa: Piece, side: int) -> list[Item]:
    """Lamp on one side of a seat and a side table on the other, where there is space."""
    lamp, small = ctx.piece("floor_lamp"), ctx.piece("side_table")
    y, out = sofa.depth / 2, sofa.width / 2 + BESIDE_SEAT_M
    return [
        Item(lamp, sofa_pose.then(side * (out + lamp.width / 2), y - lamp.depth / 2), optional=True),
        Item(
            small, sofa_pose.then(-side * (out + small.width / 2), y - small.depth / 2 - SMALL_TABLE_M), optional=True
        ),
    ]


def facing_sofas(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Two sofas face to face with a coffee table on a rug between them."""
    rng = ctx.rng("facing")
    sofa, table = ctx.piece("sofa"), ctx.piece("coffee_table")
    gap = draw(rng, TABLE_GAP_M)
    apart = table.depth / 2 + gap + sofa.depth / 2
    half = apart + sofa.depth / 2
    under = _rug_under(ctx, table, sofa.width, 2 * (apart - sofa.depth / 2 - RUG_GAP_M))
    for pose in in_room(ctx, rng, min(half, sofa.width / 2) + BEHIND_SOFAS_M):
        yield [
            Item(under, pose),
            Item(table, pose.then(0.0, 0.0, 0.0, under.height)),
            Item(sofa, pose.then(0.0, apart)),
            Item(sofa, pose.then(0.0, -apart, HALF_TURN)),
            *_beside(ctx, pose.then(0.0, apart), sofa, 1),
        ]
    if ctx.fit == 0.0:
        yield from _seat_and_table(ctx, sofa, table, gap, rng)


def reading(ctx: Context, mode: str) -> Iterator[Proposal]:
    """An armchair in a corner or at a wall, turned into the room, with a lamp or a side table and a foot rest.

    The smallest size comes last without any of them.
    """
    rng = ctx.rng("reading")
    chair = ctx.piece("armchair")
    rested = rng.random() < FOOT_REST_SHARE
    side = pick(rng, (-1, 1))

    def with_company(pose: Pose) -> Iterator[Proposal]:
        lamp, small = ctx.piece("floor_lamp"), ctx.piece("side_table")
        out = chair.width / 2 + BESIDE_SEAT_M
        lit = pose.then(side * (out + lamp.width / 2), chair.depth / 2 - SMALL_TABLE_M)
        aside = pose.then(-side * (out + small.width / 2), 0.0)
        rests = []
        if rested:
            rest = ctx.piece("ottoman", fit=0.0)
            rests = [Item(rest, pose.then(0.0, -(chair.depth + rest.depth) / 2 - FOOT_REST_M), optional=True)]
        yield [Item(chair, pose), Item(lamp, lit), Item(small, aside, optional=True), *rests]
        yield [Item(chair, pose), Item(small, aside), *rests]

    corners = (
        p.then(0.0, 0.0, jitter(rng, ctx.config.armchair_yaw_deg)) for p in in_corners(ctx, chair, rng, WALL_GAP_M)
    )
    walls = (
        p.then(0.0, 0.0, jitter(rng, ctx.config.armchair_yaw_deg / 2))
        for _, _, p in along_walls(ctx, chair, rng, "any", BEHIND_CHAIR_M)
    )
    poses = [pose for pose in chain(corners, walls) if fits(ctx, chair, pose)]
    for pose in poses:
        yield from with_company(pose)
    if ctx.fit == 0.0:
        yield from ([Item(chair, pose)] for pose in poses)


def piano(ctx: Context, mode: str) -> Iterator[Proposal]:
    """An upright piano at a wall with a stool before its keys."""
    rng = ctx.rng("piano")
    body = ctx.piece("piano")
    for _, _, pose in along_walls(ctx, body, rng, "middle"):
        if fits(ctx, body, pose):
            seat = ctx.piece("stool")
            y = -(body.depth / 2 + seat.depth / 2 + PIANO_STOOL_M)
            yield [Item(body, pose), Item(seat, pose.then(0.0, y, HALF_TURN))]
