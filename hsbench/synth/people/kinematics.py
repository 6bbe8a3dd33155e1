"""From a posture to joints: a rigid pelvis, a spine that bends in two places, and two-bone limbs solved in closed form.

Bone lengths are the body's at every time, and no joint goes beyond its range (``joint_limits``), whatever the posture
asks for: what is out of reach is approached, not reached. Frame: the scene's, z up; a person's forward is
(cos yaw, sin yaw, 0) and left is 90 degrees further. The compiled functions work on one frame each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numba
import numpy as np

from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import SIDES, Body, J
from hsbench.synth.people.joint_limits import (
    ELBOW_FLEXION,
    HIP_ABDUCTION,
    HIP_FLEXION,
    KNEE_FLEXION,
    NECK_BEND,
    NECK_TURN,
    SHOULDER_ACROSS,
    SHOULDER_BACK,
    SPINE_FLEXION,
    SPINE_SIDE,
    SPINE_TWIST,
    WRIST_BEND,
)
from hsbench.synth.people.joint_limits import HEAD_FORWARD as HEAD_FORWARD
from hsbench.synth.people.vectors import (
    Axes,
    Vector,
    add,
    at,
    bent,
    carried,
    cross,
    dot,
    inside,
    mix,
    put,
    unit,
    vector,
)
from hsbench.typing import FloatArray

STRAIGHT = 0.999  # a limb is never longer than this share of its two bones, so that its bend has a side
WITHIN = 0.999  # of a joint's range is used, so that rounding does not leave it
LEFT, RIGHT = 0, 1
SIDE_SIGN = (1.0, -1.0)  # left is +y of the body

TWIST_USED = 0.9  # of the spine's: leaning aside and forwards adds to what the shoulders show of it
LOWER_SPINE_SHARE = 0.5  # of its bends that the lower spine takes
KNEE_POLE = (1.0, 0.5)  # knees bend forwards and, seated, upwards
KNEES_OUT_RAD = 0.05  # knees point so much further outwards than feet
ELBOW_POLE = (0.45, -0.6)  # elbows point out and down,
ELBOW_AHEAD = (-0.7, 0.5)  # and back below a hanging arm, ahead below a raised one

SCENE_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
UP = (0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0)

# Rows of joints, pairs left and right.
BASE, MID, TOP, NECK, HEAD = (J[name] for name in anatomy.MIDDLE_JOINTS)
HIP, KNEE, ANKLE, FOOT = (tuple(J[f"{n}_{s}"] for s in SIDES) for n in ("hip", "knee", "ankle", "foot"))
SHOULDER, ELBOW, WRIST = (tuple(J[f"{n}_{s}"] for s in SIDES) for n in ("shoulder", "elbow", "wrist"))
HAND, TIP, THUMB = (tuple(J[f"{n}_{s}"] for s in SIDES) for n in ("hand", "hand_tip", "thumb"))


class Lengths(NamedTuple):
    """A body's measures in metres, for compiled code."""

    stature: float
    hip_half: float
    lower_spine: float
    upper_spine: float
    neck: float
    head: float
    shoulder_half: float
    shoulder_rise: float
    upper_arm: float
    forearm: float
    hand: float
    palm: float
    thumb_along: float
    thumb_across: float
    thigh: float
    shank: float
    ball_forward: float
    ball_down: float
    thigh_radius: float

    @classmethod
    def of(cls, body: Body) -> Lengths:
        """The measures of a body."""
        a, of = anatomy, body.of_stature
        return cls(
            stature=body.stature_m,
            hip_half=body.hip_half_m,
            lower_spine=of(a.SPINE_MID_HEIGHT - a.HIP_HEIGHT),
            upper_spine=of(a.SPINE_SHOULDER_HEIGHT - a.SPINE_MID_HEIGHT),
            neck=of(a.NECK_HEIGHT - a.SPINE_SHOULDER_HEIGHT),
            head=of(a.HEAD_HEIGHT - a.NECK_HEIGHT),
            shoulder_half=body.shoulder_half_m,
            shoulder_rise=of(a.SHOULDER_HEIGHT - a.RADIUS_SHOULDER / 2 - a.SPINE_SHOULDER_HEIGHT),
            upper_arm=of(a.UPPER_ARM),
            forearm=of(a.FOREARM),
            hand=of(a.HAND),
            palm=of(a.PALM),
            thumb_along=of(a.THUMB[0]),
            thumb_across=of(a.THUMB[1]),
            thigh=of(a.THIGH),
            shank=of(a.SHANK),
            ball_forward=of(a.BALL_FORWARD),
            ball_down=of(a.ANKLE_HEIGHT - a.BALL_HEIGHT),
            thigh_radius=body.radius(a.RADIUS_THIGH[1]),
        )


