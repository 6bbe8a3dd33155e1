"""Task ``object-detection-3d``: which furniture stands where, also where the camera sees none of it.

A prediction file holds, for N <= 64 boxes, ``boxes`` float32 (N, 7): centre x y z, size along the box's own axes, in
metres, and yaw about +z in radians, in the episode frame; ``scores`` float32 (N,) in 0..1, larger = surer;
``category_ids`` uint8 (N,) of the category table, 0 = no class said; and ``operating_score`` float32 (1,): from which
score on the method itself would call a box found. Metrics: ``hsbench.metrics.detection``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.boxes import LARGEST_M, SMALLEST_M
from hsbench.io.arrays import ArraySpec
from hsbench.schema.categories import CATEGORIES
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.scene_completion import GRID
from hsbench.tasks.spec import CONTROLS, OBSERVATION_TIMES_S, TRACKS, TaskSpec
from hsbench.typing import AnyArray, Float32Array, UInt8Array

MAX_BOXES = 64
CLASSES = tuple(category for category in CATEGORIES if category.group == "furniture")
"""The classes a box may have."""

ARRAYS = {
    "boxes": ArraySpec((None, 7), "float32"),
    "scores": ArraySpec((None,), "float32"),
    "category_ids": ArraySpec((None,), "uint8"),
    "operating_score": ArraySpec((1,), "float32"),
}


@dataclass(frozen=True, eq=False)
class Boxes:
    """The boxes found in one episode, as the file holds them. Raises SchemaError where a value does not fit.

    boxes: (N, 7) float32. scores: (N,) float32. category_ids: (N,) uint8. operating_score: (1,) float32.
    """

    boxes: Float32Array
    scores: Float32Array
    category_ids: UInt8Array
    operating_score: Float32Array

    def __post_init__(self) -> None:
        arrays = encode(self)
        for name, spec in ARRAYS.items():
            if fault := spec.fault(arrays[name].shape, arrays[name].dtype):
                raise SchemaError(f"{name}: {fault}")
        if wrong := faults(arrays):
            raise SchemaError(wrong[0])

    @classmethod
    def none(cls) -> Boxes:
        """No box at all: the missing answer."""
        return cls.of(np.zeros((0, 7)), np.zeros(0))

    @classmethod
    def of(
        cls, boxes: AnyArray, scores: AnyArray, category_ids: AnyArray | None = None, operating_score: float = 0.5
    ) -> Boxes:
        """From arrays of any number type; without ``category_ids`` no class is said."""
        ids = np.zeros(len(boxes), dtype=np.uint8) if category_ids is None else category_ids
        return cls(
            np.asarray(boxes, dtype=np.float32),
            np.asarray(scores, dtype=np.float32),
            np.asarray(ids, dtype=np.uint8),
            np.array([operating_score], dtype=np.float32),
        )


def encode(found: Boxes) -> dict[str, AnyArray]:
    """Boxes -> the arrays of a prediction file."""
    if not isinstance(found, Boxes):
        raise SchemaError(f"prediction is {type(found).__name__}; expected hsbench.tasks.object_detection.Boxes")
    return {item.name: getattr(found, item.name) for item in fields(found)}


def decode(arrays: Mapping[str, AnyArray]) -> Boxes:
    """The inverse of ``encode``."""
    return Boxes(**{name: arrays[name] for name in ARRAYS})


def faults(arrays: Mapping[str, AnyArray]) -> list[str]:
    """What is wrong with the values of a prediction file, a line each; of rows beyond ``MAX_BOXES`` only that."""
    boxes, scores, ids, operating = (arrays[name] for name in ARRAYS)
    found = []
    if len(boxes) > MAX_BOXES:
        found.append(f"{len(boxes)} boxes; expected at most {MAX_BOXES} (keep those of the highest scores)")
    found += [
        f"array {name!r} has {len(rows)} rows for {len(boxes)} boxes; expected one a box"
        for name, rows in (("scores", scores), ("category_ids", ids))
        if len(rows) != len(boxes)
    ]
    boxes, scores, ids = boxes[:MAX_BOXES], scores[:MAX_BOXES], ids[:MAX_BOXES]
    fits = ((boxes[:, 3:6] >= SMALLEST_M) & (boxes[:, 3:6] <= LARGEST_M)).all(axis=1)
    for row in np.flatnonzero(~np.isfinite(boxes).all(axis=1) | ~fits):
        expected = f"expected finite numbers, and sizes > 0 m ({SMALLEST_M:g} .. {LARGEST_M:g})"
        found.append(f"boxes row {row}: {boxes[row].tolist()}; {expected}")
    for row in np.flatnonzero(~((scores >= 0) & (scores <= 1))):
        found.append(f"scores row {row}: {scores[row]}; expected 0..1 (a logit? take its sigmoid)")
    known = [0, *(c.category_id for c in CLASSES)]
    for row in np.flatnonzero(~np.isin(ids, known)):
        found.append(f"category_ids row {row}: {ids[row]}; expected 0 = none, or the id of a furniture category")
    if not 0 <= operating[0] <= 1:
        found.append(f"operating_score is {operating[0]}; expected 0..1, on the scale of the scores")
    return found


OBJECT_DETECTION = TaskSpec(
    name="object-detection-3d",
    version="0",
    datasets=("rgbd-activity",),
    title="3D object detection: the furniture a camera sees, and that which it does not",
    inputs=("sensor", "frames.rgb", "frames.depth_m", "frames.timestamp_ns", "poses"),
    tracks=(*TRACKS, "oracle-poses", "oracle-depth"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays=ARRAYS,
        encode=encode,
        decode=decode,
        hint="boxes are centre, size, yaw, one row a box; no boxes: shape (0, 7)",
        faults=faults,
    ),
    grid=GRID,
    mask="furniture at t0 with longest side >= 0.3 m and its middle in the grid",
    protocol="hsbench",
    primary_metric="ap-25",
    direction="higher",
    observation_times_s=OBSERVATION_TIMES_S["rgbd-activity"],
    controls=CONTROLS,
    missing_answer="no box: every truth is missed",
    dummy=lambda episode: Boxes.none(),
)
