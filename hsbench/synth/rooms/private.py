"""Bedroom and study groups, and partitions: bed, desk with chair, shelves that stand into the room."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.synth.furniture.pieces import draw, pick
from hsbench.synth.rooms.placing import Item, Piece, Pose
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls, in_room, jitter

DOUBLE_M = 1.35  # beds from this width on stand free on both sides
CHAIR_GAP_M = (0.02, 0.08)
BEHIND_DESK_M = (0.95, 1.3)  # desk front to wall where the user sits with the back to it
PARTITION_GAP_M = 0.03
HALF_TURN = 2 * QUARTER


def bed(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A bed, head at a wall, a night stand a side; ``island``: free in the room, a dresser behind its head."""
    rng = ctx.rng("bed")
    frame, stand = ctx.piece("bed"), ctx.piece("night_stand")
    if mode == "island":
        yield from _bed_island(ctx, frame, stand, rng)
        if ctx.fit > 0.0:  # a smaller island before a bed at the wall
            return
    rug = ctx.piece("rug", fit=0.0)
    with_rug = rng.random() < 0.4
    prefer = "middle" if frame.width > DOUBLE_M else "corner"
    for _, _, pose in along_walls(ctx, frame, rng, prefer):
        items = [Item(frame, pose), *_night_stands(frame, stand, pose)]
        if with_rug:
            items.append(Item(rug, pose.then(0.0, -(frame.depth / 2 + rug.depth / 2 + 0.08)), optional=True))
        yield items


def _night_stands(frame: Piece, stand: Piece, pose: Pose) -> list[Item]:
    x, y = frame.width / 2 + stand.width / 2 + 0.04, (frame.depth - stand.depth) / 2
    return [Item(stand, pose.then(s * x, y), optional=True) for s in (-1, 1)]


def _bed_island(ctx: Context, frame: Piece, stand: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    dresser = ctx.piece("dresser")
    for pose in in_room(ctx, rng, frame.width / 2 + 0.3):
        behind = pose.then(0.0, frame.depth / 2 + dresser.depth / 2 + 0.03, HALF_TURN)
        yield [Item(frame, pose), Item(dresser, behind), *_night_stands(frame, stand, pose)]


def desk(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Desk, chair and screen: at a ``wall``, ``free`` with the user's back to a wall, or a ``pair`` back to back."""
    rng = ctx.rng("desk")
    table = ctx.piece("desk")
    chair = ctx.piece(pick(rng, ("office_chair", "office_chair", "chair")))
    gap = draw(rng, CHAIR_GAP_M)
    if mode == "pair":
        for pose in in_room(ctx, rng, table.depth + chair.depth + 0.5):
            front = _work_place(ctx, table, chair, pose.then(0.0, -table.depth / 2 - 0.01), gap, rng)
            back = _work_place(ctx, table, chair, pose.then(0.0, table.depth / 2 + 0.01, HALF_TURN), gap, rng)
            yield [*front, *back]
        if ctx.fit > 0.0:  # a smaller pair before a single desk
            return
    if mode in ("free", "pair"):
        space = draw(rng, BEHIND_DESK_M)
        for wall, place, _ in along_walls(ctx, table, rng, "middle"):
            x, y = wall.point(place, table.depth / 2 + space)
            yield _work_place(ctx, table, chair, Pose(x, y, wall.yaw + HALF_TURN), gap, rng)
        if ctx.fit > 0.0:
            return
    shelf = ctx.piece("shelf")
    for wall, place, pose in along_walls(ctx, table, rng, "any"):
        items = _work_place(ctx, table, chair, pose, gap, rng)
        if rng.random() < 0.4:
            x, y = wall.point(place, shelf.depth / 2)
            items.append(Item(shelf, Pose(x, y, wall.yaw), optional=True))
        yield items


def _work_place(
    ctx: Context, table: Piece, chair: Piece, pose: Pose, gap: float, rng: np.random.Generator
) -> list[Item]:
    """Desk, chair before its knee space, screen at the back of the top above the knees."""
    knee = _knee_x(table)
    screen = ctx.piece("monitor")
    seat = pose.then(knee, -(table.depth / 2 + chair.depth / 2 + gap + 0.03), HALF_TURN + jitter(rng, 6.0))
    screen_y = table.depth / 2 - screen.depth / 2 - 0.06
    return [Item(table, pose), Item(chair, seat), Item(screen, pose.then(knee, screen_y, 0.0, table.height))]


def _knee_x(table: Piece) -> float:
    """Middle of the space beside the chest of drawers."""
    chest = next(p for p in table.parts if p.name == "chest").vertices[:, 0]
    half = table.width / 2
    left, right = (float(chest.max()), half) if chest.mean() < 0 else (-half, float(chest.min()))
    return (left + right) / 2


def partition(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Shelves or a sideboard that stand into the room, a side at the wall: they divide it and hide what is behind."""
    rng = ctx.rng("partition")
    kind = pick(rng, ("bookshelf", "bookshelf", "sideboard"))
    piece = ctx.piece(kind)
    second = ctx.piece(kind, "" if kind == "bookshelf" else "-second", fit=0.0)
    plant = ctx.piece("plant")
    turn = pick(rng, (-QUARTER, QUARTER))
    for wall, place, pose in along_walls(ctx, piece, rng, "middle", PARTITION_GAP_M, turn=turn):
        if not 0.9 <= place <= wall.length_m - 0.9:
            continue
        items = [Item(piece, pose)]
        if kind == "bookshelf":
            x, y = wall.point(place, piece.width + second.width / 2 + PARTITION_GAP_M + 0.01)
            items.append(Item(second, Pose(x, y, wall.yaw + turn), optional=True))
        x, y = wall.point(place, piece.width + second.width + plant.depth / 2 + 0.1)
        if kind == "sideboard":
            x, y = wall.point(place, piece.width + plant.depth / 2 + 0.1)
        items.append(Item(plant, Pose(x, y, wall.yaw), optional=True))
        yield items
