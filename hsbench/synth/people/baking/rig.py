"""Where a shape's 25 joints are, how much each vertex follows each bone, and fingers at rest."""

from __future__ import annotations

import numpy as np

from hsbench.synth.people import body as anatomy
from hsbench.synth.people.baking.makehuman import MakeHuman
from hsbench.synth.people.body import J, unit
from hsbench.synth.people.bones import BONES, TWISTS
from hsbench.synth.people.kinematics import HEAD_FORWARD
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

CURL_RAD = 0.42  # of each finger joint of a hand at rest: about 25 degrees
GATHER_SHARES = {1: 0.8, 2: 0.7, 3: 0.7, 4: 0.7, 5: 0.7}  # how much of a finger's way from the hand's axis is closed
TRUNK_SLAB = (0.06, 0.025)  # half width and half height of the part of the trunk that is measured, shares of stature
TRUNK_SHARE = 0.8  # of the way from the line between hips and shoulders to the middle of the trunk
FINGERS = {1: "thumb", 2: "index", 3: "middle", 4: "ring", 5: "pinky"}  # MakeHuman's numbers and the rig's names
MOST_BONES = 4  # that move one vertex
WHOLE = 255  # weights are stored in shares of this

_SWAP = {"left": "right", "right": "left"}
OPPOSITE_BONES: IntArray = np.array(
    [BONES.index("_".join(_SWAP.get(word, word) for word in name.split("_"))) for name in BONES]
)
"""Of each bone its mirror image; those of the trunk's middle are their own."""

# Bones of MakeHuman's rig ``game_engine``, without side, and ours.
_TRUNK = {"pelvis": ("pelvis",), "spine_01": ("belly",), "spine_02": ("belly", "chest"), "spine_03": ("chest",),
          "neck_01": ("neck",), "head": ("head",)}  # fmt: skip
_LIMBS = {"upperarm": ("arm", "upper"), "lowerarm": ("arm", "lower"), "thigh": ("leg", "upper"),
          "calf": ("leg", "lower")}  # fmt: skip
_ENDS = {"foot": "leg", "ball": "leg"}  # all that is left is fingers and hand
_LIMB_JOINTS = {"arm": ("shoulder", "elbow", "wrist"), "leg": ("hip", "knee", "ankle")}


def rest_joints(human: MakeHuman, points: FloatArray) -> FloatArray:
    """(25, 3) joints of a shape's (N, 3) vertices, at the shares of its stature that ``body`` gives them.

    MakeHuman's shoulder and hip lie under the skin of the contour; the centres of rotation lie as far inside it as
    Winter says, the shoulder on the line of the upper arm.
    """
    floor, tall = human.joint(points, "ground")[2], stature(human, points)
    joints = np.empty((len(J), 3))
    shoulder, elbow = human.joint(points, "l-shoulder"), human.joint(points, "l-elbow")
    hip = human.joint(points, "l-upper-leg")
    out = tall * (anatomy.SHOULDER_BREADTH / 2 - anatomy.RADIUS_UPPER_ARM[0])
    shoulder = elbow + (shoulder - elbow) * (elbow[0] - out) / (elbow[0] - shoulder[0])
    hip[0] = tall * (anatomy.HIP_BREADTH / 2 - anatomy.RADIUS_THIGH[0])
    ankle = human.joint(points, "l-ankle")
    ankle[2] = floor + tall * anatomy.ANKLE_HEIGHT
    toes = human.joint(points, "l-foot-2") - ankle
    ahead = unit(np.array([toes[0], toes[1], 0.0]))
    ball = ankle + ahead * tall * anatomy.BALL_FORWARD
    ball[2] = floor + tall * anatomy.BALL_HEIGHT
    wrist, knuckle = human.joint(points, "l-hand"), human.joint(points, "l-finger-3-1")
    along = unit(knuckle - wrist)
    thumb = human.joint(points, "l-finger-1-3") - wrist
    beside = unit(thumb - along * (along @ thumb))
    left = {
        "shoulder": shoulder, "elbow": elbow, "wrist": wrist, "hip": hip, "knee": human.joint(points, "l-knee"),
        "ankle": ankle, "foot": ball, "hand": wrist + along * tall * anatomy.PALM,
        "hand_tip": wrist + along * tall * anatomy.HAND,
        "thumb": wrist + tall * (along * anatomy.THUMB[0] + beside * anatomy.THUMB[1]),
    }  # fmt: skip
    for name, place in left.items():
        joints[J[f"{name}_left"]], joints[J[f"{name}_right"]] = place, place * (-1, 1, 1)
    skull_y = human.joint(points, "head-2")[1]
    rise = tall * (anatomy.HEAD_HEIGHT - anatomy.NECK_HEIGHT)
    lower = (anatomy.SPINE_MID_HEIGHT - anatomy.HIP_HEIGHT) / (anatomy.SPINE_SHOULDER_HEIGHT - anatomy.HIP_HEIGHT)
    top = np.array([0.0, shoulder[1], floor + tall * anatomy.SPINE_SHOULDER_HEIGHT])
    joints[J["spine_base"]] = (0.0, hip[1], hip[2])
    joints[J["spine_shoulder"]] = top
    joints[J["spine_mid"]] = joints[J["spine_base"]] + lower * (top - joints[J["spine_base"]])
    joints[J["spine_mid"], 1] += TRUNK_SHARE * (
        _trunk_middle_y(human, points, joints[J["spine_mid"], 2], tall) - joints[J["spine_mid"], 1]
    )
    joints[J["head"]] = (0.0, skull_y, floor + tall * anatomy.HEAD_HEIGHT)
    joints[J["neck"]] = joints[J["head"]] - np.array([0.0, -HEAD_FORWARD * rise, rise])
    return joints


