"""One person: chooses what to do next, goes there without meeting anybody, does it, and writes it down.

Each way of doing something is a generator that yields whenever time has passed, so that people take turns: whoever is
free first goes on. Until its first yield nothing has been done.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import SceneObject
from hsbench.schema.states import Action
from hsbench.synth.activities.catalogue import CATALOGUE, EXPLORE, LOOK, SIT, TOUCH, Activity
from hsbench.synth.activities.clips import PLAY, play
from hsbench.synth.activities.config import LifeConfig, Range
from hsbench.synth.activities.contact import body_depth
from hsbench.synth.activities.diary import Diary, Undone, rows_of
from hsbench.synth.activities.fetching import fetch
from hsbench.synth.activities.going import go_out
from hsbench.synth.activities.lounging import at_ease
from hsbench.synth.activities.places import Places
from hsbench.synth.activities.schedule import HABITS, Quota, duration_s, weights
from hsbench.synth.activities.seats import Seat, Surface, is_over
from hsbench.synth.activities.sitting import NO_SEAT, lie_somewhere, sit_somewhere
from hsbench.synth.activities.spots import is_tried
from hsbench.synth.activities.standing import stand_about, stand_beside, talk, wander
from hsbench.synth.activities.touching import touch_something
from hsbench.synth.activities.traffic import Traffic, are_apart, without_lines
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import Channels, Idle, pose_block, standing
from hsbench.synth.people.gestures import gesture
from hsbench.synth.people.motion import carry, shift, stand, walk
from hsbench.synth.people.navigation import costs_from, route_from
from hsbench.synth.seeds import Seeds
from hsbench.truth.revealed import FEET_M
from hsbench.typing import FloatArray, UInt8Array

SEEN_STRIDE_S = 0.15  # of a walk, a place every so long explores
TRIES = 4  # places tried for an activity
ACTIVITIES_TRIED = 6  # before one waits
DELAYS_S = (0.0, 0.5, 1.0, 2.0, 4.0)  # of a walk that somebody is in the way of
WAIT_S = 1.0
SLICE_S = 20.0  # what takes longer is done in pieces
SETTLE_S = 6.0  # between two shifts of weight
JOIN_GAIN = 6.0  # how much likelier an activity is that others are at, for so much longer at least:
LEAST_JOINED_S = 20.0
UNTRIED_GAIN = 2.0  # how much likelier one who explores walks, or sits, while there is floor, or a seat, left to try
AGAIN_GAIN = 0.1  # and one that one has just done
FEET_APART_M = 0.25  # of those who sit opposite each other
ELBOWS_M = 0.82  # between the pelvises of neighbours, where one works with the hands
CHECK_FRAMES = 10  # a gesture is tried against furniture every so many frames
GRAZE_M = 0.025
TWO_HANDED = ("type",)

Steps = Generator[None, None, str]
"""Yields when time has passed; returns why nothing was done, "" if it was."""


@dataclass(frozen=True)
class Present:
    """What somebody is doing: activity, the object it is about (0: none), until which frame, and on which seat."""

    activity: Activity
    anchor: int
    until: int
    seat: Seat | None = None


class Person:
    """Number 0, 1, ...; comes in at a frame, on a free cell, with a heading. All up to ``config`` is shared."""

    def __init__(
        self, number: int, places: Places, traffic: Traffic, company: dict[int, Present], atypical: Quota,
        config: LifeConfig, seeds: Seeds, frame: int, xy: FloatArray, yaw_rad: float,
    ) -> None:  # fmt: skip
        self.number, self.places, self.traffic, self.company, self.config = number, places, traffic, company, config
        self.atypical = atypical
        self.body = Body.sample(seeds.rng("body"))
        self.rng, self.idle = seeds.rng("plan"), Idle.sample(seeds.rng("idle"))
        self.habits = HABITS[config.habits[number % len(config.habits)]]
        self.hand = self.body.style.hand
        self.used_id, self.obstacles = NO_SEAT, places.obstacles
        self.diary = Diary(frame, standing(self.body, xy, yaw_rad))
        self.seen = np.zeros_like(places.floor.free)
        self.unfit: set[int] = set()  # surfaces on which there was no room for this body
        self.room: dict[int, UInt8Array] = {}  # of the spots of others, as ``spots.room`` finds it
        self.counted = 0  # of the contacts so far, by ``atypical``
        self.last = EXPLORE
        self.remember(xy[None])

    def live(self) -> Iterator[None]:
        """Does one thing after another; yields whenever time has passed."""
        natural, clips = self.config.mode == "natural", (PLAY,) if self.config.clips else ()
        if not natural:
            yield from wander(self, EXPLORE)
        while True:
            before = self.diary.frame
            yield from self._next((*CATALOGUE, *clips) if natural else (EXPLORE, SIT, TOUCH, LOOK))
            if self.diary.frame == before:
                yield from self.wait(WAIT_S)

    @property
    def fps(self) -> int:
        """Frames a second."""
        return self.config.fps

    def _next(self, activities: Sequence[Activity]) -> Generator[None, None, None]:
        """Do the first of some activities, drawn in turn, that can be done; before them what is atypical and due."""
        self.atypical.contacts += self.diary.contacts - self.counted
        self.counted = self.diary.contacts
        if self.atypical.is_due:
            reason = yield from sit_somewhere(self, SIT, self.places.odd_seats(self.rng))
            if not reason:
                self.atypical.fill()
                return
            self.diary.undone.append(Undone(self.diary.frame, SIT.name, reason))
        likely = self._weights(activities)
        for _ in range(ACTIVITIES_TRIED):
            if not likely.any():
                return
            edges = np.cumsum(likely)
            choice = int(np.searchsorted(edges, self.rng.random() * edges[-1], side="right"))
            activity = activities[choice]
            reason = yield from self._do(activity)
            if not reason:
                self.last = activity
                return
            self.diary.undone.append(Undone(self.diary.frame, activity.name, reason))
            likely[choice] = 0.0

    def _weights(self, activities: Sequence[Activity]) -> FloatArray:
        config = self.config
        if config.mode == "exploring":
            floor = UNTRIED_GAIN if (self.places.floor.free & ~self.seen).any() else 1.0
            seats = 1.0 if all(is_tried(self, surface) for surface in self.places.surfaces) else UNTRIED_GAIN
            return np.array([floor * config.explore, seats * config.sit, config.touch, config.look])
        hour = (config.start_hour + self.diary.frame / self.fps / 3600) % 24
        likely = weights(activities, hour, self.habits)
        likely[[not self.places.offers(activity) for activity in activities]] = 0.0
        for other, present in self.company.items():
            if other != self.number and present.activity.social and self.left_s(present) > LEAST_JOINED_S:
                likely[[a.name == present.activity.name for a in activities]] *= JOIN_GAIN
        likely[[a is self.last for a in activities]] *= AGAIN_GAIN
        return likely

    def _do(self, activity: Activity) -> Steps:
        self.company.pop(self.number, None)
        match activity.how:
            case "sit":
                steps = sit_somewhere(self, activity, self.places.seats_for(activity))
            case "lie":
                steps = lie_somewhere(self, activity)
            case "touch":
                steps = touch_something(self, activity)
            case "beside":
                steps = stand_beside(self, activity)
            case "fetch":
                steps = fetch(self, activity)
            case "leave":
                steps = go_out(self, activity)
            case "clip":
                steps = play(self, activity)
            case "talk":
                steps = talk(self, activity)
            case "stand":
                steps = stand_about(self, activity)
            case _:
                steps = wander(self, activity)
        return (yield from steps)

    # Where one is and how one gets on.

    def draw(self, seconds: Range) -> float:
        """A duration from a range."""
        return float(quantise_m(self.rng.uniform(*seconds)))

    def length_s(self, activity: Activity, exploring: Range) -> float:
        """How long an activity lasts, seconds: from a range in the exploring mode."""
        return (
            self.draw(exploring)
            if activity in (EXPLORE, SIT, TOUCH, LOOK)
            else duration_s(activity, self.habits, self.rng)
        )

    def left_s(self, present: Present) -> float:
        """How much longer somebody does what they do, seconds."""
        return (present.until - self.diary.frame) / self.fps

    def point(self) -> FloatArray:
        """(2, 2) what one takes up who just stands."""
        xy = self.diary.here.xy[0]
        return np.stack([xy, xy])

    def walk_to(self, goal_xy: FloatArray, yaw_rad: float | None, line: FloatArray, name: str = "walk") -> Steps:
        """Walk to a place and take up a line (2, 2) there; waits for others, or goes round them."""
        diary, reason = self.diary, self.traffic.refusal(self.number, line)
        if reason:
            return reason
        reason = "no way leads there"
        here = diary.here
        speed = self.draw(self.config.speed_m_s)
        for way in self._ways(here.xy[0], goal_xy):
            chunk = walk(self.body, here, way, yaw_rad, speed, self.fps)
            chunk = carry(chunk, 1.0) if name == "carry" else chunk
            for delay_s in DELAYS_S:
                start = diary.frame + round(delay_s * self.fps)
                reason = self.traffic.conflict(self.number, start, chunk.xy, line)
                if not reason:
                    break
            if not reason:
                if start > diary.frame:
                    waiting = diary.start("wait")
                    diary.add(here.hold(start - diary.frame), Action.STAND)
                    diary.stop(waiting)
                self.traffic.go(self.number, start, chunk.xy, line)
                doing = diary.start(name)
                diary.add(chunk, Action.STAND)
                diary.stop(doing)
                self.remember(chunk.xy)
                yield
                return ""
        return reason

    def _ways(self, start_xy: FloatArray, goal_xy: FloatArray) -> Iterator[FloatArray]:
        """Routes (n, 2): the shortest, and one that keeps clear of all who are at rest."""
        floor = self.traffic.open_floor()
        way = route_from(floor, costs_from(floor, start_xy), start_xy, goal_xy)
        if way is None:
            return
        yield way
        lines = self.traffic.rests(self.number)
        if lines:
            clear = without_lines(floor, lines)
            around = route_from(clear, costs_from(clear, start_xy), start_xy, goal_xy)
            if around is not None:
                yield around

    def remember(self, xy: FloatArray) -> None:
        """Mark the cells within ``FEET_M`` of the places of a walk (n, 2), one a frame, as explored."""
        floor = self.places.floor
        span = int(FEET_M / floor.cell_m) + 1
        disc = np.add.outer(np.arange(-span, span + 1) ** 2, np.arange(-span, span + 1) ** 2)
        disc = disc * floor.cell_m**2 <= FEET_M**2
        index, inside = floor.index(xy[:: max(1, round(SEEN_STRIDE_S * self.fps))])
        for i, j in np.unique(index[inside], axis=0):
            a, b = max(i - span, 0), max(j - span, 0)
            window = self.seen[a : i + span + 1, b : j + span + 1]
            window |= disc[a - i + span :, b - j + span :][: window.shape[0], : window.shape[1]]

    def hold(self, seconds: float, action: Action) -> Generator[None, None, None]:
        """Stay as one is, in pieces, easing the weight from time to time, unless asked to finish."""
        end = self.diary.frame + round(seconds * self.fps)
        while self.diary.frame < end:
            left_s = (end - self.diary.frame) / self.fps
            chunk = stand(self.diary.here, min(left_s, SETTLE_S), self.fps)
            if left_s > SETTLE_S and self.rng.random() < 0.5 and action != Action.IGNORED:
                moved = shift(self.diary.here, SETTLE_S, self.fps, self.rng)
                chunk = moved if self.is_clear(moved) else chunk
            self.diary.add(chunk, action)
            yield
            if self.traffic.is_asked(self.number):
                return

    def gesture(self, kind: str, seconds: float, action: Action) -> Generator[None, None, None]:
        """A gesture, in pieces, unless asked to finish."""
        end = self.diary.frame + round(seconds * self.fps)
        while self.diary.frame < end:
            left_s = (end - self.diary.frame) / self.fps
            length_s = left_s if left_s < 1.5 * SLICE_S else SLICE_S
            chunk = gesture(self.diary.here, kind, length_s, self.fps, self.rng)
            self.diary.add(chunk if self.is_clear(chunk) else chunk.last().hold(len(chunk)), action)
            yield
            if self.traffic.is_asked(self.number):
                return

    def is_clear(self, chunk: Channels) -> bool:
        """Whether a motion on the spot runs into nothing."""
        joints = pose_block(self.body, rows_of(chunk, slice(None, None, CHECK_FRAMES)), 0, 1.0, None)
        return bool((body_depth(self.obstacles, self.body, joints, self.used_id) <= GRAZE_M).all())

    def at_ease(self, surface: Surface, seat: Seat) -> Channels | None:
        """Leaning back where one sits, if there is a backrest."""
        over = partial(is_over, surface, np.array(seat.shift_xy))
        here, used_id = self.diary.here, self.used_id
        return at_ease(self.body, here, self.obstacles, used_id, self.fps, self.rng, over, among_others=seat.is_drawn)

    def ways(self, activity: Activity) -> tuple[tuple[int, ...], ...]:
        """Hands with which an activity touches things, the preferred first."""
        if activity.hands:
            return ((0, 1),) if activity.gesture in TWO_HANDED else ((self.hand,),)
        return (self.hand,), (1 - self.hand,)

    def wait(self, seconds: float) -> Generator[None, None, None]:
        """Wait for others."""
        doing = self.diary.start("wait")
        yield from self.hold(seconds, Action.STAND)
        self.diary.stop(doing)

    def stand_free(self) -> None:
        """From now on one takes up no more than where one stands."""
        self.traffic.settle(self.number, self.diary.frame, self.point())

    # Choices.

    def is_at(self, activity: Activity, anchor: int, length_s: float, seat: Seat | None = None) -> None:
        """Let the others know what one does, with which object, for how long, and on which seat."""
        self.company[self.number] = Present(activity, anchor, self.diary.frame + round(length_s * self.fps), seat)

    def has_room(self, seat: Seat, activity: Activity) -> bool:
        """Whether the feet of nobody opposite, and the elbows of no neighbour, are where one's own would be."""
        for other, present in self.company.items():
            if other == self.number or present.seat is None:
                continue
            if not are_apart(seat.line, present.seat.line):
                return False
            if np.hypot(*(seat.feet_xy - present.seat.feet_xy)) < FEET_APART_M:
                return False
            beside_m = np.hypot(*np.subtract(seat.pose.pelvis_m, present.seat.pose.pelvis_m)[:2])
            if beside_m < ELBOWS_M and (activity.is_at_table or present.activity.is_at_table):
                return False
        return True

    def is_apart(self, line: FloatArray) -> bool:
        """Whether a line (2, 2) keeps away from those on which others sat down and will get up."""
        seats = (present.seat for other, present in self.company.items() if other != self.number)
        return all(seat is None or are_apart(line, seat.line) for seat in seats)

    def is_lain_on(self, item: SceneObject) -> bool:
        """Whether somebody else lies on an object."""
        return self._is_used(item, "lie")

    def is_sat_at(self, item: SceneObject) -> bool:
        """Whether somebody else sits at an object, with their hands on it maybe."""
        return self._is_used(item, "sit")

    def _is_used(self, item: SceneObject, how: str) -> bool:
        return any(
            present.activity.how == how and present.anchor == item.object_id
            for other, present in self.company.items()
            if other != self.number
        )

    def shuffled(self, things: Sequence[object]) -> list:  # type: ignore[type-arg]
        """Some of the things in random order; in the exploring mode those nobody has tried yet come first."""
        order = self.rng.permutation(len(things)).tolist()
        if self.config.mode == "exploring":
            order.sort(key=lambda k: self._is_tried(things[k]))
        return [things[k] for k in order[:TRIES]]

    def _is_tried(self, thing: object) -> bool:
        """Whether nothing is left to try of a surface, or a thing to touch has been touched."""
        if isinstance(thing, Surface):
            return is_tried(self, thing)
        return isinstance(thing, tuple) and (thing[0].object_id, thing[1].name) in self.places.tried
