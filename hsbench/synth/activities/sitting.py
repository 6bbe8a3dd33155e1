"""A person goes to a seat or bed, does there what they came for, and gets up again."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hsbench.geometry.numerics import quantise_angle
from hsbench.schema.scene import SceneObject
from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import SIT, Activity
from hsbench.synth.activities.diary import Undone
from hsbench.synth.activities.drawing import draw_chair, draw_in, put_back
from hsbench.synth.activities.places import Touchable
from hsbench.synth.activities.schedule import duration_s
from hsbench.synth.activities.seats import Seat, Surface, facing_chair, sit_on, step_in, step_out
from hsbench.synth.activities.spots import try_all
from hsbench.synth.activities.touches import Touch, seated_touch
from hsbench.synth.activities.touching import HOLD_S, REACH_S, use
from hsbench.synth.people.channels import Channels
from hsbench.synth.people.lying import LiePose, lie_down
from hsbench.synth.people.motion import stand

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person, Steps

NO_SEAT = -1  # no object's id
PAUSE_S = 0.4  # before one sits down, and after one gets up
LIE_DOWN_S = 3.0
MOMENT_S = 1.0


def sit_somewhere(person: Person, activity: Activity, surfaces: Sequence[Surface]) -> Steps:
    """Walk to a seat, draw it back if need be, sit, do what one came for, and get up."""
    reason = "there is no such seat"
    for surface in person.shuffled(surfaces):
        if person.is_lain_on(surface.item):
            reason = "somebody lies there"
            continue
        seat = person.places.seat(surface, person.body, person.rng)
        if seat is None:
            reason = "the body does not fit"
            person.unfit.add(id(surface))
            continue
        if not person.has_room(seat, activity):
            reason = "there is no room beside the others"
            continue
        length_s = person.length_s(activity, person.config.sit_s)
        reason = yield from person.walk_to(np.array(seat.approach_xy), _arrival(surface, seat), seat.line)
        if not reason:
            person.places.tried.add((seat.object_id, seat.part))
            yield from _sit_on(person, activity, surface, seat, length_s)
            return ""
    return reason


def lie_somewhere(person: Person, activity: Activity) -> Steps:
    """Sit down on the edge of a bed or sofa, lie for a while, and get up again."""
    reason = "there is nothing to lie on"
    for surface in person.shuffled(person.places.seats_for(activity)):
        if person.is_lain_on(surface.item):
            reason = "somebody lies there"
            continue
        found = person.places.lying(surface, person.body, person.rng)
        if found is None:
            reason = "the body does not fit"
            continue
        seat, lie = found
        reason = yield from person.walk_to(np.array(seat.approach_xy), _arrival(surface, seat), seat.line)
        if not reason:
            yield from _lie_on(person, activity, surface, seat, lie)
            return ""
    return reason


def _arrival(surface: Surface, seat: Seat) -> float | None:
    """Heading in which one comes to a seat."""
    if seat.is_drawn:
        return facing_chair(surface, seat)
    away = np.array(seat.stand_xy) - seat.approach_xy
    turns = away.any() and not seat.is_sidled
    return quantise_angle(float(np.arctan2(away[1], away[0]))) if turns else seat.pose.yaw_rad


def _sit_on(
    person: Person, activity: Activity, surface: Surface, seat: Seat, length_s: float
) -> Generator[None, None, None]:
    diary = person.diary
    if seat.is_drawn and not (yield from draw_chair(person, surface, seat)):
        diary.undone.append(Undone(diary.frame, activity.name, "somebody is in the way of the chair"))
        person.stand_free()
        return
    anchors = person.places.anchors(surface, activity) if activity.near else []
    anchor = anchors[0] if anchors else surface.item
    whole = diary.start(activity.name, anchor.object_id) if activity is not SIT else None
    person.is_at(activity, anchor.object_id, length_s, seat)
    down = yield from _sit_down(person, surface, seat)
    person.used_id = seat.object_id
    person.obstacles = person.places.setting(surface.item, np.array(seat.shift_xy)).obstacles
    sitting = diary.start("sit", seat.object_id, seat.part, "pelvis")
    end = diary.frame + round(length_s * person.fps)
    if activity is SIT:
        yield from _touch_about(person, end)
        if person.config.mode == "exploring":
            yield from try_all(person, surface, seat, diary.frame + round(length_s * person.fps))
    ease = None if activity.is_at_table else person.at_ease(surface, seat)
    if ease is not None:
        diary.add(ease, Action.SIT)
    if activity.gesture:
        yield from _busy(person, activity, anchors, end)
    yield from person.hold(max((end - diary.frame) / person.fps, MOMENT_S), Action.SIT)
    if ease is not None:
        diary.add(ease.backwards(), Action.SIT)
    diary.stop(sitting)
    person.used_id, person.obstacles = NO_SEAT, person.places.obstacles
    yield from _get_up(person, surface, seat, down)
    if whole is not None:
        diary.stop(whole)
    if seat.is_drawn:
        yield from put_back(person, surface, seat)
    person.stand_free()


def _sit_down(person: Person, surface: Surface, seat: Seat) -> Generator[None, None, Channels]:
    """Sit down, and draw the seat in; returns the motion onto the seat."""
    diary = person.diary
    if seat.stand_xy != seat.approach_xy or seat.is_drawn:
        diary.add(step_in(person.body, diary.here, seat, person.fps), Action.STAND)
    diary.add(stand(diary.here, PAUSE_S, person.fps), Action.STAND)
    down = sit_on(diary.here, seat, person.fps)
    doing = diary.start("sit_down", seat.object_id, seat.part)
    diary.add(down, Action.IGNORED)
    draw_in(person, surface, seat, inwards=True)
    diary.stop(doing)
    yield
    return down


def _get_up(person: Person, surface: Surface, seat: Seat, down: Channels) -> Generator[None, None, None]:
    diary = person.diary
    doing = diary.start("stand_up", seat.object_id, seat.part)
    draw_in(person, surface, seat, inwards=False)
    diary.add(down.backwards(), Action.IGNORED)
    diary.stop(doing)
    diary.add(stand(diary.here, PAUSE_S, person.fps), Action.STAND)
    if seat.stand_xy != seat.approach_xy:
        diary.add(step_out(person.body, diary.here, seat, person.fps), Action.STAND)
    yield


def _touch_about(person: Person, end: int) -> Generator[None, None, None]:
    """Touch what is near while seated, a few times at most."""
    for _ in range(person.config.touches_seated):
        found = _seated_touch(person, person.places.touchables, person.ways(SIT))
        if found is not None and person.diary.frame < end:
            yield from person.hold(person.draw(person.config.stand_s), Action.SIT)
            yield from use(person, *found, person.draw(person.config.touch_s), "", Action.SIT)


def _busy(person: Person, activity: Activity, anchors: list[SceneObject], end: int) -> Generator[None, None, None]:
    """The gesture of an activity until a frame, with hands on the table where that is part of it."""
    found = None
    if activity.hands:
        tops = [thing for thing in person.places.touchables if thing[0] in anchors and thing[1].role == "top"]
        found = _seated_touch(person, tops, person.ways(activity))
    left_s = (end - person.diary.frame) / person.fps - 2 * (REACH_S + HOLD_S)
    if found is not None and left_s > 0:
        yield from use(person, *found, left_s, activity.gesture, Action.SIT)
    else:
        yield from person.gesture(activity.gesture, max(left_s, MOMENT_S), Action.SIT)


def _seated_touch(
    person: Person, things: Sequence[Touchable], ways: tuple[tuple[int, ...], ...]
) -> tuple[Touchable, Touch] | None:
    """A part in reach from where one sits, and how it is touched."""
    here = person.diary.here
    for k in person.rng.permutation(len(things)).tolist():
        points = person.places.points(things[k])
        for p in person.rng.permutation(len(points)).tolist():
            item, part = things[k]
            touch = seated_touch(
                item, part, points[p][0], here, person.body, person.obstacles, person.used_id, ways
            )  # fmt: skip
            if touch is not None:
                return things[k], touch
    return None


def _lie_on(
    person: Person, activity: Activity, surface: Surface, seat: Seat, lie: LiePose
) -> Generator[None, None, None]:
    diary = person.diary
    length_s = duration_s(activity, person.habits, person.rng)
    person.is_at(activity, seat.object_id, length_s)
    down = yield from _sit_down(person, surface, seat)
    yield from _sit_a_moment(person, seat)
    back = lie_down(diary.here, lie, LIE_DOWN_S, person.fps)
    diary.add(back, Action.IGNORED)
    doing = diary.start(activity.name, seat.object_id, seat.part, "back")
    yield from person.hold(length_s, Action.IGNORED)
    diary.stop(doing)
    diary.add(back.backwards(), Action.IGNORED)
    yield
    yield from _sit_a_moment(person, seat)
    yield from _get_up(person, surface, seat, down)
    person.stand_free()


def _sit_a_moment(person: Person, seat: Seat) -> Generator[None, None, None]:
    sitting = person.diary.start("sit", seat.object_id, seat.part, "pelvis")
    yield from person.hold(MOMENT_S, Action.SIT)
    person.diary.stop(sitting)
