"""What a person does over time, as plain curves: the link between activities (which append them) and joints.

A chunk of motion is a ``Channels`` of T frames; chunks follow each other, each starting one frame after the last frame
of the one before. ``pose`` turns the whole line into joints at once, adding what nobody decides: sway, breath, bob.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.gait import Feet, standing_feet
from hsbench.synth.people.kinematics import Lengths
from hsbench.synth.people.posing import IDLE_PERIODS_S, WANDERS, Manner, Tracks, pose_tracks
from hsbench.synth.people.posing import OVERLAP_S as OVERLAP_S
from hsbench.typing import FloatArray, IntArray

SEEN_ONLY = ("hand", "held")  # of no matter for the joints
KNEE_SLACK_M = 0.012  # a standing pelvis hangs so far below straight legs


@dataclass(frozen=True, eq=False)
class Channels:
    """T frames, all (T, ...) float64; index 0 of a pair is left.

    xy: (T, 2) pelvis. height: (T,) of the pelvis before bobbing. yaw: (T,) heading, continuous. lean: (T,) forward.
    gain: (T,) how much of a walk this is, 0..1. phase: (T,) gait phase of a walk, shifted so that even numbers are
    landings of the left foot. feet: ball, yaw, pitch. seated: (T,) 0..1, hands go to the thighs.
    reach: (T, 2) 0..1, share of the way of each hand to target (T, 2, 3), in the scene. near: (T, 2) 0..1, share of the
    way from there to a place of the own body: offset (T, 2, 3) forward, left, up of the top of the spine in the axes of
    the chest, as shares of stature; at_head: (T, 2) 0..1, of the middle and in the axes of the head instead.
    pointing: (T, 2, 3) where each hand points, in the axes of the chest; of length 0..1, the shorter, the more the hand
    follows the forearm. held: (T,) what is in the hands, as a place in ``props.HELD``.
    look: (T, 2) head yaw, pitch. tilt: (T,) of the trunk forward, pelvis included (lying on the back: -pi/2).
    roll: (T,) of the trunk about its own axis (lying on the left side: pi/2). hand: (T,) the preferred one.
    """

    xy: FloatArray
    height: FloatArray
    yaw: FloatArray
    lean: FloatArray
    gain: FloatArray
    phase: FloatArray
    feet: Feet
    seated: FloatArray
    reach: FloatArray
    target: FloatArray
    near: FloatArray
    offset: FloatArray
    at_head: FloatArray
    pointing: FloatArray
    held: FloatArray
    look: FloatArray
    tilt: FloatArray
    roll: FloatArray
    hand: FloatArray

    def __len__(self) -> int:
        return len(self.yaw)

    def last(self) -> Channels:
        """The last frame, as (1, ...) arrays."""
        return self._rows(slice(len(self) - 1, None))

    def hold(self, frames: int) -> Channels:
        """The last frame for so many frames."""
        return self._rows(np.full(frames, len(self) - 1))

    def part(self, first: int, last: int) -> Channels:
        """The frames from ``first`` to before ``last``."""
        return self._rows(slice(first, last))

    def backwards(self) -> Channels:
        """The same frames in reverse order."""
        return self._rows(slice(None, None, -1))

    def _rows(self, rows: slice | IntArray) -> Channels:
        feet = Feet(self.feet.ball[rows], self.feet.yaw[rows], self.feet.pitch[rows])
        return Channels(feet=feet, **{name: getattr(self, name)[rows] for name in _PLAIN})


def concatenate(chunks: Sequence[Channels]) -> Channels:
    """Chunks in order as one."""
    feet = Feet(*(np.concatenate([getattr(c.feet, n) for c in chunks]) for n in ("ball", "yaw", "pitch")))
    return Channels(feet=feet, **{n: np.concatenate([getattr(c, n) for c in chunks]) for n in _PLAIN})


_PLAIN = tuple(f.name for f in fields(Channels) if f.name != "feet")


def standing(body: Body, xy: FloatArray, yaw_rad: float) -> Channels:
    """One frame (1, ...) of a person standing at xy (2,), facing ``yaw_rad``."""
    yaw = np.array([yaw_rad])
    xy = np.asarray(xy, dtype=np.float64).reshape(1, 2)
    zero = np.zeros(1)
    return Channels(
        xy=xy, height=np.array([standing_height(body)]), yaw=yaw, lean=zero, gain=zero, phase=zero,
        feet=standing_feet(body, xy, yaw), seated=zero, reach=np.zeros((1, 2)), target=np.zeros((1, 2, 3)),
        near=np.zeros((1, 2)), offset=np.zeros((1, 2, 3)), at_head=np.zeros((1, 2)),
        pointing=np.zeros((1, 2, 3)), held=zero, look=np.zeros((1, 2)),
        tilt=zero, roll=zero, hand=np.array([float(body.style.hand)]),
    )  # fmt: skip


def standing_height(body: Body) -> float:
    """Pelvis height of a person at rest, in metres."""
    return body.of_stature(anatomy.HIP_HEIGHT) - KNEE_SLACK_M


@dataclass(frozen=True, eq=False)
class Idle:
    """What nobody decides: the phases (7, 3) in radians of a person's slow sway, lean and glances."""

    phases: FloatArray

    @classmethod
    def sample(cls, rng: np.random.Generator) -> Idle:
        """Phases drawn at random."""
        return cls(rng.uniform(0, 2 * np.pi, (WANDERS, len(IDLE_PERIODS_S))))


def pose(body: Body, channels: Channels, fps: float, rng: np.random.Generator | None) -> FloatArray:
    """(T, 25, 3) joints in metres, rounded to .1 mm. ``rng`` gives the phases of sway and glances; None: none."""
    return pose_block(body, channels, 0, fps, None if rng is None else Idle.sample(rng))


def pose_block(body: Body, channels: Channels, first_frame: int, fps: float, idle: Idle | None) -> FloatArray:
    """(T, 25, 3) joints in metres, rounded to .1 mm, of T frames that begin at ``first_frame`` of a life.

    They are those of the whole life to the last bit, but for the frames within ``OVERLAP_S`` of an end of ``channels``
    that is not an end of the life: hand in so many more there, and drop them from the result.
    """
    feet = channels.feet
    plain = {name: np.ascontiguousarray(getattr(channels, name)) for name in _PLAIN if name not in SEEN_ONLY}
    ball, foot_yaw, foot_pitch = (np.ascontiguousarray(a) for a in (feet.ball, feet.yaw, feet.pitch))
    tracks = Tracks(ball=ball, foot_yaw=foot_yaw, foot_pitch=foot_pitch, **plain)
    style = body.style
    manner = Manner(style.arm_swing, style.gaze, style.lean_rad)
    phases = np.zeros((WANDERS, len(IDLE_PERIODS_S))) if idle is None else idle.phases
    joints = pose_tracks(Lengths.of(body), manner, tracks, first_frame, float(fps), phases, float(idle is not None))
    return quantise_m(joints)
