"""Task ``affordance-topdown``: where in a room one can walk, sit and use things, seen from above.

A prediction file holds ``probability`` float32 (3, 256, 256) on ``GRID``; see ``probability_maps``. A cell may have
several labels or none.
"""

from __future__ import annotations

import numpy as np

from hsbench.io.arrays import ArraySpec
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.probability_maps import HINT, LABELS, decode, encode, faults
from hsbench.tasks.spec import CONTROLS, OBSERVATION_TIMES_S, TRACKS, PlanGrid, TaskSpec

GRID = PlanGrid((256, 256), 0.05)
SHAPE = (len(LABELS), *GRID.shape)

AFFORDANCE_TOPDOWN = TaskSpec(
    name="affordance-topdown",
    version="0",
    datasets=("activity-360",),
    title="Top-down affordance: where one can walk, sit and use things",
    inputs=("sensor", "frames.rgb", "frames.timestamp_ns", "poses", "activity_maps"),
    tracks=(*TRACKS, "oracle-poses", "oracle-camera-height"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays={"probability": ArraySpec(SHAPE, "float32")},
        encode=encode,
        decode=decode,
        hint=HINT,
        faults=faults,
    ),
    grid=GRID,
    mask="every cell but those of other rooms out of the camera's sight, and those that differ from t0 for long",
    protocol="hsbench-multilabel",
    primary_metric="mean-iou",
    direction="higher",
    observation_times_s=OBSERVATION_TIMES_S["activity-360"],
    controls=CONTROLS,
    missing_answer="empty maps: no cell has any label",
    dummy=lambda episode: np.zeros(SHAPE, dtype=np.bool_),
)
