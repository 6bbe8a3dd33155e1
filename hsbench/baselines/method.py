"""What a baseline is: prepared for a data set, and for some fitted on train, a method answers an episode at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError, SchemaError
from hsbench.schema.episode import Episode
from hsbench.schema.poses import PoseTable
from hsbench.tasks.registry import task
from hsbench.typing import Float32Array

Predictor = Callable[[Episode], Any]
"""An episode -> a prediction of the task."""


@dataclass(frozen=True)
class Settings:
    """What preparing a method takes: the data it will see, training data with truth (or None), a seed, and the file of
    weights of a network (None: those that come with hsbench).
    """

    data: Dataset
    train: Dataset | None
    seed: int = 0
    weights: Path | None = None


@dataclass(frozen=True)
class Method:
    """A method of one task.

    task: its name. track: the inputs it uses. control: which of the task's controls it is, None for others.
    needs_train: it is fitted on split train; oracle: it needs truth of the episode itself. weights: name of the weights
    of a network, None for others. Raises SchemaError where the task has no such track or control.
    """

    task: str
    name: str
    track: str
    summary: str
    prepare: Callable[[Settings], Predictor]
    control: str | None = None
    needs_train: bool = False
    oracle: bool = False
    weights: str | None = None

    def __post_init__(self) -> None:
        spec = task(self.task)
        if self.track not in spec.tracks:
            raise SchemaError(f"method {self.name}: track is {self.track!r}; expected one of {', '.join(spec.tracks)}")
        if self.control not in (None, *spec.controls):
            expected = ", ".join(spec.controls)
            raise SchemaError(f"method {self.name}: control is {self.control!r}; expected one of {expected}, or None")


def training(settings: Settings, name: str) -> Dataset:
    """The episodes that method ``name`` is fitted on. Raises DataError where there is none."""
    if settings.train is None or not len(settings.train):
        raise DataError(
            f"{name} is fitted on split train, which this data set lacks; name one that has it with --train"
        )
    return settings.train


def other_episodes(settings: Settings, name: str) -> Callable[[Episode], Episode]:
    """An episode -> the next one of the selection, for the last the first: whose activity a shuffled method takes.

    Raises DataError for a selection of one.
    """
    ids = settings.data.episode_ids
    if len(ids) < 2:
        raise DataError(f"{name} takes poses of another episode; found {len(ids)} episode in this selection")
    return lambda episode: settings.data[(ids.index(episode.episode_id) + 1) % len(ids)]


def observed(episode: Episode) -> PoseTable:
    """The observed poses. Raises DataError where there are none."""
    if episode.poses is None:
        raise DataError(f"episode {episode.episode_id} has no observed poses; methods that use activity need them")
    return episode.poses


def depth_at_t0(episode: Episode) -> Float32Array:
    """(h, w) depth in metres of the first frame, 0 = none. Raises DataError where there is no frame or no depth."""
    if not len(episode.frames):
        raise DataError(f"episode {episode.episode_id} has no frame, so no depth; this method needs the one at t0")
    depth = episode.frames[0].depth_m
    if depth is None:
        raise DataError(f"episode {episode.episode_id} has no depth; this method needs an RGB-D sensor")
    return depth
