"""Methods that say yes in the best bins: fitted on train, then answering; and those of traces, which tasks share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hsbench.baselines.best_iou import answer, fit_bins
from hsbench.baselines.method import Method, Predictor, Settings, training
from hsbench.baselines.traces import Traces, own_traces, shuffled_traces
from hsbench.errors import DataError
from hsbench.evaluation.scorers import scorer
from hsbench.schema.episode import Episode
from hsbench.typing import BoolArray, IntArray

Places = Callable[[Episode], IntArray]
"""An episode -> (L, ...) number of the bin of each place, for each label."""

TraceBins = Callable[[Traces, Episode], IntArray]
"""What people left in a room, and the episode that looks at it -> bins as ``Places``."""

Labels = Callable[[Any], tuple[BoolArray, BoolArray]]
"""Truth as the task's scorer takes it -> (L, ...) bool labels and (...) bool: ignored."""


def prepare(
    settings: Settings, name: str, task: str, places: Places, bins: int, labels: Labels, asked: Places | None = None
) -> Callable[[Episode], BoolArray]:
    """An episode -> (L, ...) bool: the bins with the best IoU on train.

    asked: bins of the places of the episodes to answer, where they are not those of training (shuffled activity).
    """
    chosen = fit_bins(((places(e), *labels(truth(e, task))) for e in training(settings, name)), bins)
    return lambda episode: answer(chosen, (asked or places)(episode))


def trace_methods(
    task: str, summary: str, binned: TraceBins, bins: int, labels: Labels, finish: Callable[[BoolArray], Any]
) -> tuple[Method, Method]:
    """``traces`` of a task and its control ``traces-shuffled``. finish: (L, ...) bool -> a prediction."""

    def own(episode: Episode) -> IntArray:
        return binned(own_traces(episode), episode)

    def usual(settings: Settings) -> Predictor:
        said = prepare(settings, "traces", task, own, bins, labels)
        return lambda episode: finish(said(episode))

    def shuffled(settings: Settings) -> Predictor:
        others = shuffled_traces(settings, "traces-shuffled")
        said = prepare(settings, "traces-shuffled", task, own, bins, labels, lambda e: binned(others(e), e))
        return lambda episode: finish(said(episode))

    control = "traces of another episode's people, turned and clipped"
    return (
        Method(task, "traces", "poses", summary, usual, needs_train=True),
        Method(task, "traces-shuffled", "poses", control, shuffled, control="shuffled-activity", needs_train=True),
    )


def for_each(label_count: int, bins: IntArray) -> IntArray:
    """(...) bins -> (L, ...): the same for every label."""
    return np.broadcast_to(bins, (label_count, *bins.shape))


def truth(episode: Episode, task: str) -> Any:
    """What the scorer of a task takes of an episode. Raises DataError where it is not there."""
    known = scorer(task).truth(episode)
    if known is None:
        raise DataError(f"episode {episode.episode_id} lacks the truth of {task}, which training needs")
    return known
