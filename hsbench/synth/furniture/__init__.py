"""Parametric furniture from convex parts: one builder a category, all with the same signature.

``build("sofa", rng, style)`` gives parts in the object frame: origin on the floor at the middle of the footprint, z up,
front towards -y, width along x, metres quantised to .1 mm. ``fit`` below 1 asks for a smaller variant. Every part of an
object has a name of its own (``seat``, ``seat_2`` ...). What hangs on a wall has its back at the wall (+y) and its real
height in z; what hangs from a ceiling has z = 0 at the ceiling and reaches below it.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np

from hsbench.errors import SchemaError
from hsbench.schema.scene import Part
from hsbench.synth.furniture import (
    bathroom,
    beds,
    kitchen,
    lamps,
    office,
    plants,
    screens,
    seats,
    small,
    sofas,
    storage,
    tables,
    textiles,
    wall,
)
from hsbench.synth.furniture.kitchen import kitchen_counter_of, wall_cabinet_of
from hsbench.synth.furniture.openings import door, passage, window
from hsbench.synth.furniture.sizes import SIZES, Size, size
from hsbench.synth.furniture.style import COMMON_FAMILIES, FAMILIES, NOVEL_FAMILIES, Finish, Style, family


class Builder(Protocol):
    """Builds one object of a category."""

    def __call__(self, rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
        """Parts in the object frame; ``fit`` 1 draws from the full range of sizes, 0 gives the smallest."""
        ...


BUILDERS: Mapping[str, Builder] = MappingProxyType(
    {
        "bed": beds.bed,
        "bunk_bed": beds.bunk_bed,
        "sofa": sofas.sofa,
        "armchair": sofas.armchair,
        "ottoman": sofas.ottoman,
        "chair": seats.chair,
        "office_chair": seats.office_chair,
        "stool": seats.stool,
        "bar_stool": seats.bar_stool,
        "bench": seats.bench,
        "dining_table": tables.dining_table,
        "coffee_table": tables.coffee_table,
        "side_table": tables.side_table,
        "meeting_table": tables.meeting_table,
        "desk": tables.desk,
        "night_stand": tables.night_stand,
        "wardrobe": storage.wardrobe,
        "bookshelf": storage.bookshelf,
        "sideboard": storage.sideboard,
        "dresser": storage.dresser,
        "tv_stand": storage.tv_stand,
        "shelf": storage.shelf,
        "storage_box": storage.storage_box,
        "filing_cabinet": office.filing_cabinet,
        "shoe_cabinet": office.shoe_cabinet,
        "coat_rack": office.coat_rack,
        "whiteboard": office.whiteboard,
        "water_cooler": office.water_cooler,
        "waste_bin": office.waste_bin,
        "fridge": kitchen.fridge,
        "kitchen_counter": kitchen.kitchen_counter,
        "kitchen_island": kitchen.kitchen_island,
        "wall_cabinet": kitchen.wall_cabinet,
        "stove": kitchen.stove,
        "dishwasher": kitchen.dishwasher,
        "range_hood": kitchen.range_hood,
        "toilet": bathroom.toilet,
        "bathtub": bathroom.bathtub,
        "shower": bathroom.shower,
        "washbasin": bathroom.washbasin,
        "bathroom_cabinet": bathroom.bathroom_cabinet,
        "washing_machine": bathroom.washing_machine,
        "laundry_basket": bathroom.laundry_basket,
        "towel_rail": bathroom.towel_rail,
        "television": screens.television,
        "monitor": screens.monitor,
        "laptop": screens.laptop,
        "keyboard": screens.keyboard,
        "piano": screens.piano,
        "floor_lamp": lamps.floor_lamp,
        "table_lamp": lamps.table_lamp,
        "ceiling_lamp": lamps.ceiling_lamp,
        "plant": plants.plant,
        "mirror": wall.mirror,
        "picture": wall.picture,
        "wall_clock": wall.wall_clock,
        "radiator": wall.radiator,
        "rug": textiles.rug,
        "curtain": textiles.curtain,
        "cushion": textiles.cushion_piece,
        "books": small.books,
        "vase": small.vase,
        "bowl": small.bowl,
        "cup": small.cup,
        "plate": small.plate,
        "bottle": small.bottle,
        "pot": small.pot,
        "kettle": small.kettle,
        "microwave": small.microwave,
        "clutter": small.clutter,
    }
)
"""Category name -> builder."""

MOVABLE: frozenset[str] = frozenset(("chair", "office_chair", "stool", "bar_stool"))
"""Categories that people move when they use them."""

WALL_HUNG: frozenset[str] = frozenset(
    ("shelf", "curtain", "wall_cabinet", "range_hood", "whiteboard", "mirror", "picture", "wall_clock", "radiator",
     "towel_rail")
)  # fmt: skip
"""Categories that hang on a wall, their back (+y) at it: no part of theirs touches the floor."""

HANGING: frozenset[str] = frozenset(("ceiling_lamp",))
"""Categories that hang from the ceiling: z = 0 of their frame is the ceiling."""


def build(category_name: str, rng: np.random.Generator, style: Style, fit: float = 1.0) -> tuple[Part, ...]:
    """The parts of one object of a category. Raises SchemaError for a category without a builder."""
    if category_name not in BUILDERS:
        raise SchemaError(f"no furniture builder for {category_name!r}; expected one of {', '.join(BUILDERS)}")
    return BUILDERS[category_name](rng, style, fit)


__all__ = [
    "BUILDERS",
    "COMMON_FAMILIES",
    "FAMILIES",
    "HANGING",
    "MOVABLE",
    "NOVEL_FAMILIES",
    "SIZES",
    "WALL_HUNG",
    "Builder",
    "Finish",
    "Size",
    "Style",
    "build",
    "door",
    "family",
    "kitchen_counter_of",
    "passage",
    "size",
    "wall_cabinet_of",
    "window",
]
