"""Small things on tops, boards and seats, chosen to suit what carries them, where they hit nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hsbench.geometry.convex import span
from hsbench.schema.scene import Part
from hsbench.synth.furniture import Style
from hsbench.synth.furniture.pieces import draw, pick
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.items import Piece, Pose
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.poses import QUARTER, Context, jitter
from hsbench.synth.rooms.surfaces import EDGE_M, Carrier, half_size, surfaces
from hsbench.synth.seeds import Seeds

SUITED: Mapping[str, tuple[str, ...]] = {
    "dining_table": ("bowl", "vase", "bottle", "cup", "plate"),
    "coffee_table": ("books", "cup", "vase", "bowl", "clutter"),
    "side_table": ("table_lamp", "books", "cup", "vase"),
    "night_stand": ("table_lamp", "table_lamp", "books", "cup"),
    "desk": ("books", "cup", "books", "storage_box", "clutter"),
    "meeting_table": ("laptop", "cup", "bottle", "books"),
    "sideboard": ("vase", "table_lamp", "books", "bowl", "clutter"),
    "dresser": ("table_lamp", "vase", "books", "storage_box", "clutter"),
    "tv_stand": ("books", "vase", "clutter"),
    "filing_cabinet": ("books", "storage_box", "vase", "cup"),
    "shoe_cabinet": ("vase", "bowl", "clutter"),
    "kitchen_counter": ("kettle", "microwave", "bottle", "bowl", "plate", "cup"),
    "kitchen_island": ("bowl", "bottle", "plate", "cup", "vase"),
    "dishwasher": ("kettle", "plate", "bowl", "cup"),
    "washing_machine": ("storage_box", "bowl"),
    "washbasin": ("cup",),
    "bathroom_cabinet": ("cup", "storage_box", "vase"),
    "bookshelf": ("books", "books", "storage_box", "vase", "clutter"),
    "shelf": ("books", "vase", "clutter", "bowl"),
}
"""Carrier -> things that may stand on it; twice means twice as likely."""

ONCE: frozenset[str] = frozenset(("microwave", "kettle", "table_lamp", "laptop"))
"""At most one of these on one surface."""
ONE_A_ROOM: frozenset[str] = frozenset(("microwave", "kettle"))
SETS: frozenset[str] = frozenset(("plate", "cup", "table_lamp", "kettle", "microwave", "laptop"))
"""Categories of which a room has one shape; it has ``SHAPES`` of others, ``BOOK_SHAPES`` of books."""
SHAPES = 2
BOOK_SHAPES = 6
AT_BACK: frozenset[str] = frozenset(("microwave", "table_lamp", "storage_box"))
"""Categories that stand at the back of a top."""
TURN_DEG: Mapping[str, float] = {"books": 12.0, "clutter": 20.0, "cup": 90.0, "vase": 90.0, "kettle": 20.0}
"""How far things are turned from the front of what carries them, at most."""

TRIES = 8  # places tried for one thing
TOP_M2 = 0.5  # a top of this size carries ``clutter_per_top`` things on average,
TOP_SHARES = (0.6, 2.0)  # the smallest and the largest this much of it,
BOARD_SHARE = 0.4  # and each board of a shelf this much
MOST = 5  # things on one surface
SETTING: Mapping[str, str] = {"dining_table": "plate", "meeting_table": "laptop"}
"""Table -> what lies before every seat at ``SETTING_SHARE`` of them."""
SETTING_SHARE = 0.35
SEAT_REACH_M = 0.75  # from the middle of a chair to the edge of its table
BEFORE_SEAT_M = 0.06  # from the edge of a table to what lies before a seat
HOBS = ("kitchen_counter", "stove")
POT_SHARE = 0.6  # of hobs with a pot on a plate
POT_TURN_DEG = 12.0
CUSHION_SHARE: Mapping[str, float] = {"sofa": 0.7, "bed": 0.35}
CUSHION_TURN_DEG = 4.0  # it stands on its edge, so that one can sit before it
SIT_BEFORE_M = 0.4  # depth of a seat before a cushion: a patch of .35 m and the bevel of its edge
CUSHION_GAP_M = 0.01  # to the back of a sofa or the pillows of a bed


@dataclass(frozen=True, eq=False)
class _Room:
    """A room while small things are put on its furniture: its shapes, and the categories that are there."""

    layout: Layout
    ctx: Context
    present: set[str] = field(default_factory=set)

    def piece(self, category_name: str, rng: np.random.Generator) -> Piece:
        """One of the room's shapes of a category."""
        shapes = 1 if category_name in SETS else BOOK_SHAPES if category_name == "books" else SHAPES
        return self.ctx.piece(category_name, f"-{int(rng.integers(shapes))}")


def small_things(layout: Layout, style: Style, seeds: Seeds, config: RoomConfig) -> None:
    """Lay tables, put lamps, books, pots and the like on tops and boards, cushions on sofas and beds."""
    room = _Room(layout, Context(layout, style, seeds.child("things"), config))
    for i, item in enumerate(list(layout.items)):
        name = item.piece.category_name
        rng = seeds.rng(f"things-{i}")
        if name not in SUITED and name not in HOBS and name not in CUSHION_SHARE:
            continue
        carrier = Carrier.of(layout, item)
        if rng.random() < CUSHION_SHARE.get(name, 0.0):
            _cushions(room, carrier, rng)
        if name in SETTING and rng.random() < SETTING_SHARE:
            _set_table(room, carrier, rng)
        if name in HOBS and rng.random() < POT_SHARE:
            _pot(room, carrier, rng)
        for top in surfaces(item.piece.parts) if name in SUITED else ():
            _fill(room, carrier, top, rng)


