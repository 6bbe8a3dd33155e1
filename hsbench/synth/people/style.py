"""How a person moves, apart from what they do: pace, swing, width, posture, gaze, preferred hand."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.numerics import quantise_m

LEFT_HANDED = 0.106  # of adults (Papadatou-Pastou et al. 2020, Psychological Bulletin 146:481)

RANGES: dict[str, tuple[float, float]] = {
    "cadence": (0.90, 1.10),  # the walk ratio of healthy adults varies by about a tenth (Sekiya & Nagasaki 1998)
    "arm_swing": (0.60, 1.30),
    "step_width": (0.75, 1.20),
    "lean_rad": (-0.02, 0.06),
    "gaze": (0.40, 1.40),
}
"""From which to which each number of a style is drawn, evenly."""


@dataclass(frozen=True)
class Style:
    """Factors on the average person's cadence at a given speed, arm swing, step width and idle glances.

    lean_rad: how far the spine is bent forwards at rest. hand: the preferred one, 0 left, 1 right.
    Raises SchemaError for a factor that is not in 0.25..2, a lean of more than .3 rad, or another hand.
    """

    cadence: float = 1.0
    arm_swing: float = 1.0
    step_width: float = 1.0
    lean_rad: float = 0.0
    gaze: float = 1.0
    hand: int = 1

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            low, high = {"lean_rad": (-0.3, 0.3), "hand": (0, 1)}.get(field.name, (0.25, 2.0))
            if not low <= value <= high:
                hint = " (is it in degrees?)" if field.name == "lean_rad" else ""
                raise SchemaError(f"style.{field.name} is {value}; expected {low}..{high}{hint}")

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Style:
        """A style drawn at random."""
        drawn = {name: float(quantise_m(rng.uniform(*limits))) for name, limits in RANGES.items()}
        return cls(hand=int(rng.random() >= LEFT_HANDED), **drawn)


AVERAGE = Style()
