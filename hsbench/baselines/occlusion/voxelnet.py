"""The network of scene completion by name: with activity, without, and with another episode's."""

from __future__ import annotations

from collections.abc import Callable

from hsbench.baselines.method import Method, Predictor, Settings, depth_at_t0, observed, other_episodes
from hsbench.baselines.model_card import bundled
from hsbench.baselines.occlusion.action import Activity, recognise
from hsbench.baselines.occlusion.boundary import Boundary, estimate_boundary
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.shuffle import shuffled_activity
from hsbench.baselines.occlusion.voxelnet_features import depth_features, evidence
from hsbench.schema.episode import Episode
from hsbench.synth.seeds import Seeds
from hsbench.tasks.scene_completion import SCENE_COMPLETION
from hsbench.typing import BoolArray

TASK = SCENE_COMPLETION.name
WITH, ALONE = "voxelnet", "voxelnet-alone"


def _activity(episode: Episode, config: CarveConfig) -> Activity:
    return recognise(observed(episode), config)


def _boundary(episode: Episode) -> Boundary:
    return estimate_boundary(episode.sensor, depth_at_t0(episode), episode.poses)


def _predictor(
    settings: Settings, name: str, activity_of: Callable[[Episode, CarveConfig], Activity] | None
) -> Predictor:
    """The network of the weights ``name`` fed with the activity of an episode, or with none."""
    import hsbench.baselines.training  # noqa: F401, names the extra where torch is missing
    from hsbench.baselines.occlusion.voxelnet_training import answers, load_network

    model = load_network(settings.weights or bundled(name), activity=activity_of is not None)
    carving = model.config.carving

    def predict(episode: Episode) -> BoolArray:
        seen = None if activity_of is None else evidence(activity_of(episode, carving), carving)
        return answers(model, depth_features(episode), seen)

    return predict


def _prepare_with(settings: Settings) -> Predictor:
    return _predictor(settings, WITH, _activity)


def _prepare_alone(settings: Settings) -> Predictor:
    return _predictor(settings, ALONE, None)


def _prepare_shuffled(settings: Settings) -> Predictor:
    """Each episode gets the activity of the next one of the selection, the last that of the first."""
    other_of = other_episodes(settings, "voxelnet-shuffled")
    seeds = Seeds(settings.seed).child("shuffled-activity")

    def activity(episode: Episode, config: CarveConfig) -> Activity:
        other = other_of(episode)
        rng = seeds.rng(episode.episode_id)
        return shuffled_activity(_activity(other, config), _boundary(other), _boundary(episode), rng)

    return _predictor(settings, WITH, activity)


METHODS = (
    Method(
        TASK,
        WITH,
        "poses+frames",
        "3D encoder-decoder on the depth at t0 and maps of where people stood and sat, trained on train",
        _prepare_with,
        weights=WITH,
    ),
    Method(
        TASK,
        ALONE,
        "frames",
        "the same network trained without activity",
        _prepare_alone,
        control="no-activity",
        weights=ALONE,
    ),
    Method(
        TASK,
        "voxelnet-shuffled",
        "poses+frames",
        "voxelnet with another episode's activity",
        _prepare_shuffled,
        control="shuffled-activity",
        weights=WITH,
    ),
)
