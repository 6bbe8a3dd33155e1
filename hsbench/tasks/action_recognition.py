"""Task ``action-recognition``: what each observed person is doing, one label a pose.

A prediction file holds ``action`` uint8 (N,), one value of ``Action`` for each row of the episode's observed poses, in
their order: 1 stand (walking too), 2 sit, 3 interact, 0 = no answer, which is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsbench.errors import SchemaError
from hsbench.io.arrays import ArraySpec
from hsbench.schema.episode import Episode
from hsbench.schema.states import Action
from hsbench.submission.layout import PredictionFormat
from hsbench.tasks.spec import CONTROLS, TRACKS, TaskSpec
from hsbench.typing import AnyArray, UInt8Array

NO_ANSWER = 0
LABELS = (Action.STAND, Action.SIT, Action.INTERACT)


def observed(episode: Episode) -> int:
    """How many labels an episode asks for."""
    return 0 if episode.poses is None else len(episode.poses)


def encode(action: UInt8Array) -> dict[str, AnyArray]:
    """(N,) uint8 labels -> the arrays of a prediction file. Raises SchemaError where they are none."""
    if not isinstance(action, np.ndarray) or action.dtype != np.uint8 or action.ndim != 1:
        found = f"{action.dtype} {action.shape}" if isinstance(action, np.ndarray) else type(action).__name__
        raise SchemaError(f"prediction is {found}; expected uint8 (poses,): one label an observed pose")
    arrays: dict[str, AnyArray] = {"action": action}
    for fault in faults(arrays):
        raise SchemaError(fault)
    return arrays


def decode(arrays: Mapping[str, AnyArray]) -> UInt8Array:
    """The inverse of ``encode``."""
    return np.asarray(arrays["action"])


def faults(arrays: Mapping[str, AnyArray]) -> list[str]:
    """Values that are no label, a line each."""
    values, first, count = np.unique(arrays["action"], return_index=True, return_counts=True)
    allowed = ", ".join(f"{label} {label.name.lower()}" for label in LABELS)
    return [
        f"action row {row}: {value}, in {n} rows; expected {allowed}, or {NO_ANSWER} for no answer"
        for value, row, n in zip(values, first, count, strict=True)
        if value not in (NO_ANSWER, *LABELS)
    ]


def misfits(arrays: Mapping[str, AnyArray], episode: Episode) -> list[str]:
    """Another number of labels than of observed poses."""
    found, expected = len(arrays["action"]), observed(episode)
    return (
        [] if found == expected else [f"array 'action' has {found} labels; expected {expected}, one an observed pose"]
    )


ACTION_RECOGNITION = TaskSpec(
    name="action-recognition",
    version="0",
    datasets=("activity-360", "rgbd-activity"),
    title="Action recognition: stand, sit or interact, for each observed pose",
    inputs=("sensor", "frames.rgb", "frames.depth_m", "frames.timestamp_ns", "poses"),
    tracks=(*TRACKS, "oracle-poses"),
    prediction=PredictionFormat(
        suffix=".npz",
        arrays={"action": ArraySpec((None,), "uint8")},
        encode=encode,
        decode=decode,
        hint="one uint8 label a row of the observed poses",
        faults=faults,
        misfits=misfits,
    ),
    grid=None,
    mask="observed poses of real people who stand, sit or interact; not false detections, lying and transitions",
    protocol="hsbench",
    primary_metric="macro-f1",
    direction="higher",
    observation_times_s=(),
    controls=CONTROLS,
    missing_answer="all wrong: no pose has an answer",
    dummy=lambda episode: np.full(observed(episode), NO_ANSWER, dtype=np.uint8),
)
