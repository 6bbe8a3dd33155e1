"""How much floor each category needs in front, and what must be within reach of a person who stands.

Sources: kitchens, NKBA Kitchen Planning Guidelines (a work aisle of 1.07 m for one cook; the .7 m here is what a zone
keeps of it before other furniture narrows it). Bathrooms, International Residential Code 2021, R307.1: 21 inches
(.53 m) before toilet, basin and bath, 24 inches (.61 m) before a shower. All others are our default: the depth of a
drawer or door and a person beside it, or the shins of somebody seated.
"""

from __future__ import annotations

CLEAR_FRONT_M: dict[str, float] = {
    "sofa": 0.5,
    "armchair": 0.4,
    "bunk_bed": 0.5,
    "wardrobe": 0.6,
    "bookshelf": 0.5,
    "sideboard": 0.5,
    "dresser": 0.55,
    "filing_cabinet": 0.6,
    "shoe_cabinet": 0.45,
    "coat_rack": 0.4,
    "tv_stand": 0.45,
    "desk": 0.6,
    "piano": 0.7,
    "whiteboard": 0.6,
    "water_cooler": 0.5,
    "fridge": 0.65,
    "kitchen_counter": 0.7,
    "kitchen_island": 0.7,
    "stove": 0.7,
    "dishwasher": 0.7,
    "washing_machine": 0.6,
    "toilet": 0.53,
    "washbasin": 0.53,
    "bathtub": 0.53,
    "shower": 0.61,
    "bathroom_cabinet": 0.45,
}
"""Category -> depth of the zone before its front that others keep free, metres."""

CLEAR_SIDE_M: dict[str, float] = {"toilet": 0.25, "shelf": 0.0, "radiator": 0.05}
"""Category -> how far this zone, and with it the floor below and beside the body, reaches to either side (our default;
IRC 2021, R307.1, asks for .38 m from the middle of a toilet)."""

TIGHT_FRONT_M: dict[str, float] = {
    "toilet": 0.53,
    "washbasin": 0.32,
    "shower": 0.36,
    "fridge": 0.5,
    "kitchen_counter": 0.5,
}
"""Category -> what the pieces of one group leave each other in front in a room too small for more (our default)."""

OPENING_ROLES: tuple[str, ...] = ("door", "drawer", "front")
"""Roles of parts that are opened, their handles on them: of each object with such parts at least one is within a hand's
reach of a person who stands. (The handle of a toilet is reached from its seat.)"""

SITTING_ROLES: tuple[str, ...] = ("seat", "mattress")
SITTING_M = 0.95
"""Nothing hangs lower than this above what one sits on."""
