"""How large things are: ranges of the whole object in metres, from which builders draw.

Source, where a category has a counterpart: bounding boxes of the assets of ProcTHOR (Deitke et al., NeurIPS 2022;
asset-database.json, Apache-2.0), of which the ranges keep the plausible part between about the 5th and 95th percentile;
``REAL`` names the counterpart. These are facts read off, not the file. The assets are sized for American homes and some
are toy-like: ``DEVIATIONS`` says where we depart, and why. Handles, taps and flowers are not counted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from hsbench.synth.furniture.style import Range


@dataclass(frozen=True)
class Size:
    """Ranges of width (x), depth (y) and height (z extent) in metres."""

    width_m: Range
    depth_m: Range
    height_m: Range


SIZES: Mapping[str, Size] = MappingProxyType(
    {
        # to sit and lie on
        "sofa": Size((1.45, 2.5), (0.78, 0.98), (0.74, 0.95)),
        "armchair": Size((0.68, 0.98), (0.74, 0.95), (0.72, 0.98)),
        "chair": Size((0.41, 0.5), (0.44, 0.6), (0.8, 1.02)),
        "stool": Size((0.4, 0.46), (0.4, 0.46), (0.42, 0.48)),
        "office_chair": Size((0.54, 0.7), (0.54, 0.7), (0.86, 1.1)),
        "bench": Size((1.1, 1.5), (0.4, 0.46), (0.43, 0.48)),
        "ottoman": Size((0.42, 0.86), (0.42, 0.62), (0.4, 0.46)),
        "bar_stool": Size((0.36, 0.48), (0.36, 0.5), (0.62, 1.0)),
        "bed": Size((0.95, 2.0), (2.02, 2.2), (0.7, 1.25)),
        "bunk_bed": Size((1.0, 1.1), (2.04, 2.14), (1.55, 1.75)),
        # to put things on
        "dining_table": Size((0.9, 1.95), (0.76, 1.16), (0.72, 0.77)),
        "coffee_table": Size((0.68, 1.2), (0.46, 0.84), (0.34, 0.46)),
        "side_table": Size((0.36, 0.52), (0.36, 0.52), (0.47, 0.6)),
        "desk": Size((1.1, 1.65), (0.58, 0.76), (0.71, 0.76)),
        "meeting_table": Size((1.6, 3.0), (0.95, 1.3), (0.72, 0.76)),
        "night_stand": Size((0.38, 0.52), (0.34, 0.44), (0.45, 0.6)),
        # to put things in
        "wardrobe": Size((0.9, 2.1), (0.55, 0.66), (1.85, 2.2)),
        "bookshelf": Size((0.6, 1.15), (0.28, 0.36), (1.35, 2.1)),
        "sideboard": Size((1.1, 1.75), (0.4, 0.5), (0.74, 0.9)),
        "dresser": Size((0.78, 1.35), (0.42, 0.52), (0.78, 1.1)),
        "tv_stand": Size((1.05, 1.65), (0.38, 0.46), (0.42, 0.56)),
        "shelf": Size((0.6, 1.2), (0.2, 0.26), (0.1, 0.7)),
        "filing_cabinet": Size((0.4, 0.48), (0.5, 0.64), (0.68, 1.34)),
        "shoe_cabinet": Size((0.6, 0.95), (0.22, 0.36), (0.75, 1.1)),
        "coat_rack": Size((0.42, 0.9), (0.38, 0.5), (1.6, 1.85)),
        "storage_box": Size((0.27, 0.42), (0.22, 0.34), (0.16, 0.28)),
        # screens, boards, instruments
        "television": Size((0.98, 1.45), (0.2, 0.3), (0.6, 0.89)),
        "monitor": Size((0.5, 0.65), (0.16, 0.22), (0.4, 0.52)),
        "laptop": Size((0.33, 0.4), (0.22, 0.36), (0.21, 0.29)),
        "keyboard": Size((0.38, 0.46), (0.13, 0.17), (0.02, 0.035)),
        "whiteboard": Size((1.2, 2.1), (0.03, 0.1), (0.9, 1.25)),
        "piano": Size((1.38, 1.54), (0.56, 0.66), (1.05, 1.3)),
        # kitchen
        "kitchen_counter": Size((1.2, 2.7), (0.6, 0.64), (0.86, 0.94)),
        "kitchen_island": Size((1.1, 1.75), (0.7, 0.95), (0.86, 0.94)),
        "wall_cabinet": Size((0.5, 1.2), (0.33, 0.38), (0.58, 0.75)),
        "fridge": Size((0.56, 0.9), (0.6, 0.72), (1.55, 2.0)),
        "stove": Size((0.5, 0.62), (0.6, 0.64), (0.86, 0.98)),
        "dishwasher": Size((0.45, 0.6), (0.6, 0.64), (0.86, 0.94)),
        "washing_machine": Size((0.58, 0.62), (0.58, 0.64), (0.84, 0.94)),
        "range_hood": Size((0.58, 0.92), (0.45, 0.54), (0.45, 0.7)),
        "microwave": Size((0.46, 0.62), (0.34, 0.43), (0.27, 0.36)),
        "kettle": Size((0.2, 0.27), (0.15, 0.2), (0.19, 0.26)),
        "pot": Size((0.26, 0.4), (0.2, 0.3), (0.12, 0.22)),
        # bathroom
        "toilet": Size((0.36, 0.42), (0.62, 0.78), (0.75, 0.95)),
        "bathtub": Size((1.5, 1.8), (0.7, 0.85), (0.52, 0.64)),
        "shower": Size((0.8, 1.1), (0.8, 1.0), (1.9, 2.2)),
        "washbasin": Size((0.5, 0.8), (0.4, 0.52), (0.82, 0.9)),
        "bathroom_cabinet": Size((0.32, 0.62), (0.3, 0.4), (0.75, 1.75)),
        "laundry_basket": Size((0.36, 0.52), (0.34, 0.46), (0.52, 0.68)),
        "towel_rail": Size((0.42, 0.66), (0.04, 0.13), (0.02, 1.2)),
        # smaller things that stand or hang
        "waste_bin": Size((0.24, 0.42), (0.24, 0.38), (0.28, 0.62)),
        "water_cooler": Size((0.3, 0.38), (0.3, 0.38), (1.18, 1.45)),
        "floor_lamp": Size((0.3, 0.56), (0.3, 0.56), (1.45, 1.85)),
        "table_lamp": Size((0.18, 0.34), (0.18, 0.34), (0.3, 0.56)),
        "ceiling_lamp": Size((0.25, 0.62), (0.25, 0.62), (0.1, 0.62)),
        "plant": Size((0.26, 0.95), (0.26, 0.95), (0.55, 1.7)),
        "mirror": Size((0.4, 0.8), (0.02, 0.05), (0.55, 1.5)),
        "radiator": Size((0.5, 1.4), (0.07, 0.14), (0.5, 0.7)),
        "picture": Size((0.3, 0.95), (0.02, 0.04), (0.3, 0.85)),
        "wall_clock": Size((0.24, 0.36), (0.03, 0.06), (0.24, 0.36)),
        "rug": Size((1.5, 2.3), (1.05, 1.6), (0.012, 0.012)),
        "curtain": Size((0.34, 0.6), (0.06, 0.14), (2.1, 2.3)),
        "cushion": Size((0.36, 0.48), (0.09, 0.12), (0.3, 0.48)),
        # small things on tops
        "books": Size((0.14, 0.28), (0.18, 0.3), (0.04, 0.16)),
        "vase": Size((0.1, 0.2), (0.1, 0.2), (0.16, 0.3)),
        "bowl": Size((0.16, 0.28), (0.16, 0.28), (0.06, 0.12)),
        "cup": Size((0.07, 0.15), (0.065, 0.14), (0.08, 0.13)),
        "plate": Size((0.19, 0.28), (0.19, 0.28), (0.015, 0.03)),
        "bottle": Size((0.06, 0.11), (0.06, 0.11), (0.22, 0.34)),
        "clutter": Size((0.06, 0.4), (0.06, 0.4), (0.02, 0.4)),
    }
)
"""Category -> size."""

REAL: Mapping[str, str] = MappingProxyType(
    {
        "sofa": "Sofa", "armchair": "ArmChair", "chair": "Chair", "stool": "Stool", "ottoman": "Ottoman", "bed": "Bed",
        "dining_table": "DiningTable", "coffee_table": "CoffeeTable", "side_table": "SideTable", "desk": "Desk",
        "night_stand": "SideTable", "bookshelf": "ShelvingUnit", "dresser": "Dresser", "tv_stand": "TVStand",
        "sideboard": "Dresser", "storage_box": "Box", "television": "Television", "laptop": "Laptop",
        "kitchen_counter": "CounterTop", "fridge": "Fridge", "washing_machine": "WashingMachine",
        "microwave": "Microwave", "pot": "Pot", "toilet": "Toilet", "washbasin": "Sink",
        "laundry_basket": "LaundryHamper", "waste_bin": "GarbageCan",
        "floor_lamp": "FloorLamp", "table_lamp": "DeskLamp", "plant": "HousePlant", "picture": "Painting",
        "cushion": "Pillow", "books": "Book", "vase": "Vase", "bowl": "Bowl", "cup": "Mug", "plate": "Plate",
    }
)  # fmt: skip
"""Category -> asset type of ProcTHOR (with two assets at least) whose sizes it shares."""

DEVIATIONS: Mapping[str, str] = MappingProxyType(
    {
        "washing_machine": "the assets are American top loaders; ours is the 60 cm under-counter machine (EN 1116)",
        "cushion": "the assets lie flat; ours stand on their edge, so that one can sit before them",
        "toilet": "two assets of .53 m, too wide for a bowl; ours are our default",
    }
)
"""Category -> why its ranges depart from the real ones."""


def size(category_name: str) -> Size:
    """The size of a category of the table."""
    return SIZES[category_name]
