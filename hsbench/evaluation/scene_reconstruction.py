"""Scoring task ``scene-reconstruction-360``: labelled voxels against affordance volumes and against true solids.

``mean-iou`` is over walkable, sittable, interactable and wall, against ``truth.affordance_volumes``. ``occupancy/``
takes sittable, interactable and wall as solid, against true solids; ``surface/`` are shares of the faces of either
within 10 cm of the other's (``hsbench.metrics.reconstruction``). ``scale-free/`` is the answer scaled about the origin,
the point of the floor below the camera, for the best mean IoU of the episode.
"""

from __future__ import annotations

import numpy as np

from hsbench.errors import SchemaError
from hsbench.evaluation.confusion import class_cells
from hsbench.evaluation.metric import Metric, PooledMetric, mean_of, share
from hsbench.evaluation.scale import FACTORS, best, source
from hsbench.evaluation.scorer import Scorer, Statistics
from hsbench.evaluation.voxel_faces import faces, near
from hsbench.geometry.grids import VoxelGrid
from hsbench.metrics.reconstruction import THRESHOLD_M
from hsbench.metrics.segmentation import confusion_matrix
from hsbench.metrics.tables import count
from hsbench.schema.episode import Episode
from hsbench.tasks.spec import TaskSpec
from hsbench.truth.affordance_volumes import Volume, VolumeTruth, volume_truth
from hsbench.typing import AnyArray, FloatArray, UInt8Array

VERSION = "0"
IGNORED = 255
LABELS = tuple(label for label in Volume if label is not Volume.NONE)
CELLS = {label: class_cells(label, len(Volume), len(Volume)) for label in LABELS}
MEAN_IOU = mean_of([cells.iou for cells in CELLS.values()])


def truth(episode: Episode) -> VolumeTruth | None:
    """Volumes and solids of the room."""
    known = episode.truth
    if known is None or known.scene is None or known.occupancy is None or known.affordance is None:
        return None
    return volume_truth(known.scene, known.occupancy, known.affordance)


def statistics(true: VolumeTruth, label: UInt8Array | None, spec: TaskSpec) -> Statistics:
    """Confusion matrices, counts of solid voxels and of near faces; a missing prediction is empty space."""
    if true.grid != spec.grid:
        raise SchemaError(f"truth is on {true.grid}; task {spec.name} asks for {spec.grid}")
    answer = np.zeros(true.grid.shape, dtype=np.uint8) if label is None else label
    wanted = np.where(true.ignored, np.uint8(IGNORED), true.labels)
    tables = [_table(wanted, answer)] + [_table(wanted, _scaled(answer, true.grid, f)) for f in FACTORS]
    chosen = best(MEAN_IOU(np.array(tables[1:])).tolist())
    solid = (answer != Volume.NONE) & (answer != Volume.WALKABLE)
    voxels = count(true.solid, solid, ~true.ignored)
    said, there = faces(solid & ~true.ignored), faces(true.solid & ~true.ignored)
    reach_voxels = THRESHOLD_M / true.grid.voxel_m
    return {
        "volumes": tables[0],
        "scale-free": tables[1 + chosen],
        "occupancy": (voxels.tp, voxels.fp, voxels.fn),
        "surface": (
            near(said, there, reach_voxels),
            int(np.count_nonzero(said)),
            near(there, said, reach_voxels),
            int(np.count_nonzero(there)),
        ),
    }


def _table(truth: UInt8Array, answer: UInt8Array) -> tuple[int, ...]:
    return tuple(confusion_matrix(truth, answer, len(Volume), ignore=IGNORED).reshape(-1).tolist())


def _scaled(answer: UInt8Array, grid: VoxelGrid, factor: float) -> UInt8Array:
    """Labels scaled about the origin of the frame; what comes from outside has none."""
    padded = np.pad(answer, ((0, 1), (0, 1), (0, 1)))  # index -1 is the border without labels
    x, y, z = (source(n, -low / grid.voxel_m, factor) for n, low in zip(answer.shape, grid.origin_m, strict=True))
    _, width, height = padded.shape
    upright = (y[:, None] % width) * height + z % height  # both in one index: six times faster than one by one
    return np.asarray(padded.reshape(len(padded), -1)[x].take(upright.reshape(-1), axis=1).reshape(answer.shape))


def _f_score(counts: AnyArray) -> FloatArray:
    """(..., 4) near and all predicted, near and all true faces -> (...) F; 0 where one side alone has faces."""
    predicted_near, predicted, true_near, true = np.moveaxis(np.asarray(counts), -1, 0)
    accuracy = predicted_near / np.maximum(predicted, 1)
    completeness = true_near / np.maximum(true, 1)
    both = accuracy + completeness
    value = np.where(both > 0, 2 * accuracy * completeness / np.where(both > 0, both, 1.0), 0.0)
    return np.asarray(np.where(predicted + true > 0, value, np.nan))


def _metrics() -> dict[str, Metric]:
    cells = len(Volume) ** 2
    named: dict[str, Metric] = {}
    for prefix, name in (("", "volumes"), ("scale-free/", "scale-free")):
        named[f"{prefix}mean-iou"] = PooledMetric(name, cells, MEAN_IOU)
        for label, of in CELLS.items():
            for ratio in ("iou", "precision", "recall"):
                named[f"{prefix}{label.name.lower()}/{ratio}"] = PooledMetric(name, cells, getattr(of, ratio))
    named["occupancy/iou"] = PooledMetric("occupancy", 3, share([0], [0, 1, 2]))
    named["occupancy/precision"] = PooledMetric("occupancy", 3, share([0], [0, 1]))
    named["occupancy/recall"] = PooledMetric("occupancy", 3, share([0], [0, 2]))
    named["surface/accuracy"] = PooledMetric("surface", 4, share([0], [1]))
    named["surface/completeness"] = PooledMetric("surface", 4, share([2], [3]))
    named["surface/f-score"] = PooledMetric("surface", 4, _f_score)
    return named


SCENE_RECONSTRUCTION = Scorer(truth, statistics, _metrics(), VERSION)