@dataclass(frozen=True, eq=False)
class Posture:
    """T postures. All (T, ...) float64; index 0 of a pair is left.

    pelvis: (T, 3) spine base in metres. yaw: (T,) of the pelvis. tilt, roll: (T,) of the whole trunk forward, and then
    about its own axis to the left. lean: (T,) forward bend of the spine. side: (T,) bend to the left. twist: (T,) of
    the chest against the pelvis, left positive. look: (T, 2) head yaw and pitch (up positive) against the chest.
    ball: (T, 2, 3) balls of the feet. foot_yaw, foot_pitch: (T, 2), heel up positive. tip: (T, 2, 3) where the finger
    tips should be.
    """

    pelvis: FloatArray
    yaw: FloatArray
    tilt: FloatArray
    roll: FloatArray
    lean: FloatArray
    side: FloatArray
    twist: FloatArray
    look: FloatArray
    ball: FloatArray
    foot_yaw: FloatArray
    foot_pitch: FloatArray
    tip: FloatArray


def solve(body: Body, posture: Posture) -> FloatArray:
    """(T,) postures -> (T, 25, 3) joints in metres."""
    columns = [np.ascontiguousarray(getattr(posture, f.name), dtype=np.float64) for f in fields(posture)]
    return np.asarray(_solve(Lengths.of(body), *columns))


@numba.njit(cache=True)
def _solve(
    lengths: Lengths, pelvis: FloatArray, yaw: FloatArray, tilt: FloatArray, roll: FloatArray, lean: FloatArray,
    side: FloatArray, twist: FloatArray, look: FloatArray, ball: FloatArray, foot_yaw: FloatArray,
    foot_pitch: FloatArray, tip: FloatArray,
) -> FloatArray:  # fmt: skip
    joints = np.empty((len(yaw), 25, 3))
    for t in range(len(yaw)):
        row = joints[t]
        base = base_axes(yaw[t], tilt[t], roll[t])
        chest, _ = solve_trunk(
            lengths, vector(pelvis[t]), base, lean[t], side[t], twist[t], look[t, 0], look[t, 1], row
        )
        for s in range(2):
            solve_leg(lengths, base, yaw[t], tilt[t], vector(ball[t, s]), foot_yaw[t, s], foot_pitch[t, s], s, row)
            solve_arm(lengths, chest, tilt[t], vector(tip[t, s]), NOWHERE, s, row)
    return joints


@numba.njit(cache=True)
def base_axes(yaw: float, tilt: float, roll: float) -> Axes:
    """Axes of the pelvis."""
    return bent(bent(SCENE_AXES, yaw, tilt, 0.0), roll, 0.0, 0.0)


@numba.njit(cache=True)
def hip(lengths: Lengths, pelvis: Vector, base: Axes, side: int) -> Vector:
    """A hip joint."""
    return add(pelvis, base[1], SIDE_SIGN[side] * lengths.hip_half)


@numba.njit(cache=True)
def foot_bone(lengths: Lengths, yaw: float, pitch: float) -> Vector:
    """Ankle to ball; a pitch turns it downwards about the ball, so that the heel rises."""
    ahead = lengths.ball_forward * math.cos(pitch) - lengths.ball_down * math.sin(pitch)
    fall = lengths.ball_forward * math.sin(pitch) + lengths.ball_down * math.cos(pitch)
    return ahead * math.cos(yaw), ahead * math.sin(yaw), -fall


@numba.njit(cache=True)
def solve_trunk(
    lengths: Lengths, pelvis: Vector, base: Axes, lean: float, side: float, twist: float, look_yaw: float,
    look_pitch: float, row: FloatArray,
) -> tuple[Axes, Axes]:  # fmt: skip
    """Write the spine, head, hips and shoulders into a row (25, 3); the axes of chest and head."""
    lean = _clip(lean, SPINE_FLEXION[0] * WITHIN, SPINE_FLEXION[1] * WITHIN)
    side = _clip(side, -SPINE_SIDE * WITHIN, SPINE_SIDE * WITHIN)
    twist = _clip(twist, -SPINE_TWIST * TWIST_USED, SPINE_TWIST * TWIST_USED)
    half = LOWER_SPINE_SHARE
    lower = bent(base, 0.0, half * lean, -half * side)
    chest = bent(bent(lower, 0.0, (1 - half) * lean, -(1 - half) * side), twist, 0.0, 0.0)
    pitch = _clip(-half * lean - look_pitch, -NECK_BEND * WITHIN, NECK_BEND * WITHIN)
    head = bent(chest, _clip(look_yaw, -NECK_TURN, NECK_TURN), pitch, 0.0)
    mid = add(pelvis, lower[2], lengths.lower_spine)
    top = add(mid, chest[2], lengths.upper_spine)
    neck = add(top, chest[2], lengths.neck)
    put(row[BASE], pelvis)
    put(row[MID], mid)
    put(row[TOP], top)
    put(row[NECK], neck)
    put(row[HEAD], add(neck, at(head, (HEAD_FORWARD, 0.0, 1.0)), lengths.head))
    for s in range(2):
        put(row[HIP[s]], hip(lengths, pelvis, base, s))
        out = SIDE_SIGN[s] * lengths.shoulder_half
        put(row[SHOULDER[s]], add(top, at(chest, (0.0, out, lengths.shoulder_rise)), 1.0))
    return chest, head


