"""Rooms of flats and offices: two bands of rooms along a corridor, a large room at its head, wings and shafts.

Many arrangements are drawn and the one whose rooms come nearest to what is usual is taken, so that there is always a
plan. Everything is in whole centimetres, given in millimetres. Before it is turned the corridor runs along x:

    top     | room | room | room |
            ----------------------  head
    corridor                      |
            ----------------------
    bottom  | room |  room       |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hsbench.synth.rooms.plan_shapes import CM, turn
from hsbench.synth.rooms.regions import Rect
from hsbench.synth.rooms.room_kinds import ROOM_KINDS

DRAWN = 60  # arrangements to choose from
SLENDER_COST = 12.0  # of a ratio of sides twice as large as it should be; a size e times too large or small costs 1
CORRIDOR_MM = (1300, 1700)
CONTACT_MM = 1200  # of each room's wall at the corridor: a door, its casings and a leaf
DEEPEST_MM = 5200  # of a band: light comes from one side
LEAST_WING_MM = 1250  # narrower leftovers are of no use to anybody
LEAST_END_MM = 1700  # of what reaches around the end of the corridor: a leaf may open into it, and one walks past
HEADS = frozenset(("living", "meeting", "office", "dining"))
"""Rooms that may lie across the end of the corridor."""
HOSTS = ("living", "dining", "office", "meeting", "study", "bedroom")
"""Rooms that may take in leftover space, likely ones first."""
LEAST_JOG_MM = 600  # walls are straight rather than offset by less
BATH_MM = (2300, 2900)  # depth of a bathroom that leaves the rest of a deep band to its neighbour
LONGEST_LOBBY_MM = 1800
SHAFT_MM = ((300, 600), (400, 900))  # depth, width of a shaft in a corner
SHAFT_ROOM_M2 = 10.0  # rooms from this size on may have one
WING_SHARE, LOBBY_SHARE, HEAD_SHARE, END_SHARE = 0.6, 0.3, 0.5, 0.7
HALL_MM = (1300, 1700)  # beside the bathroom of a studio
STUDIO_MORE = 1.35  # room to live, cook and sleep in against one to live in
LONGEST_BATH_MM, STUDIO_RATIO = 3000, (1.2, 1.8)
GENEROUS = (0.0, 0.55)  # how far into the usual range of areas a home's rooms are
ROOMS_DIFFER = (0.6, 1.4)  # one room of a home may be more generous than another
BAND_DEPTH = (0.85, 1.1)  # against the side of a square of the area of its largest room
CORRIDOR_COST = 0.3  # a corridor's size matters less than that of a room


@dataclass(frozen=True)
class Sketch:
    """Room types and the rectangles (disjoint, walls between rooms left free) of each, cuts that are shafts, a cost."""

    types: tuple[str, ...]
    rects: tuple[tuple[Rect, ...], ...]
    cuts: tuple[tuple[Rect, ...], ...] = ()
    cost: float = 0.0


@dataclass
class _Band:
    """Rooms (their numbers) side by side, and the widths of their slots."""

    rooms: list[int]
    depth: int
    widths: list[int] = field(default_factory=list)


def draw_sketch(rng: np.random.Generator, types: Sequence[str], inner_mm: int, shaft_share: float) -> Sketch:
    """The rooms of a home, the first of which holds the entrance: a corridor, or in a studio the living room."""
    generous = rng.uniform(*GENEROUS)
    areas = []
    for kind in types:
        low, high = ROOM_KINDS[kind].area_m2
        areas.append(low + (high - low) * min(1.0, generous * rng.uniform(*ROOMS_DIFFER)))
    if types[0] == "corridor":
        drawn = [_arranged(rng, tuple(types), areas, inner_mm) for _ in range(DRAWN)]
        best = min(drawn, key=lambda sketch: sketch.cost)
    else:
        best = _studio(rng, tuple(types), areas, inner_mm)
    return _turned(rng, _with_shafts(rng, best, shaft_share))


def _arranged(rng: np.random.Generator, types: tuple[str, ...], areas: list[float], wall: int) -> Sketch:
    """One arrangement of a corridor with rooms on both sides, and what it costs."""
    corridor = _cm(rng.uniform(*CORRIDOR_MM))
    order = [int(i) + 1 for i in rng.permutation(len(types) - 1)]
    heads = [i for i in order if types[i] in HEADS]
    head = heads[0] if heads and len(order) > 1 and rng.random() < HEAD_SHARE else None
    rest = [i for i in order if i != head]
    cut = int(rng.integers(0, len(rest) + 1))
    bottom, top = (_band(rng, rooms, types, areas) for rooms in (rest[:cut], rest[cut:]))
    length = max(_length(bottom, wall), _length(top, wall), CONTACT_MM)
    for band in (bottom, top):
        _stretch(band, length, wall, areas)
    y0 = bottom.depth + wall if bottom.rooms else 0
    y1 = y0 + corridor
    rects: list[list[Rect]] = [[] for _ in types]
    for band, low, high in ((bottom, 0, bottom.depth), (top, y1 + wall, y1 + wall + top.depth)):
        x = 0
        for room, width in zip(band.rooms, band.widths, strict=True):
            rects[room].append((x, low, x + width, high))
            x += width + wall
    end = length
    if head is None and rng.random() < END_SHARE:
        end = _shorten(rng, types, rects, (bottom, top), (y0, y1), length, wall)
    rects[0].append((0, y0, end, y1))
    if head is not None:
        depth = y1 + (wall + top.depth if top.rooms else 0)
        width = max(_cm(areas[head] * 1e6 / depth), _cm(1000 * ROOM_KINDS[types[head]].side_m))
        rects[head].append((length + wall, 0, length + wall + width, depth))
    for band, is_top in ((bottom, False), (top, True)):
        _wing(rng, types, rects, band, is_top, wall)
    return Sketch(types, tuple(map(tuple, rects)), cost=_cost(types, rects, areas))


def _band(rng: np.random.Generator, rooms: list[int], types: tuple[str, ...], areas: list[float]) -> _Band:
    """A band as deep as suits its largest room, each room as wide as its area asks."""
    if not rooms:
        return _Band(rooms, 0)
    largest = max(rooms, key=lambda i: areas[i])
    side = math.sqrt(areas[largest]) * 1000 * rng.uniform(*BAND_DEPTH)
    least = max(1000 * ROOM_KINDS[types[i]].side_m for i in rooms)
    depth = _cm(min(DEEPEST_MM, max(least, side)))
    widths = [max(_cm(1000 * ROOM_KINDS[types[i]].side_m), _cm(areas[i] * 1e6 / depth)) for i in rooms]
    return _Band(rooms, depth, widths)


def _length(band: _Band, wall: int) -> int:
    return sum(band.widths) + wall * (len(band.widths) - 1) if band.widths else 0


def _stretch(band: _Band, length: int, wall: int, areas: list[float]) -> None:
    """Widen the rooms of a band in proportion to their areas until it is as long as the building."""
    spare = length - _length(band, wall)
    total = sum(areas[i] for i in band.rooms)
    for k, room in enumerate(band.rooms):
        more = spare if k == len(band.rooms) - 1 else min(spare, _cm(spare * areas[room] / total))
        total -= areas[room]
        spare -= more
        band.widths[k] += more


def _shorten(
    rng: np.random.Generator, types: tuple[str, ...], rects: list[list[Rect]], bands: tuple[_Band, _Band],
    corridor: tuple[int, int], length: int, wall: int,
) -> int:  # fmt: skip
    """Where the corridor ends; what lies beyond goes to the last room of one band, which reaches around its end."""
    ends = [band.rooms[-1] for band in bands if band.rooms]
    hosts = [i for i in ends if types[i] in HOSTS]
    if not hosts:
        return length
    host = min(hosts, key=lambda i: HOSTS.index(types[i]))
    others = [rects[i][0][0] for i in ends if i != host]
    # The host is reached through the wall across the corridor's end or through its side; the others through theirs.
    low = max([rects[host][0][0] - wall, *(x + CONTACT_MM for x in others), CONTACT_MM])
    high = length - wall - LEAST_END_MM
    if high < low:
        return length
    end = _cm(low + (high - low) * rng.random() ** 2)
    x0, y0, _, y1 = rects[host][0]
    if low <= x0 - wall < end < x0 - wall + LEAST_JOG_MM:
        end = x0 - wall
    wing = (end + wall, corridor[0] - wall if y1 < corridor[0] else corridor[0], length,
            corridor[1] + wall if y0 > corridor[1] else corridor[1])  # fmt: skip
    rects[host].append(wing)
    return end


def _wing(
    rng: np.random.Generator, types: tuple[str, ...], rects: list[list[Rect]], band: _Band, is_top: bool, wall: int
) -> None:
    """Where a bathroom is deep, leave a part of its slot to the room beside it, which becomes an L, or to the hall."""
    for k, room in enumerate(band.rooms):
        depth = _cm(rng.uniform(*BATH_MM))
        over = band.depth - depth - wall
        if types[room] != "bathroom" or over < LEAST_WING_MM or rng.random() >= WING_SHARE:
            continue
        x0, y0, x1, y1 = rects[room][0]
        hosts = [band.rooms[j] for j in (k - 1, k + 1) if 0 <= j < len(band.rooms)]
        hosts = [i for i in hosts if types[i] in HOSTS and len(rects[i]) == 1]
        lobby = x1 <= rects[0][0][2] and over <= LONGEST_LOBBY_MM and rng.random() < LOBBY_SHARE
        low, high = (x0, y0, x1, y0 + depth), (x0, y1 - depth, x1, y1)
        if lobby:
            rects[room] = [high if is_top else low]
            rects[0].append((x0, y0 - wall, x1, y0 + over) if is_top else (x0, y1 - over, x1, y1 + wall))
        elif hosts:
            host = min(hosts, key=lambda i: HOSTS.index(types[i]))
            a, b = (x0 - wall, x1) if rects[host][0][0] < x0 else (x0, x1 + wall)
            rects[room] = [low if is_top else high]
            rects[host].append((a, y1 - over, b, y1) if is_top else (a, y0, b, y0 + over))


def _studio(rng: np.random.Generator, types: tuple[str, ...], areas: list[float], wall: int) -> Sketch:
    """One large room with the bathroom cut out of a corner; the way in leads along it."""
    side = 1000 * ROOM_KINDS[types[1]].side_m
    total = (areas[0] * STUDIO_MORE + areas[1]) * 1e6
    hall = _cm(rng.uniform(*HALL_MM))
    wide = _cm(max(side, min(LONGEST_BATH_MM, math.sqrt(total / rng.uniform(*STUDIO_RATIO)) - hall - wall)))
    deep = _cm(max(side, areas[1] * 1e6 / wide))
    d = wide + wall + hall
    w = max(_cm(total / d), deep + wall + _cm(1000 * ROOM_KINDS[types[0]].side_m))
    living: tuple[Rect, ...] = ((0, wide + wall, w, d), (deep + wall, 0, w, wide + wall))
    return Sketch(types, (living, ((0, 0, deep, wide),)))


def _cost(types: tuple[str, ...], rects: list[list[Rect]], areas: list[float]) -> float:
    """How far rooms are from the size they should have and from a good ratio of their sides, squared and summed."""
    cost = 0.0
    for kind, area, own in zip(types, areas, rects, strict=True):
        size = sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in own) / 1e6
        x0, y0, x1, y1 = own[0]
        ratio = max(x1 - x0, y1 - y0) / min(x1 - x0, y1 - y0)
        cost += (CORRIDOR_COST if kind == "corridor" else 1.0) * math.log(size / area) ** 2
        cost += max(0.0, ratio / ROOM_KINDS[kind].slender - 1.0) ** 2 * SLENDER_COST
    return round(cost, 9)  # the last bits of a logarithm decide nothing


def _with_shafts(rng: np.random.Generator, sketch: Sketch, share: float) -> Sketch:
    """Shafts in corners of large rooms, away from the first room, where doors are."""
    cuts: list[tuple[Rect, ...]] = []
    for kind, own in zip(sketch.types, sketch.rects, strict=True):
        cuts.append(())
        x0, y0, x1, y1 = own[0]
        size = (x1 - x0) * (y1 - y0) / 1e6
        if kind in ("corridor", "bathroom") or size < SHAFT_ROOM_M2 or len(own) > 1 or rng.random() >= share:
            continue
        deep, wide = (_cm(rng.uniform(*sizes)) for sizes in SHAFT_MM)
        corners = [(x, y, x + wide, y + deep) for x in (x0, x1 - wide) for y in (y0, y1 - deep)]
        free = [c for c in corners if all(_gap(c, r) > CONTACT_MM for r in sketch.rects[0])]
        if free:
            cuts[-1] = (free[int(rng.integers(len(free)))],)
    return replace(sketch, cuts=tuple(cuts))


def _gap(a: Rect, b: Rect) -> int:
    """How far two rectangles are apart along the axis along which they are farther apart."""
    return max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])


def _turned(rng: np.random.Generator, sketch: Sketch) -> Sketch:
    swap, flip_x, flip_y = (bool(b) for b in rng.random(3) < 0.5)

    def turned(groups: tuple[tuple[Rect, ...], ...]) -> tuple[tuple[Rect, ...], ...]:
        return tuple(tuple(turn(r, swap, flip_x, flip_y) for r in own) for own in groups)

    return replace(sketch, rects=turned(sketch.rects), cuts=turned(sketch.cuts))


def _cm(millimetres: float) -> int:
    """Millimetres rounded to whole centimetres."""
    return round(millimetres / CM) * CM
