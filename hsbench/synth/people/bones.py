"""The 35 bones of a body's mesh, and their frames from 25 joints alone.

A joint has a place but no orientation, so a bone's twist about its axis follows from its neighbours: the trunk from
hips and shoulders, a limb's middle from the plane in which elbow or knee bends, its root from its parent by the least
rotation, its end from thumb or foot. Each limb bone is three that share the twist from root to end, so that skin
wrings over the whole length. Everything is continuous in the joints; a straight limb keeps its parent's twist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.synth.people.body import MIDDLE_JOINTS, J, cross, unit
from hsbench.typing import BoolArray, FloatArray

TWISTS = 3
TRUNK = ("pelvis", "belly", "chest", "neck", "head", "clavicle_left", "clavicle_right")
LIMBS = ("arm_left", "arm_right", "leg_left", "leg_right")
SEGMENTS = ("upper_0", "upper_1", "upper_2", "lower_0", "lower_1", "lower_2", "end")
BONES: tuple[str, ...] = (*TRUNK, *(f"{limb}_{segment}" for limb in LIMBS for segment in SEGMENTS))
"""Bone names in the order of ``bodies.npz``."""

STRETCHED: BoolArray = np.array([name not in ("pelvis", "neck", "head") for name in BONES])
"""Bones that reach from joint to joint; the others keep their length."""
GIRTHED: BoolArray = np.array([name not in ("neck", "head") and not name.endswith("_end") for name in BONES])
"""Bones whose cross-section follows a body's girth."""

EASE = 0.15  # the sine of the bend at which a limb follows the plane of its bend rather than its parent
MIDDLE_EASE = 0.1  # keeps the middle of a limb defined when its ends are twisted half a turn
THUMB_EASE = 0.02  # and of a thumb against its hand, of a foot against its shank
OPPOSITE = 1e-3  # least rotations are damped this near to a half turn

_LIMB_JOINTS = np.array(
    [
        *([J[f"{name}_{side}"] for name in ("shoulder", "elbow", "wrist", "hand_tip")] for side in ("left", "right")),
        *([J[f"{name}_{side}"] for name in ("hip", "knee", "ankle", "foot")] for side in ("left", "right")),
    ]
)
_THUMBS = [J["thumb_left"], J["thumb_right"]]
_PARENTS = [TRUNK.index(name) for name in ("clavicle_left", "clavicle_right", "pelvis", "pelvis")]


@dataclass(frozen=True, eq=False)
class Frames:
    """Bones. axes: (..., B, 3, 3) columns along, beside, across. origin: (..., B, 3). length: (..., B) in metres."""

    axes: FloatArray
    origin: FloatArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class Rest:
    """A body at rest: its frames, and what a limb takes from its neighbours.

    root, hinge: (4, 3) direction of each limb's upper bone and axis of its middle joint, which turn with the parent.
    grip: (4, 3) that axis, of the lower bone, in the axes of hand or foot.
    """

    frames: Frames
    root: FloatArray
    hinge: FloatArray
    grip: FloatArray

    @classmethod
    def of(cls, joints: FloatArray) -> Rest:
        """From the (25, 3) joints of a body at rest that looks along -y: elbows are bent, knees bend about x."""
        limbs = joints[_LIMB_JOINTS]
        upper, lower = unit(limbs[:, 1] - limbs[:, 0]), unit(limbs[:, 2] - limbs[:, 1])
        hinge = cross(upper, lower)
        hinge[2:] = (1.0, 0.0, 0.0)
        hinge = unit(aside(hinge, upper))
        end = _ends(joints[None], lower[None], np.zeros((1, 4, 3)))[0]
        bend = _bent(cross(upper, lower), hinge, upper)
        grip = np.swapaxes(end, -1, -2) @ unit(aside(bend, lower))[..., None]
        frames = _joined(_trunk(joints[None]), _limbs(joints[None], upper[None], hinge[None], grip[..., 0]))
        return cls(Frames(frames.axes[0], frames.origin[0], frames.length[0]), upper, hinge, grip[..., 0])


def pose_frames(rest: Rest, joints: FloatArray) -> Frames:
    """(T, 25, 3) joints -> the bones' frames at T times."""
    trunk = _trunk(joints)
    turned = trunk.axes[:, _PARENTS] @ np.swapaxes(rest.frames.axes[_PARENTS], -1, -2)
    root, hinge = ((turned @ way[..., None])[..., 0] for way in (rest.root, rest.hinge))
    return _joined(trunk, _limbs(joints, root, hinge, rest.grip))


