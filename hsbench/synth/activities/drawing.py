"""Chairs are drawn back to be sat on, in with whoever sits on them, out again, and put back where they were.

A hand draws them by their highest part where it gets there.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.states import Action
from hsbench.synth.activities.diary import Shift
from hsbench.synth.activities.seats import Seat, Surface, facing_chair
from hsbench.synth.activities.touches import moved_touch, reach_out
from hsbench.synth.people.motion import scoot, stand, walk
from hsbench.synth.people.timing import frames_of, shares_of, smooth
from hsbench.typing import FloatArray

if TYPE_CHECKING:
    from hsbench.synth.activities.person import Person

REACH_S = 0.7
DRAW_S, DRAW_PER_M_S = 0.6, 1.5  # seconds, and seconds more for each metre
SCOOT_S, SCOOT_PER_M_S = 0.6, 2.0
KEY_FRAMES = 3  # between two key poses of a chair
WAIT_S = 1.0
PATIENCE_S = 4.0


def draw_chair(person: Person, surface: Surface, seat: Seat) -> Generator[None, None, bool]:
    """Draw a seat back to where it is got to; False if somebody is in its way for too long."""
    diary, traffic = person.diary, person.traffic
    shifts = (np.array(seat.entry_xy), np.array(seat.shift_xy))
    taken = np.any([person.places.setting(surface.item, shift).taken for shift in shifts], axis=0)
    for _ in range(round(PATIENCE_S / WAIT_S)):
        if traffic.can_move(person.number, taken, diary.frame):
            break
        yield from person.wait(WAIT_S)
    else:
        return False
    traffic.move(surface.item.object_id, taken, diary.frame)
    _drag(person, surface, seat, "draw_back", np.zeros(2), shifts[0])
    yield
    return True


def put_back(person: Person, surface: Surface, seat: Seat) -> Generator[None, None, None]:
    """Put a seat back to where it was."""
    _drag(person, surface, seat, "put_back", np.array(seat.entry_xy), np.zeros(2))
    person.traffic.move_back(surface.item.object_id, person.diary.frame)
    yield


def draw_in(person: Person, surface: Surface, seat: Seat, inwards: bool) -> None:
    """Slide with a seat from where one got onto it to where one sits, or back."""
    start, end = np.array(seat.entry_xy), np.array(seat.shift_xy)
    if not inwards:
        start, end = end, start
    length_m = float(np.sqrt(np.sum((end - start) ** 2)))
    if length_m == 0:
        return
    length_s = SCOOT_S + SCOOT_PER_M_S * length_m
    log_shifts(person, surface, start, end, frames_of(length_s, person.fps))
    person.diary.add(scoot(person.diary.here, end - start, length_s, person.fps), Action.IGNORED)


def _drag(person: Person, surface: Surface, seat: Seat, name: str, start_xy: FloatArray, end_xy: FloatArray) -> None:
    diary, fps, item = person.diary, person.fps, surface.item
    diary.add(walk(person.body, diary.here, diary.here.xy, facing_chair(surface, seat), 1.0, fps), Action.STAND)
    grip = person.places.grip(surface, seat, person.body, person.hand)
    length_s = DRAW_S + DRAW_PER_M_S * float(np.sqrt(np.sum((end_xy - start_xy) ** 2)))
    rest = diary.here
    if grip is not None:
        out = reach_out(rest, moved_touch(grip, start_xy), REACH_S, fps)
        diary.add(out, Action.STAND)
        doing = diary.start(name, item.object_id, grip.part, grip.contact)
    else:
        doing = diary.start(name, item.object_id)
    log_shifts(person, surface, start_xy, end_xy, frames_of(length_s, fps))
    if grip is not None:
        along = replace(moved_touch(grip, end_xy), crouch_m=0.0)  # one has gone down already
        diary.add(reach_out(out, along, length_s, fps), Action.STAND)
        diary.stop(doing)
        diary.add(reach_out(rest, moved_touch(grip, end_xy), REACH_S, fps).backwards(), Action.STAND)
    else:
        diary.add(stand(rest, length_s, fps), Action.STAND)
        diary.stop(doing)


def log_shifts(person: Person, surface: Surface, start_xy: FloatArray, end_xy: FloatArray, frames: int) -> None:
    """Key poses of a seat that goes from one shift to another while ``frames`` are done, as bodies go."""
    turn = surface.item.scene_T_object[:2, :2]
    share = np.append(0.0, smooth(shares_of(frames / person.fps, person.fps)))
    first = person.diary.frame - 1
    for row in sorted({*range(0, frames, KEY_FRAMES), frames}):
        x, y = quantise_m((start_xy + share[row] * (end_xy - start_xy)) @ turn).tolist()
        person.diary.shifts.append(Shift(first + row, surface.item.object_id, "", (x, y, 0.0)))
