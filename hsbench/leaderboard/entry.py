"""A board entry: a report that follows from its own rows, and who vouches for it. One JSON file an entry."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from hsbench.errors import DataError, SchemaError
from hsbench.evaluation.pooled import recompute
from hsbench.evaluation.report import Report
from hsbench.io.atomic import write_json
from hsbench.io.plain import from_plain, to_plain
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import check_id
from hsbench.tasks import task

FORMAT = "hsbench-entry/0"
"""Written into every entry file; raised when a field changes its meaning."""

Status = Literal["self-reported", "verified"]


@dataclass(frozen=True)
class Entry:
    """One line of a board.

    name: short, unique on the board, safe as a file name. year: of the method. status: ``self-reported`` on open
    truth, ``verified`` where the organisers scored it on a private split. Raises SchemaError where the report is of
    an unknown task, or is of its current version and does not follow the task's rules or from its own episodes.
    """

    name: str
    year: int
    authors: tuple[str, ...]
    status: Status
    report: Report

    def __post_init__(self) -> None:
        check_id(self.name, "entry.name")
        if not 1900 <= self.year <= 2200:
            raise SchemaError(f"entry {self.name}: year is {self.year}; expected a year such as 2025")
        if self.report.task_version == task(self.report.task).version:
            self._check_report()

    def _check_report(self) -> None:
        """An entry of an older task version was checked when that was current, and stays readable."""
        report, spec = self.report, task(self.report.task)
        for item, found, expected in (
            ("protocol", report.protocol, (spec.protocol,)),
            ("primary metric", report.primary.name, (spec.primary_metric,)),
            ("data set", report.dataset.name, spec.datasets),
            ("track", report.method.track, spec.tracks),
        ):
            if found not in expected:
                raise SchemaError(f"entry {self.name}: {item} is {found!r}; expected {' or '.join(expected)}")
        faults = recompute(report)
        if faults:
            raise SchemaError(f"entry {self.name}: {faults[0]} ({len(faults)} such faults)")

    def to_json(self) -> dict[str, Any]:
        """The object of an entry file."""
        return {"format": FORMAT, **to_plain(self), "report": self.report.to_json()}

    @classmethod
    def from_json(cls, value: Any) -> Entry:
        """The inverse of ``to_json``. Raises DataError naming the item."""
        if not isinstance(value, dict) or value.get("format") != FORMAT:
            raise DataError(f"entry.format is not {FORMAT!r} (a report.json? make an entry of it first)")
        report = Report.from_json(value.get("report"))
        plain = {key: item for key, item in value.items() if key != "format"}
        return from_plain(cls, {**plain, "report": to_plain(report)}, "entry")


def entry_path(root: str | Path, entry: Entry) -> Path:
    """``<root>/<task>/<version>/<name>.json``."""
    return Path(root) / entry.report.task / entry.report.task_version / f"{entry.name}.json"


def write_entry(root: str | Path, entry: Entry, *, replace: bool = False) -> Path:
    """Write an entry below a board's root, atomically, and return its path.

    Raises DataError where an entry of that name, whatever its case, is there and ``replace`` is False, and
    SchemaError for a task version that is no longer current.
    """
    spec = task(entry.report.task)
    if entry.report.task_version != spec.version:
        raise SchemaError(f"entry {entry.name} is of version {entry.report.task_version!r}; expected {spec.version!r}")
    path = entry_path(root, entry)
    if path.parent.is_dir() and not replace:
        taken = next((p for p in path.parent.glob("*.json") if p.name.casefold() == path.name.casefold()), None)
        if taken is not None:
            raise DataError(f"{taken} exists already; choose another name or replace it")
    write_json(path, entry.to_json())
    return path


def read_entry(path: str | Path) -> Entry:
    """Read one entry. Raises DataError naming the file and the item."""
    value = read_json(path)
    try:
        entry = Entry.from_json(value)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
    if Path(path).stem != entry.name:
        raise DataError(f"{path}: entry.name is {entry.name!r}; expected the file's name")
    return entry


def read_entries(root: str | Path, task_name: str, version: str) -> list[Entry]:
    """All entries of one board, ascending by name; empty where there are none yet."""
    folder = Path(root) / task_name / version
    entries = [read_entry(path) for path in sorted(folder.glob("*.json"))]
    for entry in entries:
        if (entry.report.task, entry.report.task_version) != (task_name, version):
            raise DataError(f"{entry.name} is of {entry.report.task} {entry.report.task_version}; expected {folder}")
    return entries
