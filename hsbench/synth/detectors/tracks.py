"""Which body a detector believes it sees: track ids that break, change and are exchanged.

Ids count from 1 in the order in which tracks begin.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.episode import NS_PER_S
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.seeds import Seeds
from hsbench.typing import FloatArray, Int32Array, IntArray


class Seen(NamedTuple):
    """A body at the looks (n,) at which it was found, and where (n, 3), metres from the camera, camera frame."""

    look: IntArray
    place: FloatArray


def track_ids(
    times_ns: IntArray, bodies: dict[int, Seen], config: DetectorConfig, seeds: Seeds
) -> dict[int, Int32Array]:
    """The track id of each body at each look at which it was found.

    times_ns: (T,) the detector's looks, ascending. bodies: by number; people have numbers > 0, and only they are
    taken for each other. The ids of a longer take begin with those of a shorter one.
    """
    begun = [
        (look, 0, body, 0) for body, seen in bodies.items() for look in _beginnings(times_ns, body, seen, config, seeds)
    ]
    people = sorted(body for body in bodies if body > 0)
    swapped = [
        (look, 1, a, b)
        for a, b in combinations(people, 2)
        for look in _exchanges(times_ns, a, b, bodies, config, seeds)
    ]
    current: dict[int, int] = {}
    changes: dict[int, list[tuple[int, int]]] = {body: [] for body in bodies}
    begins = 0
    for look, exchange, a, b in sorted(begun + swapped):
        if exchange:
            current[a], current[b] = current[b], current[a]
            changes[b].append((look, current[b]))
        else:
            begins += 1
            current[a] = begins
        changes[a].append((look, current[a]))
    return {body: _ids(seen.look, changes[body]) for body, seen in bodies.items()}


def _ids(look: IntArray, changes: list[tuple[int, int]]) -> Int32Array:
    """(n,) the id after the last change at or before each look."""
    if not len(look):
        return np.empty(0, dtype=np.int32)
    at, ids = np.array(changes).T
    return np.asarray(ids[np.searchsorted(at, look, side="right") - 1], dtype=np.int32)


def _beginnings(times_ns: IntArray, body: int, seen: Seen, config: DetectorConfig, seeds: Seeds) -> list[int]:
    """Looks at which a body gets a new track: the first, and after losses."""
    if not len(seen.look):
        return []
    gaps = np.flatnonzero(np.diff(seen.look) > 1) + 1
    unsure = seeds.child("relabel").rng(body).random(len(gaps)) < config.relabel_share
    before, after = times_ns[seen.look[gaps - 1]], times_ns[seen.look[gaps]]
    new = unsure | (after - before > round(config.lost_s * NS_PER_S))
    return [int(seen.look[0]), *seen.look[gaps[new]].tolist()]


def _exchanges(
    times_ns: IntArray, a: int, b: int, bodies: dict[int, Seen], config: DetectorConfig, seeds: Seeds
) -> list[int]:
    """Looks at which two bodies exchange their tracks: some of those at which they come near each other."""
    both, rows_a, rows_b = np.intersect1d(bodies[a].look, bodies[b].look, assume_unique=True, return_indices=True)
    near = both[_apart(bodies[a].place[rows_a], bodies[b].place[rows_b], config) < config.near_m]
    if not len(near):
        return []
    times = times_ns[near]
    met = near[np.diff(times, prepend=times[0] - 2 * round(config.lost_s * NS_PER_S) - 1) > config.lost_s * NS_PER_S]
    chance = seeds.child("swap").rng(f"{a}-{b}").random(len(met))
    return [int(look) for look in met[chance < config.swap_share]]


def _apart(a: FloatArray, b: FloatArray, config: DetectorConfig) -> FloatArray:
    """(n, 3) two places -> (n,) metres between them; for a detector in pixels, across the line of sight."""
    if not config.in_metres:
        far_a, far_b = (np.sqrt((p * p).sum(axis=1, keepdims=True)) for p in (a, b))
        nearer = np.minimum(far_a, far_b)
        a, b = a / far_a * nearer, b / far_b * nearer
    return quantise_m(np.sqrt(((a - b) ** 2).sum(axis=1)))
