"""Walking feet: where they are planted along a moving root, and how they swing from one plant to the next.

The gait's phase p grows by one with every step. Landing k (1, 2, ...) happens at p = k, feet in turn; the foot stands
until p = k + 1.25 (both feet are down for a quarter of a step) and swings until its next landing at k + 2. A foot is
planted under the place the root has about half a step later. It lands on its heel, stands flat, and leaves the floor
over its toes: the end of the sole that bears the weight does not move.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.synth.people.body import BALL_FORWARD, BALL_HEIGHT, HEEL_BACK, TOE_FORWARD, Body
from hsbench.synth.people.kinematics import SIDE_SIGN
from hsbench.synth.people.timing import smooth
from hsbench.typing import FloatArray

# Step length over stature and steps a minute: constant from about 1 m/s on (Sekiya & Nagasaki 1998; Murakami & Otaka
# 2017), used for slower walking as well.
WALK_RATIO_MIN = 0.0037
SHORTEST_STEP, LONGEST_STEP = 0.14, 0.42  # of stature: setting off and stopping, hurrying
LONG_STEP = 0.36  # of stature (.61 m at 1.7 m): from here on heels and toes rise fully
STEP_TURN_RAD = 0.7  # turning on the spot by this takes a step
DOUBLE_SUPPORT = 0.25  # of a step, both feet on the floor
ANKLE_UNDER_HIP = 0.9  # share of the foot bone by which a standing ball is ahead of the hip
LIFT_M = 0.045  # of the ball in mid swing
PLANTED_AHEAD = 0.55  # steps by which a foot is planted before the root is there
HEEL_RISE_RAD = 0.95  # before toe-off
HEEL_RISE_FROM = 0.70  # steps after landing
TOE_RISE_RAD = 0.28  # at landing, about the heel
TOE_RISE_FROM = 1.55
TOE_SETTLE = 0.30
HEEL_SETTLE = 0.6  # steps after lift
FOOT_OUT_RAD = 0.10  # feet point a little outwards
STEP_LIFT = (0.06, 0.5)  # of a foot that steps while one sits: at most, in metres, and as a share of its way
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


def standing_feet(body: Body, xy: FloatArray, yaw: FloatArray) -> Feet:
    """(N, 2) places and (N,) headings -> (N, ...) feet side by side below a standing person."""
    ball = np.stack([_plant(body, xy, yaw, side) for side in (0, 1)], axis=1)
    foot_yaw = np.stack([yaw + SIDE_SIGN[side] * FOOT_OUT_RAD for side in (0, 1)], axis=1)
    return Feet(ball, foot_yaw, np.zeros_like(foot_yaw))


def step_length_m(body: Body, speed_m_s: FloatArray) -> FloatArray:
    """(N,) speeds -> (N,) length of a step: it grows with the root of the speed, as cadence does."""
    steady = np.sqrt(WALK_RATIO_MIN * body.stature_m * 60 * speed_m_s) / body.style.cadence
    return np.clip(steady, body.of_stature(SHORTEST_STEP), body.of_stature(LONGEST_STEP))


def phase_of(body: Body, xy: FloatArray, yaw: FloatArray, fps: float, ramp_s: float = 0.5) -> FloatArray:
    """(T, 2) root and (T,) continuous heading -> (T,) gait phase from 0 to a whole number >= 2, never decreasing."""
    way = np.sqrt(np.sum(np.diff(xy, axis=0) ** 2, axis=1))
    each = np.maximum(way / step_length_m(body, way * fps), np.abs(np.diff(yaw)) / STEP_TURN_RAD)
    time = np.arange(len(yaw)) / fps
    ends = smooth(time / ramp_s) + smooth(1 + (time - time[-1]) / ramp_s)
    raw = np.concatenate([[0.0], np.cumsum(each)]) + END_STEP * (ends - ends[0])
    steps = max(2.0, float(np.round(raw[-1])))
    return np.asarray(raw * (steps / raw[-1]))


def walk_feet(body: Body, start: Feet, xy: FloatArray, yaw: FloatArray, phase: FloatArray, first: int) -> Feet:
    """Feet (T, ...) of a walk from ``start`` (1, ...) with root xy (T, 2), heading yaw (T,) and phase (T,).

    first: the foot that swings first, 0 left, 1 right.
    """
    steps = int(np.round(phase[-1]))
    landings = np.arange(1, steps + 1)
    under = np.where(landings >= steps - 1, steps, landings + PLANTED_AHEAD)
    rows = np.arange(len(phase))
    when = np.interp(under, phase, rows)
    place_xy = np.stack([np.interp(when, rows, xy[:, a]) for a in (0, 1)], axis=1)
    place = standing_feet(body, place_xy, np.interp(when, rows, yaw))
    feet = []
    for side in (0, 1):
        landing = 1 if side == first else 2
        own = landings[(landings - landing) % 2 == 0] - 1
        plants = np.concatenate([start.ball[:, side], place.ball[own, side]])
        yaws = np.concatenate([start.yaw[:, side], place.yaw[own, side]])
        feet.append(_steps(body, plants, yaws, phase, landing))
    return Feet(*(np.stack(both, axis=1) for both in zip(*feet, strict=True)))


def stepped_over(feet: Feet, balls: FloatArray, turn: float, share: FloatArray) -> Feet:
    """(1, ...) feet to balls (2, 3): one after the other, lifted on their way."""
    n = len(share)
    ball, foot_yaw = np.empty((n, 2, 3)), np.empty((n, 2))
    for side in (0, 1):
        part = smooth((share - 0.3 * side) / 0.6)
        way = balls[side] - feet.ball[0, side]
        ball[:, side] = feet.ball[0, side] + part[:, None] * way
        lift_m = min(STEP_LIFT[0], STEP_LIFT[1] * float(np.sqrt(np.sum(way[:2] ** 2))))
        ball[:, side, 2] += lift_m * np.sin(np.pi * part)
        foot_yaw[:, side] = feet.yaw[0, side] + part * turn
    return Feet(ball, foot_yaw, np.zeros((n, 2)))


def _steps(
    body: Body, plants: FloatArray, yaws: FloatArray, phase: FloatArray, landing: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One foot from plant to plant (n + 1, 3), the first landing at a phase: (T, 3) ball, (T,) yaw and pitch."""
    nth = np.clip(np.ceil((phase - landing) / 2), 0, len(plants) - 2).astype(np.int64)
    since = phase - landing - 2 * nth + 2  # steps since the foot landed, 0..2
    swing = np.clip((since - 1 - DOUBLE_SUPPORT) / (1 - DOUBLE_SUPPORT), 0.0, 1.0)
    moved = swing * swing * (3 - 2 * swing)
    length = np.sqrt(np.sum(np.diff(plants[:, :2], axis=0) ** 2, axis=1)) / body.of_stature(2 * LONG_STEP)
    gains = np.concatenate([[0.0], np.minimum(length, 1.0)])
    gain = gains[nth + 1]
    rise = smooth((since - HEEL_RISE_FROM) / (1 + DOUBLE_SUPPORT - HEEL_RISE_FROM)) * smooth(phase / DOUBLE_SUPPORT)
    heel = HEEL_RISE_RAD * gain * rise * (1 - smooth((since - 1 - DOUBLE_SUPPORT) / HEEL_SETTLE))
    landed = gains[nth] * (1 - smooth(since / TOE_SETTLE))
    toe = TOE_RISE_RAD * (landed + gain * smooth((since - TOE_RISE_FROM) / (2 - TOE_RISE_FROM)))
    yaw = yaws[nth] + moved * (yaws[nth + 1] - yaws[nth])
    ahead, up = _rolled(body, heel, toe)
    up = up + LIFT_M * np.sin(np.pi * swing) * np.minimum(1.0, 0.5 + gain)
    ball = plants[nth] + moved[:, None] * (plants[nth + 1] - plants[nth])
    return ball + np.stack([ahead * np.cos(yaw), ahead * np.sin(yaw), up], axis=1), yaw, heel - toe


