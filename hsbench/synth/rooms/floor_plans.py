"""Floor plans from seeds: the outlines of rooms first, then the openings between and around them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.scene import Room
from hsbench.synth.rooms.config import HomeConfig, RoomConfig, Weights
from hsbench.synth.rooms.plan import FloorPlan
from hsbench.synth.rooms.plan_homes import draw_sketch
from hsbench.synth.rooms.plan_openings import OpeningPlanner
from hsbench.synth.rooms.plan_shapes import CM, draw_shape, draw_size
from hsbench.synth.rooms.regions import MM_PER_M, Rect, outline_of
from hsbench.synth.rooms.room_kinds import PROGRAMMES, ROOM_KINDS, Range
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, IntArray

DRAWS = 4  # of entrance and doors
PARTY_WALL_SHARE = 0.4  # of the sides of a flat, without windows: the neighbours are there
SIDES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def draw_room_plan(seeds: Seeds, config: RoomConfig, room_type: str) -> FloorPlan:
    """A single room with a closed door and windows."""
    rng = seeds.rng("shape")
    width, depth = draw_size(rng, room_type, config.width_m, config.depth_m)
    shape = draw_shape(rng, weighted(rng, config.shapes), width, depth)
    height, outer = _cm(rng, config.ceiling_m), _cm(rng, config.wall_m)
    corners = [outline_of(shape.rects, shape.cuts)]
    planner = _planner(corners, shape.body, [room_type], outer, height, seeds.rng("openings"))
    planner.entrance(0)
    planner.windows(0, np.empty((0, 2)), config.windows)
    return FloorPlan(tuple(planner.rooms), tuple(planner.openings), height, outer, planner.outline_xy)


def draw_home_plan(seeds: Seeds, config: HomeConfig) -> FloorPlan:
    """A flat or office with its entrance, the ways between its rooms and its windows."""
    rng = seeds.rng("home")
    types = PROGRAMMES[weighted(rng, config.programmes)]
    height, outer = _cm(rng, config.ceiling_m), _cm(rng, config.outer_m)
    inner = round(_cm(rng, config.inner_m) * MM_PER_M)
    sketch = draw_sketch(rng, types, inner, config.shaft_share)
    corners = [outline_of(r, c) for r, c in zip(sketch.rects, sketch.cuts, strict=True)]
    whole = np.concatenate(corners)
    body: Rect = (*map(int, whole.min(axis=0)), *map(int, whole.max(axis=0)))  # type: ignore[assignment]
    planner = _reached(corners, body, types, outer, height, seeds)
    planner.open_up(config.open_share)
    blind = _party_walls(rng, planner)
    for room in range(len(types)):
        planner.windows(room, blind)
    return FloorPlan(tuple(planner.rooms), tuple(planner.openings), height, outer, planner.outline_xy)


def _reached(
    corners: list[IntArray], body: Rect, types: Sequence[str], outer_m: float, height_m: float, seeds: Seeds
) -> OpeningPlanner:
    """Rooms with entrance and doors such that each is reached, of some draws one without a way through a bedroom or an
    office. Where no draw leaves the swing of the entrance free, other doors may lead into it.

    Raises SchemaError where no wall takes a door.
    """

    def drawn(name: str, swings: bool) -> OpeningPlanner:
        planner = _planner(corners, (body,), types, outer_m, height_m, seeds.rng(name))
        planner.entrance(0, swings)
        planner.connect(0)
        return planner

    found = None
    for k in range(DRAWS):
        try:
            planner = drawn(f"openings-{k}", swings=True)
        except SchemaError:
            continue
        if not planner.through_private:
            return planner
        found = found or planner
    return found or drawn("openings", swings=False)


def _party_walls(rng: np.random.Generator, planner: OpeningPlanner) -> FloatArray:
    """(k, 2) outward directions without windows, such that no room that needs light is without."""
    blind = np.empty((0, 2))
    lit = [i for i, room in enumerate(planner.rooms) if ROOM_KINDS[room.room_type].windows.count[0] > 0]
    for i in rng.permutation(4):
        more = np.vstack([blind, SIDES[i]])
        if rng.random() < PARTY_WALL_SHARE and all(planner.lit_walls(room, more) for room in lit):
            blind = more
    return blind


def weighted(rng: np.random.Generator, weights: Weights) -> str:
    """One of the names, in proportion to the weights."""
    edges = np.cumsum(np.array([w for _, w in weights], dtype=np.float64))
    return weights[int(np.searchsorted(edges, rng.random() * edges[-1], side="right"))][0]


def _planner(
    corners: list[IntArray], body: Sequence[Rect], types: Sequence[str], outer_m: float, height_m: float,
    rng: np.random.Generator,
) -> OpeningPlanner:  # fmt: skip
    """Rooms and building in metres, moved so that the smallest coordinate of all rooms is 0."""
    low = np.concatenate(corners).min(axis=0)
    grow = round(outer_m * MM_PER_M)
    grown = outline_of([(x0 - grow, y0 - grow, x1 + grow, y1 + grow) for x0, y0, x1, y1 in body])

    def metres(points: IntArray) -> FloatArray:
        return np.asarray((points - low) / MM_PER_M)

    rooms = tuple(Room(kind, metres(outline)) for kind, outline in zip(types, corners, strict=True))
    return OpeningPlanner(rooms, metres(grown), outer_m, height_m, rng)


def _cm(rng: np.random.Generator, sizes: Range) -> float:
    """A length in whole centimetres."""
    mm = round((sizes[0] + (sizes[1] - sizes[0]) * rng.random()) * MM_PER_M / CM) * CM
    return mm / MM_PER_M
