"""What a recipe may set about rooms: sizes, kinds, density, and the guarantees a finished room keeps."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError
from hsbench.synth.rooms.templates import COMMON_TEMPLATES, TEMPLATES, even_weights

Range = tuple[float, float]


@dataclass(frozen=True)
class RoomConfig:
    """Lengths are metres, areas square metres, shares 0..1. Raises SchemaError for impossible values."""

    width_m: Range = (3.6, 6.0)
    depth_m: Range = (3.4, 5.4)
    ceiling_m: Range = (2.4, 2.8)
    wall_m: Range = (0.1, 0.2)
    windows: tuple[int, int] = (1, 2)
    templates: tuple[tuple[str, float], ...] = even_weights(COMMON_TEMPLATES)
    """Arrangement templates with their weights; the novel ones are kept for test-novel."""
    extras: tuple[int, int] = (3, 5)
    """Fewest and most optional groups that are tried after those of the template."""
    furniture: tuple[int, int] = (6, 20)
    """Fewest and most objects of the furniture group."""
    clutter_per_top: float = 1.2
    """Mean number of small things tried on a table or board, at most 3."""
    curtain_share: float = 0.5
    turned_chair_share: float = 0.2
    """Share of chairs at a table that stand somewhat turned, as left by who got up."""
    turned_chair_deg: float = 25.0
    armchair_yaw_deg: float = 12.0
    door_clear_m: float = 0.9
    free_floor_share: float = 0.37
    """Floor that no footprint covers; kept above the promised .35."""
    walkable_share: float = 0.15
    """Floor where a body can stand and that is connected to the door."""
    pocket_m2: float = 0.1
    """Free floor that may be cut off from the door, in all."""
    seat_reach_m: float = 0.65
    """From the middle of a seat to a cell one can walk to; half a cell is kept from the promised .7."""
    hand_reach_m: float = 0.7
    """From a door, drawer or handle to a cell one can walk to; half a cell is kept from the promised .75."""
    bedside_m: float = 0.4
    """From the edge of a mattress to a cell one can walk to."""

    def __post_init__(self) -> None:
        for name in ("width_m", "depth_m", "ceiling_m", "wall_m", "windows", "extras", "furniture"):
            low, high = getattr(self, name)
            if not 0 <= low <= high:
                raise SchemaError(f"room.{name} is {(low, high)}; expected 0 <= smallest <= largest")
        if not self.templates:
            raise SchemaError("room.templates is empty; expected at least one (name, weight)")
        for name, weight in self.templates:
            if name not in TEMPLATES:
                raise SchemaError(f"room.templates names {name!r}; expected some of {', '.join(TEMPLATES)}")
            if not weight > 0:
                raise SchemaError(f"room.templates gives {name} the weight {weight}; expected a positive number")
        if self.width_m[0] < 3.0 or self.depth_m[0] < 3.0:
            raise SchemaError(f"room is {self.width_m[0]} x {self.depth_m[0]} m at least; expected 3 m or more")
