"""Evaluation: (task, truth, predictions) -> Report, and two reports -> Comparison. Returns data, draws nothing."""

from hsbench.evaluation.compare import Comparison, compare
from hsbench.evaluation.evaluator import Evaluator
from hsbench.evaluation.report import DatasetRef, Report, read_report, write_report
from hsbench.evaluation.split import episode_row, score_episodes, split_report, watched_report

__all__ = [
    "Comparison",
    "DatasetRef",
    "Evaluator",
    "Report",
    "compare",
    "episode_row",
    "read_report",
    "score_episodes",
    "split_report",
    "watched_report",
    "write_report",
]
