"""``submission.json``: who made a submission, how, and for which task. Every fault is listed, not the first alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from typing import Any

from hsbench.errors import DataError
from hsbench.io.strict_json import parse_json
from hsbench.submission.layout import METADATA_FILE, SubmittedTask

MAX_BYTES = 1 << 20
"""Of ``submission.json``."""

MAX_TEXT = 2000
"""Characters of any one text."""

MAX_NUMBER = 10**15
"""Parameters and seconds stay below it."""


@dataclass(frozen=True)
class Metadata:
    """What a submission says of itself; None or empty = not said.

    track: the inputs used, one of the task's tracks. causal: the answer at a time uses nothing after it.
    parameters: learned parameters of the method. hardware: what it ran on. training_data: every data set it learned
    from, by name.
    """

    task: str
    task_version: str
    method: str
    track: str
    authors: tuple[str, ...] = ()
    paper: str | None = None
    code: str | None = None
    parameters: int | None = None
    hardware: str | None = None
    seconds_per_episode: float | None = None
    causal: bool | None = None
    training_data: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The object of ``submission.json``."""
        plain = asdict(self)
        return {**plain, "authors": list(self.authors), "training_data": list(self.training_data)}


REQUIRED = ("task", "task_version", "method", "track")


def read_metadata(data: bytes, task: SubmittedTask) -> tuple[Metadata | None, list[str]]:
    """The metadata in the bytes of ``submission.json`` (None where not sound), and every fault, a line each."""
    if len(data) > MAX_BYTES:
        return None, [f"{METADATA_FILE}: {len(data)} bytes; the limit is {MAX_BYTES}"]
    try:
        value = parse_json(data)
    except DataError as error:
        return None, [f"{METADATA_FILE}: {error}"]
    if not isinstance(value, dict):
        return None, [f"{METADATA_FILE}: holds a {_kind(value)}; expected an object with keys {', '.join(REQUIRED)}"]
    metadata, faults = metadata_from_json(value)
    faults.extend(_task_faults(value, task))
    return (None if faults else metadata), [f"{METADATA_FILE}: {fault}" for fault in faults]


def metadata_from_json(value: dict[str, Any]) -> tuple[Metadata | None, list[str]]:
    """Metadata from an object of ``Metadata.to_json``, and every fault: missing and unknown keys, wrong types."""
    known = [f.name for f in fields(Metadata)]
    faults = [f"{key} is missing; expected {_CHECKS[key][1]}" for key in REQUIRED if value.get(key) is None]
    faults.extend(f"unknown key {_shown(key)}; expected only {', '.join(known)}" for key in value if key not in known)
    for key in known:
        found = value.get(key)
        good, expected = _CHECKS[key]
        if found is not None and not good(found):
            faults.append(f"{key} is {_shown(found)}; expected {expected}")
    if faults:
        return None, faults
    given: dict[str, Any] = {
        key: tuple(item) if isinstance(item, list) else item for key, item in value.items() if item is not None
    }
    return Metadata(**given), []


def _task_faults(value: dict[str, Any], task: SubmittedTask) -> list[str]:
    faults: list[str] = []
    if isinstance(value.get("task"), str) and value["task"] != task.name:
        faults.append(f"task is {_shown(value['task'])}; expected {task.name!r} (checked against another task?)")
    if isinstance(value.get("task_version"), str) and value["task_version"] != task.version:
        faults.append(f"task_version is {_shown(value['task_version'])}; expected {task.version!r}")
    if isinstance(value.get("track"), str) and value["track"] not in task.tracks:
        faults.append(f"track is {_shown(value['track'])}; expected one of {', '.join(task.tracks)}")
    return faults


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= MAX_TEXT and value.isprintable()


def _is_texts(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(_is_text(item) for item in value)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and 0 <= value < MAX_NUMBER


_TEXT: tuple[Callable[[Any], bool], str] = (_is_text, f"one line of text, at most {MAX_TEXT} characters")
_TEXTS: tuple[Callable[[Any], bool], str] = (_is_texts, "a list of texts")

_CHECKS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "task": _TEXT,
    "task_version": (_is_text, 'text such as "0"'),
    "method": _TEXT,
    "track": _TEXT,
    "authors": _TEXTS,
    "paper": _TEXT,
    "code": _TEXT,
    "parameters": (lambda v: _is_number(v) and isinstance(v, int), "a whole number of learned parameters"),
    "hardware": _TEXT,
    "seconds_per_episode": (_is_number, "seconds >= 0"),
    "causal": (lambda v: isinstance(v, bool), "true or false"),
    "training_data": _TEXTS,
}


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _kind(value: Any) -> str:
    return {list: "list", str: "text", type(None): "null"}.get(type(value), type(value).__name__)
