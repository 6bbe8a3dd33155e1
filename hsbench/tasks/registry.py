"""The tasks by name. A new task is a file beside this one and a line here."""

from __future__ import annotations

from collections.abc import Mapping

from hsbench.errors import SchemaError
from hsbench.tasks.action_recognition import ACTION_RECOGNITION
from hsbench.tasks.affordance_topdown import AFFORDANCE_TOPDOWN
from hsbench.tasks.affordance_view import AFFORDANCE_VIEW
from hsbench.tasks.object_detection import OBJECT_DETECTION
from hsbench.tasks.scene_completion import SCENE_COMPLETION
from hsbench.tasks.scene_reconstruction import SCENE_RECONSTRUCTION
from hsbench.tasks.spec import TaskSpec

TASKS: Mapping[str, TaskSpec] = {
    spec.name: spec
    for spec in (
        SCENE_COMPLETION,
        OBJECT_DETECTION,
        AFFORDANCE_TOPDOWN,
        AFFORDANCE_VIEW,
        ACTION_RECOGNITION,
        SCENE_RECONSTRUCTION,
    )
}


def scored_on(spec: TaskSpec, dataset: str) -> bool:
    """Whether a task is scored on a data set of a name; if not, the data are somebody's own, and have no board.

    Raises SchemaError for a data set of other tasks alone: an answer to it would be of another question.
    """
    if dataset in spec.datasets:
        return True
    others = [other.name for other in TASKS.values() if dataset in other.datasets]
    if others:
        raise SchemaError(
            f"task {spec.name} is scored on {' or '.join(spec.datasets)}; {dataset} belongs to {', '.join(others)}"
        )
    return False


def task(name: str) -> TaskSpec:
    """The task of a name. Raises SchemaError for an unknown one, naming the known."""
    try:
        return TASKS[name]
    except KeyError:
        raise SchemaError(f"task {name!r} is unknown; expected one of {', '.join(TASKS)}") from None
