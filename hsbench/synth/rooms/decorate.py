"""What hangs on walls and ceilings: radiators under windows, curtains beside them, lamps, pictures and clocks.

Each function has the shape ``f(layout, style, seeds, config)`` and adds to the layout what finds its place.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hsbench.geometry.convex import span
from hsbench.geometry.polygons import contains, outline_distance
from hsbench.schema.scene import Part
from hsbench.synth.furniture import Style, size
from hsbench.synth.furniture.lamps import CEILING_LAMPS, ceiling_lamp_of
from hsbench.synth.furniture.pieces import draw
from hsbench.synth.furniture.textiles import curtain_of
from hsbench.synth.furniture.wall import picture_of
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.items import Item, Piece, Pose
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.poses import Context, at_wall
from hsbench.synth.rooms.search import HANG_GAP_M
from hsbench.synth.rooms.shell import DOOR_SIDE_M, Opening, Wall
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray

CURTAIN_SHARE = 0.3  # width of a curtain drawn aside, of that of its window
CURTAIN_SIDE_M = 0.01  # to what is kept free before a window
CURTAIN_LIFT_M = 0.045  # it ends above the skirting
RADIATOR_SHARE = 0.8  # of windows with one below
UNDER_SILL_M = 0.06  # least space between radiator and window zone
LAMP_HEAD_M = 2.0  # below a lamp that people pass under
OVER_TABLE_M = 0.65  # below a lamp over a table
LAMP_APART_M = 3.0
LAMP_GRID_M = 0.2
OFF_CENTRE = 0.2  # weight of the way from the middle of the room against the distance from its walls
SECOND_LAMP_SHARE = 0.8  # another lamp hangs where walls are at least this far, compared with the first
EYE_M = 1.5  # middle of a picture above the floor: museums hang at 1.45 to 1.55 m
HIGHEST_M = 1.9  # and the highest middle over furniture
ABOVE_M, BESIDE_M = 0.12, 0.05  # picture to what stands below it, and what counts as below
THIN_M = 0.01  # less than any picture
SIDE_BY_SIDE_M, SAME_HEIGHT_M = 1.0, 0.005  # pictures of a wall no farther apart have their middles at one height
CLOCK_M = 1.95
TO_CEILING_M = 0.1
PICTURES_PER_M = 0.16  # of wall, on average
ROW_SHARE, ROW_GAP_M = 0.35, 0.1  # of places with several pictures in a row, and the space between them
CLOCK_SHARE = 0.25
MOST_IN_ROW = 3
PLACE_M = 0.4  # between places on bare walls
PLAIN_LAMPS = CEILING_LAMPS[:1]
LAMPS_OF: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("living", "dining", "bedroom"), CEILING_LAMPS),
    **dict.fromkeys(("kitchen", "study", "meeting"), CEILING_LAMPS[:2]),
}
"""Room type -> kinds of lamps under its ceiling; others have plain ones."""
TABLES = ("dining_table", "meeting_table", "kitchen_island")
BELOW_PICTURES = ("sofa", "bed", "sideboard", "dresser", "desk", "piano", "bench", "shoe_cabinet", "dining_table")
WET = "toilet"  # a room with one has neither curtains nor pictures


def radiators(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """A radiator under the middle of a window, as wide as the window allows."""
    for i, hole, wall in _windows(layout):
        own = seeds.child(f"radiator-{i}")
        if own.rng("wish").random() >= RADIATOR_SHARE:
            continue
        for fit in (1.0, 0.0):
            piece = Context(layout, style, own, config).piece("radiator", fit=fit)
            if piece.width <= hole.width_m and piece.height + UNDER_SILL_M <= hole.low_m:
                layout.place([[Item(piece, at_wall(wall, piece, hole.middle_m, HANG_GAP_M))]])
                break


def curtains(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """A curtain on each side of a window, on one only where the wall ends; none where something stands in the way."""
    if _is_wet(layout):
        return
    for i, hole, wall in _windows(layout):
        own = seeds.child(f"curtain-{i}")
        if own.rng("wish").random() >= config.curtain_share:
            continue
        piece = Piece("curtain", curtain_of(own.rng("shape"), style, CURTAIN_SHARE * hole.width_m))
        off = hole.width_m / 2 + DOOR_SIDE_M + piece.width / 2 + CURTAIN_SIDE_M
        places = [hole.middle_m + s * off for s in (-1, 1)]
        places = [p for p in places if piece.width / 2 < p < wall.length_m - piece.width / 2]
        poses = (at_wall(wall, piece, p, HANG_GAP_M) for p in places)
        layout.place([[Item(piece, pose.then(0.0, 0.0, 0.0, CURTAIN_LIFT_M)) for pose in poses]])


def _windows(layout: Layout) -> Iterator[tuple[int, Opening, Wall]]:
    for i, hole in enumerate(layout.shell.openings):
        if hole.kind == "window":
            yield i, hole, layout.shell.walls[hole.wall]


def _is_wet(layout: Layout) -> bool:
    return any(item.piece.category_name == WET for item in layout.items)


def ceiling_lamps(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """A lamp over each large table, or in the middle of the room; more where a long room has other middles."""
    height = layout.shell.size_m[2]
    tall, flat = (
        Piece("ceiling_lamp", ceiling_lamp_of(seeds.child("lamp").rng("shape"), style, kinds, fit))
        for kinds, fit in ((LAMPS_OF.get(layout.room_type, PLAIN_LAMPS), 1.0), (PLAIN_LAMPS, 0.0))
    )
    hung: list[FloatArray] = []
    for item in layout.items:
        if item.piece.category_name in TABLES:
            free = height - item.z_range[1] - OVER_TABLE_M
            piece = tall if -tall.bounds[0, 2] <= free else flat
            hung.append(np.array([item.pose.x, item.pose.y]))
            layout.place([[Item(piece, Pose(item.pose.x, item.pose.y, item.pose.yaw, height))]])
    for xy in _middles(layout.shell.outline_xy, hung):
        for piece in (tall, flat):
            if height + piece.bounds[0, 2] >= LAMP_HEAD_M:
                layout.place([[Item(piece, Pose(float(xy[0]), float(xy[1]), 0.0, height))]])
                break


def _middles(outline_xy: FloatArray, taken: list[FloatArray]) -> list[FloatArray]:
    """(2,) points far from the walls, the one nearest the middle first, all apart from each other and ``taken``."""
    low, high = outline_xy.min(axis=0), outline_xy.max(axis=0)
    axes = (np.arange(a + LAMP_GRID_M, b - LAMP_GRID_M / 2, LAMP_GRID_M) for a, b in zip(low, high, strict=True))
    # The grid has a point in the middle of the box.
    shift = (high - low) / 2 % LAMP_GRID_M
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2) + shift
    points = points[contains(outline_xy, points)]
    clear = outline_distance(outline_xy, points)
    worth = clear - OFF_CENTRE * np.linalg.norm(points - (low + high) / 2, axis=1)
    least = SECOND_LAMP_SHARE * clear.max()
    found: list[FloatArray] = []
    for k in np.argsort(-worth.round(6), kind="stable"):
        apart = [float(np.linalg.norm(points[k] - p)) for p in (*taken, *found)]
        if clear[k] >= least and min(apart, default=LAMP_APART_M) >= LAMP_APART_M:
            found.append(points[k])
    return found


def pictures(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """Pictures at eye height, above low furniture first, and a clock now and then."""
    if _is_wet(layout):
        return
    rng = seeds.rng("pictures")
    ctx = Context(layout, style, seeds.child("picture"), config)
    around = sum(w.length_m for w in layout.shell.walls)
    wanted = int(rng.integers(1, max(1, round(2 * PICTURES_PER_M * around)), endpoint=True))
    items: list[Item] = []
    places = [*_above_furniture(layout), *_bare_places(layout, rng)]
    for k, (wall, along, width) in enumerate(places):
        if len(items) >= wanted:
            break
        format_rng = ctx.rng(f"format-{k}")
        width_m, height_m = draw(format_rng, size("picture").width_m), draw(format_rng, size("picture").height_m)
        count = min(MOST_IN_ROW, int((width + ROW_GAP_M) / (width_m + ROW_GAP_M))) if rng.random() < ROW_SHARE else 1
        count = max(1, min(count, wanted - len(items)))
        half = (count * (width_m + ROW_GAP_M) - ROW_GAP_M) / 2
        if not half <= along <= wall.length_m - half:
            continue
        # Most places are taken: a plain box shows it before pictures are made.
        low, high = (-width_m / 2, -THIN_M / 2, 0.0), (width_m / 2, THIN_M / 2, height_m)
        box = Piece("picture", (Part("box", (0, 0, 0), None, span(low, high)),))
        tried = _row(layout, [box] * count, wall, along)
        if not tried or not all(layout.free_of(item, ()) for item in tried):
            continue
        if any(_uneven(a, b) for a in tried for b in items):
            continue
        framed = [(ctx.rng(f"frame-{k}"), ctx.rng(f"image-{k}-{i}")) for i in range(count)]  # alike in a row
        row = _row(
            layout, [Piece("picture", picture_of(*own, style, width_m, height_m)) for own in framed], wall, along
        )
        if row and all(layout.free_of(item, ()) for item in row):
            items += layout.place([row])
    if rng.random() < CLOCK_SHARE:
        clock = ctx.piece("wall_clock")
        spots = (_hung(clock, wall, along, CLOCK_M) for wall, along, _ in _bare_places(layout, rng))
        layout.place([spot] for spot in spots if layout.free_of(spot, ()))


def _above_furniture(layout: Layout) -> Iterator[tuple[Wall, float, float]]:
    """(wall, place along it, width) of the middle of what is low and has its back to a wall."""
    for item in layout.items:
        if item.piece.category_name in BELOW_PICTURES:
            for wall in layout.shell.walls:
                to = np.array([item.pose.x, item.pose.y]) - wall.start
                along, off = float(to @ wall.along), float(to @ wall.inward)
                if 0 < along < wall.length_m and 0 <= off - item.piece.depth / 2 < PLACE_M / 2:
                    yield wall, along, item.piece.width


def _bare_places(layout: Layout, rng: np.random.Generator) -> list[tuple[Wall, float, float]]:
    """(wall, place along it, width to fill) anywhere, in random order, the middles of walls first."""
    places = []
    for wall in layout.shell.walls:
        for along in np.arange(PLACE_M / 2, wall.length_m - PLACE_M / 2 + 1e-9, PLACE_M).tolist():
            off = abs(2 * along / wall.length_m - 1)
            places.append((off + rng.random(), wall, along))
    return [(wall, along, PLACE_M) for _, wall, along in sorted(places, key=lambda p: p[0])]


def _row(layout: Layout, pieces: Sequence[Piece], wall: Wall, along: float) -> list[Item]:
    """Pictures of one size side by side about a place, above what stands there; none if that is too high."""
    pitch = pieces[0].width + ROW_GAP_M
    half = float(pieces[0].bounds[1, 2] - pieces[0].bounds[0, 2]) / 2
    places = [along + (i - (len(pieces) - 1) / 2) * pitch for i in range(len(pieces))]
    first = [_hung(piece, wall, at, EYE_M) for piece, at in zip(pieces, places, strict=True)]
    below = [_top_below(layout, item) for item in first]
    middle = max(EYE_M, max(below) + half)
    if middle > HIGHEST_M or middle + half > layout.shell.size_m[2] - TO_CEILING_M:
        return []
    return [_hung(piece, wall, at, middle) for piece, at in zip(pieces, places, strict=True)]


def _uneven(a: Item, b: Item) -> bool:
    """Whether two pictures hang side by side on one wall at different heights."""
    (x0, y0), (x1, y1) = a.corners.min(axis=0), a.corners.max(axis=0)
    (u0, v0), (u1, v1) = b.corners.min(axis=0), b.corners.max(axis=0)
    near = max(u0 - x1, x0 - u1) < SIDE_BY_SIDE_M and max(v0 - y1, y0 - v1) < SIDE_BY_SIDE_M
    return a.pose.yaw == b.pose.yaw and near and abs(sum(a.z_range) - sum(b.z_range)) / 2 > SAME_HEIGHT_M


def _hung(piece: Piece, wall: Wall, along: float, middle_m: float) -> Item:
    """A piece flat on a wall with its middle at a height."""
    pose = at_wall(wall, piece, along, HANG_GAP_M)
    lift = middle_m - float(piece.bounds[:, 2].mean())
    return Item(piece, Pose(pose.x, pose.y, pose.yaw, lift))


def _top_below(layout: Layout, hung: Item) -> float:
    """Where a picture may begin above what stands under a place on the wall, 0 where nothing does."""
    low, high = hung.corners.min(axis=0), hung.corners.max(axis=0)
    tops = [0.0]
    for item in layout.items:
        a, b = item.corners.min(axis=0), item.corners.max(axis=0)
        if (np.minimum(b, high) - np.maximum(a, low) > -BESIDE_M).all() and item.z_range[0] < EYE_M:
            tops.append(max(item.z_range[1] + ABOVE_M, item.taken_z[1]))
    return max(tops)
