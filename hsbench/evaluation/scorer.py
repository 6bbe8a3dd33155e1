"""What scoring a task takes, in one object: one file a task makes it, everything else is common to all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hsbench.evaluation.metric import Metric
from hsbench.schema.episode import Episode
from hsbench.tasks.spec import TaskSpec

Statistics = Mapping[str, tuple[int, ...]]
"""Sufficient statistics of an episode by name: counts that add up, or lists that metrics join."""


@dataclass(frozen=True)
class Scorer:
    """How a task is scored.

    truth: an episode with truth -> what the task needs of it, None where it is not there.
    statistics: (that, the prediction or None where it is missing, the task) -> sufficient statistics; raises
    SchemaError where one does not fit. metrics: by name, from these. version: raised when a rule changes.
    """

    truth: Callable[[Episode], Any | None]
    statistics: Callable[[Any, Any | None, TaskSpec], Statistics]
    metrics: Mapping[str, Metric]
    version: str
