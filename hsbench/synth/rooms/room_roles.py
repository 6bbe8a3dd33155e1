"""What each room of a home is for beyond its type: where people cook, sleep and eat; and the template it gets."""

from __future__ import annotations

from collections.abc import Sequence

from hsbench.errors import SchemaError
from hsbench.synth.rooms.config import RoomConfig, Weights
from hsbench.synth.rooms.floor_plans import weighted
from hsbench.synth.rooms.placing import Layout
from hsbench.synth.rooms.plan import FloorPlan
from hsbench.synth.rooms.templates import TEMPLATES, Template
from hsbench.synth.seeds import Seeds

ROOMY_KITCHEN_M2 = 10.0  # kitchens from this size on hold a table rather than the living room (our default)
EATING_AT = frozenset(("dining_table", "bar_stool"))
"""Where one of these stands people eat."""


def draw_templates(seeds: Seeds, plan: FloorPlan, config: RoomConfig) -> tuple[Template, ...]:
    """A template for each room of a plan; of a home one room has a table to eat at, in offices as templates have it.

    Bathrooms of offices have neither bath nor shower, the only one of a home has one basin.

    Raises SchemaError for a room type without a template.
    """
    weights = divided(config.templates, config.divider_share)
    types = [room.room_type for room in plan.rooms]
    found = []
    for i, kind in enumerate(types):
        own = tuple((name, w) for name, w in weights if TEMPLATES[name].room_type == kind)
        if not own:
            raise SchemaError(f"room.templates has none for a {kind}; expected one for each type of room")
        wanted = (kind == _cooking_room(types), kind == _sleeping_room(types))
        fitting = tuple((n, w) for n, w in own if (TEMPLATES[n].holds("kitchen"), _sleeps(n)) == wanted)
        found.append(TEMPLATES[weighted(seeds.rng(f"template-{i}"), fitting or own)])
    if "living" not in types:
        found = [t.without_bath() if t.room_type == "bathroom" else t for t in found]
    elif types.count("bathroom") == 1:
        found = [t.with_one_basin() for t in found]
    eating = eating_rooms(plan, found)
    if not eating:
        return tuple(found)
    return tuple(t.with_table() if i == eating[0] else t.without_table() for i, t in enumerate(found))


def eating_rooms(plan: FloorPlan, templates: Sequence[Template]) -> list[int]:
    """The rooms of a home where people may eat, likely ones first; none in an office.

    A dining room, else one with a table in its template, else a large kitchen, the living room, a small kitchen.
    """
    types = [room.room_type for room in plan.rooms]
    if "living" not in types:
        return []

    def rank(i: int) -> tuple[bool, ...]:
        small = types[i] == "kitchen" and plan.rooms[i].area_m2 < ROOMY_KITCHEN_M2
        return types[i] != "dining", not templates[i].holds("dining"), small, types[i] != "kitchen"

    return sorted((i for i, kind in enumerate(types) if kind in ("dining", "living", "kitchen")), key=rank)


def eaten_in(layout: Layout) -> bool:
    """Whether people have a place to eat in a furnished room."""
    return any(item.piece.category_name in EATING_AT for item in layout.items)


def divided(weights: Weights, share: float) -> Weights:
    """The weights such that, within a room type that has both, templates with a divider have this share."""
    totals: dict[tuple[str, bool], float] = {}
    for name, weight in weights:
        key = (TEMPLATES[name].room_type, TEMPLATES[name].divided)
        totals[key] = totals.get(key, 0.0) + weight
    found = []
    for name, weight in weights:
        kind, is_divided = TEMPLATES[name].room_type, TEMPLATES[name].divided
        with_divider, without = totals.get((kind, True), 0.0), totals.get((kind, False), 0.0)
        if with_divider and without:
            own = share if is_divided else 1.0 - share
            weight *= own * (with_divider + without) / (with_divider if is_divided else without)
        found.append((name, weight))
    return tuple((name, weight) for name, weight in found if weight > 0)


def _cooking_room(types: Sequence[str]) -> str:
    """The type of the one room of a home where people cook: a kitchen, else the dining or living room."""
    return next((kind for kind in ("kitchen", "dining", "living") if kind in types), "")


def _sleeping_room(types: Sequence[str]) -> str:
    """The type of the rooms of a home where people sleep: bedrooms, else the living room."""
    return next((kind for kind in ("bedroom", "living") if kind in types), "")


def _sleeps(template_name: str) -> bool:
    """Whether every room of a template holds a bed."""
    return any(TEMPLATES[template_name].holds(group) for group in ("bed", "bunk"))