def _trunk_middle_y(human: MakeHuman, points: FloatArray, height: float, tall: float) -> float:
    """Half way between belly and back at a height."""
    skin = points[np.unique(human.triangles("body"))]
    half_width, half_height = (share * tall for share in TRUNK_SLAB)
    slab = skin[(np.abs(skin[:, 0]) < half_width) & (np.abs(skin[:, 2] - height) < half_height), 1]
    return float((slab.min() + slab.max()) / 2)


def stature(human: MakeHuman, points: FloatArray) -> float:
    """Floor to crown of a shape's (N, 3) vertices."""
    return float(points[np.unique(human.triangles("body")), 2].max() - human.joint(points, "ground")[2])


def curled(human: MakeHuman, points: FloatArray, angle_rad: float) -> FloatArray:
    """(N, 3) vertices with hands at rest: fingers gathered, their joints bent by an angle towards the palm."""
    points = points.copy()
    for side, sign in (("l", 1.0), ("r", -1.0)):
        at = {(i, k): human.joint(points, f"{side}-finger-{i}-{k}") for i in range(1, 6) for k in range(1, 5)}
        across = sign * unit(at[2, 1] - at[5, 1])
        along = unit(at[3, 1] - human.joint(points, f"{side}-hand"))
        palm = unit(np.cross(across, along))
        for number, share in GATHER_SHARES.items():
            way = at[number, 4] - at[number, 2]
            aside = float(np.arctan2(np.cross(way, along) @ palm, along @ (way - palm * (palm @ way))))
            root = 2 if number == 1 else 1
            gathering = (FINGERS[number], at[number, root], palm, share * aside, root)
            bends = [(FINGERS[number], at[number, k], across, angle_rad, k) for k in (3, 2, 1) if number > 1]
            for name, centre, axis, angle, first in [*bends, gathering]:
                moving = np.asarray(sum(human.weights[f"{name}_0{m}_{side}"] for m in range(first, 4)))
                turned = centre + _turned(points - centre, axis, angle)
                points += moving[:, None] * (turned - points)
    return points


def _turned(vectors: FloatArray, axis: FloatArray, angle_rad: float) -> FloatArray:
    """(N, 3) vectors turned about a unit axis (Rodrigues)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(vectors * c + np.cross(axis, vectors) * s + np.outer(vectors @ axis, axis) * (1 - c))


def vertex_weights(
    human: MakeHuman, rows: FloatArray, points: FloatArray, joints: FloatArray
) -> tuple[UInt8Array, UInt8Array]:
    """Sparse (V, N) rows at (V, 3) places with (25, 3) joints -> (V, 4) bones and their (V, 4) weights of sum 255."""
    table = np.zeros((len(points), len(BONES)))
    for name, column in human.weights.items():
        share = np.asarray(rows @ column)
        stem, _, side = name.rpartition("_")
        if stem == "clavicle":
            table[:, BONES.index(f"clavicle_{_SIDE[side]}")] += share
        elif name in _TRUNK:
            for ours in _TRUNK[name]:
                table[:, BONES.index(ours)] += share / len(_TRUNK[name])
        elif stem in _LIMBS:
            limb, segment = _LIMBS[stem]
            k = 0 if segment == "upper" else 1
            a, b = (joints[J[f"{_LIMB_JOINTS[limb][k + m]}_{_SIDE[side]}"]] for m in (0, 1))
            along = (points - a) @ (b - a) / ((b - a) @ (b - a))
            place = np.clip(along, 0.0, 1.0) * (TWISTS - 1)
            for twist in range(TWISTS):
                bone = BONES.index(f"{limb}_{_SIDE[side]}_{segment}_{twist}")
                table[:, bone] += share * np.maximum(0.0, 1.0 - np.abs(place - twist))
        elif side in _SIDE:
            table[:, BONES.index(f"{_ENDS.get(stem, 'arm')}_{_SIDE[side]}_end")] += share
    return _quantised(table, points[:, 0] == 0)


_SIDE = {"l": "left", "r": "right"}


def _quantised(table: FloatArray, middle: BoolArray) -> tuple[UInt8Array, UInt8Array]:
    """(V, B) weights -> the four greatest of each vertex, in whole shares that sum to 255.

    What is lost by rounding goes to the greatest remainders; in the middle plane, where left and right have the same,
    to the greatest bone of the trunk.
    """
    table = np.where(middle[:, None], (table + table[:, OPPOSITE_BONES]) / 2, table)
    table = np.round(table, 6)
    single = np.where(np.arange(len(BONES)) == OPPOSITE_BONES, table, -1.0)
    greatest = middle[:, None] & (np.arange(len(BONES)) == np.argmax(single, axis=1)[:, None])
    bones = np.argsort(-(table + greatest), axis=1, kind="stable")[:, :MOST_BONES]
    kept = np.zeros_like(table)
    np.put_along_axis(kept, bones, np.take_along_axis(table, bones, axis=1), axis=1)
    kept = np.where(middle[:, None], np.minimum(kept, kept[:, OPPOSITE_BONES]), kept)
    exact = kept / kept.sum(axis=1, keepdims=True) * WHOLE
    whole = np.floor(np.round(exact, 6))
    lacking = WHOLE - whole.sum(axis=1, keepdims=True)
    order = np.argsort(np.argsort(-(exact - whole), axis=1, kind="stable"), axis=1, kind="stable")
    whole += np.where(middle[:, None], lacking * greatest, order < lacking)
    return bones.astype(np.uint8), np.take_along_axis(whole, bones, axis=1).astype(np.uint8)
