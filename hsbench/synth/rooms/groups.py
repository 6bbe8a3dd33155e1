"""Groups of furniture that belong together: each proposes arrangements, best first.

A group is a generator ``(ctx, mode) -> proposals``; local coordinates are those of its anchor (front -y). Most look at
nothing else in the room, the layout decides; where several pieces must share little space the group asks it beforehand
(``search``). Proposals are made one by one, as the layout asks for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from hsbench.synth.rooms.bathroom import bathroom
from hsbench.synth.rooms.bedroom import bed, bunk
from hsbench.synth.rooms.dining import dining
from hsbench.synth.rooms.dividers import divider
from hsbench.synth.rooms.hall import wardrobe_corner
from hsbench.synth.rooms.kitchen import kitchen
from hsbench.synth.rooms.living import facing_sofas, media, piano, reading
from hsbench.synth.rooms.meeting import meeting
from hsbench.synth.rooms.office import desk
from hsbench.synth.rooms.placing import Item
from hsbench.synth.rooms.poses import Context, Proposal, along_walls, in_corners, jitter
from hsbench.synth.rooms.search import HANG_GAP_M

Group = Callable[[Context, str], Iterator[Proposal]]

MOST_STOOLS = 2  # that stand about


def _at_wall(category_name: str, prefer: str, gap_m: float = 0.02, most: int = 9) -> Group:
    """A single piece with its back to a wall, in a room that has fewer than ``most`` of them."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        if _count(ctx, category_name) < most:
            piece = ctx.piece(category_name)
            for _, _, pose in along_walls(ctx, piece, ctx.rng("place"), prefer, gap_m):
                yield [Item(piece, pose)]

    return propose


def _in_corner(category_name: str, most: int) -> Group:
    """A small piece in a corner, or else along a wall, in a room that has fewer than ``most`` of them."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        if _count(ctx, category_name) < most:
            piece = ctx.piece(category_name)
            rng = ctx.rng("place")
            for pose in in_corners(ctx, piece, rng, 0.04):
                yield [Item(piece, pose)]
            for _, _, pose in along_walls(ctx, piece, rng, "corner", 0.05):
                yield [Item(piece, pose)]

    return propose


def _stool(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A stool at a wall, turned at will."""
    if _count(ctx, "stool") < MOST_STOOLS:
        piece = ctx.piece("stool")
        rng = ctx.rng("place")
        for _, _, pose in along_walls(ctx, piece, rng, "any", 0.08):
            yield [Item(piece, pose.then(0.0, 0.0, jitter(rng, 40.0)))]


def _count(ctx: Context, category_name: str) -> int:
    return sum(item.piece.category_name == category_name for item in ctx.layout.items)


def _or_bare(group: Group) -> Group:
    """The group; in its smallest size each proposal is followed by what of it is required, alone."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        for proposal in group(ctx, mode):
            yield proposal
            if ctx.fit == 0.0 and any(item.optional for item in proposal):
                yield [item for item in proposal if not item.optional]

    return propose


_GROUPS: dict[str, Group] = {
    "media": media,
    "facing": facing_sofas,
    "reading": reading,
    "piano": piano,
    "dining": dining,
    "kitchen": kitchen,
    "bathroom": bathroom,
    "bed": bed,
    "bunk": bunk,
    "desk": desk,
    "meeting": meeting,
    "wardrobe_corner": wardrobe_corner,
    "divider": divider,
    "sofa": _at_wall("sofa", "middle"),
    "wardrobe": _at_wall("wardrobe", "corner"),
    "bookshelf": _at_wall("bookshelf", "corner"),
    "sideboard": _at_wall("sideboard", "middle"),
    "dresser": _at_wall("dresser", "any"),
    "bench": _at_wall("bench", "middle", 0.04, 1),
    "shelf": _at_wall("shelf", "middle", HANG_GAP_M, 2),
    "fridge": _at_wall("fridge", "corner", most=1),
    "washing_machine": _at_wall("washing_machine", "corner", most=1),
    "bathroom_cabinet": _at_wall("bathroom_cabinet", "corner", most=1),
    "laundry_basket": _at_wall("laundry_basket", "corner", most=1),
    "towel_rail": _at_wall("towel_rail", "any", HANG_GAP_M, 2),
    "mirror": _at_wall("mirror", "any", HANG_GAP_M, 1),
    "whiteboard": _at_wall("whiteboard", "middle", HANG_GAP_M, 1),
    "filing_cabinet": _at_wall("filing_cabinet", "corner", most=3),
    "water_cooler": _at_wall("water_cooler", "corner", most=1),
    "coat_rack": _at_wall("coat_rack", "corner", most=1),
    "shoe_cabinet": _at_wall("shoe_cabinet", "any", most=2),
    "waste_bin": _at_wall("waste_bin", "corner", 0.04, 1),
    "storage_box": _at_wall("storage_box", "corner", most=2),
    "side_table": _in_corner("side_table", 2),
    "night_stand": _at_wall("night_stand", "corner", most=2),
    "plant": _in_corner("plant", 3),
    "floor_lamp": _in_corner("floor_lamp", 1),
    "stool": _stool,
}

GROUPS: dict[str, Group] = {name: _or_bare(group) for name, group in _GROUPS.items()}
"""Name used in templates -> group."""
