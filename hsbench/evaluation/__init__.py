"""Evaluation: (task, truth, predictions) -> Report, and two reports -> Comparison. Returns data, draws nothing."""

from hsbench.evaluation.compare import Comparison, compare
from hsbench.evaluation.completion import completion_report, episode_row, score_completion
from hsbench.evaluation.report import DatasetRef, Report, read_report, write_report

__all__ = [
    "Comparison",
    "DatasetRef",
    "Report",
    "compare",
    "completion_report",
    "episode_row",
    "read_report",
    "score_completion",
    "write_report",
]
