"""What a recipe may set about rooms and homes: sizes, shapes, kinds, density, and what a finished room guarantees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from hsbench.errors import SchemaError
from hsbench.synth.rooms.plan_shapes import SHAPES
from hsbench.synth.rooms.room_kinds import PROGRAMMES, Range
from hsbench.synth.rooms.templates import COMMON_TEMPLATES, TEMPLATES, even_weights

Weights = tuple[tuple[str, float], ...]
"""(name, weight) pairs."""


LEAST_SIDE_M = 1.4


@dataclass(frozen=True)
class RoomConfig:
    """One room and how it is furnished. Lengths are metres, shares 0..1. Raises SchemaError for impossible values."""

    width_m: Range | None = None
    """Range of the width where it is not to be what is usual for the room type; so for the depth."""
    depth_m: Range | None = None
    ceiling_m: Range = (2.3, 3.2)
    wall_m: Range = (0.2, 0.4)
    shapes: Weights = (("rectangle", 0.55), ("l", 0.2), ("t", 0.1), ("niche", 0.15))
    windows: tuple[int, int] = (1, 2)
    templates: tuple[tuple[str, float], ...] = even_weights(COMMON_TEMPLATES)
    """Arrangement templates with their weights; the novel ones are kept for test-novel."""
    divider_share: float = 0.12
    """Share of rooms divided by shelves or a sofa, where the type has such templates: they hide what is behind."""
    extras: tuple[int, int] = (3, 5)
    """Fewest and most optional groups that are tried after those of the template."""
    furniture: tuple[int, int] = (6, 20)
    """Fewest and most objects of the furniture group in a room of usual size."""
    clutter_per_top: float = 1.2
    """Mean number of small things tried on a table or board, at most 3."""
    curtain_share: float = 0.7
    turned_chair_share: float = 0.2
    """Share of chairs at a table that stand somewhat turned, as left by who got up."""
    turned_chair_deg: float = 25.0
    armchair_yaw_deg: float = 12.0
    door_clear_m: float = 0.9
    free_floor_share: float = 0.37
    """Floor that no footprint covers; kept above the promised .35."""
    walkable_share: float = 0.15
    """Floor where a body can stand and that is connected to the doors."""
    pocket_m2: float = 0.1
    """Free floor that may be cut off from the doors, in all."""
    seat_reach_m: float = 0.65
    """From the middle of a seat to a cell one can walk to; half a cell is kept from the promised .7."""
    hand_reach_m: float = 0.7
    """From a door, drawer or handle to a cell one can walk to; half a cell is kept from the promised .75."""
    window_reach_m: float = 0.93
    """From the wall below the handle of a window to a cell one can walk to: one leans over low furniture."""
    bedside_m: float = 0.4
    """From the edge of a mattress to a cell one can walk to."""

    def __post_init__(self) -> None:
        for name in ("width_m", "depth_m", "ceiling_m", "wall_m", "windows", "extras", "furniture"):
            _check_range(f"room.{name}", getattr(self, name))
        _check_weights("room.templates", self.templates, TEMPLATES)
        _check_weights("room.shapes", self.shapes, SHAPES)
        for name in ("width_m", "depth_m"):
            sizes = getattr(self, name)
            if sizes is not None and not sizes[0] >= LEAST_SIDE_M:
                raise SchemaError(f"room.{name} is {sizes}; expected {LEAST_SIDE_M} m or more, place for the door")


@dataclass(frozen=True)
class HomeConfig:
    """A flat or office: which rooms, how they are built. ``room`` says how each is furnished, not how large it is.

    programmes: names of ``PROGRAMMES`` with weights. Lengths are metres, shares 0..1. Raises SchemaError.
    """

    programmes: tuple[tuple[str, float], ...] = tuple((name, 1.0) for name in PROGRAMMES)
    ceiling_m: Range = (2.3, 3.2)
    outer_m: Range = (0.2, 0.4)
    inner_m: Range = (0.1, 0.15)
    shaft_share: float = 0.3
    """Of rooms large enough that have a shaft in a corner."""
    open_share: float = 0.5
    """Of neighbouring rooms for living, cooking and eating that have a wide passage between them."""
    room: RoomConfig = field(default_factory=RoomConfig)

    def __post_init__(self) -> None:
        for name in ("ceiling_m", "outer_m", "inner_m"):
            _check_range(f"home.{name}", getattr(self, name))
        _check_weights("home.programmes", self.programmes, PROGRAMMES)


def _check_range(name: str, values: tuple[float, float] | None) -> None:
    if values is not None and not 0 <= values[0] <= values[1]:
        raise SchemaError(f"{name} is {values}; expected 0 <= smallest <= largest")


def _check_weights(name: str, weights: Weights, known: Iterable[str]) -> None:
    names = tuple(known)
    if not weights:
        raise SchemaError(f"{name} is empty; expected at least one (name, weight)")
    for key, weight in weights:
        if key not in names:
            raise SchemaError(f"{name} names {key!r}; expected some of {', '.join(names)}")
        if not weight > 0:
            raise SchemaError(f"{name} gives {key} the weight {weight}; expected a positive number")
