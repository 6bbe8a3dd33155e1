"""From a posture to joints: a rigid pelvis, a spine that bends in two places, and two-bone limbs solved in closed form.

Bone lengths are the body's at every time, whatever the posture asks for: a target out of reach is approached, not
reached. Frame: the scene's, z up; a person's forward is (cos yaw, sin yaw, 0) and left is 90 degrees further.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body, J, unit
from hsbench.typing import FloatArray

STRAIGHT = 0.999  # a limb is never longer than this share of its two bones, so that its bend has a side
LEFT, RIGHT = 0, 1
SIDE_SIGN = (1.0, -1.0)  # left is +y of the body

LOWER_SPINE_SHARE = 0.5  # of lean and twist that the lower spine takes
KNEE_POLE = (1.0, 0.5)  # knees bend forwards and, seated, upwards
KNEES_OUT_RAD = 0.05  # knees point so much further outwards than feet
HEAD_FORWARD = 0.12  # the skull's middle lies a little before the neck, as a share of its height above it
ELBOW_POLE = (-0.7, 0.45, -0.6)  # elbows point back, out and down


@dataclass(frozen=True, eq=False)
class Posture:
    """T postures. All (T, ...) float64; index 0 of a pair is left.

    pelvis: (T, 3) spine base in metres. yaw: (T,) of the pelvis. lean: (T,) forward bend of the spine. side: (T,) bend
    to the left. twist: (T,) of the chest against the pelvis, left positive. look: (T, 2) head yaw and pitch (up
    positive) against the chest. ball: (T, 2, 3) balls of the feet. foot_yaw, foot_pitch: (T, 2), heel up positive.
    tip: (T, 2, 3) where the finger tips should be.
    """

    pelvis: FloatArray
    yaw: FloatArray
    lean: FloatArray
    side: FloatArray
    twist: FloatArray
    look: FloatArray
    ball: FloatArray
    foot_yaw: FloatArray
    foot_pitch: FloatArray
    tip: FloatArray


def frame(yaw: FloatArray, lean: FloatArray, side: FloatArray) -> FloatArray:
    """(T,) angles -> (T, 3, 3) with columns forward, left, up: turn by yaw, then bend forward, then to the left."""
    cy, sy, cl, sl, cs, ss = (f(a) for a in (yaw, lean, -side) for f in (np.cos, np.sin))
    zero, one = np.zeros_like(cy), np.ones_like(cy)
    turn = _matrix(((cy, -sy, zero), (sy, cy, zero), (zero, zero, one)))
    bend = _matrix(((cl, zero, sl), (zero, one, zero), (-sl, zero, cl)))
    roll = _matrix(((one, zero, zero), (zero, cs, -ss), (zero, ss, cs)))
    return np.asarray(turn @ bend @ roll)


def chest_frame(posture: Posture) -> FloatArray:
    """(T, 3, 3) columns forward, left, up of the chest."""
    return frame(posture.yaw + posture.twist, posture.lean, posture.side)


def shoulders(body: Body, posture: Posture) -> FloatArray:
    """(T, 2, 3) shoulder joints, left and right."""
    _, _, spine_shoulder = _spine(body, posture)
    chest = chest_frame(posture)
    return np.stack([spine_shoulder + _at(chest, _shoulder_offset(body, s)) for s in (LEFT, RIGHT)], axis=1)


def solve(body: Body, posture: Posture) -> FloatArray:
    """(T,) postures -> (T, 25, 3) joints in metres."""
    joints = np.empty((len(posture.yaw), len(J), 3))
    base, mid, spine_shoulder = _spine(body, posture)
    chest = chest_frame(posture)
    head_turn = frame(
        posture.yaw + posture.twist + posture.look[:, 0], 0.5 * posture.lean - posture.look[:, 1], 0.5 * posture.side
    )
    neck = spine_shoulder + _at(chest, (0.0, 0.0, body.of_stature(anatomy.NECK_HEIGHT - anatomy.SPINE_SHOULDER_HEIGHT)))
    head_up = body.of_stature(anatomy.HEAD_HEIGHT - anatomy.NECK_HEIGHT)
    joints[:, J["spine_base"]], joints[:, J["spine_mid"]] = base, mid
    joints[:, J["spine_shoulder"]], joints[:, J["neck"]] = spine_shoulder, neck
    joints[:, J["head"]] = neck + _at(head_turn, (HEAD_FORWARD * head_up, 0.0, head_up))
    for side, name in ((LEFT, "left"), (RIGHT, "right")):
        places = leg(body, posture, side)
        for joint, place in zip(("hip", "knee", "ankle", "foot"), places, strict=True):
            joints[:, J[f"{joint}_{name}"]] = place
        _arm(body, posture, chest, spine_shoulder + _at(chest, _shoulder_offset(body, side)), side, name, joints)
    return joints


def leg(body: Body, posture: Posture, side: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(T, 3) hip, knee, ankle and foot of one side."""
    hip = _hip(body, posture, side)
    bone = _foot_bone(body, posture.foot_yaw[:, side], posture.foot_pitch[:, side])
    knee_yaw = posture.foot_yaw[:, side] + SIDE_SIGN[side] * KNEES_OUT_RAD
    ahead, up = KNEE_POLE
    pole = np.stack([ahead * np.cos(knee_yaw), ahead * np.sin(knee_yaw), np.full(len(knee_yaw), up)], axis=-1)
    thigh_m, shank_m = body.of_stature(anatomy.THIGH), body.of_stature(anatomy.SHANK)
    knee, ankle = two_bones(hip, posture.ball[:, side] - bone, pole, thigh_m, shank_m)
    return hip, knee, ankle, ankle + bone


