"""What activity leaves in a room: where people walked, where they sat, and where their hands reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hsbench.baselines.lift import lifted
from hsbench.baselines.method import Settings, observed, other_episodes
from hsbench.baselines.posture import REACH_M, postures
from hsbench.geometry.footprints import hull
from hsbench.schema.episode import Episode
from hsbench.schema.poses import PoseTable
from hsbench.synth.seeds import Seeds
from hsbench.tasks.shuffle import shuffled_poses
from hsbench.typing import FloatArray

KEPT_SHARE = 0.95  # of the places that span a boundary, the nearest to their middle: the others may be false detections
CORNERS = 3  # of a boundary that holds anything


@dataclass(frozen=True, eq=False)
class Traces:
    """Places in metres, episode frame: walked (n, 3) on the floor, sat (m, 3) hips, hands (k, 3) wrists that reach.

    share: of the observation that one of them stands for.
    """

    walked: FloatArray
    sat: FloatArray
    hands: FloatArray
    share: float

    @property
    def boundary(self) -> FloatArray:
        """(n, 2) convex hull of most places of people: the boundary of a room that only poses tell of."""
        places = np.concatenate([self.walked, self.sat])[:, :2]
        if not len(places):
            return places
        far = np.linalg.norm(places - np.median(places, axis=0), axis=1)
        return hull(places[far <= np.quantile(far, KEPT_SHARE)])


def traces(poses: PoseTable) -> Traces:
    """The traces of poses that have metres."""
    found = postures(poses)
    known = np.isfinite(found.place).all(axis=-1)
    walked = found.place[known & found.stands]
    walked[:, 2] = 0.0
    share = 1.0 / max(len(np.unique(poses.timestamp_ns)), 1)
    return Traces(walked, found.place[known & found.sits], found.hands[found.reach_m > REACH_M], share)


def own_traces(episode: Episode) -> Traces:
    """What the people of an episode left. Raises DataError where it has no poses."""
    return traces(_metric(episode))


def shuffled_traces(settings: Settings, name: str) -> Callable[[Episode], Traces]:
    """An episode -> the traces of the next one's people, turned about the camera into the boundary of its own.

    Where its own poses span no boundary, nobody is left. Raises DataError for a selection of one episode.
    """
    other_of, seeds = other_episodes(settings, name), Seeds(settings.seed).child("shuffled-activity")

    def left(episode: Episode) -> Traces:
        boundary, others = own_traces(episode).boundary, _metric(other_of(episode))
        if len(boundary) < CORNERS:
            return traces(others.select(np.zeros(len(others), dtype=np.bool_)))
        return traces(shuffled_poses(others, boundary, seeds.rng(episode.episode_id)))

    return left


def _metric(episode: Episode) -> PoseTable:
    return lifted(observed(episode), episode.sensor)
