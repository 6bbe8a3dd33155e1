"""Bedroom groups: a bed with what stands beside its head and at its foot, a bunk bed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.geometry.polygons import outline_distance
from hsbench.synth.furniture.pieces import pick
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.living import rug
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls

DOUBLE_M = 1.35  # beds from this width on stand free on both sides
BESIDE_M = 0.55  # way along each side of a double bed
STAND_GAP_M = 0.04
CORNER_M = 0.5  # a bed this near to a corner stands in it
HEAD_GAP_M = 0.1  # head of a bed in a corner to the wall there
FOOT_GAP_M = 0.05
FOOT_SHARE, RUG_SHARE, SIDEWAYS_SHARE = 0.4, 0.5, 0.5
RUG_M, RUG_Y_M = (0.65, 1.5), -0.2  # rug beside a bed: across and along, its middle before that of the bed
LEAST_SIDE_M = 0.05  # two beds to the wall beside them


def bed(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A bed, head at a wall, a night stand a side; ``alcove``: a narrow one, for a room where one also lives;
    ``twin``: two narrow ones with a night stand between them, in the smallest size one alone where two do not fit.
    """
    rng = ctx.rng("bed")
    frame = ctx.piece("bed", fit=None if mode == "" else 0.0)
    stand = ctx.piece("night_stand")
    if mode == "twin":
        yield from _twins(ctx, frame, stand, rng)
        if ctx.fit > 0.0:
            return
    company = _company(ctx, frame, rng)
    if frame.width > DOUBLE_M:
        poses = [p for _, _, p in along_walls(ctx, frame, rng, "middle", half_m=frame.width / 2 + BESIDE_M)]
        # Where both night stands have their place comes first.
        lacking = [sum(not ctx.layout.free_of(i, ()) for i in _night_stands(frame, stand, p)) for p in poses]
        for k in np.argsort(lacking, kind="stable"):
            pose = poses[int(k)]
            yield [Item(frame, pose), *_night_stands(frame, stand, pose), *_moved(company, pose)]
    for pose in _cornered(ctx, frame, rng):
        yield [Item(frame, pose), *_night_stands(frame, stand, pose), *_moved(company, pose)]


def bunk(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A bunk bed in a corner."""
    rng = ctx.rng("bunk")
    frame = ctx.piece("bunk_bed")
    for pose in _cornered(ctx, frame, rng):
        yield [Item(frame, pose)]


def _cornered(ctx: Context, frame: Piece, rng: np.random.Generator) -> Iterator[Pose]:
    """With the head at a wall beside a corner, or in a corner with a long side at the other wall, in either order; then
    with the head anywhere at a wall.
    """
    heads = list(along_walls(ctx, frame, rng, "corner"))
    beside = [p for wall, at, p in heads if min(at, wall.length_m - at) < frame.width / 2 + CORNER_M]
    turn = pick(rng, (-QUARTER, QUARTER))
    sideways = [
        p
        for t in (turn, -turn)
        for _, _, p in along_walls(ctx, frame, rng, "corner", turn=t)
        if _head_m(ctx, frame, p) < HEAD_GAP_M
    ]
    yield from (*sideways, *beside) if rng.random() < SIDEWAYS_SHARE else (*beside, *sideways)
    yield from (p for _, _, p in heads)


def _head_m(ctx: Context, frame: Piece, pose: Pose) -> float:
    """From the head of a bed to the nearest wall: where a wall ends the room may go on round the corner."""
    head = pose.then(0.0, frame.depth / 2)
    return float(outline_distance(ctx.layout.shell.outline_xy, np.array([head.x, head.y])))


def _night_stands(frame: Piece, stand: Piece, pose: Pose) -> list[Item]:
    x, y = frame.width / 2 + stand.width / 2 + STAND_GAP_M, (frame.depth - stand.depth) / 2
    return [Item(stand, pose.then(s * x, y), optional=True) for s in (-1, 1)]


def _company(ctx: Context, frame: Piece, rng: np.random.Generator) -> list[Item]:
    """A seat at the foot of a double bed or a rug beside a bed, in the frame of the bed."""
    if frame.width > DOUBLE_M and rng.random() < FOOT_SHARE:
        seat = ctx.piece(pick(rng, ("bench", "ottoman")), fit=0.0)
        return [Item(seat, Pose(0.0, -(frame.depth / 2 + seat.depth / 2 + FOOT_GAP_M)), optional=True)]
    if rng.random() >= RUG_SHARE:
        return []
    cloth = rug(ctx, *RUG_M)
    x = frame.width / 2 + cloth.width / 2 + FOOT_GAP_M
    return [Item(cloth, Pose(s * x, RUG_Y_M), optional=True) for s in pick(rng, ((-1, 1), (1,), (-1,)))]


def _moved(items: list[Item], pose: Pose) -> list[Item]:
    return [Item(i.piece, pose.then(i.pose.x, i.pose.y, i.pose.yaw), i.optional) for i in items]


def _twins(ctx: Context, frame: Piece, stand: Piece, rng: np.random.Generator) -> Iterator[Proposal]:
    between = stand.width + 2 * STAND_GAP_M
    x, y = (frame.width + between) / 2, (frame.depth - stand.depth) / 2
    for _, _, pose in along_walls(ctx, frame, rng, "middle", half_m=frame.width + between / 2 + LEAST_SIDE_M):
        yield [*(Item(frame, pose.then(s * x, 0.0)) for s in (-1, 1)), Item(stand, pose.then(0.0, y), optional=True)]
