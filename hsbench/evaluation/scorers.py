"""The scorers by task. A new task is a file beside this one and a line here."""

from __future__ import annotations

from collections.abc import Mapping

from hsbench.errors import SchemaError
from hsbench.evaluation.action_recognition import ACTION_RECOGNITION
from hsbench.evaluation.affordance_topdown import AFFORDANCE_TOPDOWN
from hsbench.evaluation.affordance_view import AFFORDANCE_VIEW
from hsbench.evaluation.completion import COMPLETION
from hsbench.evaluation.metric import Metric
from hsbench.evaluation.object_detection import OBJECT_DETECTION
from hsbench.evaluation.scene_reconstruction import SCENE_RECONSTRUCTION
from hsbench.evaluation.scorer import Scorer

SCORERS: Mapping[str, Scorer] = {
    "scene-completion": COMPLETION,
    "object-detection-3d": OBJECT_DETECTION,
    "affordance-topdown": AFFORDANCE_TOPDOWN,
    "affordance-view": AFFORDANCE_VIEW,
    "action-recognition": ACTION_RECOGNITION,
    "scene-reconstruction-360": SCENE_RECONSTRUCTION,
}


def scorer(task: str) -> Scorer:
    """The scorer of a task. Raises SchemaError for a task without one."""
    if task not in SCORERS:
        raise SchemaError(f"task {task!r} has no scorer; expected one of {', '.join(SCORERS)}")
    return SCORERS[task]


def metrics_of(task: str) -> Mapping[str, Metric]:
    """The metrics of a task by name, e.g. ``occluded/iou``. Raises SchemaError for a task without any."""
    return scorer(task).metrics
