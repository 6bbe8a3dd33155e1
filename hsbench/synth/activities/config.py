"""How a person lives in a room: lengths, and how often what is done."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError

Range = tuple[float, float]


@dataclass(frozen=True)
class LifeConfig:
    """Lengths are seconds, drawn uniformly from their ranges.

    duration_s: from t0 to the end, the empty time included. empty_s: nobody is there before. fps: poses a second.
    explore, sit, touch, look: weights of what is done next. stand_s: pauses. sit_s: on a seat. touch_s: a hand at rest
    on a part. look_s: at a window. speed_m_s: a walker's pace, m/s. touches_seated: tries to touch something while
    seated. atypical_share: of sits and touches that become sitting on a table's edge (TASKS: life is not a label).
    """

    duration_s: float = 120.0
    empty_s: float = 1.0
    fps: int = 30
    explore: float = 0.36
    sit: float = 0.20
    touch: float = 0.34
    look: float = 0.10
    stand_s: Range = (0.5, 2.5)
    sit_s: Range = (5.0, 15.0)
    touch_s: Range = (1.5, 5.0)
    look_s: Range = (2.0, 5.0)
    speed_m_s: Range = (0.9, 1.2)
    touches_seated: int = 2
    atypical_share: float = 0.04

    def __post_init__(self) -> None:
        if not self.fps > 0:
            raise SchemaError(f"life.fps is {self.fps}; expected poses per second > 0")
        if not 0 <= self.empty_s <= self.duration_s:
            raise SchemaError(f"life.empty_s is {self.empty_s}; expected 0..duration_s = {self.duration_s}")
        weights = (self.explore, self.sit, self.touch, self.look)
        if min(weights) < 0 or sum(weights) <= 0:
            raise SchemaError(f"life weights explore, sit, touch, look are {weights}; expected >= 0, not all zero")
        if not 0 <= self.atypical_share <= 1:
            raise SchemaError(f"life.atypical_share is {self.atypical_share}; expected 0..1 (is it in percent?)")
        for name in ("stand_s", "sit_s", "touch_s", "look_s", "speed_m_s"):
            low, high = getattr(self, name)
            if not 0 < low <= high:
                raise SchemaError(f"life.{name} is ({low}, {high}); expected 0 < least <= most")
