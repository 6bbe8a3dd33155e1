"""Task ``scene-completion``: which voxels of a room are solid, above all those the camera never sees.

A prediction file holds one array ``occupied``: uint8 (128, 128, 6), the bool grid [x, y, z] packed along z in little
bit order (``np.packbits(grid, axis=-1, bitorder="little")``). Metrics: ``hsbench.metrics.completion``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid, pack_bits, unpack_bits
from hsbench.io.arrays import ArraySpec
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.spec import CONTROLS, OBSERVATION_TIMES_S, TRACKS, TaskSpec
from hsbench.typing import AnyArray, BoolArray

GRID = VoxelGrid(origin_m=(0.0, -3.2, 0.0), shape=(128, 128, 48), voxel_m=0.05)
"""Of predictions and truth, in the episode frame: 6.4 m ahead, 3.2 m to each side, 2.4 m up."""


def encode(occupied: BoolArray) -> dict[str, AnyArray]:
    """(128, 128, 48) bool -> the arrays of a prediction file. Raises SchemaError where it does not fit."""
    if not isinstance(occupied, np.ndarray) or occupied.dtype != np.bool_ or occupied.shape != GRID.shape:
        found = f"{occupied.dtype} {occupied.shape}" if isinstance(occupied, np.ndarray) else type(occupied).__name__
        raise SchemaError(f"prediction is {found}; expected bool {GRID.shape} (probabilities? threshold them)")
    return {"occupied": pack_bits(occupied)}


def decode(arrays: Mapping[str, AnyArray]) -> BoolArray:
    """The inverse of ``encode``: the arrays of a prediction file -> (128, 128, 48) bool."""
    return unpack_bits(arrays["occupied"], GRID.shape[2])


SCENE_COMPLETION = TaskSpec(
    name="scene-completion",
    version="0",
    datasets=("rgbd-activity",),
    title="Scene completion: the solid space a camera does not see",
    inputs=("sensor", "frames.rgb", "frames.depth_m", "frames.timestamp_ns", "poses"),
    tracks=(*TRACKS, "oracle-poses", "oracle-depth"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays={"occupied": ArraySpec((*GRID.shape[:2], GRID.shape[2] // 8), "uint8")},
        encode=encode,
        decode=decode,
        hint="pack a bool grid with np.packbits(grid, axis=-1, bitorder='little')",
    ),
    grid=GRID,
    mask="voxels occluded at t0, inside the room, at 0 < z <= 2 m, not floor, wall, ceiling, door or window",
    protocol="hsbench-occluded",
    primary_metric="occluded/iou",
    direction="higher",
    observation_times_s=OBSERVATION_TIMES_S["rgbd-activity"],
    controls=CONTROLS,
    missing_answer="an empty prediction: every solid voxel is missed",
    dummy=lambda episode: np.zeros(GRID.shape, dtype=np.bool_),
)
