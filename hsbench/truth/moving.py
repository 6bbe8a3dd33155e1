"""What scores leave out because things have moved: where truth differs from that at t0 for more than half an episode.

All tasks: truth is the room at t0, and moved chairs return after use; a voxel, cell or pixel is ignored only if its
truth differs from t0 for more than half of the episode. Time is exact but for things on their way: from key pose to
key pose, their place in the middle of the way stands for all of it, as ways are short.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hsbench.schema.motions import Move, ObjectMotions, Thing, scene_at
from hsbench.schema.scene import Scene
from hsbench.typing import AnyArray, BoolArray, FloatArray

NEAR_M = 0.1  # things nearer to each other may lie in one voxel or cell

Moves = tuple[tuple[Thing, Move], ...]
Span = tuple[int, Mapping[Thing, Move]]
"""How long things are where, in nanoseconds."""


def ignored(
    truth_at_t0: AnyArray,
    truth_of: Callable[[Scene], AnyArray],
    scene: Scene,
    motions: ObjectMotions,
    t0_ns: int,
    end_ns: int,
) -> BoolArray:
    """Bool of the shape of ``truth_at_t0``: the truth differs for more than half of the time from t0 to the end.

    truth_of: the truth of a scene in the same form: labels of voxels, cells or pixels. What a thing changes is taken to
    lie where it is or was at t0: objects whose places never meet are looked at apart, and not at all if they are away
    for at most half of the time.
    """
    spans = _spans(motions, t0_ns, end_ns)
    mask = np.zeros(truth_at_t0.shape, dtype=np.bool_)
    for group in _groups(scene, spans):
        away: dict[Moves, int] = {}
        for time_ns, moves in spans:
            own = tuple((thing, move) for thing, move in moves.items() if thing[0] in group)
            if own:
                away[own] = away.get(own, 0) + time_ns
        mask |= _mostly_different(truth_at_t0, truth_of, scene, away, end_ns - t0_ns)
    return mask


def _spans(motions: ObjectMotions, t0_ns: int, end_ns: int) -> list[Span]:
    """The moves in the middle between all key poses one after the other."""
    keys = np.unique(np.clip(motions.timestamp_ns, t0_ns, end_ns)).tolist()
    edges = sorted({t0_ns, *keys, end_ns})
    return [(b - a, motions.moves_at((a + b) // 2)) for a, b in pairwise(edges)]


def _groups(scene: Scene, spans: list[Span]) -> list[set[int]]:
    """Ids of moving objects, those together whose places meet."""
    found: list[tuple[set[int], FloatArray]] = []
    for object_id in sorted({object_id for _, moves in spans for object_id, _ in moves}):
        group, bounds = {object_id}, _bounds(scene, object_id, spans)
        while met := [entry for entry in found if _meet(entry[1], bounds)]:
            for entry in met:
                found.remove(entry)
                group, bounds = group | entry[0], _hull(bounds, entry[1])
        found.append((group, bounds))
    return [group for group, _ in found]


def _bounds(scene: Scene, object_id: int, spans: list[Span]) -> FloatArray:
    """(2, 3) smallest and largest coordinates of an object over all of its places, that at t0 among them."""
    item = scene.object(object_id)
    alone = replace(scene, objects=(item,))
    places = {tuple((thing, move) for thing, move in moves.items() if thing[0] == object_id) for _, moves in spans}
    vertices = np.concatenate([item.vertices, *(scene_at(alone, dict(place)).objects[0].vertices for place in places)])
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _meet(a: FloatArray, b: FloatArray) -> bool:
    return bool((a[0] <= b[1] + NEAR_M).all() and (b[0] <= a[1] + NEAR_M).all())


def _hull(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])


def _mostly_different(
    truth_at_t0: AnyArray,
    truth_of: Callable[[Scene], AnyArray],
    scene: Scene,
    away: Mapping[Moves, int],
    duration_ns: int,
) -> BoolArray:
    """Where truth differs for more than half of the time; places are asked, long ones first, until that is known."""
    different_ns = np.zeros(truth_at_t0.shape, dtype=np.int64)
    left_ns = sum(away.values())
    for moves, time_ns in sorted(away.items(), key=lambda entry: (-entry[1], entry[0])):
        open_ = (2 * different_ns <= duration_ns) & (2 * (different_ns + left_ns) > duration_ns)
        if not open_.any():
            break
        different_ns += time_ns * (truth_of(scene_at(scene, dict(moves))) != truth_at_t0)
        left_ns -= time_ns
    return np.asarray(2 * different_ns > duration_ns)
