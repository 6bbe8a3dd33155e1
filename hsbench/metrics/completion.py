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
floor, ceiling, wall, door, window or the frame of a passage, which is a door without a leaf (``STRUCTURE``).

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

Breakdown (``breakdown``): the known voxels of the room (region ``known``) by how they could be known: ``seen`` (free or
surface at t0), ``swept`` (not seen, a body entered) and ``never-observed`` (neither); and the ``occluded`` region by
height, ``0.0-0.5 m`` standing for 0.0 < z <= 0.5 of the voxel centre. Either set of parts adds up to its region.

Protocols: ``hsbench-occluded``, ``hsbench-surface-occluded`` and ``hsbench-known`` are the regions of those names.
``sscnet``, ``aicnet``, ``3dsketch``, ``monoscene`` and ``semantic-kitti`` follow other benchmarks exactly, with their
own voxels, ratios and averages: ``completion_protocols`` specifies them. ``score`` is for one scene, ``aggregate`` for
several. Labels are scored by ``semantic_completion``.

Differences from other scorers
------------------------------
* SSCNet and its descendants evaluate every unobserved voxel, or the surface too; the mask alone moves IoU by more
  than 20 points. Here the primary mask is occluded space only: lower than with visible surfaces.
* SSCNet sets unlabelled voxels (255) to empty and evaluates them; here they are ignored: higher precision.
* Walls, floor and ceiling count as solid in most scorers and are the easy part; here they leave the mask (and
  predicting them solid costs nothing): usually lower. ``occluded-with-structure`` keeps them.
* SSCNet averages precision, recall and IoU over scenes, a scene without solid voxels giving NaN; here counts are
  pooled, so rooms weigh by their occluded volume. The mean over episodes stands beside it in reports.
* Several scorers give 0 where nothing is solid or predicted, or count in float32, which stops at 2^24; here it is None
  and integers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hsbench.errors import SchemaError
from hsbench.metrics import voxel_masks
from hsbench.metrics.completion_protocols import FOREIGN, UNLABELLED, evaluated, ratios
from hsbench.metrics.tables import Counts as Counts
from hsbench.metrics.tables import count
from hsbench.metrics.voxel_masks import Bits, Masks, pack, unpack
from hsbench.schema.categories import CATEGORIES, STRUCTURE
from hsbench.schema.occupancy import OccupancyTruth
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, BoolArray, FloatArray

DEFAULT_VOXEL_M = 0.05
"""Side of a voxel where ``score`` is not told heights."""


@dataclass(frozen=True)
class CompletionScore:
    """One scene under a protocol: its name, the counts, and their ratios by the protocol's rule (None = undefined).

    verified_by: what the protocol's numbers were checked against; None = unverified.
    """

    protocol: str
    counts: Counts

    @property
    def precision(self) -> float | None:
        """Precision under the protocol."""
        return ratios(self.protocol, self.counts)[0]

    @property
    def recall(self) -> float | None:
        """Recall under the protocol."""
        return ratios(self.protocol, self.counts)[1]

    @property
    def iou(self) -> float | None:
        """Intersection over union under the protocol."""
        return ratios(self.protocol, self.counts)[2]

    @property
    def verified_by(self) -> str | None:
        """What the protocol's numbers were compared with."""
        return verification(self.protocol)


@dataclass(frozen=True)
class CompletionSummary:
    """Several scenes under a protocol, averaged by its rule; None = undefined.

    undefined_scenes: for precision, recall, IoU, in how many scenes the value has no denominator. counts: added up.
    """

    protocol: str
    precision: float | None
    recall: float | None
    iou: float | None
    scenes: int
    undefined_scenes: tuple[int, int, int]
    counts: Counts
    verified_by: str | None


REGIONS: tuple[str, ...] = tuple(voxel_masks.REGIONS)
"""Names of the regions of ``episode_counts``, the primary one first."""

OWN_PROTOCOLS: Mapping[str, str] = {
    "hsbench-occluded": "occluded",
    "hsbench-surface-occluded": "surface+occluded",
    "hsbench-known": "known",
}
"""Name of a protocol of hsbench -> region whose counts it scores."""

PROTOCOLS: tuple[str, ...] = (*OWN_PROTOCOLS, *FOREIGN)
"""All protocol names of ``score``."""

