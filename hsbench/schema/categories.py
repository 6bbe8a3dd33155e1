"""The category table: class ids are data. Append only; an id once given never changes its meaning."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError


@dataclass(frozen=True)
class Category:
    """One row: id (0 is nothing), name, and the group that decides which tasks count it.

    Groups: ``structure`` (the room itself), ``furniture`` (object detection counts it), ``soft`` (rugs,
    curtains: solid, never detected), ``clutter`` (small things on supports).
    """

    category_id: int
    name: str
    group: str


_TABLE: dict[str, tuple[str, ...]] = {
    "structure": ("floor", "ceiling", "wall", "door", "window"),
    "furniture": (
        "bed", "sofa", "armchair", "chair", "stool", "office_chair", "bench", "dining_table", "coffee_table",
        "side_table", "desk", "night_stand", "wardrobe", "bookshelf", "sideboard", "dresser", "tv_stand",
        "television", "floor_lamp", "plant", "fridge", "kitchen_counter", "kitchen_island", "shelf", "monitor",
    ),
    "soft": ("rug", "curtain"),
    "clutter": ("clutter",),
    "imported": ("object",),
}  # fmt: skip

CATEGORIES: tuple[Category, ...] = tuple(
    Category(category_id, name, group)
    for category_id, (name, group) in enumerate(
        ((name, group) for group, names in _TABLE.items() for name in names), start=1
    )
)
"""Every category, ordered by id; ``CATEGORIES[i].category_id == i + 1``."""

STRUCTURE: frozenset[int] = frozenset(c.category_id for c in CATEGORIES if c.group == "structure")
"""Ids of floor, ceiling, wall, door, window: left out of the primary completion mask."""

_BY_NAME = {c.name: c for c in CATEGORIES}


def category(name: str) -> Category:
    """The category of a name. Raises SchemaError for an unknown one, naming the known."""
    try:
        return _BY_NAME[name]
    except KeyError:
        raise SchemaError(f"category {name!r} is unknown; expected one of {', '.join(_BY_NAME)}") from None
