"""One person's day: choose what to do next, do it, remember where one has been."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.states import Action
from hsbench.synth.activities.config import LifeConfig, Range
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.seats import Seat, find_seat, ledge_parts, seat_parts, sit_on
from hsbench.synth.activities.touches import REACH_S, Touch, find_seated_touch, find_touch, touch_parts
from hsbench.synth.people.body import Body, J
from hsbench.synth.people.channels import Channels, concatenate, pose, standing
from hsbench.synth.people.motion import reach, stand, walk
from hsbench.synth.people.navigation import costs_from, nearest_free, route_from
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray, UInt8Array

SEEN_M = 0.40  # a place so near to where one has walked is explored
SEEN_WEIGHT = 0.05  # of an explored place as a target, against 1 of another
SEEN_STRIDE_FRAMES = 5  # of a walk, every so many frames explore
TRIES = 6  # parts tried before something else is done
SEAT_PAUSE_S = 0.4  # before one sits down, and after one gets up
WINDOW_M = 1.3  # how near one comes to a window
TOUCH_M = 0.03  # a finger tip farther than this from its point touches nothing
TURN_RAD = 1.2  # most one turns while pausing


@dataclass(frozen=True)
class Doing:
    """One event in frames of the life, ``end`` being the last frame."""

    activity: str
    start: int
    end: int
    object_id: int = 0
    part: str = ""
    contact: str = ""


class Person:
    """Builds the channels, actions and events of one life, frame by frame from frame 0."""

    def __init__(
        self, scene: Scene, body: Body, walk_map: WalkMap, reachable: BoolArray, config: LifeConfig, seeds: Seeds,
        xy: FloatArray, yaw_rad: float, frames: int,
    ) -> None:  # fmt: skip
        self.body, self.walk_map, self.reachable, self.config = body, walk_map, reachable, config
        self.rng, self.pose_rng = seeds.rng("plan"), seeds.rng("idle")
        self.obstacles = Obstacles.of(scene)
        self.frames = frames
        self.chunks: list[Channels] = [standing(body, xy, yaw_rad)]
        self.actions: list[UInt8Array] = [np.array([Action.STAND], dtype=np.uint8)]
        self.length = 1
        self.doings: list[Doing] = []
        self.touches: dict[int, Touch] = {}  # the touch of an event, by its place in ``doings``
        self.seen = np.zeros_like(walk_map.free)
        self.centres = walk_map.centres()
        self.seats, self.ledges = seat_parts(scene), ledge_parts(scene)
        self.touchable = touch_parts(scene)
        self.windows = [item for item in scene.objects if item.category_name == "window"]
        self._remember(xy[None])

    def live(self) -> tuple[FloatArray, UInt8Array, list[Doing]]:
        """(T, 25, 3) joints, (T,) actions and the events, T being the frames asked for."""
        config = self.config
        choices = (self._explore, self._sit, self._touch, self._look)
        edges = np.cumsum([config.explore, config.sit, config.touch, config.look])
        self._explore()
        while self.length < self.frames:
            choice = choices[int(np.searchsorted(edges, self.rng.random() * edges[-1], side="right"))]
            contact = choice in (self._sit, self._touch)
            atypical = contact and self.rng.random() < config.atypical_share and self._sit_on_one_of(self.ledges)
            if not (atypical or choice() or self._explore()):
                self._pause()
        return self._finished()

    def _finished(self) -> tuple[FloatArray, UInt8Array, list[Doing]]:
        joints = pose(self.body, concatenate(self.chunks), self.config.fps, self.pose_rng)[: self.frames]
        action = np.concatenate(self.actions)[: self.frames]
        kept = []
        for number, doing in enumerate(self.doings):
            if doing.start >= self.frames:
                continue
            doing = replace(doing, end=min(doing.end, self.frames - 1))
            if number in self.touches and self._misses(self.touches[number], joints[doing.start : doing.end + 1]):
                action[doing.start : doing.end + 1] = action[doing.start - 1]
                continue
            kept.append(doing)
        return joints, action, kept

    def _misses(self, touch: Touch, joints: FloatArray) -> bool:
        """Whether the finger tip is ever too far from the point it should touch, in (T, 25, 3) joints."""
        tips = joints[:, J[touch.contact.replace("hand", "hand_tip")]]
        return bool((np.sum((tips - np.array(touch.point_m)) ** 2, axis=1) > TOUCH_M**2).any())

    def _do(
        self, chunk: Channels, action: Action, activity: str = "", thing: tuple[int, str, str] = (0, "", "")
    ) -> None:
        """Append a chunk, and an event if it has a name; thing: object id, part and contact of the event."""
        start = self.length
        self.chunks.append(chunk)
        self.actions.append(np.full(len(chunk), action, dtype=np.uint8))
        self.length += len(chunk)
        if activity:
            self.doings.append(Doing(activity, start, self.length - 1, *thing))

    def _draw(self, seconds: Range) -> float:
        return float(quantise_m(self.rng.uniform(*seconds)))

    def _here(self) -> Channels:
        return self.chunks[-1].last()

    def _walk_to(self, goal_xy: FloatArray, yaw_rad: float | None, activity: str = "walk") -> bool:
        here = self._here()
        way = route_from(self.walk_map, costs_from(self.walk_map, here.xy[0]), here.xy[0], goal_xy)
        if way is None:
            return False
        chunk = walk(self.body, here, way, yaw_rad, self._draw(self.config.speed_m_s), self.config.fps)
        self._do(chunk, Action.STAND, activity)
        self._remember(chunk.xy[::SEEN_STRIDE_FRAMES])
        return True

    def _remember(self, places: FloatArray) -> None:
        """Mark the cells within ``SEEN_M`` of places (n, 2) as explored."""
        for x, y in places:
            self.seen |= np.sum((self.centres - (x, y)) ** 2, axis=-1) <= SEEN_M**2

    def _pause(self) -> None:
        here = self._here()
        if self.rng.random() < 0.5:
            turned = float(here.yaw[0]) + quantise_angle(float(self.rng.uniform(-TURN_RAD, TURN_RAD)))
            self._do(walk(self.body, here, here.xy, turned, 1.0, self.config.fps), Action.STAND)
        self._do(stand(self._here(), self._draw(self.config.stand_s), self.config.fps), Action.STAND, "stand")

    def _explore(self) -> bool:
        """Walk to a place drawn from the whole floor, mostly where one has not been; stop there a while."""
        cells = np.argwhere(self.reachable)
        edges = np.cumsum(np.where(self.seen[tuple(cells.T)], SEEN_WEIGHT, 1.0))
        goal = cells[int(np.searchsorted(edges, self.rng.random() * edges[-1], side="right"))]
        if not self._walk_to(self.centres[tuple(goal)], None, "explore"):
            return False
        self._pause()
        return True

    def _look(self) -> bool:
        """Look out of a window."""
        if not self.windows:
            return False
        window = self.windows[int(self.rng.integers(len(self.windows)))]
        middle = quantise_m(window.box[:2])
        cell = nearest_free(self.walk_map, middle, self.reachable)
        if cell is None or cell[1] > WINDOW_M:
            return False
        away = middle - cell[0]
        if not self._walk_to(cell[0], quantise_angle(float(np.arctan2(away[1], away[0])))):
            return False
        watching = stand(self._here(), self._draw(self.config.look_s), self.config.fps)
        self._do(watching, Action.STAND, "look", (window.object_id, "", ""))
        return True

    def _touch(self) -> bool:
        """Walk to where a part can be touched, and touch it."""
        for _ in range(min(TRIES, len(self.touchable))):
            choice = int(self.rng.integers(len(self.touchable)))
            found = find_touch(
                *self.touchable[choice], self.body, self.walk_map, self.reachable, self.obstacles, self.rng
            )
            if found is None:
                continue
            if self._walk_to(np.array(found.stand_xy), found.yaw_rad):
                self._hold(found.touch, Action.STAND)
                return True
        return False

    def _hold(self, touch: Touch, otherwise: Action) -> None:
        fps = self.config.fps
        out = reach(self._here(), touch.side, np.array(touch.point_m), touch.lean_rad, touch.crouch_m, REACH_S, fps)
        self._do(out, otherwise)
        held = out.hold(max(1, round(self._draw(self.config.touch_s) * fps)))
        self.touches[len(self.doings)] = touch
        self._do(held, Action.INTERACT, "touch", (touch.object_id, touch.part, touch.contact))
        self._do(out.backwards(), otherwise)

    def _sit(self) -> bool:
        """Walk to a seat, sit for a while, perhaps touch what is near, and get up."""
        return self._sit_on_one_of(self.seats)

    def _sit_on_one_of(self, parts: list[tuple[SceneObject, Part]]) -> bool:
        for _ in range(min(TRIES, len(parts))):
            choice = int(self.rng.integers(len(parts)))
            seat = find_seat(*parts[choice], self.body, self.walk_map, self.reachable, self.obstacles, self.rng)
            if seat is not None and self._walk_to(np.array(seat.approach_xy), seat.pose.yaw_rad):
                self._sit_on(seat)
                return True
        return False

    def _sit_on(self, seat: Seat) -> None:
        fps = self.config.fps
        self._do(stand(self._here(), SEAT_PAUSE_S, fps), Action.STAND)
        down = sit_on(self._here(), seat, fps)
        self._do(down, Action.IGNORED, "sit_down", (seat.object_id, seat.part, ""))
        start, budget = self.length, self.length + round(self._draw(self.config.sit_s) * fps)
        for _ in range(self.config.touches_seated):
            touch = self._seated_touch()
            if touch is not None and self.length < budget:
                self._do(stand(self._here(), self._draw(self.config.stand_s), fps), Action.SIT)
                self._hold(touch, Action.SIT)
        if self.length < budget:
            self._do(self._here().hold(budget - self.length), Action.SIT)
        self.doings.append(Doing("sit", start, self.length - 1, seat.object_id, seat.part, "pelvis"))
        self._do(down.backwards(), Action.IGNORED, "stand_up", (seat.object_id, seat.part, ""))
        self._do(stand(self._here(), SEAT_PAUSE_S, fps), Action.STAND)

    def _seated_touch(self) -> Touch | None:
        here = self._here()
        for _ in range(min(TRIES, len(self.touchable))):
            item, part = self.touchable[int(self.rng.integers(len(self.touchable)))]
            touch = find_seated_touch(item, part, here, self.body, self.obstacles, self.rng)
            if touch is not None:
                return touch
        return None
