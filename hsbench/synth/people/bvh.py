"""A person's own motion capture: a BVH file as a clip of Kinect joints on a body of ours.

Known are the joint names of three families of files: CMU's (and other MotionBuilder ones), Mixamo's, and Xsens's (also
Biped-like ones with shoulders, elbows, wrists). The unit of length and the axis that points up stand in no BVH file and
are never guessed: the caller says both, and legs that belong to nobody of 1 to 2.3 m are refused.

A clip keeps the directions of the file's bones and takes their lengths from the body. The way over the floor is scaled
by the lengths of the legs, and the lowest sole of the clip is put on the floor. Frame: metres, z up; a file's x stays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from hsbench.errors import DataError, SchemaError
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import SIDES, Body, J, unit
from hsbench.synth.people.channels import pose, standing
from hsbench.synth.people.footfalls import soles
from hsbench.typing import FloatArray

METRES = {"m": 1.0, "cm": 0.01}
UPS = ("y", "z")
STATURE_M = (1.0, 2.3)
MOST_BYTES = 256 * 1024**2
MOST_JOINTS = 1000
MOST_FRAMES = 500_000  # more than an hour at 120 frames a second
RATES_HZ = (1.0, 1000.0)
LEG_SHARE = anatomy.THIGH + anatomy.SHANK  # of stature
SPINE_ABOVE_SHOULDERS = anatomy.SPINE_SHOULDER_HEIGHT - (anatomy.SHOULDER_HEIGHT - anatomy.RADIUS_SHOULDER / 2)
SIDE_PREFIX = {"left": ("left", "l"), "right": ("right", "r")}

FAMILIES: tuple[dict[str, tuple[str, ...]], ...] = (
    {
        "spine_mid": ("spine1", "spine"), "neck": ("neck",), "head": ("head",), "shoulder": ("arm",),
        "elbow": ("forearm",), "wrist": ("hand",), "hip": ("upleg",), "knee": ("leg",), "ankle": ("foot",),
        "foot": ("toebase",), "hand_tip": ("handmiddle1", "fingerbase"), "thumb": ("handthumb2", "thumb"),
    },
    {
        "spine_mid": ("chest2", "chest", "spine1", "spine"), "neck": ("neck",), "head": ("head",),
        "shoulder": ("shoulder",), "elbow": ("elbow",), "wrist": ("wrist",), "hip": ("hip",), "knee": ("knee",),
        "ankle": ("ankle",), "foot": ("toe",), "hand_tip": ("middle1",), "thumb": ("thumb2",),
    },
)  # fmt: skip
"""Names of joints, lower case without prefix and punctuation, in CMU's and Mixamo's files and in Xsens's; the first
that is there counts. Those of limbs follow the name of their side."""
MIDDLE = ("spine_mid", "neck", "head")
OPTIONAL = ("hand_tip", "thumb")


@dataclass(frozen=True, eq=False)
class Clip:
    """joints: (T, 25, 3) in metres, Kinect v2's, floor at z = 0. fps: frames a second."""

    joints: FloatArray
    fps: float


@dataclass(frozen=True, eq=False)
class _Joint:
    """One joint of a file. parent: index or -1. channels: names in order. end: offset of an end site, or None."""

    name: str
    parent: int
    offset: tuple[float, ...]
    channels: tuple[str, ...]
    end: tuple[float, ...] | None


def read_bvh(path: Path, body: Body, unit_of_length: Literal["m", "cm"], up: Literal["y", "z"]) -> Clip:
    """A BVH file as a clip on a body.

    Raises SchemaError for another unit or axis and for a person of impossible size, DataError for a damaged file or
    joints whose names are not known.
    """
    if unit_of_length not in METRES:
        raise SchemaError(f"unit_of_length is {unit_of_length!r}; expected one of {', '.join(METRES)}")
    if up not in UPS:
        raise SchemaError(f"up is {up!r}; expected one of {', '.join(UPS)}")
    joints, values, fps = _parsed(path)
    places = _forward(joints, values) * METRES[unit_of_length]
    if up == "y":
        places = np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)
    kinect = _kinect(path, joints, places)
    stature_m = float(np.median(_leg_m(kinect))) / LEG_SHARE
    if not STATURE_M[0] <= stature_m <= STATURE_M[1]:
        other = "cm" if unit_of_length == "m" else "m"
        raise SchemaError(
            f"{path}: the legs are those of a person of {stature_m:.3g} m; expected {STATURE_M[0]}..{STATURE_M[1]} m "
            f"(is the unit {other}?)"
        )
    return Clip(quantise_m(on_body(body, kinect)), fps)