HEIGHTS_M = (0.0, 0.5, 1.0, 1.5, 2.0)
"""Limits of the height bands of ``breakdown``."""

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

    truth: (nx, ny, nz) category ids, 0 = free, or bool (solid; structure is then unknown and stays in the mask). For
    another benchmark's protocol any labels 0..254, 255 = unlabelled.
    prediction: (nx, ny, nz) bool or integers, occupied where not 0.
    state: (nx, ny, nz) uint8 of ``VoxelState``; all protocols but monoscene need it.
    ignored: (nx, ny, nz) bool, voxels to leave out; for other benchmarks' protocols they are unlabelled.
    z_m: (nz,) heights of voxel centres above the floor in metres; default (k + 1/2) 0.05, the grid of the task. Only
    hsbench's protocols know heights.
    Raises SchemaError for an unknown protocol and for arrays that do not fit, naming the array.
    """
    if protocol not in PROTOCOLS:
        raise SchemaError(f"completion protocol {protocol!r} is unknown; expected one of {', '.join(PROTOCOLS)}")
    foreign = FOREIGN.get(protocol)
    check_truth(truth, unlabelled=foreign is not None)
    occupied = _check_prediction(prediction, truth.shape)
    check_state(state, truth.shape, protocol, needed=foreign is None or foreign.needs_state)
    if ignored is not None:
        check_array(ignored, "ignored", truth.shape, np.bool_, "True where a voxel does not count")
    if foreign is not None:
        if z_m is not None:
            raise SchemaError(f"z_m is given; protocol {protocol} evaluates all heights")
        if prediction.dtype != np.bool_ and int(prediction.max()) == UNLABELLED:
            raise SchemaError(
                "prediction holds 255, the label of unlabelled truth; expected 0 = free, 1..254 = occupied"
            )
        labels, mask = evaluated(foreign, truth, state, ignored, semantic=False)
        return CompletionScore(protocol, count(labels != 0, occupied, mask))
    assert state is not None
    structure = STRUCTURE if truth.dtype != np.bool_ else frozenset()
    masks = Masks(truth, structure, state, ignored, None, heights(truth.shape, z_m))
    region = voxel_masks.REGIONS[OWN_PROTOCOLS[protocol]]
    return CompletionScore(protocol, _count(masks.solid, pack(occupied), masks.region(region)))


def aggregate(scores: Sequence[CompletionScore]) -> CompletionSummary:
    """Scores of several scenes, averaged as their protocol does: pooled counts, or the mean of the scenes' ratios.

    A mean over scenes is None as soon as one scene is undefined, where the source gives NaN.
    Raises SchemaError for no score or different protocols.
    """
    names = sorted({s.protocol for s in scores})
    if len(names) != 1:
        raise SchemaError(f"scores are of protocols {names}; expected one scene or more, all of one protocol")
    counts = sum((s.counts for s in scores), Counts())
    precisions, recalls, ious = zip(*((s.precision, s.recall, s.iou) for s in scores), strict=True)
    values = ratios(names[0], counts)
    if names[0] in FOREIGN and FOREIGN[names[0]].average == "scenes":
        values = (_mean(precisions), _mean(recalls), _mean(ious))
    undefined = (precisions.count(None), recalls.count(None), ious.count(None))
    return CompletionSummary(names[0], *values, len(scores), undefined, counts, verification(names[0]))


def verification(protocol: str) -> str | None:
    """What a protocol's numbers were compared with, None = unverified; a report must then say *unverified*."""
    if protocol in FOREIGN:
        return FOREIGN[protocol].verified_by
    if protocol == "hsbench-known":
        return "defined by hsbench; tests/reference/completion_loop.py, loops by the author of this scorer"
    return (
        "defined by hsbench; tests/reference/completion_from_tasks.py, loops by somebody who had not read this scorer"
    )


def episode_counts(truth: OccupancyTruth, prediction: BoolArray) -> dict[str, Counts]:
    """Counts of one episode in every region of ``REGIONS``.

    prediction: (nx, ny, nz) bool, occupied, on the grid of ``truth``. Raises SchemaError where it does not fit.
    """
    predicted = pack(_check_prediction(prediction, truth.grid.shape))
    z_m = tuple(truth.grid.axis_centres(2).tolist())
    masks = Masks(truth.semantic, STRUCTURE, truth.state, truth.ignored, truth.swept_s, z_m)
    return {name: _count(masks.solid, predicted, masks.region(region)) for name, region in voxel_masks.REGIONS.items()}


