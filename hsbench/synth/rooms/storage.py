"""Things kept side by side: a wall of shelves and cupboards, a corner to play in."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.furniture.pieces import pick
from hsbench.synth.rooms.items import Item, Pose
from hsbench.synth.rooms.living import rug
from hsbench.synth.rooms.poses import WALL_GAP_M, Context, Proposal, along_walls
from hsbench.synth.rooms.search import fits, leaves_way

ROWS = (
    ("bookshelf", "bookshelf"),
    ("bookshelf", "bookshelf", "bookshelf"),
    ("bookshelf", "sideboard", "bookshelf"),
    ("sideboard", "bookshelf"),
)
ASIDE_M = 0.01  # between pieces of a row
RUG_M = (1.5, 1.2)  # along the wall, into the room
RUG_GAP_M = 0.45  # from the wall: boxes stand between
BOXES_APART_M = 0.06


def storage(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Two or three shelves and sideboards side by side at a wall, their backs in one plane."""
    rng = ctx.rng("storage")
    names = pick(rng, ROWS if ctx.fit > 0.0 else ROWS[:1])
    pieces = [ctx.piece(name) for name in names]
    width, depth = sum(p.width for p in pieces) + ASIDE_M * (len(pieces) - 1), max(p.depth for p in pieces)
    for wall, along, pose in along_walls(ctx, pieces[0], rng, "middle", half_m=width / 2):
        if fits(ctx, pieces[0], pose) and leaves_way(ctx, wall, along, WALL_GAP_M + depth):
            x, items = -width / 2, []
            for piece in pieces:
                items.append(Item(piece, pose.then(x + piece.width / 2, (pieces[0].depth - piece.depth) / 2)))
                x += piece.width + ASIDE_M
            yield items


def play(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A rug before two boxes at a wall."""
    rng = ctx.rng("play")
    cloth = rug(ctx, *RUG_M)
    boxes = [ctx.piece("storage_box", f"-{k}") for k in range(2)]
    for _, _, pose in along_walls(ctx, boxes[0], rng, "corner", half_m=RUG_M[0] / 2):
        back = boxes[0].depth / 2
        x = [(box.width + BOXES_APART_M) / 2 * side for box, side in zip(boxes, (-1, 1), strict=True)]
        kept = [Item(box, pose.then(at, back - box.depth / 2)) for box, at in zip(boxes, x, strict=True)]
        on_rug = Pose(0.0, back - RUG_GAP_M - RUG_M[1] / 2)
        lying = Item(cloth, pose.then(on_rug.x, on_rug.y))
        yield [lying, *kept]