def on_body(body: Body, joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints of somebody else -> the same directions of bones with a body's lengths, on the floor."""
    rest = pose(body, standing(body, np.zeros(2), 0.0), 1.0, None)
    placed = np.empty_like(joints)
    placed[:, 0] = joints[:, 0] * (float(_leg_m(rest)[0]) / float(np.median(_leg_m(joints))))
    for parent, child in KINECT_V2.bones:
        length = np.sqrt(np.sum((rest[0, child] - rest[0, parent]) ** 2))
        placed[:, child] = placed[:, parent] + length * unit(joints[:, child] - joints[:, parent])
    placed[..., 2] -= soles(body, placed)[..., 2].min()
    return placed


def _leg_m(joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T,) mean length of hip to knee to ankle."""
    rows = np.array([[J[f"{n}_{side}"] for n in ("hip", "knee", "ankle")] for side in SIDES])
    bones = np.diff(joints[:, rows], axis=2)
    return np.asarray(np.sqrt(np.sum(bones**2, axis=-1)).sum(axis=2).mean(axis=1))


def _parsed(path: Path) -> tuple[list[_Joint], FloatArray, float]:
    """Joints, (T, channels) values, and frames a second of a file."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise DataError(f"{path}: {path.stat().st_size} bytes; expected at most {MOST_BYTES}")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read as text ({error})") from error
    head, found, tail = text.partition("MOTION")
    if not head.split()[:1] == ["HIERARCHY"] or not found:
        raise DataError(f"{path}: no HIERARCHY and MOTION; expected a BVH file (is it cut off?)")
    joints = _hierarchy(path, head.split()[1:])
    words = tail.split(maxsplit=5)
    if len(words) < 5 or [w.lower() for w in (words[0], *words[2:4])] != ["frames:", "frame", "time:"]:
        raise DataError(f"{path}: MOTION begins with {' '.join(words[:5])!r}; expected Frames: n Frame Time: s")
    frames, rate = _number(path, words[1]), 1 / max(_number(path, words[4]), 1e-9)
    if not 1 <= frames <= MOST_FRAMES or frames != int(frames):
        raise DataError(f"{path}: {words[1]} frames; expected 1..{MOST_FRAMES}")
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise DataError(f"{path}: a frame time of {words[4]} s; expected {1 / RATES_HZ[1]}..{1 / RATES_HZ[0]} s")
    columns = sum(len(joint.channels) for joint in joints)
    try:
        values = np.array(words[5].split() if len(words) > 5 else [], dtype=np.float64)
    except ValueError as error:
        raise DataError(f"{path}: {error}; expected numbers after Frame Time") from error
    if values.size != int(frames) * columns:
        raise DataError(
            f"{path}: {values.size} numbers of motion; expected {int(frames)} frames x {columns} channels "
            f"(is the file cut off?)"
        )
    if not np.isfinite(values).all():
        raise DataError(f"{path}: frame {int(np.argmin(np.isfinite(values))) // columns} holds NaN or infinity")
    return joints, values.reshape(int(frames), columns), float(np.round(rate, 3))


def _hierarchy(path: Path, words: list[str]) -> list[_Joint]:
    """The joints of the words between HIERARCHY and MOTION, parents first."""
    joints: list[_Joint] = []
    open_joints: list[int] = []  # -1 for an end site
    at = 0
    try:
        while at < len(words):
            word = words[at]
            if word in ("ROOT", "JOINT"):
                name_end = words.index("{", at)
                if (word == "ROOT") == bool(joints) or len(joints) >= MOST_JOINTS:
                    raise DataError(f"{path}: {len(joints)} joints before {word}; expected one ROOT first, then JOINTs")
                parent = open_joints[-1] if open_joints else -1
                joints.append(_Joint(" ".join(words[at + 1 : name_end]), parent, (), (), None))
                open_joints.append(len(joints) - 1)
                at = name_end + 1
            elif word == "End":
                open_joints.append(-1)
                at = words.index("{", at) + 1
            elif word == "OFFSET":
                offset = tuple(_number(path, w) for w in words[at + 1 : at + 4])
                _fill(joints, open_joints, offset=offset)
                at += 4
            elif word == "CHANNELS":
                count = int(words[at + 1])
                _fill(joints, open_joints, channels=tuple(words[at + 2 : at + 2 + count]))
                at += 2 + count
            elif word == "}":
                open_joints.pop()
                at += 1
            else:
                raise DataError(f"{path}: {word!r} in HIERARCHY; expected JOINT, End, OFFSET, CHANNELS or a bracket")
    except (ValueError, IndexError) as error:
        raise DataError(f"{path}: HIERARCHY is damaged at word {at} (is the file cut off?)") from error
    if open_joints or not joints:
        raise DataError(f"{path}: {len(open_joints)} brackets of HIERARCHY stay open (is the file cut off?)")
    for joint in joints:
        if len(joint.offset) != 3:
            raise DataError(f"{path}: joint {joint.name!r} has no OFFSET of three numbers")
        for channel in joint.channels:
            if channel[:1] not in "XYZ" or channel[1:] not in ("position", "rotation"):
                raise DataError(f"{path}: joint {joint.name!r} has the channel {channel!r}; expected such as Xrotation")
    return joints


def _fill(
    joints: list[_Joint], open_joints: list[int], offset: tuple[float, ...] = (), channels: tuple[str, ...] = ()
) -> None:
    """Give the innermost open joint its offset or channels; that of an end site goes to the joint that it ends."""
    if open_joints[-1] < 0:
        joint = joints[open_joints[-2]]
        joints[open_joints[-2]] = _Joint(joint.name, joint.parent, joint.offset, joint.channels, offset)
        return
    joint = joints[open_joints[-1]]
    joints[open_joints[-1]] = _Joint(
        joint.name, joint.parent, offset or joint.offset, channels or joint.channels, joint.end
    )


