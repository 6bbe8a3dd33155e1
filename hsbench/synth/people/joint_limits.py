"""How far joints go, and by how much a pose goes further.

Ranges are those of the American Academy of Orthopaedic Surgeons (1965), as printed in Norkin & White, Measurement of
Joint Motion, appendix. Angles are measured on joint positions alone, in the axes that these span:

- of the pelvis: left along the hips, up as near to ``spine_mid`` as that allows; of the chest: left along the
  shoulders, up as near to ``spine_mid`` -> ``spine_shoulder`` as that allows;
- ``spine_flexion``: of the upper spine against the lower, which take half of the bend each, so half of the range;
  ``spine_side``: of the upper spine against the pelvis; ``spine_twist``: of the shoulders against the hips;
- ``neck_bend``: of ``neck`` -> ``head`` against the chest's up, in any direction. A skull's middle lies ahead of its
  neck at rest, which is added;
- ``shoulder_back``, ``shoulder_across``: how far an upper arm points behind, and over to the other side;
- ``wrist``: of ``wrist`` -> ``hand_tip`` against the forearm, in any direction;
- ``hip_flexion`` and ``hip_abduction`` of a thigh against the pelvis; ``knee_*`` and ``elbow_*``: 0 is straight.
"""

from __future__ import annotations

import math

import numpy as np

from hsbench.synth.people.body import SIDES, J, unit
from hsbench.typing import FloatArray

HEAD_FORWARD = 0.12  # the skull's middle lies so far before the neck, as a share of its height above it

SPINE_FLEXION = (math.radians(-25), math.radians(80))
SPINE_SIDE = math.radians(35)
SPINE_TWIST = math.radians(45)
NECK_BEND = math.radians(45)
NECK_TURN = math.radians(60)
SHOULDER_BACK = math.radians(60)
SHOULDER_ACROSS = math.radians(45)  # horizontal flexion of 135 degrees
ELBOW_FLEXION = math.radians(150)
WRIST_BEND = math.radians(70)  # extension; flexion is 80 degrees
HIP_FLEXION = (math.radians(-30), math.radians(120))
HIP_ABDUCTION = (math.radians(-30), math.radians(45))
KNEE_FLEXION = math.radians(135)

LIMITS_RAD: dict[str, tuple[float, float]] = {
    "spine_flexion": (SPINE_FLEXION[0] / 2, SPINE_FLEXION[1] / 2),
    "spine_side": (-SPINE_SIDE, SPINE_SIDE),
    "spine_twist": (-SPINE_TWIST, SPINE_TWIST),
    "neck_bend": (0.0, NECK_BEND + math.atan(HEAD_FORWARD)),
    **{f"shoulder_back_{side}": (-math.pi / 2, SHOULDER_BACK) for side in SIDES},
    **{f"shoulder_across_{side}": (-math.pi / 2, SHOULDER_ACROSS) for side in SIDES},
    **{f"elbow_{side}": (0.0, ELBOW_FLEXION) for side in SIDES},
    **{f"wrist_{side}": (0.0, WRIST_BEND) for side in SIDES},
    **{f"hip_flexion_{side}": HIP_FLEXION for side in SIDES},
    **{f"hip_abduction_{side}": HIP_ABDUCTION for side in SIDES},
    **{f"knee_{side}": (0.0, KNEE_FLEXION) for side in SIDES},
}
"""Least and greatest angle by name, in the order of ``joint_angles``."""


def limit_violations(joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T, len(LIMITS_RAD)) radians by which each angle is beyond its range; 0 within it."""
    angles = joint_angles(joints)
    low, high = np.array(list(LIMITS_RAD.values())).T
    return np.asarray(np.maximum(np.maximum(low - angles, angles - high), 0.0))


def joint_angles(joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T, len(LIMITS_RAD)) angles in radians, in the order of ``LIMITS_RAD``."""
    place = {name: joints[:, index] for name, index in J.items()}
    lower, upper = place["spine_mid"] - place["spine_base"], place["spine_shoulder"] - place["spine_mid"]
    pelvis = _axes(place["hip_left"] - place["hip_right"], lower)
    chest = _axes(place["shoulder_left"] - place["shoulder_right"], upper)
    spine = _inside(pelvis, unit(upper))
    across = _inside(pelvis, chest[:, 1])
    skull = _inside(chest, unit(place["head"] - place["neck"]))
    middle = [
        np.arcsin(np.clip(spine[:, 0], -1, 1)),
        np.arcsin(np.clip(spine[:, 1], -1, 1)),
        np.arcsin(np.clip(-across[:, 0], -1, 1)),
        np.arccos(np.clip(skull[:, 2], -1, 1)),
    ]
    arms = [_arm(place, chest, side, sign) for side, sign in zip(SIDES, (1.0, -1.0), strict=True)]
    legs = [_leg(place, pelvis, side, sign) for side, sign in zip(SIDES, (1.0, -1.0), strict=True)]
    limbs = [angle for both in (zip(*arms, strict=True), zip(*legs, strict=True)) for pair in both for angle in pair]
    return np.stack([*middle, *limbs], axis=1)


def _arm(place: dict[str, FloatArray], chest: FloatArray, side: str, sign: float) -> tuple[FloatArray, ...]:
    upper = unit(place[f"elbow_{side}"] - place[f"shoulder_{side}"])
    fore = unit(place[f"wrist_{side}"] - place[f"elbow_{side}"])
    hand = unit(place[f"hand_tip_{side}"] - place[f"wrist_{side}"])
    way = _inside(chest, upper)
    back, over = np.arcsin(np.clip(-way[:, 0], -1, 1)), np.arcsin(np.clip(-sign * way[:, 1], -1, 1))
    return back, over, _between(upper, fore), _between(fore, hand)


def _leg(place: dict[str, FloatArray], pelvis: FloatArray, side: str, sign: float) -> tuple[FloatArray, ...]:
    thigh = unit(place[f"knee_{side}"] - place[f"hip_{side}"])
    shank = unit(place[f"ankle_{side}"] - place[f"knee_{side}"])
    way = _inside(pelvis, thigh)
    return np.arctan2(way[:, 0], -way[:, 2]), np.arcsin(np.clip(sign * way[:, 1], -1, 1)), _between(thigh, shank)


def _axes(left: FloatArray, up: FloatArray) -> FloatArray:
    """(T, 3) left and about up -> (T, 3, 3) rows forward, left, up."""
    left = unit(left)
    up = unit(up - left * np.sum(up * left, axis=-1, keepdims=True))
    return np.stack([np.cross(left, up), left, up], axis=1)


def _inside(axes: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray((axes @ vectors[:, :, None])[:, :, 0])


def _between(a: FloatArray, b: FloatArray) -> FloatArray:
    """(T,) angle between unit vectors (T, 3), exact near 0 as well."""
    return np.asarray(2 * np.arctan2(np.sqrt(np.sum((a - b) ** 2, axis=-1)), np.sqrt(np.sum((a + b) ** 2, axis=-1))))
