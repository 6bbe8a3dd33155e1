"""Scoring task ``affordance-view``: tables of the labels over the pixels of the empty room at t0."""

from __future__ import annotations

import numpy as np

from hsbench.evaluation.affordance import (
    exclusive_metrics,
    exclusive_statistics,
    label_metrics,
    predicted,
    table_statistics,
)
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.metrics import multilabel
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.tasks.probability_maps import LABELS
from hsbench.tasks.spec import TaskSpec
from hsbench.truth.view_affordance import stored_view
from hsbench.typing import Float32Array, UInt8Array

VERSION = "0"


def truth(episode: Episode) -> UInt8Array | None:
    """(rows, columns) bits of ``Affordance`` and ``VIEW_UNSCORED``."""
    return stored_view(episode)


def statistics(bits: UInt8Array, probability: Float32Array | None, spec: TaskSpec) -> Statistics:
    """Tables of the labels and of exclusive labels; a missing prediction has no label."""
    planes = multilabel.planes(bits, LABELS)
    ignored = (bits & VIEW_UNSCORED) > 0
    answer = np.zeros(planes.shape, dtype=np.bool_) if probability is None else predicted(probability)
    return {
        "labels": table_statistics(planes, answer, ignored),
        "exclusive": exclusive_statistics(planes, answer, ignored),
    }


AFFORDANCE_VIEW = Scorer(truth, statistics, {**label_metrics("", "labels"), **exclusive_metrics("exclusive")}, VERSION)
