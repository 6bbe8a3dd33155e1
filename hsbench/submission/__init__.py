"""Submissions: written, read and checked without any truth. ``layout`` shows what one looks like."""

from hsbench.submission.check import check, check_or_raise
from hsbench.submission.layout import PredictionFormat, SubmittedTask, prediction_file
from hsbench.submission.metadata import Metadata, read_metadata
from hsbench.submission.pack import SubmissionWriter, write_submission
from hsbench.submission.read import Predictions, open_submission

__all__ = [
    "Metadata",
    "PredictionFormat",
    "Predictions",
    "SubmissionWriter",
    "SubmittedTask",
    "check",
    "check_or_raise",
    "open_submission",
    "prediction_file",
    "read_metadata",
    "write_submission",
]