def _fill(room: _Room, carrier: Carrier, top: Part, rng: np.random.Generator) -> None:
    """Some things on one surface."""
    low, high = (v[:2] for v in (top.vertices.min(axis=0), top.vertices.max(axis=0)))
    share = min(max(float(np.prod(high - low)) / TOP_M2, TOP_SHARES[0]), TOP_SHARES[1])
    mean = room.ctx.config.clutter_per_top * (BOARD_SHARE if top.role == "shelf" else share)
    placed: set[str] = set()
    for _ in range(int((rng.random(MOST) < mean / MOST).sum())):
        name = pick(rng, SUITED[carrier.item.piece.category_name])
        if (name in ONCE and name in placed) or (name in ONE_A_ROOM and name in room.present):
            continue
        piece = room.piece(name, rng)
        for _ in range(TRIES):
            yaw = jitter(rng, TURN_DEG.get(name, 0.0))
            first, last = low + half_size(piece, yaw), high - half_size(piece, yaw)
            if (first > last).any():
                continue
            x, y = (draw(rng, (float(a), float(b))) for a, b in zip(first, last, strict=True))
            if carrier.put(room.layout, top, piece, Pose(x, float(last[1]) if name in AT_BACK else y, yaw)):
                placed.add(name)
                room.present.add(name)
                break


def _set_table(room: _Room, carrier: Carrier, rng: np.random.Generator) -> None:
    """A plate and a cup, or a laptop and a cup, before every chair at a table."""
    table = carrier.item.piece
    top = max(surfaces(table.parts), key=lambda p: float(p.vertices[:, 2].max()))
    piece, cup = room.piece(SETTING[table.category_name], rng), room.piece("cup", rng)
    half = np.array([table.width, table.depth]) / 2
    for seat in [i for i in room.layout.items if i.piece.category_name.endswith("chair")]:
        x, y = carrier.points(np.array([[seat.pose.x, seat.pose.y]]))[0].tolist()
        beyond = np.maximum(np.abs([x, y]) - half, 0.0)
        if math.hypot(*beyond) > SEAT_REACH_M:
            continue
        at_side = beyond[1] >= beyond[0]
        out = half[int(at_side)] - BEFORE_SEAT_M - piece.depth / 2
        at = Pose(x, math.copysign(out, y)) if at_side else Pose(math.copysign(out, x), y)
        # Squared to the table, and with its front to who sits there.
        yaw = (round((seat.pose.yaw - carrier.item.pose.yaw) / QUARTER) + 2) * QUARTER
        if carrier.put(room.layout, top, piece, Pose(at.x, at.y, yaw)):
            beside = Pose(at.x, at.y, yaw).then((piece.width + cup.width) / 2 + 2 * EDGE_M, 0.0)
            carrier.put(room.layout, top, cup, beside)


def _pot(room: _Room, carrier: Carrier, rng: np.random.Generator) -> None:
    """A pot on one of the plates of a hob; it may be wider than its plate."""
    parts = carrier.item.piece.parts
    hob = next((p.vertices for p in parts if p.name == "hob"), None)
    plates = [p.vertices for p in parts if p.name.startswith("plate")]
    if hob is None or not plates:
        return
    (x0, y0, z0), (x1, y1, _) = hob.min(axis=0).tolist(), hob.max(axis=0).tolist()
    top = Part("hob", (0, 0, 0), None, span((x0, y0, z0), (x1, y1, float(plates[0][:, 2].max()))))
    for i in rng.permutation(len(plates)):
        x, y = plates[int(i)][:, :2].mean(axis=0).tolist()
        if carrier.put(room.layout, top, room.piece("pot", rng), Pose(x, y, jitter(rng, POT_TURN_DEG)), lying=True):
            return


def _cushions(room: _Room, carrier: Carrier, rng: np.random.Generator) -> None:
    """Cushions on the outer seats of a sofa, one seat at least left free, or below the pillows of a bed."""
    parts = carrier.item.piece.parts
    seats = [p for p in parts if p.role == "seat"]
    seats.sort(key=lambda p: float(p.vertices[:, 0].sum()))
    if seats:
        both = len(seats) > 2 and rng.random() < 0.5
        chosen = [seats[0], seats[-1]] if both else [pick(rng, (seats[0], seats[-1]))]
        chosen = chosen[: len(seats) - 1]
    else:
        chosen = [p for p in parts if p.role == "mattress"]
    for seat in chosen:
        piece, yaw = room.piece("cushion", rng), jitter(rng, CUSHION_TURN_DEG)
        low, high = seat.vertices.min(axis=0), seat.vertices.max(axis=0)
        y = float(high[1]) - float(half_size(piece, yaw)[1]) - CUSHION_GAP_M
        if seats and y - half_size(piece, yaw)[1] - low[1] < SIT_BEFORE_M:
            continue
        carrier.put(room.layout, seat, piece, Pose(float(low[0] + high[0]) / 2, y, yaw), lying=True)
