"""A person touches a part of something and takes the hands back; some work there for a while."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import TOUCH, Activity
from hsbench.synth.activities.diary import Undone
from hsbench.synth.activities.mesh_contact import gap_m
from hsbench.synth.activities.places import Touchable
from hsbench.synth.activities.touches import Touch, reach_out
from hsbench.synth.people.channels import OVERLAP_S, Channels, concatenate, pose_block
from hsbench.synth.people.gestures import gesture
from hsbench.synth.people.motion import stand

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

REACH_S = 0.8
HOLD_S = 0.7  # a hand at rest before and after its gesture
WAIT_S = 1.0
SIZES = (1.0, 0.6, 0.3)  # of a gesture, tried in turn
SLICE_S = 20.0  # what takes longer is done in pieces
TOUCH_M = 0.03  # a finger tip farther than this from its part touches nothing


def touch_something(person: Person, activity: Activity) -> Steps:
    """Walk to where a part can be touched, and touch it."""
    reason, places = "there is none", person.places
    for thing in person.shuffled(places.touchables_for(activity)):
        if person.is_sat_at(thing[0]):
            reason = "somebody sits there"
            continue
        found = places.touch(thing, person.body, person.ways(activity), person.rng)
        if found is None:
            reason = "no hand gets there"
            continue
        reason = yield from person.walk_to(np.array(found.stand_xy), found.yaw_rad, found.line)
        if not reason:
            person.places.tried.add((thing[0].object_id, thing[1].name))
            length_s = person.length_s(activity, person.config.touch_s)
            person.is_at(activity, thing[0].object_id, length_s)
            doing = person.diary.start(activity.name, thing[0].object_id) if activity is not TOUCH else None
            if activity.gesture and not activity.hands:
                yield from use(person, thing, found.touch, person.draw(person.config.touch_s), "", Action.STAND)
                yield from person.gesture(activity.gesture, length_s, Action.STAND)
            else:
                yield from use(person, thing, found.touch, length_s, activity.gesture, Action.STAND)
            if doing is not None:
                person.diary.stop(doing)
            person.stand_free()
            return ""
    return reason


def use(
    person: Person, thing: Touchable, touch: Touch, length_s: float, kind: str, otherwise: Action
) -> Generator[None, None, None]:
    """Touch a part and take the hands back; with a gesture, between two moments of rest."""
    diary, fps = person.diary, person.fps
    out = reach_out(diary.here, touch, REACH_S, fps)
    held = stand(out, HOLD_S if kind else length_s, fps)
    if _misses(person, thing, touch, out, diary.frame, held):
        diary.undone.append(Undone(diary.frame, "touch", "the hand would miss"))
        yield from person.hold(WAIT_S, otherwise)
        return
    diary.add(out, otherwise)
    doing = diary.start("touch", touch.object_id, touch.part, touch.contact)
    diary.add(held, Action.INTERACT)
    yield
    lead, end = _lead(person), diary.frame + round(length_s * fps)
    while kind and diary.frame < end and not person.traffic.is_asked(person.number):
        slice_s = min((end - diary.frame) / fps, SLICE_S)
        chunk = _working(person, kind, max(slice_s, WAIT_S))
        away = _misses(person, thing, touch, diary.here.hold(lead), diary.frame - lead, chunk)
        if away:
            diary.stop(doing)
        diary.add(chunk, otherwise if away else Action.INTERACT)
        yield
        if away:  # back where it was
            doing = diary.start("touch", touch.object_id, touch.part, touch.contact)
            diary.add(held.last().hold(round(HOLD_S * fps)), Action.INTERACT)
    diary.stop(doing)
    diary.add(out.backwards(), otherwise)
    yield


def _working(person: Person, kind: str, seconds: float) -> Channels:
    """A gesture as large as there is room for it, or none."""
    here = person.diary.here
    for size in SIZES:
        chunk = gesture(here, kind, seconds, person.fps, person.rng, size)
        if person.is_clear(chunk):
            return chunk
    return stand(here, seconds, person.fps)


def _misses(person: Person, thing: Touchable, touch: Touch, before: Channels, first: int, held: Channels) -> bool:
    """Whether a finger tip is ever too far from its part in the frames ``held``, as posed in the end; they follow the
    frames ``before``, which begin at frame ``first``.
    """
    item, part = thing
    line = concatenate([before, held, held.hold(_lead(person))])
    joints = pose_block(person.body, line, first, person.fps, person.idle)[len(before) :][: len(held)]
    return any(bool((gap_m(item, part, joints[:, tip], 2 * TOUCH_M) > TOUCH_M).any()) for tip in touch.tips)


def _lead(person: Person) -> int:
    return int(np.ceil(OVERLAP_S * person.fps))
