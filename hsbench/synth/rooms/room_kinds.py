"""How large rooms of each type are, what windows they have, and which rooms make a home.

Areas and least sides: bedrooms after the Nationally described space standard (DCLG, 2015: 11.5 m2 and 2.75 m for a
double room), offices after ASR A1.2 (BAuA, 2013: 8 m2 for the first place of work, 6 m2 for each further one); all
others are our default. So are windows: sills above desks and radiators, in kitchens above the worktop, in bathrooms
high.
"""

from __future__ import annotations

from dataclasses import dataclass

Range = tuple[float, float]


@dataclass(frozen=True)
class Windows:
    """How many windows a room tries to have, and ranges of width, sill height and height, metres."""

    count: tuple[int, int]
    width_m: Range
    sill_m: Range = (0.85, 1.0)
    height_m: Range = (1.05, 1.35)


@dataclass(frozen=True)
class RoomKind:
    """What is usual for a room type. slender: the largest ratio of its sides that looks like one."""

    area_m2: Range
    side_m: float
    slender: float
    windows: Windows


ROOM_KINDS: dict[str, RoomKind] = {
    "living": RoomKind((16.0, 32.0), 3.4, 1.7, Windows((1, 3), (1.0, 2.0))),
    "bedroom": RoomKind((11.5, 20.0), 2.8, 1.6, Windows((1, 2), (0.9, 1.7))),
    "kitchen": RoomKind((7.0, 14.0), 2.2, 2.0, Windows((1, 1), (0.8, 1.4), (1.05, 1.15), (0.85, 1.05))),
    "dining": RoomKind((12.0, 22.0), 3.0, 1.7, Windows((1, 2), (0.9, 1.7))),
    "bathroom": RoomKind((4.6, 9.0), 1.85, 2.0, Windows((0, 1), (0.5, 0.8), (1.3, 1.5), (0.5, 0.7))),
    "study": RoomKind((9.0, 16.0), 2.7, 1.7, Windows((1, 2), (0.9, 1.6))),
    "office": RoomKind((10.0, 24.0), 2.8, 1.7, Windows((1, 3), (0.9, 1.8))),
    "meeting": RoomKind((14.0, 28.0), 3.2, 1.8, Windows((1, 3), (0.9, 1.8))),
    "corridor": RoomKind((4.0, 9.0), 1.3, 6.0, Windows((0, 0), (0.8, 1.0))),
}
"""Room type -> what is usual for it."""

PROGRAMMES: dict[str, tuple[str, ...]] = {
    "studio": ("living", "bathroom"),
    "one_room": ("corridor", "living", "kitchen", "bathroom"),
    "one_bedroom": ("corridor", "living", "kitchen", "bathroom", "bedroom"),
    "one_bedroom_study": ("corridor", "living", "kitchen", "bathroom", "bedroom", "study"),
    "two_bedroom": ("corridor", "living", "kitchen", "bathroom", "bedroom", "bedroom"),
    "two_bedroom_dining": ("corridor", "living", "dining", "bathroom", "bedroom", "bedroom"),
    "three_bedroom": ("corridor", "living", "kitchen", "bathroom", "bathroom", "bedroom", "bedroom", "bedroom"),
    "small_office": ("corridor", "office", "kitchen", "bathroom"),
    "office": ("corridor", "office", "office", "meeting", "bathroom"),
    "large_office": ("corridor", "office", "office", "office", "meeting", "kitchen", "bathroom"),
}
"""Name -> room types; the entrance leads into the first."""
