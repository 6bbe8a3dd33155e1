"""Scene completion: which voxels of a room are solid, scored where the camera could not see.

Task
----
A method watches a room and says of every voxel of a fixed grid whether it is occupied. Truth is solid space with
closed interiors (a shut cupboard is solid, the space under a table is free), as it was at t0.

Conventions
-----------
Voxel arrays are indexed [x, y, z] in the episode frame, floor at z = 0. Truth is a category id per voxel, 0 = free,
or a bool. ``state`` holds ``VoxelState``: what the noise-free, person-free view at t0 knew of a voxel; it belongs
to truth and is never computed from a prediction. Counts are Python integers: exact at any size.

Metrics
-------
TP solid and predicted, FP free and predicted, FN solid and not predicted, TN neither, over the voxels of a mask.
precision = TP / (TP + FP); recall = TP / (TP + FN); IoU = TP / (TP + FP + FN). A ratio without a denominator is
None: precision where nothing is predicted, recall where nothing is solid, IoU where neither. Over many episodes
counts are added first and divided once ("pooled").

Masks. All hsbench masks hold voxels inside the room (state is not OUTSIDE_ROOM), not ignored (truth does not differ
from t0 for more than half of the episode), and, unless said otherwise, with centre at 0 < z <= 2.0 m and truth not
floor, ceiling, wall, door or window (``STRUCTURE``).

| region | further condition |
|---|---|
| ``occluded`` | OCCLUDED: the primary one |
| ``surface+occluded`` | SURFACE or OCCLUDED |
| ``known`` | any state but UNKNOWN: all voxels whose truth is known |
| ``everything`` | any state but UNKNOWN, no limits on z, structure counts as solid: every voxel whose truth is known |
| ``occluded-full-height`` | OCCLUDED, no limits on z |
| ``occluded-with-structure`` | OCCLUDED, structure counts as solid |
| ``outside-frustum`` | OUTSIDE_FOV |
| ``occluded-swept`` | OCCLUDED, a body entered the voxel during the episode |
| ``occluded-unswept`` | OCCLUDED, none did |

Protocols: ``hsbench-occluded``, ``hsbench-surface-occluded`` and ``hsbench-known`` are the regions of those names.
``monoscene`` is region ``everything``: MonoScene (Cao, de Charette, CVPR 2022) and VoxFormer evaluate all voxels with
a label, structure and visible ones too, counts pooled over scenes.

Differences from other scorers
------------------------------
* SSCNet and its descendants evaluate every unobserved voxel, or the surface too; the mask alone moves IoU by more
  than 20 points. Here the primary mask is occluded space only: lower than with visible surfaces.
* SSCNet sets unlabelled voxels (255) to empty and evaluates them; here they are ignored: higher precision.
* Walls, floor and ceiling count as solid in most scorers and are the easy part; here they leave the mask (and
  predicting them solid costs nothing): usually lower. ``occluded-with-structure`` keeps them.
* SSCNet averages precision, recall and IoU over scenes, a scene without solid voxels giving NaN; here counts are
  pooled, so rooms weigh by their occluded volume. The mean over episodes stands beside it in reports.
* MonoScene and VoxFormer add 1e-5 to the denominator, so truth as prediction is below 1 and an absent class is 0;
  here it is exactly 1, and absent is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics import voxel_masks
from hsbench.metrics.voxel_masks import Bits, Masks, pack, unpack
from hsbench.schema.categories import CATEGORIES, STRUCTURE
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, BoolArray, FloatArray

DEFAULT_VOXEL_M = 0.05
"""Side of a voxel where ``score`` is not told heights."""


@dataclass(frozen=True)
class Counts:
    """Sufficient statistics of one mask: voxels that are solid and predicted, only predicted, only solid, neither."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.tp + other.tp, self.fp + other.fp, self.fn + other.fn, self.tn + other.tn)

    @property
    def precision(self) -> float | None:
        """TP / (TP + FP), None where nothing is predicted."""
        return _ratio(self.tp, self.tp + self.fp)

    @property
    def recall(self) -> float | None:
        """TP / (TP + FN), None where nothing is solid."""
        return _ratio(self.tp, self.tp + self.fn)

    @property
    def iou(self) -> float | None:
        """TP / (TP + FP + FN), None where nothing is solid or predicted."""
        return _ratio(self.tp, self.tp + self.fp + self.fn)


