"""Bathroom: bath or shower, toilet and washbasin found together; mirror, cabinet, towels and laundry beside them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.synth.rooms.clearance import CLEAR_SIDE_M
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.living import rug
from hsbench.synth.rooms.poses import QUARTER, WALL_GAP_M, Context, Proposal, along_walls
from hsbench.synth.rooms.search import HANG_GAP_M, below_window, together

MIRROR_OVER_M = 0.15  # least height of a mirror's lower edge above the rim of its basin
BASIN_PITCH_M = 0.08  # between two basins
RAIL_GAP_M = 0.05  # basin to towel rail
TWO_RAILS_SHARE = 0.3  # of basins with a rail on both sides
MAT_SHARE, MAT_M, MAT_GAP_M = 0.7, (0.8, 0.5), 0.03  # of baths and showers, width and depth, way to it


def bathroom(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Shower (``shower``) or bath (``tub``), toilet, basin with mirror; ``double``: two basins side by side.

    The smallest size takes a shower, or a bath where only that has a place (under a window).
    """
    rng = ctx.rng("bathroom")
    toilets = _toilets(ctx, rng)
    basins = _basins(ctx, rng, 1)
    wanted = "bathtub" if mode == "tub" else "shower"
    for name in ("shower", "bathtub") if ctx.fit == 0.0 else (wanted,):
        wet = _wet(ctx, ctx.piece(name), rng)
        if mode == "double" and ctx.fit > 0.0:
            yield from together(ctx, (wet, _basins(ctx, rng, 2), toilets))
        yield from together(ctx, (wet, basins, toilets))


def wc(ctx: Context, mode: str) -> Iterator[Proposal]:
    """Toilet and basin with mirror, as in an office."""
    rng = ctx.rng("bathroom")
    yield from together(ctx, (_toilets(ctx, rng), _basins(ctx, rng, 1)))


def _wet(ctx: Context, piece: Piece, rng: np.random.Generator) -> list[Proposal]:
    """A bath or shower in a corner, its long side or its short one at the wall; a mat before it."""
    turns = (0.0, QUARTER, -QUARTER) if piece.category_name == "bathtub" else (0.0,)
    mat = rug(ctx, *MAT_M)
    y = -(piece.depth + mat.depth) / 2 - MAT_GAP_M
    matted = rng.random() < MAT_SHARE
    return [
        [Item(piece, pose), *[Item(mat, pose.then(0.0, y), optional=True)] * matted]
        for turn in turns
        for _, _, pose in along_walls(ctx, piece, rng, "corner", WALL_GAP_M, turn=turn)
    ]


def _toilets(ctx: Context, rng: np.random.Generator) -> list[Proposal]:
    piece = ctx.piece("toilet")
    half = piece.width / 2 + CLEAR_SIDE_M["toilet"]
    proposals = [[Item(piece, pose)] for _, _, pose in along_walls(ctx, piece, rng, "any", WALL_GAP_M, half_m=half)]
    return sorted(proposals, key=lambda items: below_window(ctx, items[0]))


def _basins(ctx: Context, rng: np.random.Generator, count: int) -> list[Proposal]:
    """One or two basins at a wall, each with its mirror above; a towel rail beside them where there is space."""
    piece, rail = ctx.piece("washbasin"), ctx.piece("towel_rail")
    mirror = ctx.piece("mirror")
    pitch = piece.width + BASIN_PITCH_M
    places = [(i - (count - 1) / 2) * pitch for i in range(count)]
    half = count * pitch / 2
    proposals = []
    for _, _, pose in along_walls(ctx, piece, rng, "middle", WALL_GAP_M, half_m=half):
        items = [Item(piece, pose.then(x, 0.0)) for x in places]
        items += [Item(mirror, over(piece, mirror, item.pose), optional=True) for item in items]
        for side in (-1, 1):
            x = side * (half + rail.width / 2 + RAIL_GAP_M)
            back = (piece.depth - rail.depth) / 2 + WALL_GAP_M - HANG_GAP_M
            items.append(Item(rail, pose.then(x, back), optional=True))
        proposals.append(items if rng.random() < TWO_RAILS_SHARE else items[:-1])
    # Where the mirror has its place comes before where a window is.
    return sorted(proposals, key=lambda items: not ctx.layout.free_of(items[count], items[:count]))


def over(below: Piece, hung: Piece, pose: Pose, gap_m: float = MIRROR_OVER_M) -> Pose:
    """Where a piece hangs at the wall behind another one at ``pose``, lifted if need be until it clears it."""
    low = float(hung.bounds[0, 2])
    back = (below.depth - hung.depth) / 2 + WALL_GAP_M - HANG_GAP_M
    return pose.then(0.0, back, 0.0, max(0.0, below.height + gap_m - low))