def _number(path: Path, word: str) -> float:
    try:
        value = float(word)
    except ValueError as error:
        raise DataError(f"{path}: {word!r} where a number is expected") from error
    if not math.isfinite(value):
        raise DataError(f"{path}: {word!r}; expected a finite number")
    return value


def _forward(joints: list[_Joint], values: FloatArray) -> FloatArray:
    """Joints and (T, channels) values -> (T, 2 N, 3) places of joints, and of their end sites (or themselves)."""
    times = len(values)
    turned = np.empty((len(joints), times, 3, 3))
    places = np.empty((times, 2 * len(joints), 3))
    column = 0
    for k, joint in enumerate(joints):
        offset, turn = np.tile(np.array(joint.offset), (times, 1)), np.tile(np.eye(3), (times, 1, 1))
        for name in joint.channels:
            axis = "XYZ".index(name[0])
            if name.endswith("position"):
                offset[:, axis] = values[:, column]
            else:
                turn = turn @ _about(axis, np.radians(values[:, column]))
            column += 1
        if joint.parent < 0:
            places[:, k], turned[k] = offset, turn
        else:
            places[:, k] = places[:, joint.parent] + (turned[joint.parent] @ offset[:, :, None])[:, :, 0]
            turned[k] = turned[joint.parent] @ turn
        places[:, len(joints) + k] = places[:, k] + turned[k] @ np.array(joint.end or (0.0, 0.0, 0.0))
    return places


def _about(axis: int, angle: FloatArray) -> FloatArray:
    """(T,) angles about x, y or z -> (T, 3, 3) rotations."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1.0
    turn[:, first, first] = turn[:, second, second] = np.cos(angle)
    turn[:, second, first] = np.sin(angle)
    turn[:, first, second] = -np.sin(angle)
    return turn


def _kinect(path: Path, joints: list[_Joint], places: FloatArray) -> FloatArray:
    """(T, 2 N, 3) places of a file's joints and end sites -> (T, 25, 3) Kinect joints."""
    rows = _rows(path, joints)
    out = np.empty((len(places), len(J), 3))
    for name, row in rows.items():
        out[:, J[name]] = places[:, row]
    # The end of a head's bone is its crown: the middle of the skull lies half way.
    out[:, J["head"]] = (places[:, rows["head"]] + places[:, len(joints) + rows["head"]]) / 2
    out[:, J["spine_base"]] = (out[:, J["hip_left"]] + out[:, J["hip_right"]]) / 2
    between = (out[:, J["shoulder_left"]] + out[:, J["shoulder_right"]]) / 2
    above_m = SPINE_ABOVE_SHOULDERS * float(np.median(_leg_m(out))) / LEG_SHARE
    out[:, J["spine_shoulder"]] = between + above_m * unit(out[:, J["neck"]] - out[:, J["spine_mid"]])
    for side in SIDES:
        wrist, elbow = out[:, J[f"wrist_{side}"]], out[:, J[f"elbow_{side}"]]
        forearm = wrist - elbow
        if f"hand_tip_{side}" not in rows:
            out[:, J[f"hand_tip_{side}"]] = wrist + forearm * (anatomy.HAND / anatomy.FOREARM)
        tip = out[:, J[f"hand_tip_{side}"]]
        out[:, J[f"hand_{side}"]] = wrist + (anatomy.PALM / anatomy.HAND) * (tip - wrist)
        if f"thumb_{side}" not in rows:
            across = out[:, J["shoulder_right"]] - out[:, J["shoulder_left"]]
            inward = unit(across) * (1.0 if side == "left" else -1.0)
            size = np.sqrt(np.sum(forearm**2, axis=1, keepdims=True)) / anatomy.FOREARM
            along, aside = anatomy.THUMB
            out[:, J[f"thumb_{side}"]] = wrist + size * (along * unit(tip - wrist) + aside * inward)
    return out


def _rows(path: Path, joints: list[_Joint]) -> dict[str, int]:
    """The row of each Kinect joint that a file has, by the family of names that fits."""
    known = {"".join(c for c in joint.name.lower().split(":")[-1] if c.isalnum()): k for k, joint in enumerate(joints)}
    missing: list[list[str]] = []
    for family in FAMILIES:
        rows, absent = {}, []
        for target, names in family.items():
            for side in ("",) if target in MIDDLE else SIDES:
                wanted = [prefix + name for name in names for prefix in SIDE_PREFIX.get(side, ("",))]
                found = [known[name] for name in wanted if name in known]
                if found:
                    rows[f"{target}_{side}".rstrip("_")] = found[0]
                elif target not in OPTIONAL:
                    absent.append(wanted[0])
        if not absent:
            return rows
        missing.append(absent)
    fewest = min(missing, key=len)
    raise DataError(f"{path}: no joint named like {', '.join(fewest)}; expected names as CMU, Mixamo or Xsens use them")