@dataclass(frozen=True)
class CompletionScore:
    """What ``score`` returns: the protocol's name, its counts, and their ratios (None = undefined)."""

    protocol: str
    counts: Counts

    @property
    def precision(self) -> float | None:
        """Precision under the protocol."""
        return self.counts.precision

    @property
    def recall(self) -> float | None:
        """Recall under the protocol."""
        return self.counts.recall

    @property
    def iou(self) -> float | None:
        """Intersection over union under the protocol."""
        return self.counts.iou


REGIONS: tuple[str, ...] = tuple(voxel_masks.REGIONS)
"""Names of the regions of ``episode_counts``, the primary one first."""

PROTOCOLS: Mapping[str, str] = {
    "hsbench-occluded": "occluded",
    "hsbench-surface-occluded": "surface+occluded",
    "hsbench-known": "known",
    "monoscene": "everything",
}
"""Protocol name -> region whose counts it scores."""

PROTOCOL_VERSION = "0"
"""Raised when a mask or a rule above changes."""


def score(
    truth: AnyArray,
    prediction: AnyArray,
    state: AnyArray | None = None,
    protocol: str = "hsbench-occluded",
    *,
    ignored: BoolArray | None = None,
    z_m: FloatArray | None = None,
) -> CompletionScore:
    """Score one scene under a named protocol.

    truth: (nx, ny, nz) category ids, 0 = free, or bool (solid; structure is then unknown and stays in the mask).
    prediction: (nx, ny, nz) bool or integers, occupied where not 0.
    state: (nx, ny, nz) uint8 of ``VoxelState``; the hsbench protocols need it.
    ignored: (nx, ny, nz) bool, voxels to leave out. z_m: (nz,) heights of voxel centres above the floor in metres;
    default (k + 1/2) 0.05, the grid of the task.
    Raises SchemaError for an unknown protocol and for arrays that do not fit, naming the array.
    """
    if protocol not in PROTOCOLS:
        raise SchemaError(f"completion protocol {protocol!r} is unknown; expected one of {', '.join(PROTOCOLS)}")
    _check_truth(truth)
    structure = STRUCTURE if truth.dtype != np.bool_ else frozenset()
    predicted = pack(_check_prediction(prediction, truth.shape))
    if state is None:
        raise SchemaError(f"state is missing; protocol {protocol} needs to know which voxels the camera saw")
    _check(state, "state", truth.shape, np.uint8, "values of VoxelState")
    if state.max() > max(VoxelState):
        raise SchemaError(f"state holds {state.max()}; expected 0..{max(VoxelState)} (the values of another data set?)")
    if ignored is not None:
        _check(ignored, "ignored", truth.shape, np.bool_, "True where a voxel does not count")
    heights_m = (np.arange(truth.shape[2]) + 0.5) * DEFAULT_VOXEL_M if z_m is None else np.asarray(z_m, np.float64)
    if heights_m.shape != truth.shape[2:] or not np.isfinite(heights_m).all():
        raise SchemaError(f"z_m has shape {heights_m.shape} or is not finite; expected ({truth.shape[2]},) metres")
    masks = Masks(truth, structure, state, ignored, None, tuple(heights_m.tolist()))
    return CompletionScore(
        protocol, _count(masks.solid, predicted, masks.region(voxel_masks.REGIONS[PROTOCOLS[protocol]]))
    )


def episode_counts(truth: OccupancyTruth, prediction: BoolArray) -> dict[str, Counts]:
    """Counts of one episode in every region of ``REGIONS``.

    prediction: (nx, ny, nz) bool, occupied, on the grid of ``truth``. Raises SchemaError where it does not fit.
    """
    predicted = pack(_check_prediction(prediction, truth.grid.shape))
    z_m = tuple(truth.grid.axis_centres(2).tolist())
    masks = Masks(truth.semantic, STRUCTURE, truth.state, truth.ignored, truth.swept_s, z_m)
    return {name: _count(masks.solid, predicted, masks.region(region)) for name, region in voxel_masks.REGIONS.items()}


