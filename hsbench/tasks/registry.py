"""The tasks by name. A new task is a file beside this one and a line here."""

from __future__ import annotations

from collections.abc import Mapping

from hsbench.errors import SchemaError
from hsbench.tasks.scene_completion import SCENE_COMPLETION
from hsbench.tasks.spec import TaskSpec

TASKS: Mapping[str, TaskSpec] = {spec.name: spec for spec in (SCENE_COMPLETION,)}


def task(name: str) -> TaskSpec:
    """The task of a name. Raises SchemaError for an unknown one, naming the known."""
    try:
        return TASKS[name]
    except KeyError:
        raise SchemaError(f"task {name!r} is unknown; expected one of {', '.join(TASKS)}") from None
