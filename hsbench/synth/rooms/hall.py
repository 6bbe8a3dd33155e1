"""Hall and corridor: shoes, coats, a mirror and a seat, shallow and along the walls."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.rooms.bathroom import over
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.poses import WALL_GAP_M, Context, Proposal, along_walls
from hsbench.synth.rooms.search import beside_ways, leaves_way

BESIDE_M = 0.06  # between what stands side by side


def wardrobe_corner(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A shoe cabinet with a mirror above it and a coat rack beside it."""
    rng = ctx.rng("hall")
    shoes, mirror, coats = ctx.piece("shoe_cabinet"), ctx.piece("mirror"), ctx.piece("coat_rack")
    x = (shoes.width + coats.width) / 2 + BESIDE_M
    for wall, along, pose in along_walls(ctx, shoes, rng, "corner"):
        if not leaves_way(ctx, wall, along, WALL_GAP_M + max(shoes.depth, coats.depth)):
            continue
        items = [Item(shoes, pose), Item(mirror, over(shoes, mirror, pose), optional=True)]
        racks = (pose.then(s * x, (shoes.depth - coats.depth) / 2) for s in (1, -1))
        aside = (at for at in racks if beside_ways(ctx, at, coats.width / 2))
        yield [*items, *(Item(coats, at, optional=True) for at in aside)]
