"""Errors a user can cause, each one line long, each with the exit code of the command line.

A message names the item, what was found, what was expected and, where it can be guessed, the likely
mistake. Anything else that is raised is a fault of hsbench and keeps its traceback.
"""

from __future__ import annotations


class HsbenchError(Exception):
    """Base of all errors that are the user's to mend. The command line prints the message and exits with 2."""

    exit_code = 2


class SchemaError(HsbenchError, ValueError):
    """A value does not fit the schema: wrong shape, dtype, range or frame."""


class DataError(HsbenchError):
    """Something on disk is missing, damaged or not what its descriptor says."""


class SubmissionError(HsbenchError):
    """A submission fails its check; ``faults`` lists every one. The command line exits with 3."""

    exit_code = 3

    def __init__(self, faults: list[str]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(self.faults))


class MissingExtraError(HsbenchError, ImportError):
    """An optional dependency is needed and absent; the message names the extra to install."""

    def __init__(self, feature: str, package: str, extra: str) -> None:
        super().__init__(f"{feature} needs {package}, which is not installed: pip install 'hsbench[{extra}]'")