@numba.njit(cache=True)
def solve_leg(
    lengths: Lengths, base: Axes, yaw: float, tilt: float, ball: Vector, foot_yaw: float, foot_pitch: float, side: int,
    row: FloatArray,
) -> None:  # fmt: skip
    """Write knee, ankle and foot of a side into a row (25, 3) that has its trunk.

    Knees bend to where feet point, of lying people to where the pelvis faces.
    """
    start = vector(row[HIP[side]])
    bone = foot_bone(lengths, foot_yaw, foot_pitch)
    knee_yaw = foot_yaw + SIDE_SIGN[side] * KNEES_OUT_RAD
    walking = (KNEE_POLE[0] * math.cos(knee_yaw), KNEE_POLE[0] * math.sin(knee_yaw), KNEE_POLE[1])
    pole = mix(walking, base[0], math.sin(tilt) ** 2)
    knee, ankle = two_bones(start, add(ball, bone, -1.0), pole, lengths.thigh, lengths.shank, KNEE_FLEXION)
    thigh = unit(add(knee, start, -1.0))
    allowed = _thigh_within(thigh, base, unit(add(vector(row[MID]), vector(row[BASE]), -1.0)), SIDE_SIGN[side])
    if allowed != thigh:
        shank = carried(add(ankle, knee, -1.0), thigh, allowed)
        knee = add(start, allowed, lengths.thigh)
        ankle = add(knee, shank, 1.0)
    put(row[KNEE[side]], knee)
    put(row[ANKLE[side]], ankle)
    put(row[FOOT[side]], add(ankle, bone, 1.0))


@numba.njit(cache=True)
def solve_arm(
    lengths: Lengths, chest: Axes, tilt: float, target: Vector, pointing: Vector, side: int, row: FloatArray
) -> None:
    """Write elbow, wrist, hand, tip and thumb of a side into a row (25, 3) that has its trunk; the tip at a target.

    pointing: where the hand points, in the scene; the shorter, the more it follows the forearm, which it does at 0.
    Elbows of lying people point neither down into what they lie on nor up.
    """
    sign = SIDE_SIGN[side]
    start = vector(row[SHOULDER[side]])
    raised = (1 + dot(chest[2], unit(add(target, start, -1.0)))) / 2
    ahead = ELBOW_AHEAD[0] + raised * (ELBOW_AHEAD[1] - ELBOW_AHEAD[0])
    pole = at(chest, (ahead, sign * ELBOW_POLE[0], ELBOW_POLE[1]))
    pole = (pole[0], pole[1], pole[2] * math.cos(tilt) ** 2)
    elbow, tip = two_bones(start, target, pole, lengths.upper_arm, lengths.forearm + lengths.hand, ELBOW_FLEXION)
    fore = unit(add(tip, elbow, -1.0))
    hand = fore
    share = math.sqrt(dot(pointing, pointing))
    if share > 0.0:
        hand = unit(add(pointing, fore, 1.0 - share))
        held = add(target, hand, -lengths.hand)
        elbow, wrist = two_bones(start, held, pole, lengths.upper_arm, lengths.forearm, ELBOW_FLEXION)
        fore = unit(add(wrist, elbow, -1.0))
        hand = _hand_within(hand, fore)
    upper = unit(add(elbow, start, -1.0))
    allowed = _arm_within(upper, chest, sign)
    if allowed != upper:
        fore, hand = carried(fore, upper, allowed), carried(hand, upper, allowed)
        elbow = add(start, allowed, lengths.upper_arm)
    wrist = add(elbow, fore, lengths.forearm)
    inward = add(chest[0], chest[1], -sign)
    across = unit(add(inward, hand, -dot(inward, hand)))
    put(row[ELBOW[side]], elbow)
    put(row[WRIST[side]], wrist)
    put(row[HAND[side]], add(wrist, hand, lengths.palm))
    put(row[TIP[side]], add(wrist, hand, lengths.hand))
    put(row[THUMB[side]], add(add(wrist, hand, lengths.thumb_along), across, lengths.thumb_across))


