"""Lives in a scene: people come in, do what they do, and never meet a wall, a thing or each other.

Everything is in the scene frame. The event log and the poses come from one plan, so that they agree to the frame. A
life is made in blocks, so that a day needs no more memory than minutes; the blocks of a longer life begin as those of a
shorter one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import ndimage

from hsbench.schema.episode import NS_PER_S
from hsbench.schema.events import EventTable
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.activities.config import LifeConfig
from hsbench.synth.activities.diary import Doing, Shift
from hsbench.synth.activities.entrance import find_entrance
from hsbench.synth.activities.going import come_in
from hsbench.synth.activities.person import Person, Present
from hsbench.synth.activities.places import Places
from hsbench.synth.activities.schedule import Quota
from hsbench.synth.activities.traffic import Traffic, Way
from hsbench.synth.people.body import Body
from hsbench.synth.people.channels import OVERLAP_S, pose_block
from hsbench.synth.people.navigation import nearest_free
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import WalkMap, connected, door_entries, walk_map
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

BLOCK_S = 60.0  # of a stream
ENTRY_TRIES_S = 1.0  # whoever finds somebody at the door comes in so much later


@dataclass(frozen=True, eq=False)
class Life:
    """What people do in a scene.

    bodies: body of person 1, 2, ... poses: true joints, scene frame, all TRACKED, track_id = person id, a row for each
    frame in which the person is there. action: (N,) uint8 of ``Action`` for each pose. events: who did what.
    motions: of chairs and of the door. undone: (person, activity, reason) of what was to be done and was not.
    held: (N,) uint8, what is in the hands at each pose, for the eye alone: a place in ``people.HELD``; None: nothing.
    """

    bodies: tuple[Body, ...]
    poses: PoseTable
    action: UInt8Array
    events: EventTable
    motions: ObjectMotions = field(default_factory=ObjectMotions.none)
    undone: tuple[tuple[int, str, str], ...] = ()
    held: UInt8Array | None = None


def live(scene: Scene, seeds: Seeds, config: LifeConfig) -> Life:
    """The whole life in the scene.

    Persons come in by a door when ``empty_s`` is over: on the free cell nearest to the door from which most of the
    floor can be walked to; without a door, on the free cell farthest from everything. A scene without a free cell stays
    empty: no body, no pose, no event.
    """
    return joined(list(stream(scene, seeds, config)))


def joined(blocks: Sequence[Life]) -> Life:
    """The life whose consecutive pieces are given; at least one."""
    tables = [block.poses for block in blocks]
    joints = [table.joints_m for table in tables if table.joints_m is not None]
    poses = PoseTable(
        KINECT_V2.name,
        np.concatenate([table.timestamp_ns for table in tables]),
        np.concatenate([table.track_id for table in tables]),
        np.concatenate([table.joint_state for table in tables]),
        np.concatenate(joints),
    )
    return Life(
        blocks[-1].bodies,
        poses,
        np.concatenate([block.action for block in blocks]),
        _joined_events([block.events for block in blocks]),
        _joined_motions([block.motions for block in blocks]),
        tuple(row for block in blocks for row in block.undone),
        np.concatenate([block.held for block in blocks if block.held is not None]),
    )


def stream(scene: Scene, seeds: Seeds, config: LifeConfig, block_s: float = BLOCK_S) -> Iterator[Life]:
    """The life in pieces of ``block_s``: poses, actions and motions of each; events in the piece in which they end.

    ``bodies`` are those of everybody who has come in so far. There is at least one piece.
    """
    last = round(config.duration_s * config.fps)
    first = -(-round(config.empty_s * NS_PER_S) * config.fps // NS_PER_S)
    crowd = Crowd(scene, seeds, config, first)
    step = max(1, round(block_s * config.fps))
    for start in range(0, max(last, 1), step):
        yield crowd.block(start, min(start + step, last), last)


class Crowd:
    """The people of a scene and their plans, up to a frame."""

    def __init__(self, scene: Scene, seeds: Seeds, config: LifeConfig, first: int) -> None:
        self.config, self.seeds = config, seeds
        walk = walk_map(scene)
        self.entry = _entry(scene, walk)
        self.people: list[Person] = []
        self.company: dict[int, Present] = {}
        self.atypical = Quota(config.atypical_share, seeds.rng("atypical"))
        self.arrivals: list[int] = []
        if self.entry is None:
            return
        xy, reachable = self.entry
        self.yaw_rad = _inward(xy, walk, reachable)
        self.places = Places(scene, walk, reachable, config.unused_share, seeds.child("unused"))
        self.traffic = Traffic(walk, self.places.floor.free, config.people)
        rng = seeds.rng("arrivals")
        gaps_s = rng.uniform(*config.arrival_s, config.people - 1).round(1)
        self.arrivals = [first + round(gap_s * config.fps) for gap_s in [0.0, *np.cumsum(gaps_s)]]
        self._turns: list[Iterator[None]] = []
        if config.from_outside:
            self.places.entrance = find_entrance(scene, self.places.floor, xy, self.places.obstacles)

    def block(self, start: int, stop: int, last: int) -> Life:
        """Frames start .. stop - 1 of a life of ``last`` frames."""
        fps = self.config.fps
        lead = int(np.ceil(OVERLAP_S * fps))
        self._advance(stop + lead)
        tables, actions, held = [], [], []
        for person in self.people:
            diary = person.diary
            begin = max(start, diary.begin)
            if begin >= stop:
                continue
            before = min(lead, begin - diary.begin)
            motion, here = diary.motion(begin - before, stop + lead), slice(before, before + stop - begin)
            joints = pose_block(person.body, motion, begin - before, fps, person.idle)[here]
            joints, there = diary.with_clips(begin, joints), diary.is_there(begin, stop)
            held.append(motion.held[here][there].astype(np.uint8))
            tables.append((person.number + 1, begin + np.flatnonzero(there), joints[there]))
            actions.append(diary.actions(begin, stop)[there])
        order = np.lexsort((_ids(tables), _frames(tables)))
        ended = [(person.number + 1, doing) for person in self.people for doing in _ended(person, stop, stop == last)]
        undone = [(u.frame, p.number + 1, u.activity, u.reason) for p in self.people for u in p.diary.undone]
        block = Life(
            tuple(person.body for person in self.people),
            _poses(tables, order, fps),
            np.concatenate([np.empty(0, np.uint8), *actions])[order],
            _events([(person, _clipped(doing, last)) for person, doing in ended], fps),
            _motions([s for person in self.people for s in _shifted(person, stop)], fps),
            tuple(row[1:] for row in sorted(undone)),
            np.concatenate([np.empty(0, np.uint8), *held])[order],
        )
        for person in self.people:
            person.diary.undone.clear()
            person.diary.forget(stop - lead)
        if self.people:
            self.traffic.forget(min(person.diary.frame for person in self.people))
        return block

    def _advance(self, frame: int) -> None:
        """Go on until everybody's plans reach a frame; whoever is free first goes first."""
        while self.entry is not None:
            turns = [(person.diary.frame, person.number) for person in self.people]
            if self.arrivals:
                turns.append((self.arrivals[0], len(self.people)))
            when, number = min(turns)
            if when >= frame:
                return
            if number == len(self.people):
                self._arrive(when)
            else:
                next(self._turns[number])

    def _arrive(self, frame: int) -> None:
        assert self.entry is not None
        xy, number = self.entry[0], len(self.people)
        node = self.seeds.child("person").child(number + 1)
        shared = self.places, self.traffic, self.company, self.atypical, self.config
        person = Person(number, *shared, node, frame, xy, self.yaw_rad)
        entrance = self.places.entrance
        if not (self._begins(number, frame) if entrance is None else come_in(person, entrance)):
            self.traffic.awaited = self._way_in()
            self.arrivals[0] += round(ENTRY_TRIES_S * self.config.fps)
            return
        self.traffic.awaited = None
        self.people.append(person)
        self._turns.append(person.live())
        self.arrivals.pop(0)

    def _begins(self, number: int, frame: int) -> bool:
        """Begin inside the door, if nobody is there."""
        door = self._way_in().places
        if self.traffic.taken(number, door) or self.traffic.conflict(number, frame, np.empty((0, 2)), door):
            return False
        self.traffic.settle(number, frame, door)
        return True

    def _way_in(self) -> Way:
        """What a newcomer needs."""
        assert self.entry is not None
        if self.places.entrance is not None:
            return Way(self.places.entrance.way, self.places.entrance.swept)
        return Way(np.stack([self.entry[0]] * 2), np.zeros_like(self.places.floor.free))