def two_bones(
    start: FloatArray, target: FloatArray, pole: FloatArray, first_m: float, second_m: float
) -> tuple[FloatArray, FloatArray]:
    """(T, 3) start, target and pole -> (T, 3) middle joint and end: two bones whose bend points towards the pole."""
    reach = target - start
    length = np.sqrt(np.sum(reach * reach, axis=-1, keepdims=True))
    along = unit(np.where(length > 0, reach, pole))
    length = np.clip(length, abs(first_m - second_m) + (1 - STRAIGHT), STRAIGHT * (first_m + second_m))
    ahead = (first_m**2 - second_m**2 + length**2) / (2 * length)
    aside = np.sqrt(np.maximum(first_m**2 - ahead**2, 0.0))
    bend = unit(pole - along * np.sum(pole * along, axis=-1, keepdims=True))
    return start + ahead * along + aside * bend, start + length * along


def ankle_of(body: Body, ball: FloatArray, foot_yaw: FloatArray, foot_pitch: FloatArray) -> FloatArray:
    """(T, 3) ball of a foot, (T,) yaw and pitch -> (T, 3) ankle above and behind it."""
    return ball - _foot_bone(body, foot_yaw, foot_pitch)


def highest_pelvis(body: Body, posture: Posture) -> FloatArray:
    """(T,) greatest pelvis height in metres at which both feet stay where they are."""
    limit = np.full(len(posture.yaw), np.inf)
    for side in (LEFT, RIGHT):
        hip = _hip(body, posture, side)
        ankle = ankle_of(body, posture.ball[:, side], posture.foot_yaw[:, side], posture.foot_pitch[:, side])
        away = np.sum((hip - ankle)[:, :2] ** 2, axis=1)
        limit = np.minimum(limit, ankle[:, 2] + np.sqrt(np.maximum((STRAIGHT * body.leg_m) ** 2 - away, 0.0)))
    return limit


def _spine(body: Body, posture: Posture) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(T, 3) spine base, spine mid and spine shoulder."""
    half = LOWER_SPINE_SHARE
    lower = frame(posture.yaw + half * posture.twist, half * posture.lean, half * posture.side)
    mid = posture.pelvis + _at(lower, (0.0, 0.0, body.of_stature(anatomy.SPINE_MID_HEIGHT - anatomy.HIP_HEIGHT)))
    upper_m = body.of_stature(anatomy.SPINE_SHOULDER_HEIGHT - anatomy.SPINE_MID_HEIGHT)
    return posture.pelvis, mid, mid + _at(chest_frame(posture), (0.0, 0.0, upper_m))


def _hip(body: Body, posture: Posture, side: int) -> FloatArray:
    level = np.zeros_like(posture.yaw)
    return posture.pelvis + _at(frame(posture.yaw, level, level), (0.0, SIDE_SIGN[side] * body.hip_half_m, 0.0))


def _shoulder_offset(body: Body, side: int) -> tuple[float, float, float]:
    rise = body.of_stature(anatomy.SHOULDER_HEIGHT - anatomy.RADIUS_SHOULDER / 2 - anatomy.SPINE_SHOULDER_HEIGHT)
    return (0.0, SIDE_SIGN[side] * body.shoulder_half_m, rise)


def _arm(
    body: Body, posture: Posture, chest: FloatArray, shoulder: FloatArray, side: int, name: str, joints: FloatArray
) -> None:
    back, out, down = ELBOW_POLE
    pole = _at(chest, (back, SIDE_SIGN[side] * out, down))
    upper_m, fore_m, hand_m = (body.of_stature(s) for s in (anatomy.UPPER_ARM, anatomy.FOREARM, anatomy.HAND))
    elbow, tip = two_bones(shoulder, posture.tip[:, side], pole, upper_m, fore_m + hand_m)
    along = unit(tip - elbow)
    wrist = elbow + along * fore_m
    inward = -SIDE_SIGN[side] * chest[:, :, 1] + chest[:, :, 0]
    across = unit(inward - along * np.sum(inward * along, axis=-1, keepdims=True))
    thumb = wrist + along * body.of_stature(anatomy.THUMB[0]) + across * body.of_stature(anatomy.THUMB[1])
    palm = wrist + along * body.of_stature(anatomy.PALM)
    for joint, place in (
        ("shoulder", shoulder), ("elbow", elbow), ("wrist", wrist), ("hand", palm), ("hand_tip", tip), ("thumb", thumb),
    ):  # fmt: skip
        joints[:, J[f"{joint}_{name}"]] = place


def _foot_bone(body: Body, yaw: FloatArray, pitch: FloatArray) -> FloatArray:
    """(T, 3) ankle to ball; a pitch turns it downwards about the ball, so that the heel rises."""
    forward = body.of_stature(anatomy.BALL_FORWARD)
    down = body.of_stature(anatomy.ANKLE_HEIGHT - anatomy.BALL_HEIGHT)
    ahead = forward * np.cos(pitch) - down * np.sin(pitch)
    fall = forward * np.sin(pitch) + down * np.cos(pitch)
    return np.stack([ahead * np.cos(yaw), ahead * np.sin(yaw), -fall], axis=-1)


def _at(frames: FloatArray, offset: tuple[float, float, float]) -> FloatArray:
    """(T, 3, 3) frames and an offset forward, left, up -> (T, 3) the offset in the scene's axes."""
    return np.asarray(frames @ np.array(offset))


def _matrix(rows: tuple[tuple[FloatArray, ...], ...]) -> FloatArray:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
