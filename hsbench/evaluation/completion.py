"""Scoring task ``scene-completion``: tp, fp, fn, tn of every region, and their ratios.

Rules: ``hsbench.metrics.completion``.
"""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.metric import PooledMetric
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.metrics import completion
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.tasks.spec import TaskSpec
from hsbench.typing import BoolArray

RATIOS = {"iou": completion.iou, "precision": completion.precision, "recall": completion.recall}


def truth(episode: Episode) -> OccupancyTruth | None:
    """What is solid, and what the camera knew of it."""
    return None if episode.truth is None else episode.truth.occupancy


def statistics(true: OccupancyTruth, occupied: BoolArray | None, spec: TaskSpec) -> Statistics:
    """tp, fp, fn, tn of every region; a missing prediction counts as an empty one."""
    if true.grid != spec.grid:
        raise SchemaError(f"truth is on {true.grid}; task {spec.name} asks for {spec.grid}")
    answer = np.zeros(true.grid.shape, dtype=bool) if occupied is None else occupied
    counts = completion.episode_counts(true, answer)
    return {region: (c.tp, c.fp, c.fn, c.tn) for region, c in counts.items()}


COMPLETION = Scorer(
    truth,
    statistics,
    {
        f"{region}/{name}": PooledMetric(region, 4, ratio)
        for region in completion.REGIONS
        for name, ratio in RATIOS.items()
    },
    completion.PROTOCOL_VERSION,
)
