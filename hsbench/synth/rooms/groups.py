"""Groups of furniture that belong together: each proposes arrangements, best first.

A group is a generator ``(ctx, mode) -> proposals``; local coordinates are those of its anchor (front -y). The layout
decides; nothing here looks at what else is in the room.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from hsbench.synth.rooms.dining import dining, kitchen
from hsbench.synth.rooms.living import facing_sofas, media, reading
from hsbench.synth.rooms.placing import Item
from hsbench.synth.rooms.poses import Context, Proposal, along_walls, in_corners, jitter
from hsbench.synth.rooms.private import bed, desk, partition

Group = Callable[[Context, str], Iterator[Proposal]]


def _at_wall(category_name: str, prefer: str, gap_m: float = 0.02) -> Group:
    """A single piece with its back to a wall."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        piece = ctx.piece(category_name)
        for _, _, pose in along_walls(ctx, piece, ctx.rng("place"), prefer, gap_m):
            yield [Item(piece, pose)]

    return propose


def _in_corner(category_name: str) -> Group:
    """A small piece in a corner, or else along a wall."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        piece = ctx.piece(category_name)
        rng = ctx.rng("place")
        for pose in in_corners(ctx, piece, rng, 0.04):
            yield [Item(piece, pose)]
        for _, _, pose in along_walls(ctx, piece, rng, "corner", 0.05):
            yield [Item(piece, pose)]

    return propose


def _stool(ctx: Context, mode: str) -> Iterator[Proposal]:
    piece = ctx.piece("stool")
    rng = ctx.rng("place")
    for _, _, pose in along_walls(ctx, piece, rng, "any", 0.08):
        yield [Item(piece, pose.then(0.0, 0.0, jitter(rng, 40.0)))]


GROUPS: dict[str, Group] = {
    "media": media,
    "facing": facing_sofas,
    "reading": reading,
    "dining": dining,
    "kitchen": kitchen,
    "bed": bed,
    "desk": desk,
    "partition": partition,
    "sofa": _at_wall("sofa", "middle"),
    "wardrobe": _at_wall("wardrobe", "corner"),
    "bookshelf": _at_wall("bookshelf", "corner"),
    "sideboard": _at_wall("sideboard", "middle"),
    "dresser": _at_wall("dresser", "any"),
    "bench": _at_wall("bench", "middle", 0.04),
    "shelf": _at_wall("shelf", "middle", 0.0),
    "side_table": _in_corner("side_table"),
    "night_stand": _at_wall("night_stand", "corner"),
    "plant": _in_corner("plant"),
    "floor_lamp": _in_corner("floor_lamp"),
    "stool": _stool,
}
"""Name used in templates -> group."""
