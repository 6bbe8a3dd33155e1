"""Meeting rooms: a table with chairs before a whiteboard or a screen on the wall."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.synth.furniture.pieces import pick
from hsbench.synth.rooms.dining import chairs_before, chairs_round, cramped, in_middle
from hsbench.synth.rooms.items import Item, Piece
from hsbench.synth.rooms.living import television_on
from hsbench.synth.rooms.poses import QUARTER, WALL_GAP_M, Context, Proposal, along_walls
from hsbench.synth.rooms.search import HANG_GAP_M, across_m, fits, standing
from hsbench.synth.rooms.shell import Wall

SPEAK_M = (0.9, 2.0)  # meeting table to the wall with the board: least and most
CHAIR_ROOM_M = 0.15  # from a chair at a meeting table to the wall behind it
ROW_AISLE_M = 0.5  # behind the chairs of a row of tables
BOARD_END = 1  # sign of x of the end of a table that looks at the board after a quarter turn


def meeting(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A table with chairs all round, lengthwise before a ``board`` or a ``screen`` at a wall; ``rows``: two tables
    across, chairs behind them only, all looking at the board.

    The smallest size falls back to a table anywhere, without the board.
    """
    rng = ctx.rng("meeting")
    table = ctx.piece("meeting_table")
    chair = ctx.piece(pick(rng, ("office_chair", "chair")) if ctx.fit > 0.0 else "chair")
    shown = ctx.piece("tv_stand", fit=0.0) if mode == "screen" else ctx.piece("whiteboard")
    gap = WALL_GAP_M if mode == "screen" else HANG_GAP_M
    for wall, along, pose in along_walls(ctx, shown, rng, "middle", gap):
        if not fits(ctx, shown, pose):
            continue
        seated = _rows if mode == "rows" else _lengthwise
        items = seated(ctx, table, chair, wall, along, shown.depth + gap, rng)
        if items:
            screen = [television_on(ctx, shown, pose)] if mode == "screen" else []
            yield [Item(shown, pose), *screen, *items]
    if ctx.fit == 0.0:
        yield from in_middle(ctx, table, chair, rng)
        yield from cramped(ctx, table, chair, rng)


def _lengthwise(
    ctx: Context, table: Piece, chair: Piece, wall: Wall, along: float, front: float, rng: np.random.Generator
) -> list[Item]:
    """A table with its end towards the board, in the middle of what is left; none if the room is too short."""
    behind = chair.depth + CHAIR_ROOM_M
    spare = across_m(ctx.layout.shell, wall, along) - front - table.width - behind
    if spare < SPEAK_M[0]:
        return []
    out = front + min(SPEAK_M[1], max(SPEAK_M[0], (spare + behind) / 2)) + table.width / 2
    pose = standing(wall, along, out, QUARTER)
    return [Item(table, pose), *chairs_round(ctx, table, chair, pose, rng, True, BOARD_END)]


def _rows(
    ctx: Context, table: Piece, chair: Piece, wall: Wall, along: float, front: float, rng: np.random.Generator
) -> list[Item]:
    """Two tables behind each other, chairs on the side away from the board."""
    first = front + SPEAK_M[0] + table.depth / 2
    items = []
    for out in (first, first + table.depth + chair.depth + ROW_AISLE_M):
        pose = standing(wall, along, out)
        items += [Item(table, pose), *chairs_before(table, chair, pose, rng)]
    return items
