"""What a task is: everything that must be fixed beforehand for two numbers to be comparable."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.submission.layout import PredictionFormat

TRACKS = ("poses", "frames", "poses+frames")
"""What a submission may have used, in every task; each track is ranked by itself."""


@dataclass(frozen=True)
class TaskSpec:
    """One version of one task; changing any of it makes a new version.

    inputs: names of what a method may see. tracks: which of it a submission may say it used. grid: of the prediction,
    in the episode frame. primary_metric: a key of the report's metrics; direction: which way is better.
    observation_times_s: ascending seconds after t0; a board's number is at the last. controls: the methods without
    real activity that a claim must beat. missing_answer: what an episode without prediction counts as.
    """

    name: str
    version: str
    dataset: str
    title: str
    inputs: tuple[str, ...]
    tracks: tuple[str, ...]
    prediction: PredictionFormat
    grid: VoxelGrid
    protocol: str
    primary_metric: str
    direction: Literal["higher", "lower"]
    observation_times_s: tuple[float, ...]
    controls: tuple[str, ...]
    missing_answer: str

    def __post_init__(self) -> None:
        times = self.observation_times_s
        if not times or times[0] <= 0 or any(a >= b for a, b in pairwise(times)):
            raise SchemaError(f"task {self.name}: observation_times_s {times} do not ascend from above 0")
