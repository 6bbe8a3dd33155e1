"""The methods of every task, by task and name. A new method is a line in the file of its task's methods."""

from __future__ import annotations

from collections.abc import Mapping

from hsbench.baselines.affordance360 import classifiers
from hsbench.baselines.controls import actions, boxes, topdown, view, volumes
from hsbench.baselines.method import Method
from hsbench.baselines.occlusion import detection, voxelnet
from hsbench.baselines.occlusion import methods as completion
from hsbench.errors import DataError
from hsbench.tasks.registry import TASKS, task

METHODS: Mapping[str, Mapping[str, Method]] = {
    name: {
        method.name: method
        for method in (
            *completion.METHODS.values(),
            *voxelnet.METHODS,
            *detection.METHODS,
            *boxes.METHODS,
            *topdown.METHODS,
            *view.METHODS,
            *actions.METHODS,
            *classifiers.METHODS,
            *volumes.METHODS,
        )
        if method.task == name
    }
    for name in TASKS
}
"""Task -> name -> method."""


def find(name: str, dataset: str, task_name: str | None = None) -> Method:
    """The method of a name: of the task that is named, else of the one task that has it and takes the data set.

    Raises DataError for an unknown name, naming the known, and where several tasks have one; SchemaError for an unknown
    task.
    """
    if task_name is not None:
        chosen = METHODS[task(task_name).name]
        if name not in chosen:
            raise DataError(f"method {name!r} is unknown; expected one of {', '.join(chosen)} for task {task_name}")
        return chosen[name]
    found = [methods[name] for methods in METHODS.values() if name in methods]
    if not found:
        known = dict.fromkeys(name for methods in METHODS.values() for name in methods)
        raise DataError(f"method {name!r} is unknown; expected one of {', '.join(known)}")
    fitting = [method for method in found if dataset in task(method.task).datasets] or found
    if len(fitting) > 1:
        tasks = ", ".join(method.task for method in fitting)
        raise DataError(f"method {name!r} is of several tasks: {tasks}; name one with --task")
    return fitting[0]