def breakdown(
    truth: OccupancyTruth, prediction: BoolArray, heights_m: Sequence[float] = HEIGHTS_M
) -> dict[str, Counts]:
    """Counts of one episode by how a voxel could be known, and of the occluded region by height; see the docstring.

    prediction: (nx, ny, nz) bool on the grid of ``truth``. heights_m: ascending limits of the bands, in metres.
    Raises SchemaError where something does not fit.
    """
    occupied = _check_prediction(prediction, truth.grid.shape)
    if len(heights_m) < 2 or any(not low < high for low, high in pairwise(heights_m)):
        raise SchemaError(f"heights_m is {tuple(heights_m)}; expected two or more ascending heights in metres")
    z_m = truth.grid.axis_centres(2)
    masks = Masks(truth.semantic, STRUCTURE, truth.state, truth.ignored, None, tuple(z_m.tolist()))
    known, occluded = (unpack(masks.region(voxel_masks.REGIONS[r]), truth.grid.shape) for r in ("known", "occluded"))
    seen = (truth.state == int(VoxelState.FREE)) | (truth.state == int(VoxelState.SURFACE))
    swept = np.isfinite(truth.swept_s)
    parts = {"seen": known & seen, "swept": known & ~seen & swept, "never-observed": known & ~seen & ~swept}
    for low, high in pairwise(heights_m):
        band = (z_m > low + voxel_masks.SLACK_M) & (z_m <= high + voxel_masks.SLACK_M)
        parts[f"{low:.1f}-{high:.1f} m"] = occluded & band
    return {name: count(truth.solid, occupied, mask) for name, mask in parts.items()}


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


def check_truth(truth: AnyArray, *, unlabelled: bool) -> None:
    """Raise SchemaError unless truth is a grid of category ids, or with ``unlabelled`` of labels 0..255, or bool."""
    if not isinstance(truth, np.ndarray) or truth.ndim != 3 or not truth.size:
        raise SchemaError(f"truth has shape {np.shape(truth)}; expected (nx, ny, nz): one scene at a time")
    if truth.dtype == np.bool_:
        return
    if truth.dtype.kind not in "ui":
        raise SchemaError(f"truth has dtype {truth.dtype}; expected category ids or bool")
    low, high = int(truth.min()), int(truth.max())
    if unlabelled and low >= 0 and high <= UNLABELLED:
        return
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


def heights(shape: tuple[int, ...], z_m: FloatArray | None) -> tuple[float, ...]:
    """Heights of voxel centres above the floor in metres: those given, else of the task's grid."""
    heights_m = (np.arange(shape[2]) + 0.5) * DEFAULT_VOXEL_M if z_m is None else np.asarray(z_m, np.float64)
    if heights_m.shape != shape[2:] or not np.isfinite(heights_m).all():
        raise SchemaError(f"z_m has shape {heights_m.shape} or is not finite; expected ({shape[2]},) metres")
    return tuple(heights_m.tolist())


def check_state(state: AnyArray | None, shape: tuple[int, ...], protocol: str, *, needed: bool) -> None:
    """Raise SchemaError unless ``state`` holds ``VoxelState`` on the grid, or is None and not needed."""
    if state is None:
        if needed:
            raise SchemaError(f"state is missing; protocol {protocol} needs to know which voxels the camera saw")
        return
    check_array(state, "state", shape, np.uint8, "values of VoxelState")
    if state.max() > max(VoxelState):
        raise SchemaError(f"state holds {state.max()}; expected 0..{max(VoxelState)} (the values of another data set?)")


def check_array(array: AnyArray, name: str, shape: tuple[int, ...], dtype: type, meaning: str) -> None:
    """Raise SchemaError unless ``array`` has the shape and dtype; ``meaning`` says what it should hold."""
    if not isinstance(array, np.ndarray) or array.shape != shape or array.dtype != np.dtype(dtype):
        found = f"{array.dtype} {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
        raise SchemaError(f"{name} is {found}; expected {np.dtype(dtype)} {shape}: {meaning}")


def _mean(values: Sequence[float | None]) -> float | None:
    defined = [value for value in values if value is not None]
    return sum(defined) / len(defined) if len(defined) == len(values) else None


def _ratios(numerator: AnyArray, denominator: AnyArray) -> FloatArray:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.true_divide(numerator, denominator))
