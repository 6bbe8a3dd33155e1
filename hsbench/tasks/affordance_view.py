"""Task ``affordance-view``: what the surface point that a pixel shows affords, on the empty room at t0.

A prediction file holds ``probability`` float32 (3, rows, columns) of the camera's image; see ``probability_maps``. Of a
360 camera that is the whole panorama: a method that works on perspective patches stitches its answers first.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.io.arrays import ArraySpec
from hsbench.schema.episode import Episode
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.probability_maps import HINT, LABELS, decode, encode, faults
from hsbench.tasks.spec import CONTROLS, OBSERVATION_TIMES_S, TRACKS, TaskSpec
from hsbench.typing import AnyArray


def image_shape(episode: Episode) -> tuple[int, int]:
    """Rows and columns of the episode's pictures."""
    return episode.sensor.camera.height_px, episode.sensor.camera.width_px


def misfits(arrays: Mapping[str, AnyArray], episode: Episode) -> list[str]:
    """A map of another size than the pictures."""
    found, expected = arrays["probability"].shape[1:], image_shape(episode)
    hint = " (rows and columns swapped?)" if found == expected[::-1] else ""
    return [] if found == expected else [f"array 'probability' is of {found} pixels; expected {expected}{hint}"]


AFFORDANCE_VIEW = TaskSpec(
    name="affordance-view",
    version="0",
    datasets=("timelapse-activity", "activity-360"),
    title="Affordance in a camera's view: where one can walk, sit and use things",
    inputs=("sensor", "frames.rgb", "frames.timestamp_ns", "poses"),
    tracks=(*TRACKS, "oracle-poses", "oracle-geometry"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays={"probability": ArraySpec((len(LABELS), None, None), "float32")},
        encode=encode,
        decode=decode,
        hint=HINT,
        faults=faults,
        misfits=misfits,
    ),
    grid=None,
    mask="every pixel but those that look out of the room, and those whose truth differs from t0 for long",
    protocol="hsbench-multilabel",
    primary_metric="mean-iou",
    direction="higher",
    observation_times_s=OBSERVATION_TIMES_S["timelapse-activity"],
    controls=CONTROLS,
    missing_answer="empty maps: no pixel has any label",
    dummy=lambda episode: np.zeros((len(LABELS), *image_shape(episode)), dtype=np.bool_),
)
