"""Hall and corridor: shoes, coats, a mirror and a seat, shallow and along the walls."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.synth.rooms.bathroom import over
from hsbench.synth.rooms.placing import Item
from hsbench.synth.rooms.poses import Context, Proposal, along_walls

BESIDE_M = 0.06  # between what stands side by side


def wardrobe_corner(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A shoe cabinet with a mirror above it and a coat rack beside it."""
    rng = ctx.rng("hall")
    shoes, mirror, coats = ctx.piece("shoe_cabinet"), ctx.piece("mirror"), ctx.piece("coat_rack")
    x = (shoes.width + coats.width) / 2 + BESIDE_M
    for _, _, pose in along_walls(ctx, shoes, rng, "corner"):
        items = [Item(shoes, pose), Item(mirror, over(shoes, mirror, pose), optional=True)]
        y = (shoes.depth - coats.depth) / 2
        yield [*items, *(Item(coats, pose.then(s * x, y), optional=True) for s in (1, -1))]
