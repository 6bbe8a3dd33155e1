"""Last touches of a room that carry no weight in its plan: curtains beside windows and small things on tops."""

from __future__ import annotations

from collections.abc import Iterator

from hsbench.schema.scene import Part
from hsbench.synth.furniture import Style
from hsbench.synth.furniture.pieces import draw
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.placing import DOOR_SIDE_M, Item, Layout
from hsbench.synth.rooms.poses import Context, Proposal, at_wall
from hsbench.synth.seeds import Seeds

CURTAIN_GAP_M = 0.02
EDGE_M = 0.03  # small things keep this far from the edge of a top
CARRIERS = ("dining_table", "coffee_table", "side_table", "desk", "night_stand", "sideboard", "dresser", "tv_stand",
            "kitchen_counter", "kitchen_island")  # fmt: skip
SPOTS = 6  # places tried for one small thing
MAX_ON_TOP = 3


def curtains(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """Hang a curtain on each side of a window, where nothing stands in its way."""
    for i, hole in enumerate(layout.shell.openings):
        own = seeds.child(f"curtain-{i}")
        if hole.kind != "window" or own.rng("wish").random() >= config.curtain_share:
            continue
        piece = Context(layout, style, own, config).piece("curtain")
        wall = layout.shell.walls[hole.wall]
        off = hole.width_m / 2 + DOOR_SIDE_M + piece.width / 2 + 0.01
        places = [hole.middle_m + s * off for s in (-1, 1)]
        items = [Item(piece, at_wall(wall, piece, p, CURTAIN_GAP_M), optional=True) for p in places]
        layout.place([items])


def clutter_on(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """Put small things on tops; they never hit what stands there already."""
    for i, carrier in enumerate(list(layout.items)):
        if carrier.piece.category_name not in CARRIERS:
            continue
        own = seeds.child(f"clutter-{i}")
        count = int((own.rng("count").random(MAX_ON_TOP) < config.clutter_per_top / MAX_ON_TOP).sum())
        for k in range(count):
            layout.place(_spots(Context(layout, style, own.child(k), config), carrier))


def _spots(ctx: Context, carrier: Item) -> Iterator[Proposal]:
    """Random places on the top of a carrier."""
    rng = ctx.rng("spot")
    piece = ctx.piece("clutter")
    low, high = _top(carrier.piece.parts)
    half_x, half_y = piece.width / 2 + EDGE_M, piece.depth / 2 + EDGE_M
    if high[0] - low[0] < 2 * half_x or high[1] - low[1] < 2 * half_y:
        return
    for _ in range(SPOTS):
        x, y = draw(rng, (low[0] + half_x, high[0] - half_x)), draw(rng, (low[1] + half_y, high[1] - half_y))
        yield [Item(piece, carrier.pose.then(x, y, 0.0, high[2]))]


def _top(parts: tuple[Part, ...]) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Lowest and highest corner of the inner rectangle of the highest part with the role of a top (object frame)."""
    top = max((p for p in parts if p.role == "top"), key=lambda p: float(p.vertices[:, 2].max())).vertices
    (x0, y0, z0), (x1, y1, z1) = top.min(axis=0).tolist(), top.max(axis=0).tolist()
    if len(top) > 8:  # a round top: keep to the square inside it
        x0, y0, x1, y1 = (0.7 * v for v in (x0, y0, x1, y1))
    return (x0, y0, z0), (x1, y1, z1)
