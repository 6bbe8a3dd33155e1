"""How much floor each category needs in front, and what must be within reach of a person who stands."""

from __future__ import annotations

CLEAR_FRONT_M: dict[str, float] = {
    "sofa": 0.5,
    "armchair": 0.4,
    "wardrobe": 0.6,
    "bookshelf": 0.5,
    "sideboard": 0.5,
    "dresser": 0.55,
    "tv_stand": 0.45,
    "desk": 0.6,
    "fridge": 0.65,
    "kitchen_counter": 0.7,
    "kitchen_island": 0.7,
}
"""Category -> depth of the zone before its front that others keep free, metres."""

OPENING_ROLES: tuple[str, ...] = ("door", "drawer", "front", "handle")
"""Roles of parts that are opened: of each object with such parts at least one is within a hand's reach."""

SITTING_ROLES: tuple[str, ...] = ("seat", "mattress")
SITTING_M = 0.95
"""Nothing hangs lower than this above what one sits on."""
