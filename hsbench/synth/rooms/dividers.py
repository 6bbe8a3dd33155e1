"""Dividers: shelves or a low cupboard that stand into the room from a wall, and hide what is behind them."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.furniture.pieces import pick
from hsbench.synth.rooms.placing import Item
from hsbench.synth.rooms.poses import QUARTER, Context, Proposal, along_walls
from hsbench.synth.rooms.search import standing

GAP_M = 0.03  # to the wall, and between the pieces
ZONE_M = 1.3  # each part of the room a divider makes is at least so wide
PLANT_GAP_M = 0.08
KINDS = ("row", "backs", "low")


def divider(ctx: Context, mode: str) -> Iterator[Proposal]:
    """One side at a wall: bookshelves in a ``row``, two ``backs`` to back, a ``low`` sideboard; a plant at the end."""
    rng = ctx.rng("divider")
    kind = mode or pick(rng, KINDS)
    piece = ctx.piece("sideboard" if kind == "low" else "bookshelf")
    second = ctx.piece("bookshelf", fit=0.0)
    plant = ctx.piece("plant", fit=0.0)
    turn = pick(rng, (-QUARTER, QUARTER))
    for wall, along, pose in along_walls(ctx, piece, rng, "middle", GAP_M, half_m=ZONE_M, turn=turn):
        out = GAP_M + piece.width
        if kind == "backs":
            # Turned by a quarter, a piece has its back (+y) along the wall.
            aside, middle = (piece.depth + GAP_M) / 2, out - piece.width / 2
            items = [
                Item(piece, standing(wall, along - aside, middle, QUARTER)),
                Item(piece, standing(wall, along + aside, middle, -QUARTER)),
            ]
        else:
            items = [Item(piece, pose)]
        if kind == "row":
            items.append(Item(second, standing(wall, along, out + GAP_M + second.width / 2, turn), optional=True))
            out += GAP_M + second.width
        items.append(Item(plant, standing(wall, along, out + PLANT_GAP_M + plant.depth / 2, 0.0), optional=True))
        yield items
