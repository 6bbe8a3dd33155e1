"""A person plays a motion-capture clip (``people.bvh``) where there is room for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import cos_sin
from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import Activity
from hsbench.synth.activities.contact import body_depth
from hsbench.synth.activities.diary import Played
from hsbench.synth.people.body import J
from hsbench.synth.people.bvh import Clip, on_body
from hsbench.synth.people.channels import standing
from hsbench.synth.people.timing import smooth
from hsbench.typing import FloatArray

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

PLAY = Activity("play_clip", "clip")
PLACES_TRIED = 12
ASIDE_M = 0.25  # others keep clear of the line from a clip's start to its farthest place, and of so much beside it
BLEND_S = 0.5  # from standing into a clip, and back
GRAZE_M = 0.03  # by which a body may press into what is about it
EVERY_S = 0.2  # of a clip is tried against furniture


def play(person: Person, activity: Activity) -> Steps:
    """Walk to a place with room for a clip, and play it; one goes on from where it ends."""
    clips, floor, fps, rng = person.config.clips, person.places.floor, person.fps, person.rng
    joints = _resampled(person, clips[int(rng.integers(len(clips)))])
    cells = np.argwhere(floor.free)
    reason = "there is no room for the clip"
    for cell in cells[rng.integers(len(cells), size=PLACES_TRIED)]:
        yaw = quantise_angle(float(rng.uniform(-np.pi, np.pi)))
        there = _placed(joints, floor.origin_xy + (cell + 0.5) * floor.cell_m, yaw)
        line = _line(there[:, 0, :2])
        if line is None or not _is_clear(person, there):
            continue
        reason = yield from person.walk_to(there[0, 0, :2], yaw, line)
        if not reason:
            half = len(there) // 2
            person.is_at(activity, 0, len(there) / fps)
            doing = person.diary.start(activity.name)
            ease = np.minimum(np.arange(1, len(there) + 1), np.arange(len(there), 0, -1)) / (BLEND_S * fps)
            person.diary.played.append(Played(person.diary.frame, there, smooth(ease)))
            person.diary.add(person.diary.here.hold(half), Action.STAND)
            after = standing(person.body, there[-1, 0, :2], _heading(there[-1]))
            person.diary.add(after.hold(len(there) - half), Action.STAND)
            person.diary.stop(doing)
            yield
            person.stand_free()
            return ""
    return reason


def _resampled(person: Person, clip: Clip) -> FloatArray:
    """(n, 25, 3) joints of a clip on a person's body at the life's rate, begun at the origin, facing x."""
    joints = on_body(person.body, clip.joints)
    times = np.arange(0.0, (len(joints) - 1) / clip.fps, 1.0 / person.fps) * clip.fps
    low = np.floor(times).astype(np.int64)
    share = (times - low)[:, None, None]
    joints = (1 - share) * joints[low] + share * joints[np.minimum(low + 1, len(joints) - 1)]
    return _turned(joints - np.append(joints[0, 0, :2], 0.0), -_heading(joints[0]))


def _placed(joints: FloatArray, xy: FloatArray, yaw_rad: float) -> FloatArray:
    return quantise_m(_turned(joints, yaw_rad) + np.append(xy, 0.0))


def _turned(joints: FloatArray, yaw_rad: float) -> FloatArray:
    c, s = cos_sin(yaw_rad)
    return np.asarray(joints @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def _heading(joints: FloatArray) -> float:
    """Where the hips of joints (25, 3) face."""
    across = joints[J["hip_left"]] - joints[J["hip_right"]]
    return quantise_angle(float(np.arctan2(-across[0], across[1])))


def _line(places: FloatArray) -> FloatArray | None:
    """(2, 2) from the first place of (n, 2) to the farthest; None if others come too far aside of it."""
    away = places - places[0]
    far = away[int(np.argmax(np.sum(away**2, axis=1)))]
    length2 = max(float(far @ far), 1e-12)
    off = away - np.clip(away @ far / length2, 0.0, 1.0)[:, None] * far
    return np.stack([places[0], places[0] + far]) if float((off**2).sum(axis=1).max()) <= ASIDE_M**2 else None


def _is_clear(person: Person, joints: FloatArray) -> bool:
    """Whether a clip runs into nothing and stays on the floor that can be got to."""
    floor = person.places.floor
    index, inside = floor.index(joints[:, 0, :2])
    if not inside.all() or not floor.free[tuple(index.T)].all():
        return False
    few = joints[:: max(1, round(EVERY_S * person.fps))]
    return bool((body_depth(person.places.obstacles, person.body, few) <= GRAZE_M).all())
