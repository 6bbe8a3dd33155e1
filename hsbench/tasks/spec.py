"""What a task is: everything that must be fixed beforehand for two numbers to be comparable."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.episode import Episode
from hsbench.submission.layout import PredictionFormat

TRACKS = ("poses", "frames", "poses+frames")
"""What a submission may have used, in every task; each track is ranked by itself."""

CONTROLS = ("no-activity", "shuffled-activity", "best-constant")
"""The methods without real activity of this room that a claim must beat, in every task."""

OBSERVATION_TIMES_S: Mapping[str, tuple[float, ...]] = {
    "rgbd-activity": (5.0, 15.0, 30.0, 60.0, 120.0),
    "activity-360": (60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0),
    "timelapse-activity": (900.0, 1800.0, 3600.0, 7200.0, 14400.0, 28800.0, 43200.0),
}
"""Data set -> seconds after t0 at which a prediction may be given; an episode ends at the last one recorded."""

NOISE_PRESETS: Mapping[str, Mapping[str, str]] = {
    "rgbd-activity": {"poses": "kinect", "depth": "kinect"},
    "activity-360": {"poses": "openpose-like"},
    "timelapse-activity": {"poses": "openpose-like", "pictures": "camera"},
}
"""Data set -> noise of its inputs by preset, as its recipe sets it (docs/data/poses.md, docs/generate.md)."""

FRAME = "episode frame: origin on the floor below the camera, z up, x along its heading, y to the left"
"""Of all inputs, truth and predictions that lie in space."""


@dataclass(frozen=True)
class PlanGrid:
    """Square cells of the floor centred on the camera, in the episode frame.

    Row 0 is the largest x (forward), column 0 the largest y (left); ``cell_m`` a side.
    """

    shape: tuple[int, int]
    cell_m: float


@dataclass(frozen=True)
class TaskSpec:
    """One version of one task; changing any of it makes a new version.

    datasets: those it is scored on, each a board of its own. inputs: names of what a method may see. tracks: which of
    it a submission may say it used. grid: of the prediction, in the episode frame, None where it is on none.
    mask: what counts, in words. primary_metric: a key of the report's metrics; direction: which way is better.
    observation_times_s: ascending seconds after t0 on the first of its data sets (``on`` has those of another); a
    board's number is at the last; empty where an answer is for the whole observation alone. controls: the methods
    without real activity that a claim must beat. missing_answer: what an episode without prediction counts as. dummy:
    an episode -> a valid prediction of nothing, from which templates are made.
    """

    name: str
    version: str
    datasets: tuple[str, ...]
    title: str
    inputs: tuple[str, ...]
    tracks: tuple[str, ...]
    prediction: PredictionFormat
    grid: VoxelGrid | PlanGrid | None
    mask: str
    protocol: str
    primary_metric: str
    direction: Literal["higher", "lower"]
    observation_times_s: tuple[float, ...]
    controls: tuple[str, ...]
    missing_answer: str
    dummy: Callable[[Episode], Any] = field(compare=False)

    def __post_init__(self) -> None:
        times = self.observation_times_s
        if times and (times[0] <= 0 or any(a >= b for a, b in pairwise(times))):
            raise SchemaError(f"task {self.name}: observation_times_s {times} do not ascend from above 0")

    def on(self, dataset: str) -> TaskSpec:
        """The task on a data set of a name: with the observation times there; data of one's own have the usual ones."""
        if not self.observation_times_s:
            return self
        return replace(self, observation_times_s=OBSERVATION_TIMES_S.get(dataset, self.observation_times_s))