def primary_mask(truth: OccupancyTruth) -> BoolArray:
    """(nx, ny, nz) bool: the voxels of region ``occluded``, for methods that are fitted to the primary metric."""
    z_m = tuple(truth.grid.axis_centres(2).tolist())
    masks = Masks(truth.semantic, STRUCTURE, truth.state, truth.ignored, None, z_m)
    return unpack(masks.region(voxel_masks.REGIONS["occluded"]), truth.grid.shape)


def precision(counts: AnyArray) -> FloatArray:
    """(..., 4) counts tp, fp, fn, tn -> (...) precision, NaN where undefined: the vectorised form for resampling."""
    return _ratios(counts[..., 0], counts[..., 0] + counts[..., 1])


def recall(counts: AnyArray) -> FloatArray:
    """(..., 4) counts tp, fp, fn, tn -> (...) recall, NaN where undefined."""
    return _ratios(counts[..., 0], counts[..., 0] + counts[..., 2])


def iou(counts: AnyArray) -> FloatArray:
    """(..., 4) counts tp, fp, fn, tn -> (...) intersection over union, NaN where undefined."""
    return _ratios(counts[..., 0], counts[..., 0] + counts[..., 1] + counts[..., 2])


def _count(solid: Bits, predicted: Bits, mask: Bits) -> Counts:
    mask_solid = mask & solid
    in_mask, truths, predictions, tp = (
        int(np.bitwise_count(bits).sum(dtype=np.int64))
        for bits in (mask, mask_solid, mask & predicted, mask_solid & predicted)
    )
    return Counts(tp, predictions - tp, truths - tp, in_mask - truths - predictions + tp)


def _check_truth(truth: AnyArray) -> None:
    if not isinstance(truth, np.ndarray) or truth.ndim != 3 or not truth.size:
        raise SchemaError(f"truth has shape {np.shape(truth)}; expected (nx, ny, nz): one scene at a time")
    if truth.dtype == np.bool_:
        return
    if truth.dtype.kind not in "ui":
        raise SchemaError(f"truth has dtype {truth.dtype}; expected category ids or bool")
    low, high = int(truth.min()), int(truth.max())
    if low < 0 or high > len(CATEGORIES):
        raise SchemaError(
            f"truth holds {low if low < 0 else high}; expected category ids 0..{len(CATEGORIES)}"
            " (if it marks voxels without truth, pass them as ignored)"
        )


def _check_prediction(prediction: AnyArray, shape: tuple[int, ...]) -> BoolArray:
    if not isinstance(prediction, np.ndarray):
        raise SchemaError(f"prediction is a {type(prediction).__name__}; expected a numpy array of shape {shape}")
    if prediction.dtype.kind == "f":
        nan = " and holds NaN" if np.isnan(prediction).any() else ""
        raise SchemaError(
            f"prediction has dtype {prediction.dtype}{nan}; expected bool (probabilities? choose a threshold first)"
        )
    if prediction.dtype.kind not in "bui":
        raise SchemaError(f"prediction has dtype {prediction.dtype}; expected bool")
    if prediction.shape != shape:
        packed = (*shape[:2], -(-shape[2] // 8))
        if prediction.shape == packed:
            hint = " (a packed bit array? unpack it first)"
        elif sorted(prediction.shape) == sorted(shape):
            hint = " (axes in another order?)"
        else:
            hint = ""
        raise SchemaError(f"prediction has shape {prediction.shape}; expected {shape}{hint}")
    if prediction.dtype == np.bool_:
        return prediction
    if prediction.dtype.kind == "i" and prediction.min() < 0:
        raise SchemaError(f"prediction holds {prediction.min()}; expected 0 = free, positive = occupied")
    return np.asarray(prediction != 0)


def _check(array: AnyArray, name: str, shape: tuple[int, ...], dtype: type, meaning: str) -> None:
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype != np.dtype(dtype):
        found = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
        raise SchemaError(f"{name} is {found}; expected {np.dtype(dtype)} {shape}: {meaning}")


def _ratio(numerator: int, denominator: int) -> float | None:
    return numerator / denominator if denominator else None


def _ratios(numerator: AnyArray, denominator: AnyArray) -> FloatArray:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.true_divide(numerator, denominator))
