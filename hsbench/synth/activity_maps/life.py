"""A life in the plane: people walk from place to place and stay, as positions over time without bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.schema.states import Action
from hsbench.synth.activity_maps.config import PlanarLifeConfig, Range
from hsbench.synth.activity_maps.places import EXPLORE, SIT, TOUCH, Places, follow, wrist
from hsbench.truth.sittable import SHOULDER_SEATED_M, SHOULDER_STANDING_M
from hsbench.typing import FloatArray, Int32Array, UInt8Array

ELBOW_ROOM_M = 0.4  # a place this near to one that is taken is taken too
TRIES = 4  # kinds of places tried before a person stays where it is
HELD_SHARE = (0.2, 0.9)  # of a sit in which a hand is on a part, where one is


@dataclass(frozen=True, eq=False)
class PlanarLife:
    """P people over T moments, scene frame. body_xy, wrist_xy: (P, T, 2) metres. shoulder_m: (P, T) heights.

    action: (P, T) uint8 of ``Action``. stay: (P, T) int32, a number for each walk and each stay of a life.
    """

    body_xy: FloatArray
    wrist_xy: FloatArray
    shoulder_m: FloatArray
    action: UInt8Array
    stay: Int32Array


def live_in_plane(places: Places, rng: np.random.Generator, config: PlanarLifeConfig) -> PlanarLife:
    """The life of some people among places: who is first free decides next; a place holds one at a time.

    A scene without places has nobody in it.
    """
    people = int(rng.integers(config.people[0], config.people[1] + 1)) if len(places) else 0
    ticks = round(_log_uniform(rng, config.minutes) * 60.0 * config.rate_hz)
    life = PlanarLife(
        np.zeros((people, ticks, 2)),
        np.zeros((people, ticks, 2)),
        np.full((people, ticks), SHOULDER_STANDING_M),
        np.full((people, ticks), Action.STAND, dtype=np.uint8),
        np.zeros((people, ticks), dtype=np.int32),
    )
    if people:
        _Living(places, rng, config, life).run()
    return life


class _Living:
    """The state of a life under way: where and until when each person is, until when each place is taken."""

    def __init__(self, places: Places, rng: np.random.Generator, config: PlanarLifeConfig, life: PlanarLife) -> None:
        self.places, self.rng, self.config, self.life = places, rng, config, life
        self.liking = _liking(places, rng, config.unused_share)
        self.weights = np.cumsum([config.explore, config.sit, config.touch])
        people = len(life.action)
        self.clock = np.zeros(people, dtype=np.int64)
        spots = rng.permutation(np.flatnonzero(places.kind == EXPLORE))
        self.at = np.resize(places.cell[spots], people)
        self.taken = np.zeros(len(places), dtype=np.int64)
        self.pace = rng.uniform(*config.speed_m_s, size=people)
        self.stays = 0

    def run(self) -> None:
        while self.clock.min() < self.life.action.shape[1]:
            self._act(int(self.clock.argmin()))

    def _act(self, person: int) -> None:
        places, config = self.places, self.config
        place, atypical = self._choose(person)
        kind = SIT if atypical else int(places.kind[place])
        length_s = (config.stand_s, config.sit_s, config.touch_s)[kind]
        begin = self._walk(person, place)
        end = min(begin + max(1, round(_log_uniform(self.rng, length_s) * config.rate_hz)), self.life.action.shape[1])
        beside = ((places.body_xy - places.body_xy[place]) ** 2).sum(axis=1) < ELBOW_ROOM_M**2
        self.taken[beside] = self.clock[person] = end
        self.at[person] = places.cell[place]
        self._stay(person, place, kind, begin, end)

    def _choose(self, person: int) -> tuple[int, bool]:
        """A free place that can be walked to, and whether it is sat upon though it is no seat."""
        places, cell = self.places, self.at[person]
        usable = (self.taken <= self.clock[person]) & ((places.toward[:, cell] >= 0) | (places.cell == cell))
        for _ in range(TRIES):
            kind = int(np.searchsorted(self.weights, self.rng.random() * self.weights[-1], side="right"))
            atypical = kind != EXPLORE and self.rng.random() < self.config.atypical_share
            if atypical:
                kind = (EXPLORE, TOUCH)[int(self.rng.integers(2))]
            chance = np.cumsum(self.liking * (usable & (places.kind == kind)))
            if chance[-1] > 0:
                return int(np.searchsorted(chance, self.rng.random() * chance[-1], side="right")), atypical
        return int(np.argmax(usable if usable.any() else places.cell == cell)), False

    def _walk(self, person: int, place: int) -> int:
        """Write the way to a place; the moment of arrival."""
        walk, toward = self.places.walk, self.places.toward[place]
        begin, start = int(self.clock[person]), int(self.at[person])
        way, stride = self.life.body_xy[person, begin:], self.pace[person] / self.config.rate_hz
        steps = follow(toward, start, walk.free.shape[1], walk.origin_xy, walk.cell_m, stride, way)
        self.life.wrist_xy[person, begin : begin + steps] = way[:steps]
        self._number(person, begin, begin + steps)
        return begin + steps

    def _stay(self, person: int, place: int, kind: int, begin: int, end: int) -> None:
        """Write a stay; who sits where there is no seat is on the floor, or on the edge of what would be touched."""
        places, life, now = self.places, self.life, np.s_[person, begin:end]
        atypical = kind != places.kind[place]
        hand = places.hand_xy[place]
        body = hand if atypical else places.body_xy[place]
        life.body_xy[now] = body
        life.wrist_xy[now] = wrist(hand, body)
        life.shoulder_m[now] = SHOULDER_SEATED_M if atypical else places.shoulder_m[place]
        life.action[now] = (Action.STAND, Action.SIT, Action.INTERACT)[kind]
        self._number(person, begin, end)
        near = places.touches[places.beside[place]]
        if len(near) and self.rng.random() < self.config.seated_touch_share:
            share = self.rng.uniform(*HELD_SHARE)
            first = begin + int((1 - share) * self.rng.random() * (end - begin))
            held = np.s_[person, first : first + int(share * (end - begin))]
            life.wrist_xy[held] = wrist(places.hand_xy[near[self.rng.integers(len(near))]], body)
            life.action[held] = Action.INTERACT

    def _number(self, person: int, begin: int, end: int) -> None:
        self.life.stay[person, begin:end] = self.stays
        self.stays += 1


def _liking(places: Places, rng: np.random.Generator, unused_share: float) -> FloatArray:
    """(K,) how much each place is liked: some groups not at all, few a lot; the places of a group share its liking."""
    groups, which, size = np.unique(places.group, return_inverse=True, return_counts=True)
    liking = rng.standard_exponential(len(groups)) * (rng.random(len(groups)) >= unused_share)
    return np.asarray((liking / size).round(6)[which])


def _log_uniform(rng: np.random.Generator, values: Range) -> float:
    """A draw from a range, evenly on a logarithmic scale, rounded so that last bits decide nothing."""
    low, high = np.log(values)
    return round(float(np.exp(rng.uniform(low, high))), 6)
