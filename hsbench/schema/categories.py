"""The category table: class ids are data. Append only; an id once given never changes its meaning."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError


@dataclass(frozen=True)
class Category:
    """One row: id (0 is nothing), name, the group that decides which tasks count it, and what its parts are for.

    Groups: ``structure`` (the room itself), ``furniture`` (object detection counts it), ``fixture`` (hung or mounted,
    never detected: lamps, pictures, radiators), ``soft`` (rugs, curtains: solid, never detected), ``clutter`` (small
    things on supports), ``imported`` (of a capture, nothing known but its shape).
    roles: functional roles that parts of this category may have; the surfaces of an imported object without named parts
    have all of them, and geometry decides which surface serves for what.
    """

    category_id: int
    name: str
    group: str
    roles: tuple[str, ...] = ()


_ROWS: tuple[tuple[str, str], ...] = (
    ("structure", "floor ceiling wall door window"),
    ("furniture", "bed sofa armchair chair stool office_chair bench dining_table coffee_table side_table desk"),
    ("furniture", "night_stand wardrobe bookshelf sideboard dresser tv_stand television floor_lamp plant fridge"),
    ("furniture", "kitchen_counter kitchen_island shelf monitor"),
    ("soft", "rug curtain"),
    ("clutter", "clutter"),
    ("imported", "object"),
    ("structure", "passage"),
    ("furniture", "toilet bathtub shower washbasin bathroom_cabinet washing_machine laundry_basket wall_cabinet stove"),
    ("furniture", "dishwasher meeting_table whiteboard filing_cabinet coat_rack shoe_cabinet ottoman waste_bin piano"),
    ("furniture", "bar_stool water_cooler bunk_bed"),
    ("fixture", "range_hood mirror towel_rail radiator picture wall_clock ceiling_lamp"),
    ("clutter", "table_lamp books vase bowl cup plate bottle pot laptop keyboard microwave kettle cushion storage_box"),
)
"""(group, names) in the order of ids. Lines are only ever added at the end."""

_ROLES: dict[str, str] = {
    "seat": "sofa armchair chair stool office_chair bench toilet ottoman bar_stool",
    "mattress": "bed bunk_bed",
    "top": "dining_table coffee_table side_table desk night_stand sideboard dresser tv_stand kitchen_counter"
    " kitchen_island meeting_table washbasin bathroom_cabinet filing_cabinet shoe_cabinet washing_machine dishwasher",
    "shelf": "bookshelf shelf bathroom_cabinet coat_rack coffee_table side_table night_stand tv_stand sideboard desk"
    " wall_cabinet kitchen_counter kitchen_island wardrobe shoe_cabinet",
    "door": "door wardrobe sideboard tv_stand kitchen_counter kitchen_island wall_cabinet bathroom_cabinet shoe_cabinet"
    " shower washbasin",
    "drawer": "desk night_stand dresser sideboard tv_stand kitchen_counter kitchen_island filing_cabinet"
    " bathroom_cabinet wardrobe washbasin",
    "handle": "door window wardrobe sideboard dresser desk night_stand tv_stand kitchen_counter kitchen_island fridge"
    " wall_cabinet bathroom_cabinet filing_cabinet stove dishwasher shoe_cabinet shower toilet washbasin",
    "screen": "television monitor laptop",
    "switch": "wall floor_lamp table_lamp stove kitchen_counter",
    "tap": "kitchen_counter kitchen_island washbasin bathtub shower water_cooler",
    "front": "kitchen_counter kitchen_island fridge stove dishwasher washing_machine microwave piano",
    "board": "whiteboard",
}
"""Role -> the categories whose parts may have it."""


def _rows() -> tuple[Category, ...]:
    named = [(name, group) for group, names in _ROWS for name in names.split()]
    roles = {role: frozenset(names.split()) for role, names in _ROLES.items()}
    return tuple(
        Category(number, name, group, tuple(role for role, names in roles.items() if name in names))
        for number, (name, group) in enumerate(named, start=1)
    )


CATEGORIES: tuple[Category, ...] = _rows()
"""Every category, ordered by id; ``CATEGORIES[i].category_id == i + 1``."""

ROLES: frozenset[str] = frozenset(_ROLES)
"""Functional roles of parts: what affordances are computed from. A part without one has role None."""

STRUCTURE: frozenset[int] = frozenset(c.category_id for c in CATEGORIES if c.group == "structure")
"""Ids of floor, ceiling, wall, door, window, passage: left out of the primary completion mask."""

_BY_NAME = {c.name: c for c in CATEGORIES}


def category(name: str) -> Category:
    """The category of a name. Raises SchemaError for an unknown one, naming the known."""
    try:
        return _BY_NAME[name]
    except KeyError:
        raise SchemaError(f"category {name!r} is unknown; expected one of {', '.join(_BY_NAME)}") from None
