"""Semantic scene completion: what solid voxels are, under hsbench's protocols and those of other benchmarks.

Task
----
A method labels every voxel of the grid: 0 free, 1..n-1 classes. Truth and states are those of ``completion``.

Conventions
-----------
``confusion[t, p]`` counts the voxels of the protocol's mask, int64. Free voxels count: a class predicted in free space
is false, a class predicted free is missed. The free class itself has an IoU but is in no mean.

Metrics
-------
IoU of a class = TP / (row + column - TP); mean IoU over classes 1..n-1 by the protocol's rule.

- ``hsbench-occluded``, ``hsbench-surface-occluded``, ``hsbench-known``: the regions of ``completion``; matrices are
  added first; a class neither true nor predicted is left out of the mean and counted. With category ids, structure
  (floor, ceiling, wall, door, window, passage) is neither in the mask nor in the mean.
- ``sscnet``, ``aicnet``, ``3dsketch``, ``monoscene``, ``semantic-kitti``: the table of ``completion_protocols``.

Differences from other scorers
------------------------------
* The mask: as for ``completion``, and the surface is easier to label than occluded space.
* ``sscnet`` averages eleven classes, and one class without voxels makes the mean undefined. ``monoscene`` and
  ``semantic-kitti`` count it 0: lower. ``aicnet`` skips it a scene, even where it is predicted: higher.
* MonoScene adds 1e-5 and semantic-kitti 1e-15 below the fraction; hsbench nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics import segmentation, voxel_masks
from hsbench.metrics.completion import (
    OWN_PROTOCOLS,
    PROTOCOLS,
    check_array,
    check_state,
    check_truth,
    heights,
    verification,
)
from hsbench.metrics.completion_protocols import (
    FOREIGN,
    KITTI_CLASS_EPSILON,
    MONOSCENE_EPSILON,
    UNLABELLED,
    evaluated,
)
from hsbench.metrics.labels import check_integer, check_labels, out_of_range
from hsbench.metrics.segmentation import confusion_matrix, mean_defined
from hsbench.metrics.voxel_masks import Masks, unpack
from hsbench.schema.categories import CATEGORIES, STRUCTURE
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class SemanticScore:
    """One scene under a protocol. confusion: (n, n) int64 [truth, prediction] over the protocol's voxels."""

    protocol: str
    confusion: IntArray


@dataclass(frozen=True)
class SemanticSummary:
    """Scenes under a protocol; None = undefined.

    class_iou: of classes 1..n-1. undefined_classes: of those in the mean, how many are neither true nor predicted;
    absent_classes: without truth. verified_by: None = unverified.
    """

    protocol: str
    class_iou: tuple[float | None, ...]
    mean_iou: float | None
    undefined_classes: int
    absent_classes: int
    scenes: int
    verified_by: str | None


def score(
    truth: AnyArray,
    prediction: AnyArray,
    state: AnyArray | None = None,
    protocol: str = "hsbench-occluded",
    *,
    n_classes: int | None = None,
    ignored: BoolArray | None = None,
    z_m: FloatArray | None = None,
) -> SemanticScore:
    """Count one scene under a named protocol.

    truth: (nx, ny, nz) labels 0..n-1, for other benchmarks' protocols also 255 = unlabelled; hsbench's: category ids.
    prediction: (nx, ny, nz) labels 0..n-1. n_classes: n, the free class included; default the category table.
    state, ignored, z_m: as ``completion.score``. Raises SchemaError for what does not fit.
    """
    if protocol not in PROTOCOLS:
        raise SchemaError(f"completion protocol {protocol!r} is unknown; expected one of {', '.join(PROTOCOLS)}")
    foreign = FOREIGN.get(protocol)
    n = len(CATEGORIES) + 1 if n_classes is None else n_classes
    check_integer(n, "n_classes", 2, UNLABELLED)
    if foreign is None and n != len(CATEGORIES) + 1:
        raise SchemaError(f"n_classes is {n}; expected {len(CATEGORIES) + 1}, the category table and the free class")
    check_truth(truth, unlabelled=foreign is not None)
    if truth.dtype == np.bool_:
        raise SchemaError("truth is bool; expected labels (whether a voxel is solid is scored by completion.score)")
    check_labels(prediction, "prediction", truth.shape)
    outside = (prediction < 0) | (prediction >= n)
    if outside.any():
        raise out_of_range(prediction, "prediction", outside, n, "", None)
    check_state(state, truth.shape, protocol, needed=foreign is None or foreign.needs_state)
    if ignored is not None:
        check_array(ignored, "ignored", truth.shape, np.bool_, "True where a voxel does not count")
    if foreign is not None:
        if z_m is not None:
            raise SchemaError(f"z_m is given; protocol {protocol} evaluates all heights")
        labels, mask = evaluated(foreign, truth, state, ignored, semantic=True)
    else:
        assert state is not None
        masks = Masks(truth, STRUCTURE, state, ignored, None, heights(truth.shape, z_m))
        labels, mask = truth, unpack(masks.region(voxel_masks.REGIONS[OWN_PROTOCOLS[protocol]]), truth.shape)
    return SemanticScore(protocol, confusion_matrix(labels[mask], prediction[mask], n))


def aggregate(scores: Sequence[SemanticScore]) -> SemanticSummary:
    """Scenes averaged by their protocol's rule. Raises SchemaError for none, or different protocols or classes."""
    names, sizes = sorted({s.protocol for s in scores}), sorted({len(s.confusion) for s in scores})
    if len(names) != 1 or len(sizes) != 1:
        raise SchemaError(f"scores are of protocols {names}, classes {sizes}; expected scenes of one protocol and size")
    name, matrices = names[0], [s.confusion for s in scores]
    pooled = np.stack(matrices).sum(axis=0)
    classes = [c for c in range(1, sizes[0]) if name in FOREIGN or c not in STRUCTURE]
    plain = segmentation.score(pooled, "scannet" if name == "sscnet" else "hsbench", classes=classes)
    class_iou, mean = plain.iou[1:], plain.mean_iou
    if name == "aicnet":
        class_iou, mean = _over_scenes_with_class(matrices)
    elif name in ("monoscene", "semantic-kitti"):
        epsilon = MONOSCENE_EPSILON if name == "monoscene" else KITTI_CLASS_EPSILON
        hits = np.diagonal(pooled)
        values = (hits / (pooled.sum(axis=0) + pooled.sum(axis=1) - hits + epsilon))[1:]
        class_iou, mean = tuple(map(float, values)), float(values.mean())
    return SemanticSummary(
        name, class_iou, mean, plain.undefined_classes, plain.absent_classes, len(matrices), verification(name)
    )


def _over_scenes_with_class(matrices: Sequence[IntArray]) -> tuple[tuple[float, ...], float | None]:
    """``aicnet``: IoU of a class, mean over the scenes that have it (0 without any); mean over classes that occur."""
    scenes = [segmentation.score(matrix) for matrix in matrices]
    present = [
        [scene.iou[c] for scene in scenes if scene.class_accuracy[c] is not None] for c in range(len(matrices[0]))
    ]
    means = [mean_defined(values) for values in present[1:]]
    return tuple(0.0 if mean is None else mean for mean in means), mean_defined(means)
