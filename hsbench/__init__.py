"""hsbench measures what watching people reveals about a room.

``hsbench.load(path)`` gives a data set, a sequence of episodes; ``hsbench.score(task, predictions, data)`` the report
of a submission; ``hsbench.Evaluator(task)`` scores in a training loop. docs/ explains frames, tasks and scores.
Importing hsbench loads numpy and little else: what needs more is imported when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hsbench.datasets.dataset import Dataset as Dataset
    from hsbench.datasets.dataset import load as load
    from hsbench.evaluation.evaluator import Evaluator as Evaluator
    from hsbench.evaluation.score import score as score

__version__ = "0.1.0"

__all__ = ["Dataset", "Evaluator", "__version__", "load", "score"]

_LAZY = {
    "Dataset": "hsbench.datasets.dataset",
    "Evaluator": "hsbench.evaluation.evaluator",
    "load": "hsbench.datasets.dataset",
    "score": "hsbench.evaluation.score",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'hsbench' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