def _rolled(body: Body, heel: FloatArray, toe: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(T,) heel rise about the tip of the toes, toe rise about the heel -> (T,) how far the ball goes ahead and up."""
    high, to_toe, to_heel = (body.of_stature(s) for s in (BALL_HEIGHT, TOE_FORWARD, BALL_FORWARD + HEEL_BACK))
    ahead = to_toe * (1 - np.cos(heel)) + high * np.sin(heel) - to_heel * (1 - np.cos(toe)) - high * np.sin(toe)
    up = to_toe * np.sin(heel) - high * (1 - np.cos(heel)) + to_heel * np.sin(toe) - high * (1 - np.cos(toe))
    return ahead, up


def _plant(body: Body, xy: FloatArray, yaw: FloatArray, side: int) -> FloatArray:
    """(N, 2) root and (N,) heading -> (N, 3) where a standing foot's ball is."""
    ahead = body.of_stature(BALL_FORWARD) * ANKLE_UNDER_HIP
    left = SIDE_SIGN[side] * body.hip_half_m * body.style.step_width
    c, s = np.cos(yaw), np.sin(yaw)
    height = np.full(len(yaw), body.of_stature(BALL_HEIGHT))
    return np.stack([xy[:, 0] + ahead * c - left * s, xy[:, 1] + ahead * s + left * c, height], axis=-1)
