"""Carving and what it is compared with, by name: prepared for a data set, a method answers an episode at a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.baselines.method import Method, Predictor, Settings, depth_at_t0, observed, other_episodes, training
from hsbench.baselines.occlusion.action import Activity, recognise
from hsbench.baselines.occlusion.boundary import Boundary, estimate_boundary
from hsbench.baselines.occlusion.carve import activity_maps, carve, fill_holes, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.constant import fit_constant
from hsbench.baselines.occlusion.height_prior import HeightPrior, behind_surface, fit
from hsbench.baselines.occlusion.shuffle import shuffled_activity
from hsbench.errors import DataError
from hsbench.metrics.completion import primary_mask
from hsbench.schema.episode import Episode
from hsbench.schema.states import VoxelState
from hsbench.synth.seeds import Seeds
from hsbench.tasks.scene_completion import GRID, SCENE_COMPLETION
from hsbench.typing import BoolArray, UInt8Array

TASK = SCENE_COMPLETION.name
CONFIG = CarveConfig()


def _states(episode: Episode) -> UInt8Array:
    return voxel_states(episode.sensor, GRID, depth_at_t0(episode))


def _activity(episode: Episode) -> Activity:
    return recognise(observed(episode), CONFIG)


def _carved(episode: Episode, activity: Activity) -> BoolArray:
    maps = activity_maps(activity, GRID, CONFIG)
    return carve(_states(episode), maps.stand, seats(maps.sit, activity, GRID, CONFIG), GRID, CONFIG)


def _prepare_carve(settings: Settings) -> Predictor:
    return lambda episode: _carved(episode, _activity(episode))


def _prepare_all_solid(settings: Settings) -> Predictor:
    return lambda episode: np.isin(_states(episode), (VoxelState.SURFACE, VoxelState.OCCLUDED))


def _prepare_visible_only(settings: Settings) -> Predictor:
    return lambda episode: np.asarray(_states(episode) == VoxelState.SURFACE)


def _prepare_shuffled(settings: Settings) -> Predictor:
    """Each episode gets the activity of the next one of the selection, the last that of the first."""
    other_of = other_episodes(settings, "carve-shuffled")
    seeds = Seeds(settings.seed).child("shuffled-activity")

    def predict(episode: Episode) -> BoolArray:
        other = other_of(episode)
        activity = shuffled_activity(
            _activity(other), _boundary(other), _boundary(episode), seeds.rng(episode.episode_id)
        )
        return _carved(episode, activity)

    return predict


def _boundary(episode: Episode) -> Boundary:
    return estimate_boundary(episode.sensor, depth_at_t0(episode), episode.poses)


def _prepare_height_prior(settings: Settings) -> Predictor:
    prior = _fitted_prior(settings)

    def predict(episode: Episode) -> BoolArray:
        states = _states(episode)
        return np.asarray((states == VoxelState.SURFACE) | ((states == VoxelState.OCCLUDED) & _within(prior, episode)))

    return predict


def _prepare_carve_prior(settings: Settings) -> Predictor:
    """What the prior calls solid and nobody walked through: does activity add to what any room has in common?"""
    prior, carved = _fitted_prior(settings), _prepare_carve(settings)

    def predict(episode: Episode) -> BoolArray:
        occluded = _states(episode) == VoxelState.OCCLUDED
        return carved(episode) & (~occluded | _within(prior, episode))

    return predict


def _within(prior: HeightPrior, episode: Episode) -> BoolArray:
    return prior.solid(behind_surface(episode.sensor, GRID, fill_holes(depth_at_t0(episode))), GRID)


def _fitted_prior(settings: Settings) -> HeightPrior:
    def sample(episode: Episode) -> tuple[np.ndarray, np.ndarray, BoolArray]:
        assert episode.truth is not None
        assert episode.truth.occupancy is not None
        truth = episode.truth.occupancy
        behind = behind_surface(episode.sensor, GRID, fill_holes(depth_at_t0(episode)))
        mask = primary_mask(truth) & np.isfinite(behind)
        height = np.broadcast_to(GRID.axis_centres(2), GRID.shape)
        return behind[mask], height[mask], truth.solid[mask]

    return fit(sample(episode) for episode in training(settings, "height-prior"))


def _prepare_constant(settings: Settings) -> Predictor:
    def sample(episode: Episode) -> tuple[BoolArray, BoolArray]:
        assert episode.truth is not None
        assert episode.truth.occupancy is not None
        return primary_mask(episode.truth.occupancy), episode.truth.occupancy.solid

    constant = fit_constant(sample(episode) for episode in training(settings, "best-constant"))
    return lambda episode: constant


def _prepare_true_poses(settings: Settings) -> Predictor:
    def predict(episode: Episode) -> BoolArray:
        assert episode.truth is not None
        assert episode.truth.poses is not None
        return _carved(episode, recognise(episode.truth.poses.poses.until(episode.end_ns), CONFIG))

    return predict


def _prepare_swept(settings: Settings) -> Predictor:
    def predict(episode: Episode) -> BoolArray:
        assert episode.truth is not None
        assert episode.truth.occupancy is not None
        states = _states(episode)
        swept = episode.truth.occupancy.swept_s <= episode.duration_s
        return np.asarray((states == VoxelState.SURFACE) | ((states == VoxelState.OCCLUDED) & ~swept))

    return predict


METHODS: Mapping[str, Method] = {
    method.name: method
    for method in (
        Method(
            TASK, "carve", "poses+frames", "occluded space is solid unless people stood or sat there", _prepare_carve
        ),
        Method(
            TASK,
            "carve-shuffled",
            "poses+frames",
            "carve with another episode's activity",
            _prepare_shuffled,
            control="shuffled-activity",
        ),
        Method(TASK, "all-solid", "frames", "all occluded space is solid", _prepare_all_solid, control="no-activity"),
        Method(TASK, "visible-only", "frames", "reference: only what the camera sees is solid", _prepare_visible_only),
        Method(
            TASK,
            "height-prior",
            "frames",
            "reference: solid within d behind a surface and below h, fitted on train",
            _prepare_height_prior,
            needs_train=True,
        ),
        Method(
            TASK,
            "carve-height-prior",
            "poses+frames",
            "what the height prior calls solid, less what people walked through",
            _prepare_carve_prior,
            needs_train=True,
        ),
        Method(
            TASK,
            "best-constant",
            "frames",
            "one answer for every episode, the best on train",
            _prepare_constant,
            control="best-constant",
            needs_train=True,
        ),
        Method(
            TASK,
            "carve-true-poses",
            "oracle-poses",
            "reference: carve with the true skeletons in place of the observed ones",
            _prepare_true_poses,
            oracle=True,
        ),
        Method(
            TASK,
            "carve-swept",
            "oracle-poses",
            "reference: the volume true bodies swept is free, evidence without error",
            _prepare_swept,
            oracle=True,
        ),
    )
}


def method(name: str) -> Method:
    """A method by name. Raises DataError for an unknown one, naming the known."""
    if name not in METHODS:
        raise DataError(f"method {name!r} is unknown; expected one of {', '.join(METHODS)}")
    return METHODS[name]
