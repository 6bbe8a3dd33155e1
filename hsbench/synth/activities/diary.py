"""What one person has done so far: motion, actions and events, kept until they are written out."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TypeVar

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.states import Action
from hsbench.synth.people.channels import Channels, concatenate
from hsbench.typing import BoolArray, FloatArray, UInt8Array

T = TypeVar("T")

CONTACTS = ("sit", "touch")


@dataclass(frozen=True)
class Doing:
    """One event in frames of the scene, ``end`` being the last frame; -1 while it goes on."""

    activity: str
    start: int
    end: int = -1
    object_id: int = 0
    part: str = ""
    contact: str = ""


@dataclass(frozen=True)
class Shift:
    """An object stands moved by (x, y, yaw) in its own frame at a frame; ``part`` as in ``ObjectMotions``."""

    frame: int
    object_id: int
    part: str
    move: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Played:
    """Joints (n, 25, 3), scene frame, that replace those of the plan from a frame on, by weights (n,)."""

    first: int
    joints: FloatArray
    weight: FloatArray


@dataclass(frozen=True)
class Undone:
    """What was to be done at a frame and was not, and why."""

    frame: int
    activity: str
    reason: str


class Diary:
    """A line of motion without gaps, from the frame ``begin`` on."""

    def __init__(self, begin: int, first: Channels) -> None:
        self.begin, self.frame = begin, begin + len(first)
        self._chunks = [first]
        self._actions: list[UInt8Array] = [np.full(len(first), Action.STAND, dtype=np.uint8)]
        self._kept = begin  # the frame of the first chunk
        self.open: list[Doing] = []
        self.done: list[Doing] = []
        self.shifts: list[Shift] = []
        self.undone: list[Undone] = []
        self.contacts = 0  # sits and touches begun so far
        self.played: list[Played] = []
        self.away: list[tuple[int, int]] = []  # frames from first to before stop at which one is not there

    @property
    def here(self) -> Channels:
        """The last frame."""
        return self._chunks[-1].last()

    def add(self, chunk: Channels, action: Action) -> None:
        """What follows."""
        self._chunks.append(chunk)
        self._actions.append(np.full(len(chunk), action, dtype=np.uint8))
        self.frame += len(chunk)

    def start(self, activity: str, object_id: int = 0, part: str = "", contact: str = "") -> Doing:
        """An event begins with the next frame."""
        self.contacts += activity in CONTACTS
        self.open.append(Doing(activity, self.frame, -1, object_id, part, contact))
        return self.open[-1]

    def stop(self, doing: Doing) -> None:
        """An event has ended with the last frame."""
        self.open.remove(doing)
        self.done.append(replace(doing, end=self.frame - 1))

    def motion(self, first: int, stop: int) -> Channels:
        """Frames first .. stop - 1."""
        return rows_of(concatenate(self._chunks), slice(first - self._kept, stop - self._kept))

    def actions(self, first: int, stop: int) -> UInt8Array:
        """(stop - first,) uint8 of ``Action``."""
        return np.concatenate(self._actions)[first - self._kept : stop - self._kept]

    def is_there(self, first: int, stop: int) -> BoolArray:
        """(stop - first,) bool."""
        frames = np.arange(first, stop)
        return ~np.any([(frames >= low) & (frames < high) for low, high in [(0, 0), *self.away]], axis=0)

    def with_clips(self, first: int, joints: FloatArray) -> FloatArray:
        """(n, 25, 3) joints from a frame on, with the clips played then."""
        joints = joints.copy()
        for played in self.played:
            low, high = (
                int(np.clip(f - first, 0, len(joints))) for f in (played.first, played.first + len(played.weight))
            )
            own = slice(low + first - played.first, high + first - played.first)
            weight = played.weight[own, None, None]
            joints[low:high] = quantise_m((1 - weight) * joints[low:high] + weight * played.joints[own])
        return joints

    def forget(self, before: int) -> None:
        """Drop the motion before a frame."""
        self.played = [played for played in self.played if played.first + len(played.weight) > before]
        self.away = [span for span in self.away if span[1] > before]
        while len(self._chunks) > 1 and self._kept + len(self._chunks[0]) <= before:
            self._kept += len(self._chunks.pop(0))
            self._actions.pop(0)


def rows_of(curves: T, rows: slice) -> T:
    """Some rows of all arrays in a dataclass."""
    values = {f.name: getattr(curves, f.name) for f in fields(curves)}  # type: ignore[arg-type]
    picked = {k: rows_of(v, rows) if is_dataclass(v) else v[rows] for k, v in values.items()}
    return replace(curves, **picked)  # type: ignore[type-var]