def aside(vectors: FloatArray, axis: FloatArray) -> FloatArray:
    """(..., 3) vectors without their part along (..., 3) unit axes."""
    return np.asarray(vectors - axis * _dot(vectors, axis))


def _trunk(joints: FloatArray) -> Frames:
    base, mid, top, neck, head = (joints[:, J[name]] for name in MIDDLE_JOINTS)
    left, right = joints[:, J["shoulder_left"]], joints[:, J["shoulder_right"]]
    hips, shoulders = unit(joints[:, J["hip_left"]] - joints[:, J["hip_right"]]), unit(left - right)
    low, high, skull = mid - base, top - mid, head - neck
    along = np.stack([low, low, high, unit(high) + unit(skull), skull, left - top, right - top], axis=1)
    beside = np.stack([hips, hips + shoulders, shoulders, shoulders, shoulders, high, high], axis=1)
    origin = np.stack([base, base, mid, neck, head, top, top], axis=1)
    return Frames(_axes(unit(along), beside), origin, _length(along))


def _limbs(joints: FloatArray, root: FloatArray, hinge: FloatArray, grip: FloatArray) -> Frames:
    """(T, 25, 3) joints, (T, 4, 3) root and hinge as the parents carry them, (4, 3) grip."""
    limbs = joints[:, _LIMB_JOINTS]
    bones = np.diff(limbs, axis=2)
    upper, lower = unit(bones[:, :, 0]), unit(bones[:, :, 1])
    first = unit(aside(_carried(hinge, root, upper), upper))
    bend = _bent(cross(upper, lower), first, upper)
    folded = unit(aside(bend, lower))
    end = _ends(joints, lower, folded)
    gripped = (end @ grip[..., None])[..., 0]
    last = unit(aside(gripped, lower) + EASE * folded)
    axes = [_axes(upper, side) for side in _shared(first, bend)]
    axes += [_axes(lower, side) for side in _shared(folded, last)]
    origin = np.repeat(limbs[:, :, :3], (TWISTS, TWISTS, 1), axis=2)
    length = np.repeat(_length(bones), (TWISTS, TWISTS, 1), axis=2)
    frames = np.stack([*axes, end], axis=2)
    times = len(joints)
    return Frames(frames.reshape(times, -1, 3, 3), origin.reshape(times, -1, 3), length.reshape(times, -1))


def _bent(normal: FloatArray, hinge: FloatArray, upper: FloatArray) -> FloatArray:
    """The hinge of a middle joint: the normal of its plane, on the parent's side of it, or the parent's if straight."""
    agreeing = _dot(normal, hinge)
    return unit(aside(normal + (np.abs(agreeing) - agreeing + EASE) * hinge, upper))


def _ends(joints: FloatArray, lower: FloatArray, folded: FloatArray) -> FloatArray:
    """(T, 4, 3, 3) axes of hands (beside them the thumb) and feet (beside them the axis of the ankle)."""
    limbs = joints[:, _LIMB_JOINTS]
    along = unit(limbs[:, :, 3] - limbs[:, :, 2])
    thumb = unit(aside(joints[:, _THUMBS] - limbs[:, :2, 2], along[:, :2]))
    ankle = cross(lower[:, 2:], along[:, 2:])
    # What stands in for a thumb in line with its hand is a direction like it, not an axis: mirror images stay alike.
    thumb = thumb + THUMB_EASE * cross(along[:, :2], folded[:, :2])
    return _axes(along, np.concatenate([thumb, ankle + THUMB_EASE * folded[:, 2:]], axis=1))


def _carried(vectors: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(..., 3) vectors, turned by the least rotation that takes unit ``start`` to unit ``end``."""
    both = start + end
    share = _dot(both, vectors) / np.maximum(1.0 + _dot(start, end), OPPOSITE)
    return np.asarray(vectors - share * both + 2.0 * _dot(start, vectors) * end)


def _shared(first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The sides of a limb bone's three twists, from those at its ends."""
    return first, (1.0 + MIDDLE_EASE) * first + last, last


def _axes(along: FloatArray, beside: FloatArray) -> FloatArray:
    """(..., 3) unit axis and a vector roughly across it -> (..., 3, 3) right-handed axes in columns."""
    side = unit(aside(beside, along))
    return np.stack([along, side, cross(along, side)], axis=-1)


def _joined(trunk: Frames, limbs: Frames) -> Frames:
    return Frames(
        np.concatenate([trunk.axes, limbs.axes], axis=1),
        np.concatenate([trunk.origin, limbs.origin], axis=1),
        np.concatenate([trunk.length, limbs.length], axis=1),
    )


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.sum(vectors * vectors, axis=-1)))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.sum(a * b, axis=-1, keepdims=True))
