"""Scoring task ``action-recognition``: a confusion matrix of poses, and segments of each observed track.

Rules: ``hsbench.metrics.action``. ``confusion/sit/stand`` is the share of true sitting that is answered standing;
``segment-f1-25`` is F1 of segments at overlap .25, a track being one sequence and a pose without answer in no segment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.evaluation.confusion import class_cells
from hsbench.evaluation.metric import Metric, PooledMetric, share
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.metrics import action
from hsbench.metrics.bootstrap import Statistic
from hsbench.metrics.segmentation import confusion_matrix
from hsbench.schema.episode import Episode
from hsbench.schema.states import Action
from hsbench.tasks.action_recognition import LABELS, NO_ANSWER
from hsbench.tasks.spec import TaskSpec
from hsbench.truth.observed_action import observed_actions
from hsbench.typing import Int32Array, UInt8Array

VERSION = "0"
ROWS, COLUMNS = len(Action), len(Action) + 1  # the last column holds poses without answer


@dataclass(frozen=True, eq=False)
class ActionTruth:
    """Of each observed pose: action (M,) uint8 of ``Action``, and track_id (M,) int32 as the detector gave it."""

    action: UInt8Array
    track_id: Int32Array


def truth(episode: Episode) -> ActionTruth | None:
    """What the observed people were doing."""
    if episode.truth is None or episode.truth.poses is None or episode.poses is None:
        return None
    return ActionTruth(observed_actions(episode.truth.poses), episode.poses.track_id)


def statistics(true: ActionTruth, answer: UInt8Array | None, spec: TaskSpec) -> Statistics:
    """The matrix [truth, answer], and right segments at each overlap, predicted and true ones; missing = no answers."""
    said = np.full(len(true.action), NO_ANSWER, dtype=np.uint8) if answer is None else answer
    table = confusion_matrix(true.action, said, ROWS, ignore=int(Action.IGNORED), no_answer=NO_ANSWER)
    segments = np.zeros(len(action.OVERLAPS) + 2, dtype=np.int64)
    for track in np.unique(true.track_id):
        own = true.track_id == track
        counts = action.segment_counts(true.action[own], said[own], ignore=int(Action.IGNORED), background=NO_ANSWER)
        segments += (*counts.hits, counts.predicted, counts.true)
    return {"confusion": tuple(table.reshape(-1).tolist()), "segments": tuple(segments.tolist())}


def _metrics() -> dict[str, Metric]:
    def pooled(value: Statistic) -> PooledMetric:
        return PooledMetric("confusion", ROWS * COLUMNS, value)

    of = {label: class_cells(label, ROWS, COLUMNS) for label in LABELS}
    every = [cell for cells in of.values() for cell in cells.row]
    named: dict[str, Metric] = {
        "macro-f1": pooled(action.macro_f1),
        "accuracy": pooled(share([cells.hits for cells in of.values()], every)),
    }
    for label, cells in of.items():
        name = label.name.lower()
        named[f"{name}/f1"] = pooled(cells.f1)
        named[f"{name}/precision"] = pooled(cells.precision)
        named[f"{name}/recall"] = pooled(cells.recall)
        for other in LABELS:
            named[f"confusion/{name}/{other.name.lower()}"] = pooled(share([cells.row[other]], cells.row))
        named[f"confusion/{name}/no-answer"] = pooled(share([cells.row[ROWS]], cells.row))
    n = len(action.OVERLAPS)
    for column, overlap in enumerate(action.OVERLAPS):
        both = share([column, column], [n, n + 1])
        named[f"segment-f1-{round(100 * overlap)}"] = PooledMetric("segments", n + 2, both)
    return named


ACTION_RECOGNITION = Scorer(truth, statistics, _metrics(), VERSION)
