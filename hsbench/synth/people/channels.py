"""What a person does over time, as plain curves: the link between activities (which append them) and joints.

A chunk of motion is a ``Channels`` of T frames; chunks follow each other, each starting one frame after the last frame
of the one before. ``pose`` turns the whole line into joints at once, adding what nobody decides: sway, breath, bob.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy import ndimage

from hsbench.geometry.numerics import quantise_m
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.gait import Feet, smooth, standing_feet
from hsbench.synth.people.kinematics import SIDE_SIGN, Posture, highest_pelvis, leg, shoulders, solve
from hsbench.typing import FloatArray, IntArray

KNEE_SLACK_M = 0.012  # a standing pelvis hangs so far below straight legs
BOB_M = (0.030, 0.012)  # walking lowers the pelvis on average, and moves it up and down by this
WALK_SWAY_M = 0.018  # towards the standing foot
WALK_LEAN_RAD = 0.05
WALK_TWIST_RAD = 0.10
ARM_SWING_RAD = 0.38
ARM_OUT_RAD = 0.13
ELBOW_REST_RAD = 0.22
ELBOW_SWING_RAD = 0.30
PELVIS_EASE_S = 0.2  # a pelvis does not drop faster than over about this time when a leg gets too short
SWAY_M = 0.007  # idle, standing
IDLE_LEAN_RAD = (0.012, 0.035)  # standing, seated
IDLE_TWIST_RAD = (0.02, 0.05)
IDLE_LOOK_RAD = 0.35
IDLE_PERIODS_S = (3.1, 5.3, 8.9)  # incommensurable, so that the sum does not repeat
HAND_ON_THIGH = 0.68  # of the way from hip to knee
REACH_CURVE = (0.8, 0.12)  # a hand first draws back to below the shoulder, by this share, and rises above its target


@dataclass(frozen=True, eq=False)
class Channels:
    """T frames, all (T, ...) float64; index 0 of a pair is left.

    xy: (T, 2) pelvis. height: (T,) of the pelvis before bobbing. yaw: (T,) heading, continuous. lean: (T,) forward.
    gain: (T,) how much of a walk this is, 0..1. phase: (T,) gait phase of a walk, shifted so that even numbers are
    landings of the left foot. feet: ball, yaw, pitch. seated: (T,) 0..1, hands go to the thighs.
    reach: (T, 2) 0..1, share of the way of each hand to target (T, 2, 3). look: (T, 2) head yaw, pitch.
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
    look: FloatArray

    def __len__(self) -> int:
        return len(self.yaw)

    def last(self) -> Channels:
        """The last frame, as (1, ...) arrays."""
        return self._rows(slice(len(self) - 1, None))

    def hold(self, frames: int) -> Channels:
        """The last frame for so many frames."""
        return self._rows(np.full(frames, len(self) - 1))

    def backwards(self) -> Channels:
        """The same frames in reverse order."""
        return self._rows(slice(None, None, -1))

    def _rows(self, rows: slice | IntArray) -> Channels:
        feet = Feet(self.feet.ball[rows], self.feet.yaw[rows], self.feet.pitch[rows])
        return Channels(feet=feet, **{name: getattr(self, name)[rows] for name in _plain_names()})


def concatenate(chunks: Sequence[Channels]) -> Channels:
    """Chunks in order as one."""
    feet = Feet(*(np.concatenate([getattr(c.feet, n) for c in chunks]) for n in ("ball", "yaw", "pitch")))
    return Channels(feet=feet, **{n: np.concatenate([getattr(c, n) for c in chunks]) for n in _plain_names()})


def _plain_names() -> list[str]:
    return [f.name for f in fields(Channels) if f.name != "feet"]


def standing(body: Body, xy: FloatArray, yaw_rad: float) -> Channels:
    """One frame (1, ...) of a person standing at xy (2,), facing ``yaw_rad``."""
    yaw = np.array([yaw_rad])
    xy = np.asarray(xy, dtype=np.float64).reshape(1, 2)
    zero = np.zeros(1)
    return Channels(
        xy=xy, height=np.array([standing_height(body)]), yaw=yaw, lean=zero, gain=zero, phase=zero,
        feet=standing_feet(body, xy, yaw), seated=zero, reach=np.zeros((1, 2)), target=np.zeros((1, 2, 3)),
        look=np.zeros((1, 2)),
    )  # fmt: skip


def standing_height(body: Body) -> float:
    """Pelvis height of a person at rest, in metres."""
    return body.of_stature(anatomy.HIP_HEIGHT) - KNEE_SLACK_M


