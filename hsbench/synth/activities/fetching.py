"""A person fetches something: takes it from where it is kept, carries it in both hands, and puts it on a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import Activity
from hsbench.synth.activities.diary import Undone
from hsbench.synth.activities.places import Touchable
from hsbench.synth.activities.touching import use

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

PUT_S = 1.0


def fetch(person: Person, activity: Activity) -> Steps:
    """Take something out of a thing and bring it to a top; where that fails, it is told, and nothing was carried."""
    reason = "there is none"
    for thing in person.shuffled(person.places.touchables_for(activity)):
        reason = yield from _go_and_touch(person, activity, thing, person.length_s(activity, person.config.touch_s))
        if not reason:
            tops = [top for top in person.places.tops_for(activity) if top[0] is not thing[0]]
            reason = "there is no table"
            for top in person.shuffled(tops):
                reason = yield from _go_and_touch(person, activity, top, PUT_S, "carry")
                if not reason:
                    return ""
            person.diary.undone.append(Undone(person.diary.frame, activity.name, reason))
            return ""
    return reason


def _go_and_touch(person: Person, activity: Activity, thing: Touchable, length_s: float, name: str = "walk") -> Steps:
    """Walk to where a part can be touched, and touch it."""
    if person.is_sat_at(thing[0]):
        return "somebody sits there"
    found = person.places.touch(thing, person.body, person.ways(activity), person.rng)
    if found is None:
        return "no hand gets there"
    reason = yield from person.walk_to(np.array(found.stand_xy), found.yaw_rad, found.line, name)
    if not reason:
        doing = person.diary.start(activity.name, thing[0].object_id)
        person.is_at(activity, thing[0].object_id, length_s)
        yield from use(person, thing, found.touch, length_s, "", Action.STAND)
        person.diary.stop(doing)
        person.stand_free()
    return reason
