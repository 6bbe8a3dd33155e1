"""How people live in a scene: how many, for how long, in which manner."""

from __future__ import annotations

from dataclasses import dataclass

from hsbench.errors import SchemaError
from hsbench.synth.activities.schedule import HABITS
from hsbench.synth.people.bvh import Clip

Range = tuple[float, float]

MODES = ("exploring", "natural")
MOST_PEOPLE = 8


@dataclass(frozen=True)
class LifeConfig:
    """Lengths are seconds, drawn uniformly from their ranges.

    duration_s: from t0 to the end, the empty time included. empty_s: nobody is there before. fps: poses a second.
    people: how many live there, 1-8; each comes in ``arrival_s`` after the one before.
    from_outside: they come in through the entrance door, which opens; else they begin inside it. What lies outside is
    not modelled: an open door shows nothing.
    mode: ``exploring`` goes everywhere and tries everything, floor and seats that nobody has tried first, and moves
    along seats until their whole surface has been sat on: within some 45 s a square metre of floor, 90 s a square metre
    of seats and 60 s a seat one person comes near 95 % of both. ``natural`` does what the hour suggests.
    start_hour: of the day at t0. habits: family of ``schedule.HABITS`` of each person, in turn.
    speed_m_s: a walker's pace, m/s. atypical_share: of sits and touches, by all people together, that are sits on what
    is no seat (a floor, an edge, an arm): life is not a label. unused_share: of the things that nobody ever uses.
    clips: motion capture that people in natural mode play, now and then, where there is room.
    Of the exploring mode: explore, sit, touch, look: weights of what is done next. stand_s: pauses. sit_s: on a seat.
    touch_s: a hand at rest on a part. look_s: at a window. touches_seated: tries to touch something while seated.
    """

    duration_s: float = 120.0
    empty_s: float = 1.0
    fps: int = 30
    people: int = 1
    from_outside: bool = True
    mode: str = "exploring"
    start_hour: float = 10.0
    habits: tuple[str, ...] = ("average",)
    arrival_s: Range = (2.0, 20.0)
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
    atypical_share: float = 0.045
    unused_share: float = 0.1
    clips: tuple[Clip, ...] = ()

    def __post_init__(self) -> None:
        if not self.fps > 0:
            raise SchemaError(f"life.fps is {self.fps}; expected poses per second > 0")
        if not 0 <= self.empty_s <= self.duration_s:
            raise SchemaError(f"life.empty_s is {self.empty_s}; expected 0..duration_s = {self.duration_s}")
        if not 1 <= self.people <= MOST_PEOPLE:
            raise SchemaError(f"life.people is {self.people}; expected 1..{MOST_PEOPLE}")
        if self.mode not in MODES:
            raise SchemaError(f"life.mode is {self.mode!r}; expected {' or '.join(MODES)}")
        if not 0 <= self.start_hour < 24:
            raise SchemaError(f"life.start_hour is {self.start_hour}; expected 0..24")
        unknown = sorted(set(self.habits) - set(HABITS))
        if unknown or not self.habits:
            raise SchemaError(f"life.habits is {self.habits}; expected one or more of {', '.join(HABITS)}")
        weights = (self.explore, self.sit, self.touch, self.look)
        if min(weights) < 0 or sum(weights) <= 0:
            raise SchemaError(f"life weights explore, sit, touch, look are {weights}; expected >= 0, not all zero")
        for name in ("atypical_share", "unused_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise SchemaError(f"life.{name} is {getattr(self, name)}; expected 0..1 (is it in percent?)")
        for name in ("stand_s", "sit_s", "touch_s", "look_s", "speed_m_s", "arrival_s"):
            low, high = getattr(self, name)
            if not 0 < low <= high:
                raise SchemaError(f"life.{name} is ({low}, {high}); expected 0 < least <= most")
