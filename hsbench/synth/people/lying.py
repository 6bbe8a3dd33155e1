"""Lying down from the edge of a bed or sofa, on the back or on a side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import wrap_angle
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels
from hsbench.synth.people.gait import Feet
from hsbench.synth.people.kinematics import SIDE_SIGN
from hsbench.synth.people.timing import shares_of, smooth
from hsbench.typing import FloatArray

LENGTH_RANGE_M = (1.3, 2.0)  # from heels to the middle of the head, of anybody from 1.5 to 2.1 m tall

# Shares of stature.
PELVIS_FROM_HEELS = 0.515
BACK_DEPTH = 0.060  # the pelvis above the surface, on the back and on a side
SIDE_DEPTH = 0.112
ANKLES = {"back": (0.032, 0.070, 0.030), "side": (0.105, -0.02, 0.035)}  # from the heels, outwards or ahead, up
UPPER_ANKLE = 0.085  # of the leg that lies on the other, above it

TOES_UP_RAD = -1.25  # pitch of the feet
TOES_OUT_RAD = 0.35
TOES_LEVEL_RAD = -0.25
PILLOW_RAD = (0.05, -0.22)  # bend of the spine and pitch of the head
HANDS = {"back": ((0.01, 0.160, -0.415), (0.105, 0.02, -0.20)), "side": ((0.18, 0.06, -0.02), (0.20, 0.00, -0.10))}
"""Offsets of the hands (see ``Channels``): left and right on the back; lower and upper on a side. Outwards positive."""

# Parts of the motion, as first and last share of it.
SWIVEL, LEGS_UP, RECLINE, ROLL, PELVIS = (0.10, 0.75), (0.05, 0.50), (0.20, 0.95), (0.60, 1.0), (0.10, 0.90)


@dataclass(frozen=True)
class LiePose:
    """Where a lying person is: the points (x, y, z) of the surface below the middle of the head and below the heels.

    roll_rad: 0 on the back, pi/2 on the left side, -pi/2 on the right. The two points are ``lying_length_m`` apart.
    Raises SchemaError where no body is so long, the surface is not level, or the roll is beyond a side.
    """

    head_m: tuple[float, float, float]
    feet_m: tuple[float, float, float]
    roll_rad: float = 0.0

    def __post_init__(self) -> None:
        low, high = LENGTH_RANGE_M
        if not low <= self.length_m <= high:
            raise SchemaError(f"lie_pose: head and feet are {self.length_m:.2f} m apart; expected {low}..{high} m")
        if abs(self.head_m[2] - self.feet_m[2]) > 1e-3:
            raise SchemaError(
                f"lie_pose: head_m and feet_m are {self.head_m[2]} and {self.feet_m[2]} m high; expected one"
            )
        if abs(self.roll_rad) > np.pi / 2 + 1e-9:
            raise SchemaError(f"lie_pose.roll_rad is {self.roll_rad}; expected -pi/2..pi/2 (is it in degrees?)")

    @property
    def length_m(self) -> float:
        """From heels to the middle of the head."""
        return float(np.hypot(self.head_m[0] - self.feet_m[0], self.head_m[1] - self.feet_m[1]))

    @property
    def yaw_rad(self) -> float:
        """From head to feet."""
        return float(np.arctan2(self.feet_m[1] - self.head_m[1], self.feet_m[0] - self.head_m[0]))


def lying_length_m(body: Body) -> float:
    """How far apart the two points of a person's ``LiePose`` are."""
    return body.of_stature(anatomy.HEAD_HEIGHT)


def lie_down(start: Channels, lie: LiePose, duration_s: float, fps: float) -> Channels:
    """From sitting on the edge to lying: swivel, legs up, trunk down. ``backwards()`` of it gets up again."""
    before = start.last()
    share = shares_of(duration_s, fps)
    pelvis, balls, foot_yaw, foot_pitch = _lying(lie)
    turn = float(wrap_angle(lie.yaw_rad - before.yaw[0]))
    yaw = before.yaw + _part(share, SWIVEL) * turn
    sit = np.array([*before.xy[0], before.height[0]])
    path = sit + _part(share, PELVIS)[:, None] * (pelvis - sit)
    recline, held = _part(share, RECLINE), before.hold(len(share))
    rolled = abs(np.sin(lie.roll_rad))
    look = np.array([0.0, PILLOW_RAD[1] * (1 - rolled)])
    near = held.near + recline[:, None] * (1 - held.near)
    return replace(
        held,
        xy=path[:, :2],
        height=path[:, 2],
        yaw=yaw,
        lean=held.lean + recline * (PILLOW_RAD[0] - held.lean),
        tilt=held.tilt + recline * (-np.pi / 2 - held.tilt),
        roll=held.roll + _part(share, ROLL) * (lie.roll_rad - held.roll),
        near=near,
        offset=np.tile(_hands(lie), (len(share), 1, 1)),
        look=held.look + recline[:, None] * (look - held.look),
        feet=_swung(before.feet, balls, foot_yaw, foot_pitch, path, yaw, turn, share),
    )


