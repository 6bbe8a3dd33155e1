"""Groups of furniture that belong together: each proposes arrangements, best first.

A group is a generator ``(ctx, mode) -> proposals``; local coordinates are those of its anchor (front -y). Most look at
nothing else in the room, the layout decides; where several pieces must share little space the group asks it beforehand
(``search``). Proposals are made one by one, as the layout asks for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

import numpy as np

from hsbench.synth.furniture import WALL_HUNG
from hsbench.synth.rooms.bathroom import bathroom, wc
from hsbench.synth.rooms.bedroom import bed, bunk
from hsbench.synth.rooms.dining import BENCH_WALL_M, dining
from hsbench.synth.rooms.dividers import divider
from hsbench.synth.rooms.hall import wardrobe_corner
from hsbench.synth.rooms.items import Item
from hsbench.synth.rooms.kitchen import kitchen
from hsbench.synth.rooms.living import facing_sofas, media, piano, reading
from hsbench.synth.rooms.meeting import meeting
from hsbench.synth.rooms.office import desk
from hsbench.synth.rooms.poses import Context, Proposal, along_walls, in_corners, in_room, jitter
from hsbench.synth.rooms.search import HANG_GAP_M, beside_ways, fits, leaves_way, way_before_m
from hsbench.synth.rooms.storage import play, storage

Group = Callable[[Context, str], Iterator[Proposal]]

LOOSE = frozenset(("coat_rack", "waste_bin", "laundry_basket", "water_cooler"))
"""What stands at walls and aside from the line through a door, as plants and lamps do."""
MOST_STOOLS = 2  # that stand about
NO_SHELF_OVER = frozenset(("bed", "bunk_bed", "sofa", "armchair", "dining_table", "meeting_table"))
ASIDE_M = 0.8  # the middle of a table to the line straight out from the board in view
HEAD_M = 0.15  # a shelf to the side of these


def _at_wall(category_name: str, prefer: str, gap_m: float = 0.02, most: int = 9) -> Group:
    """A single piece with its back to a wall and a way before it, in a room that has fewer than ``most`` of them."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        if _count(ctx, category_name) < most:
            piece = ctx.piece(category_name)
            for wall, along, pose in along_walls(ctx, piece, ctx.rng("place"), prefer, gap_m):
                if not fits(ctx, piece, pose):
                    continue
                aside = category_name not in LOOSE or beside_ways(ctx, pose, piece.width / 2)
                if aside and leaves_way(ctx, wall, along, gap_m + piece.depth):
                    yield [Item(piece, pose, front_m=None if category_name in WALL_HUNG else way_before_m(ctx))]

    return propose


def _in_corner(category_name: str, most: int) -> Group:
    """A small piece in a corner or else along a wall, not before a door, in a room with fewer than ``most`` of them."""

    def propose(ctx: Context, mode: str) -> Iterator[Proposal]:
        if _count(ctx, category_name) < most:
            piece = ctx.piece(category_name)
            rng = ctx.rng("place")
            at_walls = (pose for _, _, pose in along_walls(ctx, piece, rng, "corner", 0.05))
            for pose in chain(in_corners(ctx, piece, rng, 0.04), at_walls):
                if fits(ctx, piece, pose) and beside_ways(ctx, pose, piece.width / 2):
                    yield [Item(piece, pose)]

    return propose


def _shelf(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A shelf on a wall, but not over a bed, a seat or a table."""
    below = [item.corners for item in ctx.layout.items if item.piece.category_name in NO_SHELF_OVER]
    for proposal in _at_wall("shelf", "middle", HANG_GAP_M, 2)(ctx, mode):
        a, b = (f(proposal[0].corners, axis=0) for f in (np.min, np.max))
        if not any((np.minimum(b, c.max(axis=0)) - np.maximum(a, c.min(axis=0)) > -HEAD_M).all() for c in below):
            yield proposal


def _whiteboard(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A whiteboard, where there is a table to meet at straight before that."""
    tables = [item for item in ctx.layout.items if item.piece.category_name == "meeting_table"]
    for proposal in _at_wall("whiteboard", "middle", HANG_GAP_M, 1)(ctx, mode):
        pose = proposal[0].pose
        c, s = pose.direction
        if all(abs(c * (t.pose.x - pose.x) + s * (t.pose.y - pose.y)) < ASIDE_M for t in tables):
            yield proposal


def _stool(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A stool at a wall, turned at will."""
    if _count(ctx, "stool") < MOST_STOOLS:
        piece = ctx.piece("stool")
        rng = ctx.rng("place")
        for _, _, pose in along_walls(ctx, piece, rng, "any", 0.08):
            yield [Item(piece, pose.then(0.0, 0.0, jitter(rng, 40.0)))]


def _lone_rug(ctx: Context, mode: str) -> Iterator[Proposal]:
    """A rug on bare floor, in a room without one."""
    if _count(ctx, "rug") == 0:
        piece = ctx.piece("rug")
        for pose in in_room(ctx, ctx.rng("place"), piece.width / 2):
            yield [Item(piece, pose)]


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
    "wc": wc,
    "bed": bed,
    "bunk": bunk,
    "desk": desk,
    "meeting": meeting,
    "wardrobe_corner": wardrobe_corner,
    "divider": divider,
    "storage": storage,
    "play": play,
    "sofa": _at_wall("sofa", "middle"),
    "wardrobe": _at_wall("wardrobe", "corner"),
    "bookshelf": _at_wall("bookshelf", "corner"),
    "sideboard": _at_wall("sideboard", "middle"),
    "dresser": _at_wall("dresser", "any"),
    "bench": _at_wall("bench", "middle", BENCH_WALL_M, 1),
    "shelf": _shelf,
    "fridge": _at_wall("fridge", "corner", most=1),
    "washing_machine": _at_wall("washing_machine", "corner", most=1),
    "bathroom_cabinet": _at_wall("bathroom_cabinet", "corner", most=1),
    "laundry_basket": _at_wall("laundry_basket", "corner", most=1),
    "towel_rail": _at_wall("towel_rail", "any", HANG_GAP_M, 1),
    "mirror": _at_wall("mirror", "any", HANG_GAP_M, 1),
    "whiteboard": _whiteboard,
    "filing_cabinet": _at_wall("filing_cabinet", "corner", most=3),
    "water_cooler": _at_wall("water_cooler", "corner", most=1),
    "coat_rack": _at_wall("coat_rack", "corner", most=1),
    "shoe_cabinet": _at_wall("shoe_cabinet", "any", most=2),
    "waste_bin": _at_wall("waste_bin", "corner", 0.04, 1),
    "plant": _in_corner("plant", 3),
    "floor_lamp": _in_corner("floor_lamp", 1),
    "stool": _stool,
    "rug": _lone_rug,
}

GROUPS: dict[str, Group] = {name: _or_bare(group) for name, group in _GROUPS.items()}
"""Name used in templates -> group."""