@numba.njit(cache=True)
def two_bones(
    start: Vector, target: Vector, pole: Vector, first_m: float, second_m: float, fold_rad: float
) -> tuple[Vector, Vector]:
    """Middle joint and end of two bones whose bend, of at most ``fold_rad``, points towards the pole."""
    reach = add(target, start, -1.0)
    length = math.sqrt(dot(reach, reach))
    along = unit(reach) if length > 0.0 else unit(pole)
    folded = math.sqrt(first_m**2 + second_m**2 + 2 * first_m * second_m * math.cos(WITHIN * fold_rad))
    length = _clip(length, folded, STRAIGHT * (first_m + second_m))
    ahead = (first_m**2 - second_m**2 + length**2) / (2 * length)
    aside = math.sqrt(max(first_m**2 - ahead**2, 0.0))
    bend = unit(add(pole, along, -dot(pole, along)))
    return add(add(start, along, ahead), bend, aside), add(start, along, length)


@numba.njit(cache=True)
def highest_pelvis(
    lengths: Lengths, pelvis: Vector, base: Axes, balls: FloatArray, foot_yaw: FloatArray, foot_pitch: FloatArray
) -> float:
    """Greatest pelvis height in metres at which both feet, balls (2, 3), stay where they are."""
    limit = math.inf
    most = STRAIGHT * (lengths.thigh + lengths.shank)
    for side in range(2):
        joint = hip(lengths, pelvis, base, side)
        ankle = add(vector(balls[side]), foot_bone(lengths, foot_yaw[side], foot_pitch[side]), -1.0)
        away = (joint[0] - ankle[0]) ** 2 + (joint[1] - ankle[1]) ** 2
        limit = min(limit, ankle[2] + math.sqrt(max(most**2 - away, 0.0)))
    return limit


@numba.njit(cache=True)
def _thigh_within(thigh: Vector, base: Axes, spine: Vector, sign: float) -> Vector:
    """The direction within a hip's range that is nearest to a thigh's; itself if it is within."""
    up = unit(add(spine, base[1], -dot(spine, base[1])))
    axes = (cross(base[1], up), base[1], up)
    ahead, left, rise = inside(axes, thigh)
    flexion, abduction = math.atan2(ahead, -rise), math.asin(_clip(sign * left, -1.0, 1.0))
    near_flexion = _clip(flexion, HIP_FLEXION[0] * WITHIN, HIP_FLEXION[1] * WITHIN)
    near_abduction = _clip(abduction, HIP_ABDUCTION[0] * WITHIN, HIP_ABDUCTION[1] * WITHIN)
    if near_flexion == flexion and near_abduction == abduction:
        return thigh
    c, s = math.cos(near_abduction), math.sin(near_abduction)
    return at(axes, (c * math.sin(near_flexion), sign * s, -c * math.cos(near_flexion)))


@numba.njit(cache=True)
def _arm_within(upper: Vector, chest: Axes, sign: float) -> Vector:
    """The direction within a shoulder's range that is near to an upper arm's; itself if it is within."""
    ahead, left, rise = inside(chest, upper)
    least_ahead, least_out = -math.sin(SHOULDER_BACK * WITHIN), -math.sin(SHOULDER_ACROSS * WITHIN)
    if ahead >= least_ahead and sign * left >= least_out:
        return upper
    if ahead < least_ahead:
        share = math.sqrt((1 - least_ahead**2) / max(1 - ahead**2, 1e-12))
        ahead, left, rise = least_ahead, share * left, share * rise
    if sign * left < least_out:
        share = math.sqrt((1 - least_out**2) / max(1 - left**2, 1e-12))
        ahead, left, rise = share * ahead, sign * least_out, share * rise
    return unit(at(chest, (ahead, left, rise)))


@numba.njit(cache=True)
def _hand_within(hand: Vector, fore: Vector) -> Vector:
    """The direction within a wrist's range that is nearest to a hand's."""
    along = dot(hand, fore)
    most = WITHIN * WRIST_BEND
    if along >= math.cos(most):
        return hand
    return unit(add(unit(add(hand, fore, -along)), fore, 1.0 / math.tan(most)))


@numba.njit(cache=True)
def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
