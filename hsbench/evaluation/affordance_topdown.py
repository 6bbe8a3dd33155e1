"""Scoring task ``affordance-topdown``: tables of the labels on a plan, as given and scaled about the camera."""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.affordance import (
    exclusive_metrics,
    exclusive_statistics,
    label_metrics,
    predicted,
    table_statistics,
)
from hsbench.evaluation.scale import FACTORS, best, source
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.metrics import multilabel
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.tasks.probability_maps import LABELS
from hsbench.tasks.spec import PlanGrid, TaskSpec
from hsbench.typing import BoolArray, Float32Array

VERSION = "0"


def truth(episode: Episode) -> AffordanceTruth | None:
    """Labels of cells, and which are ignored."""
    return None if episode.truth is None else episode.truth.affordance


def statistics(true: AffordanceTruth, probability: Float32Array | None, spec: TaskSpec) -> Statistics:
    """Tables of the labels, of exclusive labels, and of the best scaled answer; a missing one has no label."""
    grid = PlanGrid(true.labels.shape, true.cell_m)
    if grid != spec.grid:
        raise SchemaError(f"truth is on {grid}; task {spec.name} asks for {spec.grid}")
    planes = multilabel.planes(true.labels, LABELS)
    answer = np.zeros(planes.shape, dtype=np.bool_) if probability is None else predicted(probability)
    tables = table_statistics(planes, answer, true.ignored)
    scaled = [table_statistics(planes, _scaled(answer, factor), true.ignored) for factor in FACTORS]
    chosen = best(multilabel.mean_iou(np.array(scaled)).tolist())
    return {
        "labels": tables,
        "exclusive": exclusive_statistics(planes, answer, true.ignored),
        "scale-free": scaled[chosen],
    }


def _scaled(answer: BoolArray, factor: float) -> BoolArray:
    """(3, rows, columns) bool scaled about the middle; what comes from outside has no label."""
    rows, columns = (source(count, count / 2, factor) for count in answer.shape[1:])
    padded = np.pad(answer, ((0, 0), (0, 1), (0, 1)))  # index -1 is the border of no labels
    return np.ascontiguousarray(padded[:, rows[:, None], columns])


AFFORDANCE_TOPDOWN = Scorer(
    truth,
    statistics,
    {**label_metrics("", "labels"), **exclusive_metrics("exclusive"), **label_metrics("scale-free/", "scale-free")},
    VERSION,
)
