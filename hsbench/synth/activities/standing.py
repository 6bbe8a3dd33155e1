"""What a person does on their feet: wander, stand, talk to somebody, look at things and care for them."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import EXPLORE, Activity
from hsbench.synth.activities.schedule import duration_s
from hsbench.synth.activities.traffic import is_bottleneck
from hsbench.synth.people.channels import Channels, standing
from hsbench.synth.people.gestures import gesture
from hsbench.synth.people.motion import walk
from hsbench.synth.people.navigation import nearest_free
from hsbench.typing import FloatArray

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

ROOMY_DRAWN = 8  # places tried for a gesture that finds no room
UNSEEN_DRAWN = 3  # unexplored places drawn; the nearest is gone to
TRIES = 4  # places tried beside somebody
TURN_RAD = 1.2  # most one turns while pausing
CORNER_M2 = 1.0  # whoever stands parts no more floor than this from the rest
TALK_M = (0.9, 1.6)  # between two who talk
TALK_LEFT_S = 12.0  # whoever is talked to stays at least so long
LEAST_S = {"talk": 1.0, "beside": 3.0}  # gestures are no shorter


def wander(person: Person, activity: Activity) -> Steps:
    """Walk to a place drawn from the floor, mostly where one has not been; stop there a while."""
    floor = person.places.floor
    unseen = np.argwhere(floor.free & ~person.seen)
    cells = unseen if len(unseen) and activity is EXPLORE else np.argwhere(floor.free)
    drawn = cells[person.rng.integers(len(cells), size=UNSEEN_DRAWN)]
    goals = floor.origin_xy + (drawn + 0.5) * floor.cell_m
    away = np.round(np.sum((goals - person.diary.here.xy) ** 2, axis=1), 6)
    reason = "everywhere one would stand in the way"
    for k in np.argsort(away, kind="stable") if activity is EXPLORE else range(UNSEEN_DRAWN):
        if person.config.people > 1 and _is_bottleneck(person, goals[k]):
            continue
        reason = yield from person.walk_to(
            goals[k], None, np.stack([goals[k]] * 2), "explore" if activity is EXPLORE else "walk"
        )
        if not reason:
            yield from _pause(person)
            return ""
    return reason


def stand_about(person: Person, activity: Activity) -> Steps:
    """Stay where one is, with a gesture or without; or go to where there is room for it first."""
    if activity.gesture and not _has_room(person, activity.gesture, person.diary.here):
        reason = yield from _to_where_is_room(person, activity.gesture)
        if reason:
            return reason
    elif person.config.people > 1 and _is_bottleneck(person, person.diary.here.xy[0]):
        return "one would stand in the way"
    length_s = person.length_s(activity, person.config.stand_s)
    doing = person.diary.start(activity.name)
    person.is_at(activity, 0, length_s)
    if activity.gesture:
        yield from person.gesture(activity.gesture, length_s, Action.STAND)
    else:
        yield from person.hold(length_s, Action.STAND)
    person.diary.stop(doing)
    return ""


def _to_where_is_room(person: Person, kind: str) -> Steps:
    """Walk to the nearest of some places drawn from the floor where a gesture runs into nothing."""
    here, floor = person.diary.here.xy[0], person.places.floor
    cells = np.argwhere(floor.free)
    goals = floor.origin_xy + (cells[person.rng.integers(len(cells), size=ROOMY_DRAWN)] + 0.5) * floor.cell_m
    away = np.round(np.sum((goals - here) ** 2, axis=1), 6)
    reason = "there is no room for it"
    for goal in goals[np.argsort(away, kind="stable")]:
        if person.config.people > 1 and _is_bottleneck(person, goal):
            continue
        yaw = towards(here, goal)
        if _has_room(person, kind, standing(person.body, goal, yaw)):
            reason = yield from person.walk_to(goal, yaw, np.stack([goal, goal]))
            if not reason:
                return ""
    return reason


def _has_room(person: Person, kind: str, start: Channels) -> bool:
    return person.is_clear(gesture(start, kind, LEAST_S["beside"], person.fps, person.rng))


def talk(person: Person, activity: Activity) -> Steps:
    """Go to somebody who is at rest, and talk."""
    others = [
        other
        for other, present in sorted(person.company.items())
        if other != person.number and person.left_s(present) > TALK_LEFT_S and present.activity.how != "lie"
    ]
    reason = "nobody to talk to"
    for other in person.rng.permutation(others).astype(int).tolist():
        line = person.traffic.plans[other][-1].rest
        where = line[1] if person.company[other].activity.how == "sit" else line[0]
        goal = _beside_whom(person, where)
        if goal is None:
            reason = f"no room beside person {other + 1}"
            continue
        length_s = min(duration_s(activity, person.habits, person.rng), person.left_s(person.company[other]))
        reason = yield from person.walk_to(goal, towards(goal, where), np.stack([goal, goal]))
        if not reason:
            person.is_at(activity, 0, length_s)
            doing = person.diary.start(activity.name)
            yield from person.gesture(activity.gesture, max(length_s, LEAST_S["talk"]), Action.STAND)
            person.diary.stop(doing)
            return ""
    return reason


def stand_beside(person: Person, activity: Activity) -> Steps:
    """Stand by a thing and look at it."""
    things = person.places.things_for(activity)
    reason = "there is none"
    for item in person.shuffled(things):
        middle = quantise_m(item.box[:2])
        cell = nearest_free(person.places.floor, middle, activity.within_m)
        if cell is None:
            reason = "one does not get near"
            continue
        goal = cell[0]
        reason = yield from person.walk_to(goal, towards(goal, middle), np.stack([goal, goal]))
        if not reason:
            length_s = person.length_s(activity, person.config.look_s)
            person.is_at(activity, item.object_id, length_s)
            doing = person.diary.start("look" if not activity.gesture else activity.name, item.object_id)
            if activity.gesture:
                yield from person.gesture(activity.gesture, max(length_s, LEAST_S["beside"]), Action.STAND)
            else:
                yield from person.hold(length_s, Action.STAND)
            person.diary.stop(doing)
            return ""
    return reason


def _pause(person: Person) -> Generator[None, None, None]:
    here = person.diary.here
    if person.rng.random() < 0.5:
        turned = float(here.yaw[0]) + quantise_angle(float(person.rng.uniform(-TURN_RAD, TURN_RAD)))
        person.diary.add(walk(person.body, here, here.xy, turned, 1.0, person.fps), Action.STAND)
    doing = person.diary.start("stand")
    yield from person.hold(person.draw(person.config.stand_s), Action.STAND)
    person.diary.stop(doing)


def _is_bottleneck(person: Person, xy: FloatArray) -> bool:
    floor = person.places.floor
    return is_bottleneck(floor, floor.free, xy, round(CORNER_M2 / floor.cell_m**2))


def _beside_whom(person: Person, where_xy: FloatArray) -> FloatArray | None:
    """(2,) a free cell at the distance of a talk, in the same room; the first of some drawn."""
    floor, scene = person.places.floor, person.places.scene
    centres = floor.centres()[floor.free]
    away = np.round(np.sqrt(np.sum((centres - where_xy) ** 2, axis=1)), 6)
    ring = centres[(away >= TALK_M[0]) & (away <= TALK_M[1])]
    room = scene.room_at(where_xy)
    for k in person.rng.permutation(len(ring))[:TRIES].tolist():
        if scene.room_at(ring[k]) is room and not _is_bottleneck(person, ring[k]):
            return ring[k]
    return None


def towards(xy: FloatArray, goal_xy: FloatArray) -> float:
    """Heading from a point (2,) to another."""
    return quantise_angle(float(np.arctan2(goal_xy[1] - xy[1], goal_xy[0] - xy[0])))
