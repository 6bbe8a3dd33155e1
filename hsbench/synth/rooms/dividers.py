"""Dividers: shelves that stand into the room from a wall, and hide what is behind them."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.furniture.pieces import pick
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls
from hsbench.synth.rooms.search import standing

GAP_M = 0.03  # to the wall, and between the pieces
ZONE_M = 1.5  # each part of the room a divider makes is at least so wide
PLANT_GAP_M = 0.08


def divider(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Two bookshelves in a row, one side of the first at a wall, and a plant at the end."""
    rng = ctx.rng("divider")
    shelf = ctx.piece("bookshelf")
    plant = ctx.piece("plant", fit=0.0)
    turn = pick(rng, (-QUARTER, QUARTER))
    out = 2 * (GAP_M + shelf.width)
    for wall, along, pose in along_walls(ctx, shelf, rng, "middle", GAP_M, half_m=ZONE_M, turn=turn):
        yield [
            Item(shelf, pose),
            Item(shelf, standing(wall, along, out - shelf.width / 2, turn)),
            Item(plant, standing(wall, along, out + PLANT_GAP_M + plant.depth / 2), optional=True),
        ]