def pose(body: Body, channels: Channels, fps: float, rng: np.random.Generator | None) -> FloatArray:
    """(T, 25, 3) joints in metres, rounded to .1 mm. ``rng`` gives the phases of sway and glances; None: none."""
    time_s = np.arange(len(channels)) / fps
    calm = 1 - channels.gain
    noise = [np.zeros_like(time_s) if rng is None else _idle(time_s, rng) for _ in range(7)]
    bob, sway = np.cos(2 * np.pi * channels.phase), np.sin(np.pi * channels.phase)
    swing = channels.gain * np.cos(np.pi * channels.phase)
    upright = (1 - channels.seated) * (1 - channels.reach.max(axis=1))
    left = np.stack([-np.sin(channels.yaw), np.cos(channels.yaw)], axis=-1)
    shift = np.stack([noise[0], noise[1]], axis=-1) * (SWAY_M * calm * upright)[:, None]
    xy = channels.xy + left * (WALK_SWAY_M * channels.gain * sway)[:, None] + shift
    height = channels.height - channels.gain * (BOB_M[0] + BOB_M[1] * bob)
    at_rest = 1 - channels.reach.max(axis=1)
    look = channels.look + (IDLE_LOOK_RAD * calm * at_rest)[:, None] * np.stack([noise[2], 0.3 * noise[3]], axis=-1)
    posture = Posture(
        pelvis=np.column_stack([xy, height]),
        yaw=channels.yaw,
        lean=channels.lean + WALK_LEAN_RAD * channels.gain + calm * noise[4] * _between(IDLE_LEAN_RAD, channels.seated),
        side=calm * noise[5] * IDLE_LEAN_RAD[0] - 0.02 * channels.gain * sway,
        twist=WALK_TWIST_RAD * swing + calm * noise[6] * _between(IDLE_TWIST_RAD, channels.seated),
        look=look,
        ball=channels.feet.ball,
        foot_yaw=channels.feet.yaw,
        foot_pitch=channels.feet.pitch,
        tip=np.empty((len(channels), 2, 3)),
    )
    limited = _lower_envelope(np.minimum(height, highest_pelvis(body, posture)), frames=round(PELVIS_EASE_S * fps) | 1)
    posture = replace(posture, pelvis=np.column_stack([xy, limited]))
    posture = replace(posture, tip=_tips(body, channels, posture, swing))
    return quantise_m(solve(body, posture))


def _tips(body: Body, channels: Channels, posture: Posture, swing: FloatArray) -> FloatArray:
    """(T, 2, 3) finger tip targets: hanging and swinging, on the thighs, or on the way to a target."""
    shoulder = shoulders(body, posture)
    turn = posture.yaw + posture.twist
    ahead, left = (np.stack([np.cos(a), np.sin(a), np.zeros_like(a)], axis=-1) for a in (turn, turn + np.pi / 2))
    upper_m = body.of_stature(anatomy.UPPER_ARM)
    lower_m = body.of_stature(anatomy.FOREARM + anatomy.HAND)
    up = np.array([0.0, 0.0, 1.0])
    tips = np.empty((len(channels), 2, 3))
    for side, sign in enumerate(SIDE_SIGN):
        angle = -sign * ARM_SWING_RAD * swing
        bent = angle + ELBOW_REST_RAD + channels.gain * ELBOW_SWING_RAD * np.maximum(-sign * swing, 0.0)
        forward_m = upper_m * np.sin(angle) + lower_m * np.sin(bent)
        down_m = upper_m * np.cos(angle) + lower_m * np.cos(bent)
        out_m = sign * np.sin(ARM_OUT_RAD) * upper_m
        free = shoulder[:, side] + forward_m[:, None] * ahead + out_m * left - down_m[:, None] * up
        hip, knee, _, _ = leg(body, posture, side)
        on_thigh = hip + HAND_ON_THIGH * (knee - hip) + body.radius(anatomy.RADIUS_THIGH[1] + 0.012) * up
        tip = free + smooth(channels.seated)[:, None] * (on_thigh - free)
        share, target = channels.reach[:, side, None], channels.target[:, side]
        control = tip + REACH_CURVE[0] * (shoulder[:, side] - tip)
        control[:, 2] = np.maximum(tip[:, 2], target[:, 2]) + REACH_CURVE[1]
        tips[:, side] = (1 - share) ** 2 * tip + 2 * share * (1 - share) * control + share**2 * target
    return tips


def _idle(time_s: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(T,) a slow wander between about -1 and 1: three sines of random phase."""
    phases = rng.uniform(0, 2 * np.pi, len(IDLE_PERIODS_S))
    waves = [np.sin(2 * np.pi * time_s / period + phase) for period, phase in zip(IDLE_PERIODS_S, phases, strict=True)]
    return np.asarray(sum(waves) / len(waves) * 1.5)


def _lower_envelope(values: FloatArray, frames: int) -> FloatArray:
    """(T,) a smooth curve that is nowhere above ``values``."""
    lowest = ndimage.minimum_filter1d(values, frames, mode="nearest")
    return np.asarray(ndimage.uniform_filter1d(lowest, frames, mode="nearest"))


def _between(ends: tuple[float, float], share: FloatArray) -> FloatArray:
    return ends[0] + share * (ends[1] - ends[0])