def stamps(frames: IntArray, fps: int) -> IntArray:
    """(N,) frame numbers -> (N,) int64 nanoseconds, frame 0 at 0, rounded to the nearest."""
    return (frames * NS_PER_S + fps // 2) // fps


def _entry(scene: Scene, walk: WalkMap) -> tuple[FloatArray, BoolArray] | None:
    """Where people come in (2,), and the cells (nx, ny) that can be walked to from there."""
    best: tuple[FloatArray, BoolArray] | None = None
    for point in door_entries(scene):
        reached = connected(walk, point)
        cell = nearest_free(replace(walk, free=walk.free & reached), point)
        if cell is not None and (best is None or reached.sum() > best[1].sum()):
            best = (cell[0], reached)
    if best is None and walk.free.any():
        xy = walk.centres()[np.unravel_index(int(np.argmax(_openness(walk))), walk.free.shape)]
        best = (xy, connected(walk, xy))
    return best


def _openness(walk: WalkMap) -> IntArray:
    """(nx, ny) int64: king's moves to the nearest cell that is not free."""
    moves = ndimage.distance_transform_cdt(np.pad(walk.free, 1), metric="chessboard")
    return np.asarray(moves[1:-1, 1:-1], dtype=np.int64)


def _inward(xy: FloatArray, walk: WalkMap, reachable: BoolArray) -> float:
    """Heading from the entry towards the middle of what can be walked to."""
    ahead = walk.centres()[reachable].mean(axis=0) - xy
    return float(np.round(np.arctan2(ahead[1], ahead[0]), 4))


Rows = Sequence[tuple[int, IntArray, FloatArray]]
"""For each person: id, frames (n,), joints (n, 25, 3)."""


def _frames(tables: Rows) -> IntArray:
    return np.concatenate([np.empty(0, np.int64), *(frames for _, frames, _ in tables)])


def _ids(tables: Rows) -> IntArray:
    return np.concatenate([np.empty(0, np.int64), *(np.full(len(joints), person) for person, _, joints in tables)])


def _poses(tables: Rows, order: IntArray, fps: int) -> PoseTable:
    joints = np.concatenate([np.empty((0, len(KINECT_V2.names), 3)), *(joints for _, _, joints in tables)])[order]
    return PoseTable(
        KINECT_V2.name,
        stamps(_frames(tables)[order], fps),
        _ids(tables)[order].astype(np.int32),
        np.full(joints.shape[:2], JointState.TRACKED, dtype=np.uint8),
        joints.astype(np.float32),
    )


def _ended(person: Person, stop: int, last: bool) -> list[Doing]:
    """Events of a person that end before a frame, taken out of the diary; at the last frame all that have begun."""
    diary = person.diary
    ended = [d for d in diary.done if d.end < stop or (last and d.start < stop)]
    diary.done = [d for d in diary.done if d not in ended]
    return ended + ([d for d in diary.open if d.start < stop] if last else [])


def _clipped(doing: Doing, last: int) -> Doing:
    return replace(doing, end=last - 1 if doing.end < 0 else min(doing.end, last - 1))


def _shifted(person: Person, stop: int) -> list[Shift]:
    """Key poses before a frame, taken out of the diary."""
    diary = person.diary
    before = [s for s in diary.shifts if s.frame < stop]
    diary.shifts = [s for s in diary.shifts if s.frame >= stop]
    return before


def _events(rows: Sequence[tuple[int, Doing]], fps: int) -> EventTable:
    rows = sorted(rows, key=lambda r: (r[1].start, r[1].end, r[0], r[1].activity))
    return EventTable(
        np.array([person for person, _ in rows], dtype=np.int32),
        tuple(d.activity for _, d in rows),
        np.array([d.object_id for _, d in rows], dtype=np.int32),
        tuple(d.part for _, d in rows),
        stamps(np.array([d.start for _, d in rows], dtype=np.int64), fps),
        stamps(np.array([d.end for _, d in rows], dtype=np.int64), fps),
        tuple(d.contact for _, d in rows),
    )


def _motions(shifts: Sequence[Shift], fps: int) -> ObjectMotions:
    shifts = sorted(shifts, key=lambda s: (s.frame, s.object_id, s.part))
    return ObjectMotions(
        stamps(np.array([s.frame for s in shifts], dtype=np.int64), fps),
        np.array([s.object_id for s in shifts], dtype=np.int32),
        tuple(s.part for s in shifts),
        np.array([s.move for s in shifts], dtype=np.float64).reshape(-1, 3),
    )


TIMES_AND_IDS = ("person_id", "object_id", "start_ns", "end_ns")


def _joined_events(tables: Sequence[EventTable]) -> EventTable:
    names = [name for table in tables for name in table.activity]
    columns = [np.concatenate([getattr(t, c) for t in tables]) for c in TIMES_AND_IDS]
    person, thing, start, end = columns
    order = sorted(range(len(names)), key=lambda k: (start[k], end[k], person[k], names[k]))
    parts, contacts = ([x for t in tables for x in getattr(t, c)] for c in ("part", "contact"))
    return EventTable(
        person[order], tuple(names[k] for k in order), thing[order], tuple(parts[k] for k in order), start[order],
        end[order], tuple(contacts[k] for k in order),
    )  # fmt: skip


def _joined_motions(tables: Sequence[ObjectMotions]) -> ObjectMotions:
    return ObjectMotions(
        np.concatenate([t.timestamp_ns for t in tables]),
        np.concatenate([t.object_id for t in tables]),
        tuple(part for t in tables for part in t.part),
        np.concatenate([t.move for t in tables]),
    )
