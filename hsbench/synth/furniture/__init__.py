"""Parametric furniture from convex parts: one builder a category, all with the same signature.

``build("sofa", rng, style)`` gives parts in the object frame: origin on the floor at the middle of the footprint, z up,
front towards -y, width along x, metres quantised to .1 mm. ``fit`` below 1 asks for a smaller variant.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.scene import Part
from hsbench.synth.furniture import beds, decor, kitchen, seats, storage, tables
from hsbench.synth.furniture.openings import door, window
from hsbench.synth.furniture.style import COMMON_FAMILIES, FAMILIES, NOVEL_FAMILIES, Style, family


class Builder(Protocol):
    """Builds one object of a category."""

    def __call__(self, rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
        """Parts in the object frame; ``fit`` 1 draws from the full range of sizes, 0 gives the smallest."""
        ...


BUILDERS: Mapping[str, Builder] = MappingProxyType(
    {
        "bed": beds.bed,
        "sofa": seats.sofa,
        "armchair": seats.armchair,
        "chair": seats.chair,
        "office_chair": seats.office_chair,
        "stool": seats.stool,
        "bench": seats.bench,
        "dining_table": tables.dining_table,
        "coffee_table": tables.coffee_table,
        "side_table": tables.side_table,
        "desk": tables.desk,
        "night_stand": tables.night_stand,
        "wardrobe": storage.wardrobe,
        "bookshelf": storage.bookshelf,
        "sideboard": storage.sideboard,
        "dresser": storage.dresser,
        "tv_stand": storage.tv_stand,
        "shelf": storage.shelf,
        "fridge": kitchen.fridge,
        "kitchen_counter": kitchen.kitchen_counter,
        "kitchen_island": kitchen.kitchen_island,
        "television": decor.television,
        "monitor": decor.monitor,
        "floor_lamp": decor.floor_lamp,
        "plant": decor.plant,
        "rug": decor.rug,
        "curtain": decor.curtain,
        "clutter": decor.clutter,
    }
)
"""Category name -> builder."""

MOVABLE: frozenset[str] = frozenset(("chair", "office_chair", "stool"))
"""Categories that people move when they use them."""

WALL_HUNG: frozenset[str] = frozenset(("shelf", "curtain"))
"""Categories that hang on a wall: nothing stands under them."""


def build(category_name: str, rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """The parts of one object of a category. Raises SchemaError for a category without a builder."""
    if category_name not in BUILDERS:
        raise SchemaError(f"no furniture builder for {category_name!r}; expected one of {', '.join(BUILDERS)}")
    return BUILDERS[category_name](rng, style, fit)


__all__ = [
    "BUILDERS",
    "COMMON_FAMILIES",
    "FAMILIES",
    "MOVABLE",
    "NOVEL_FAMILIES",
    "WALL_HUNG",
    "Builder",
    "Style",
    "build",
    "door",
    "family",
    "window",
]
