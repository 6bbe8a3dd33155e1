"""Tasks: what is given, what is asked, how it is scored, fixed beforehand."""

from hsbench.tasks.registry import TASKS, task
from hsbench.tasks.spec import TaskSpec

__all__ = ["TASKS", "TaskSpec", "task"]
