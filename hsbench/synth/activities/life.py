"""A life in a room: a person comes in, explores the floor, sits, touches, looks out, until the time is up.

Everything is in the scene frame. The event log and the poses come from one plan, so that they agree to the frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hsbench.schema.episode import NS_PER_S
from hsbench.schema.events import EventTable
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.skeletons import KINECT_V2
from hsbench.synth.activities.config import LifeConfig
from hsbench.synth.activities.person import Doing, Person
from hsbench.synth.people.body import Body
from hsbench.synth.people.navigation import nearest_free
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import WalkMap, connected, door_entries, walk_map
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Life:
    """What people do in a scene.

    bodies: body of person 1, 2, ... poses: true joints, scene frame, all TRACKED, track_id = person id, a row for each
    frame in which the person is there. action: (N,) uint8 of ``Action`` for each pose. events: who did what.
    """

    bodies: tuple[Body, ...]
    poses: PoseTable
    action: UInt8Array
    events: EventTable


def live(scene: Scene, seeds: Seeds, config: LifeConfig) -> Life:
    """One person's life in the scene.

    The person stands at a door when ``empty_s`` is over: on the free cell nearest to the door from which most of the
    floor can be walked to; without a door, on the free cell farthest from everything. A room without a free cell stays
    empty: no body, no pose, no event.
    """
    walk = walk_map(scene)
    entry = _entry(scene, walk)
    first = -(-round(config.empty_s * NS_PER_S) * config.fps // NS_PER_S)
    last = round(config.duration_s * config.fps)
    if entry is None or first >= last:
        nobody = np.empty((0, len(KINECT_V2.names), 3))
        return Life((), _poses(nobody, 0, config.fps), np.empty(0, dtype=np.uint8), _events([], 0, config.fps))
    node = seeds.child("person").child(1)
    body = Body.sample(node.rng("body"))
    xy, reachable = entry
    yaw = _inward(xy, walk, reachable)
    person = Person(scene, body, walk, reachable, config, node, xy, yaw, last - first)
    joints, action, doings = person.live()
    return Life((body,), _poses(joints, first, config.fps), action, _events(doings, first, config.fps))


def _entry(scene: Scene, walk: WalkMap) -> tuple[FloatArray, BoolArray] | None:
    """Where the person comes in (2,), and the cells (nx, ny) that can be walked to from there."""
    best: tuple[FloatArray, BoolArray] | None = None
    for point in door_entries(scene):
        reached = connected(walk, point)
        cell = nearest_free(walk, point, reached)
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


def stamps(frames: IntArray, fps: int) -> IntArray:
    """(N,) frame numbers -> (N,) int64 nanoseconds, frame 0 at 0, rounded to the nearest."""
    return (frames * NS_PER_S + fps // 2) // fps


def _poses(joints: FloatArray, first: int, fps: int) -> PoseTable:
    n = len(joints)
    return PoseTable(
        KINECT_V2.name,
        stamps(first + np.arange(n, dtype=np.int64), fps),
        np.ones(n, dtype=np.int32),
        np.full((n, len(KINECT_V2.names)), JointState.TRACKED, dtype=np.uint8),
        joints.astype(np.float32),
    )


def _events(doings: list[Doing], first: int, fps: int) -> EventTable:
    doings = sorted(doings, key=lambda d: (d.start, d.end, d.activity))
    return EventTable(
        np.ones(len(doings), dtype=np.int32),
        tuple(d.activity for d in doings),
        np.array([d.object_id for d in doings], dtype=np.int32),
        tuple(d.part for d in doings),
        stamps(first + np.array([d.start for d in doings], dtype=np.int64), fps),
        stamps(first + np.array([d.end for d in doings], dtype=np.int64), fps),
        tuple(d.contact for d in doings),
    )
