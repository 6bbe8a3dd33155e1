"""Where the joints of other skeletons lie on a body that is known by its Kinect v2 joints.

COCO's joints are those that a Kinect has, and points of the head; its neck is the middle of the shoulders, as OpenPose
defines it. The head turns with the shoulders about its own axis, as the mesh of a body does. Places on head and foot
are means over the shapes in ``people/bodies.npz``, as shares of stature.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.skeletons import KINECT_V2, Skeleton
from hsbench.synth.people.body import CAPSULE_JOINTS, RADIUS_HEAD, Body, J, shoe_axis, unit
from hsbench.typing import BoolArray, FloatArray

FACE = {"nose": (0.076, 0.0, -0.012), "eye": (0.055, 0.018, 0.006), "ear": (0.0, 0.047, -0.008)}
"""From the head joint ahead, to the own side, and up along the head's axis."""

SKIN_M = 2e-3  # the capsule of a head is round: what would lie in it stands off by this much, or the head hid nothing
BIG_TOE_IN = 0.010  # from the toe end of the shoe's axis
SMALL_TOE_OUT = 0.018
SMALL_TOE_BACK = 0.012
KINECT_JOINT = {"neck": "spine_shoulder", "hip_mid": "spine_base"}
"""The Kinect joint that stands for another in what it belongs to."""


def landmarks(skeleton: Skeleton, body: Body, joints: FloatArray) -> FloatArray:
    """(N, 25, 3) Kinect joints of a body -> (N, J, 3) joints of the skeleton, metres in the same frame."""
    joints = np.asarray(joints, dtype=np.float64)
    if skeleton == KINECT_V2:
        return joints
    made = _head(body, joints) | _feet(body, joints)
    for middle, name in (("neck", "shoulder"), ("hip_mid", "hip")):
        made[middle] = (joints[:, J[f"{name}_left"]] + joints[:, J[f"{name}_right"]]) / 2
    return np.stack([made[name] if name in made else joints[:, J[name]] for name in skeleton.names], axis=1)


def belonging(skeleton: Skeleton) -> BoolArray:
    """(C, J) whether a joint belongs to a capsule of the body, and so is not hidden by it.

    Points of the head belong to none: they lie on it.
    """
    belongs = np.zeros((len(CAPSULE_JOINTS), len(skeleton.names)), dtype=np.bool_)
    for j, name in enumerate(skeleton.names):
        own = name if skeleton == KINECT_V2 else KINECT_JOINT.get(name, _foot(name))
        belongs[:, j] = [own in names for names in CAPSULE_JOINTS]
    return belongs


def _foot(name: str) -> str:
    part, _, side = name.rpartition("_")
    return f"foot_{side}" if part in ("big_toe", "small_toe", "heel") else name


def _head(body: Body, joints: FloatArray) -> dict[str, FloatArray]:
    head = joints[:, J["head"]]
    up = unit(head - joints[:, J["neck"]])
    across = joints[:, J["shoulder_left"]] - joints[:, J["shoulder_right"]]
    left = unit(across - up * np.sum(across * up, axis=1, keepdims=True))
    ahead = np.cross(left, up)
    found = {}
    for name, (forward, aside, high) in FACE.items():
        out = max(1.0, (body.radius(RADIUS_HEAD) + SKIN_M) / body.of_stature(float(np.hypot(forward, aside))))
        for side, sign in (("_left", 1.0), ("_right", -1.0)) if aside else (("", 0.0),):
            place = (forward * ahead + sign * aside * left) * out + high * up
            found[name + side] = head + place * body.stature_m
    return found


def _feet(body: Body, joints: FloatArray) -> dict[str, FloatArray]:
    found = {}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        knee, ankle, foot = (joints[:, J[f"{name}_{side}"]] for name in ("knee", "ankle", "foot"))
        heel, toe = shoe_axis(body, knee, ankle, foot)
        out = sign * unit(np.cross(ankle - knee, foot - ankle)) * body.stature_m
        back = unit(heel - toe) * body.stature_m
        found[f"heel_{side}"] = heel
        found[f"big_toe_{side}"] = toe - out * BIG_TOE_IN
        found[f"small_toe_{side}"] = toe + out * SMALL_TOE_OUT + back * SMALL_TOE_BACK
    return found
