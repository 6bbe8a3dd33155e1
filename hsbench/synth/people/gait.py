"""Walking feet: where they are planted along a moving root, and how they swing from one plant to the next.

The gait's phase p grows by one with every step. Landing k (1, 2, ...) happens at p = k, feet in turn; the foot stands
until p = k + 1.25 (both feet are down for a quarter of a step) and swings until its next landing at k + 2. A foot is
planted under the place the root has at p = k + .5: half a step ahead. Planted feet do not move.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.synth.people.body import BALL_FORWARD, BALL_HEIGHT, TOE_FORWARD, Body
from hsbench.synth.people.kinematics import SIDE_SIGN
from hsbench.typing import FloatArray

STEP_SHARE = 0.36  # step length at a comfortable pace over stature (Winter; .6 m at 1.7 m)
STEP_TURN_RAD = 0.7  # turning on the spot by this takes a step
DOUBLE_SUPPORT = 0.25  # of a step, both feet on the floor
ANKLE_UNDER_HIP = 0.9  # share of the foot bone by which a standing ball is ahead of the hip
LIFT_M = 0.045  # of the ball in mid swing
HEEL_RISE_RAD = 0.75  # before toe-off
HEEL_RISE_FROM = 0.75  # steps after landing
HEEL_SETTLE = 0.6  # steps after lift
FOOT_OUT_RAD = 0.10  # feet point a little outwards
END_STEP = 0.5  # phase gained while starting and while stopping


@dataclass(frozen=True, eq=False)
class Feet:
    """T frames of two feet (left, right): ball (T, 2, 3) metres, yaw (T, 2), pitch (T, 2), heel up positive."""

    ball: FloatArray
    yaw: FloatArray
    pitch: FloatArray

    def last(self) -> Feet:
        """The last frame, as (1, ...) arrays."""
        return Feet(self.ball[-1:], self.yaw[-1:], self.pitch[-1:])

    def hold(self, frames: int) -> Feet:
        """The last frame for so many frames."""
        return Feet(*(np.repeat(a[-1:], frames, axis=0) for a in (self.ball, self.yaw, self.pitch)))


def smooth(share: FloatArray) -> FloatArray:
    """Minimum-jerk rise from 0 to 1 over share 0..1 (Flash & Hogan 1985)."""
    x = np.clip(share, 0.0, 1.0)
    return np.asarray(x * x * x * (10 - 15 * x + 6 * x * x))


def standing_feet(body: Body, xy: FloatArray, yaw: FloatArray) -> Feet:
    """(N, 2) places and (N,) headings -> (N, ...) feet side by side below a standing person."""
    ball = np.stack([_plant(body, xy, yaw, side) for side in (0, 1)], axis=1)
    foot_yaw = np.stack([yaw + SIDE_SIGN[side] * FOOT_OUT_RAD for side in (0, 1)], axis=1)
    return Feet(ball, foot_yaw, np.zeros_like(foot_yaw))


def phase_of(body: Body, xy: FloatArray, yaw: FloatArray, fps: float, ramp_s: float = 0.5) -> FloatArray:
    """(T, 2) root and (T,) continuous heading -> (T,) gait phase from 0 to a whole number >= 2, never decreasing."""
    travelled = np.concatenate([[0.0], np.cumsum(np.sqrt(np.sum(np.diff(xy, axis=0) ** 2, axis=1)))])
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(yaw)))])
    time = np.arange(len(yaw)) / fps
    ends = smooth(time / ramp_s) + smooth(1 + (time - time[-1]) / ramp_s)
    raw = travelled / body.of_stature(STEP_SHARE) + turned / STEP_TURN_RAD + END_STEP * (ends - ends[0])
    steps = max(2.0, float(np.round(raw[-1])))
    return np.asarray(raw * (steps / raw[-1]))


def walk_feet(body: Body, start: Feet, xy: FloatArray, yaw: FloatArray, phase: FloatArray, first: int) -> Feet:
    """Feet (T, ...) of a walk from ``start`` (1, ...) with root xy (T, 2), heading yaw (T,) and phase (T,).

    first: the foot that swings first, 0 left, 1 right.
    """
    steps = int(np.round(phase[-1]))
    landings = np.arange(1, steps + 1)
    ahead = np.where(landings >= steps - 1, steps, landings + 0.5)
    when = np.interp(ahead, phase, np.arange(len(phase)))
    rows = np.arange(len(phase))
    place_xy = np.stack([np.interp(when, rows, xy[:, a]) for a in (0, 1)], axis=1)
    place = standing_feet(body, place_xy, np.interp(when, rows, yaw))
    ball, foot_yaw, pitch = np.empty((len(phase), 2, 3)), np.empty((len(phase), 2)), np.empty((len(phase), 2))
    for side in (0, 1):
        k0 = 1 if side == first else 2
        own = landings[(landings - k0) % 2 == 0] - 1
        plants = np.concatenate([start.ball[:, side], place.ball[own, side]])
        yaws = np.concatenate([start.yaw[:, side], place.yaw[own, side]])
        nth = np.clip(np.ceil((phase - k0) / 2), 0, len(own) - 1).astype(np.int64)
        landing = k0 + 2 * nth
        swing = np.clip((phase - landing + 1 - DOUBLE_SUPPORT) / (1 - DOUBLE_SUPPORT), 0.0, 1.0)
        ball[:, side] = plants[nth] + smooth(swing)[:, None] * (plants[nth + 1] - plants[nth])
        foot_yaw[:, side] = yaws[nth] + smooth(swing) * (yaws[nth + 1] - yaws[nth])
        stride = np.sqrt(np.sum((plants[nth + 1] - plants[nth])[:, :2] ** 2, axis=1))
        gain = np.minimum(stride / body.of_stature(2 * STEP_SHARE), 1.0)
        since = phase - landing + 2
        rise = smooth((since - HEEL_RISE_FROM) / (1 + DOUBLE_SUPPORT - HEEL_RISE_FROM)) * smooth(phase / DOUBLE_SUPPORT)
        pitch[:, side] = HEEL_RISE_RAD * gain * rise * (1 - smooth((since - 1 - DOUBLE_SUPPORT) / HEEL_SETTLE))
        tiptoe = body.of_stature(TOE_FORWARD) * np.sin(pitch[:, side])
        ball[:, side, 2] += LIFT_M * np.sin(np.pi * swing) ** 2 * np.minimum(1.0, 0.5 + gain) + tiptoe
    return Feet(ball, foot_yaw, pitch)


def _plant(body: Body, xy: FloatArray, yaw: FloatArray, side: int) -> FloatArray:
    """(N, 2) root and (N,) heading -> (N, 3) where a standing foot's ball is."""
    ahead = body.of_stature(BALL_FORWARD) * ANKLE_UNDER_HIP
    left = SIDE_SIGN[side] * body.hip_half_m
    c, s = np.cos(yaw), np.sin(yaw)
    height = np.full(len(yaw), body.of_stature(BALL_HEIGHT))
    return np.stack([xy[:, 0] + ahead * c - left * s, xy[:, 1] + ahead * s + left * c, height], axis=-1)
