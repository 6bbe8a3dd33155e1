"""Preparing a method that says yes in the best bins: fit on train, then answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hsbench.baselines.best_iou import answer, fit_bins
from hsbench.baselines.method import Settings, training
from hsbench.errors import DataError
from hsbench.evaluation.scorers import scorer
from hsbench.schema.episode import Episode
from hsbench.typing import BoolArray, IntArray

Places = Callable[[Episode], IntArray]
"""An episode -> (L, ...) number of the bin of each place, for each label."""

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


def truth(episode: Episode, task: str) -> Any:
    """What the scorer of a task takes of an episode. Raises DataError where it is not there."""
    known = scorer(task).truth(episode)
    if known is None:
        raise DataError(f"episode {episode.episode_id} lacks the truth of {task}, which training needs")
    return known
