"""Task ``scene-reconstruction-360``: the room as labelled volumes of what it affords.

A prediction file holds ``label`` uint8 (256, 256, 48) on ``GRID``, indexed [x, y, z]: values of ``Volume``, 0 none,
1 walkable, 2 sittable, 3 interactable, 4 wall.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.io.arrays import ArraySpec
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.spec import CONTROLS, OBSERVATION_TIMES_S, TRACKS, TaskSpec
from hsbench.truth.affordance_volumes import Volume
from hsbench.typing import AnyArray, UInt8Array

GRID = VoxelGrid(origin_m=(-6.4, -6.4, 0.0), shape=(256, 256, 48), voxel_m=0.05)


def encode(label: UInt8Array) -> dict[str, AnyArray]:
    """(256, 256, 48) uint8 -> the arrays of a prediction file. Raises SchemaError where it does not fit."""
    if not isinstance(label, np.ndarray) or label.dtype != np.uint8 or label.shape != GRID.shape:
        found = f"{label.dtype} {label.shape}" if isinstance(label, np.ndarray) else type(label).__name__
        raise SchemaError(f"prediction is {found}; expected uint8 {GRID.shape}")
    arrays: dict[str, AnyArray] = {"label": label}
    for fault in faults(arrays):
        raise SchemaError(fault)
    return arrays


def decode(arrays: Mapping[str, AnyArray]) -> UInt8Array:
    """The inverse of ``encode``."""
    return np.asarray(arrays["label"])


def faults(arrays: Mapping[str, AnyArray]) -> list[str]:
    """Values that are no label, a line each."""
    counts = np.bincount(arrays["label"].reshape(-1), minlength=len(Volume))
    allowed = ", ".join(f"{label} {label.name.lower()}" for label in Volume)
    return [
        f"label {value} in {counts[value]} voxels; expected {allowed}"
        for value in range(len(Volume), len(counts))
        if counts[value]
    ]


SCENE_RECONSTRUCTION = TaskSpec(
    name="scene-reconstruction-360",
    version="0",
    datasets=("activity-360",),
    title="Scene reconstruction: the room as volumes to walk on, sit on, use, and its walls",
    inputs=("sensor", "frames.rgb", "frames.timestamp_ns", "poses"),
    tracks=(*TRACKS, "oracle-poses", "oracle-camera-height"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays={"label": ArraySpec(GRID.shape, "uint8")},
        encode=encode,
        decode=decode,
        hint="one uint8 label a voxel",
        faults=faults,
    ),
    grid=GRID,
    mask="every voxel but the columns of other rooms out of the camera's sight, and what differs from t0 for long",
    protocol="hsbench-volumes",
    primary_metric="mean-iou",
    direction="higher",
    observation_times_s=OBSERVATION_TIMES_S["activity-360"],
    controls=CONTROLS,
    missing_answer="empty space: no voxel has a label",
    dummy=lambda episode: np.zeros(GRID.shape, dtype=np.uint8),
)
