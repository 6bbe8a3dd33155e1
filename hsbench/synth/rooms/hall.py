"""Hall and corridor: shoes, coats, a mirror and a seat, shallow and along the walls."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.rooms.bathroom import over
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.poses import Context, Proposal, along_walls
from hsbench.synth.rooms.search import beside_ways, way_before_m

BESIDE_M = 0.06  # between what stands side by side


def wardrobe_corner(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A shoe cabinet with a mirror above it and a coat rack beside it where people still pass."""
    rng = ctx.rng("hall")
    shoes, mirror, coats = ctx.piece("shoe_cabinet"), ctx.piece("mirror"), ctx.piece("coat_rack")
    x = (shoes.width + coats.width) / 2 + BESIDE_M
    way_m = way_before_m(ctx)
    for _, _, pose in along_walls(ctx, shoes, rng, "corner"):
        items = [Item(shoes, pose, front_m=way_m), Item(mirror, over(shoes, mirror, pose), optional=True)]
        racks = (pose.then(s * x, (shoes.depth - coats.depth) / 2) for s in (1, -1))
        aside = (at for at in racks if beside_ways(ctx, at, coats.width / 2))
        yield [*items, *(Item(coats, at, optional=True, front_m=way_m) for at in aside)]