def _lying(lie: LiePose) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(3,) pelvis, (2, 3) balls, (2,) yaw and pitch of the feet."""
    stature_m = lie.length_m / anatomy.HEAD_HEIGHT
    feet, yaw, side = np.array(lie.feet_m), lie.yaw_rad, np.sin(lie.roll_rad)
    to_head = np.array([-np.cos(yaw), -np.sin(yaw), 0.0])
    left, up = np.array([-np.sin(yaw), np.cos(yaw), 0.0]), np.array([0.0, 0.0, 1.0])
    depth = BACK_DEPTH + abs(side) * (SIDE_DEPTH - BACK_DEPTH)
    pelvis = feet + stature_m * (PELVIS_FROM_HEELS * to_head + depth * up)
    balls, foot_yaw, foot_pitch = np.empty((2, 3)), np.empty(2), np.empty(2)
    for foot, sign in enumerate(SIDE_SIGN):
        along, out, high = ANKLES["back"]
        on_back = along * to_head + out * sign * left + high * up
        along, ahead, high = ANKLES["side"]
        on_side = along * to_head + ahead * side * left + (high + UPPER_ANKLE * (sign * side < 0)) * up
        ankle = feet + stature_m * (on_back + abs(side) * (on_side - on_back))
        foot_yaw[foot] = yaw + (1 - abs(side)) * sign * TOES_OUT_RAD + lie.roll_rad
        foot_pitch[foot] = TOES_UP_RAD + abs(side) * (TOES_LEVEL_RAD - TOES_UP_RAD)
        balls[foot] = ankle + stature_m * _foot_bone(foot_yaw[foot], foot_pitch[foot])
    return pelvis, balls, foot_yaw, foot_pitch


def _foot_bone(yaw: float, pitch: float) -> FloatArray:
    """(3,) ankle to ball as shares of stature."""
    forward, down = anatomy.BALL_FORWARD, anatomy.ANKLE_HEIGHT - anatomy.BALL_HEIGHT
    ahead = forward * np.cos(pitch) - down * np.sin(pitch)
    return np.array([ahead * np.cos(yaw), ahead * np.sin(yaw), -forward * np.sin(pitch) - down * np.cos(pitch)])


def _hands(lie: LiePose) -> FloatArray:
    """(2, 3) offsets of left and right."""
    places = np.array(HANDS["back"])
    if lie.roll_rad != 0:
        lower, upper = HANDS["side"]
        on_side = np.array([lower, upper] if lie.roll_rad > 0 else [upper, lower])
        places = places + abs(np.sin(lie.roll_rad)) * (on_side - places)
    return np.asarray(places * np.array([[1.0, sign, 1.0] for sign in SIDE_SIGN]))


def _swung(
    start: Feet, balls: FloatArray, foot_yaw: FloatArray, foot_pitch: FloatArray, pelvis: FloatArray, yaw: FloatArray,
    turn: float, share: FloatArray,
) -> Feet:  # fmt: skip
    """(T, ...) feet that go round with the pelvis (T, 3) and its heading (T,), and rise before they come in."""
    first_yaw, last_yaw = yaw[-1] - turn, yaw[-1]
    rise, swivel = _part(share, LEGS_UP), _part(share, SWIVEL)
    ball = np.empty((len(share), 2, 3))
    for side in (0, 1):
        away = _turned(start.ball[0, side] - pelvis[0], -first_yaw)
        end = _turned(balls[side] - pelvis[-1], -last_yaw)
        place = away + swivel[:, None] * (end - away)
        place[:, 2] = start.ball[0, side, 2] + rise * (balls[side, 2] - start.ball[0, side, 2]) - pelvis[:, 2]
        ball[:, side] = pelvis + _turned(place, yaw)
    against = wrap_angle(start.yaw[0] - first_yaw)
    return Feet(
        ball,
        yaw[:, None] + against + swivel[:, None] * (wrap_angle(foot_yaw - last_yaw) - against),
        start.pitch + rise[:, None] * (foot_pitch - start.pitch),
    )


def _turned(vectors: FloatArray, yaw: FloatArray | float) -> FloatArray:
    """(..., 3) vectors turned about z."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (c * x).shape)], axis=-1)


def _part(share: FloatArray, ends: tuple[float, float]) -> FloatArray:
    """A smooth rise from 0 to 1 between two shares."""
    return smooth((share - ends[0]) / (ends[1] - ends[0]))
