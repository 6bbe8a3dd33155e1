"""Cuboids and what they are compared with, as methods of task object-detection-3d."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hsbench.baselines.method import Method, Predictor, Settings, depth_at_t0, observed, other_episodes
from hsbench.baselines.occlusion.action import Activity, recognise
from hsbench.baselines.occlusion.aligned import AlignedRoom, aligned_room
from hsbench.baselines.occlusion.boundary import Boundary, estimate_boundary
from hsbench.baselines.occlusion.config import CarveConfig, CuboidConfig
from hsbench.baselines.occlusion.cuboids import CHOSEN_SCORE, cuboids
from hsbench.baselines.occlusion.shuffle import shuffled_activity
from hsbench.schema.episode import Episode
from hsbench.schema.states import Action
from hsbench.synth.seeds import Seeds
from hsbench.tasks.object_detection import MAX_BOXES, OBJECT_DETECTION, Boxes

TASK = OBJECT_DETECTION.name
CARVING, CONFIG = CarveConfig(), CuboidConfig()
NOBODY = Activity(np.zeros((0, 2)), np.zeros(0, dtype=np.uint8), np.zeros(0))


def answer(room: AlignedRoom, config: CuboidConfig = CONFIG) -> Boxes:
    """The best boxes of a room; those that the program chose reach the operating score."""
    found = cuboids(room, config)
    return Boxes.of(found.boxes[:MAX_BOXES], found.scores[:MAX_BOXES], operating_score=CHOSEN_SCORE)


def room_of(episode: Episode, activity: Activity, boundary: Boundary) -> AlignedRoom:
    """The room that the depth frame at t0 and some activity show."""
    return aligned_room(episode.sensor, depth_at_t0(episode), boundary, activity, CARVING, CONFIG)


def _boundary(episode: Episode) -> Boundary:
    return estimate_boundary(episode.sensor, depth_at_t0(episode), episode.poses)


def _prepare(config: CuboidConfig) -> Callable[[Settings], Predictor]:
    def predictor(episode: Episode) -> Boxes:
        return answer(room_of(episode, recognise(observed(episode), CARVING), _boundary(episode)), config)

    return lambda settings: predictor


def _prepare_alone(settings: Settings) -> Predictor:
    def predictor(episode: Episode) -> Boxes:
        return answer(room_of(episode, NOBODY, estimate_boundary(episode.sensor, depth_at_t0(episode), None)))

    return predictor


def _prepare_shuffled(settings: Settings) -> Predictor:
    other_of = other_episodes(settings, "cuboids-shuffled")
    seeds = Seeds(settings.seed).child("shuffled-activity")

    def predictor(episode: Episode) -> Boxes:
        other, boundary = other_of(episode), estimate_boundary(episode.sensor, depth_at_t0(episode), None)
        activity = shuffled_activity(
            recognise(observed(other), CARVING), _boundary(other), boundary, seeds.rng(episode.episode_id)
        )
        return answer(room_of(episode, activity, boundary))

    return predictor


def _prepare_standing(settings: Settings) -> Predictor:
    def predictor(episode: Episode) -> Boxes:
        activity = recognise(observed(episode), CARVING).of(Action.STAND)
        return answer(room_of(episode, activity, _boundary(episode)))

    return predictor


METHODS = (
    Method(TASK, "cuboids", "poses+frames", "boxes that explain the carved room best together", _prepare(CONFIG)),
    Method(
        TASK, "cuboids-alone", "frames", "control: cuboids of the room as it is seen, without activity",
        _prepare_alone, control="no-activity",
    ),
    Method(
        TASK, "cuboids-shuffled", "poses+frames", "control: cuboids with another episode's activity",
        _prepare_shuffled, control="shuffled-activity",
    ),
    Method(TASK, "cuboids-standing", "poses+frames", "cuboids without the activity of sitting", _prepare_standing),
    Method(
        TASK, "cuboids-greedy", "poses+frames", "cuboids chosen one by one, each suppressing what it meets",
        _prepare(replace(CONFIG, greedy=True)),
    ),
)  # fmt: skip
