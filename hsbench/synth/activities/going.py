"""A person comes in by the entrance door, goes out for a while, and comes back; nobody is in the way of the leaf."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import Activity
from hsbench.synth.activities.diary import Diary
from hsbench.synth.activities.entrance import OPEN_S, SHUT_S, Entrance
from hsbench.synth.activities.schedule import duration_s
from hsbench.synth.activities.standing import towards
from hsbench.synth.activities.traffic import Way
from hsbench.synth.people.channels import Channels, concatenate, standing
from hsbench.synth.people.motion import walk
from hsbench.typing import FloatArray

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

AWAY_SLICE_S = 20.0  # absence passes in pieces
TRY_AGAIN_S = 1.0


def come_in(person: Person, entrance: Entrance) -> bool:
    """Open the door, walk in and shut it, if nobody is in the way; the first thing one does."""
    start = _outside(person, entrance)
    diary = Diary(person.diary.begin, start)
    return _pass(person, entrance, diary, start, entrance.way, "enter")


def go_out(person: Person, activity: Activity) -> Steps:
    """Leave by the entrance, stay away for a while, and come back."""
    entrance, traffic, fps = person.places.entrance, person.traffic, person.fps
    if entrance is None:
        return "no door opens"
    inside = entrance.way[-1]
    reason = yield from person.walk_to(inside, towards(inside, entrance.way[-2]), np.stack([inside] * 2))
    if reason:
        return reason
    if not _pass(person, entrance, person.diary, person.diary.here, entrance.way[::-1], "leave"):
        return "somebody is in the way of the door"
    yield
    diary = person.diary
    traffic.leave(person.number)
    outside, first = _outside(person, entrance), diary.frame
    end = first + round(duration_s(activity, person.habits, person.rng) * fps)
    while diary.frame < end:
        diary.add(outside.hold(min(end - diary.frame, round(AWAY_SLICE_S * fps))), Action.IGNORED)
        diary.away.append((first, diary.frame))
        yield
    while not _pass(person, entrance, diary, outside, entrance.way, "enter"):
        traffic.awaited = Way(entrance.way, entrance.swept)
        diary.add(outside.hold(round(TRY_AGAIN_S * fps)), Action.IGNORED)
        diary.away.append((end, diary.frame))
        yield
    traffic.awaited = None
    yield
    return ""


def _outside(person: Person, entrance: Entrance) -> Channels:
    """Standing before the shut door."""
    outside = entrance.way[0]
    return standing(person.body, outside, towards(outside, entrance.way[1]))


def _pass(person: Person, entrance: Entrance, diary: Diary, start: Channels, way: FloatArray, name: str) -> bool:
    """Open the door, walk over a way (n, 2) and shut it behind oneself, from the frame ``start``; False, and nothing is
    done, if somebody is in the way.
    """
    fps, traffic, number, begin = person.fps, person.traffic, person.number, diary.frame - 1
    opening = start.hold(round(OPEN_S * fps))
    chunk = concatenate([opening, walk(person.body, opening, way, None, person.config.speed_m_s[0], fps)])
    rest = np.stack([way[-1]] * 2)
    if traffic.is_away(entrance.object_id, begin) or not traffic.can_move(number, entrance.swept, begin):
        return False
    if traffic.taken(number, rest) or traffic.conflict(number, begin, chunk.xy, rest):
        return False
    shut = begin + 1 + len(chunk) + round(SHUT_S * fps)
    traffic.go(number, begin, chunk.xy, rest)
    traffic.lend(number, entrance.object_id, entrance.swept, begin, shut + 1)
    person.diary = diary
    doing = diary.start(name, entrance.object_id)
    diary.add(chunk, Action.STAND)
    diary.stop(doing)
    keys = ((begin, 0.0), (begin + len(opening), 1.0), (diary.frame - 1, 1.0), (shut, 0.0))
    for frame, share in keys:
        diary.shifts += entrance.shifts(frame, share)
    person.remember(chunk.xy)
    return True
