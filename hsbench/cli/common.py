"""What commands share: options, a progress bar, and output for people or machines."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from tqdm import tqdm

from hsbench.io.atomic import json_bytes

if TYPE_CHECKING:
    from hsbench.tasks.spec import TaskSpec

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])

FOLDER = click.Path(path_type=Path, file_okay=False)
ANY_PATH = click.Path(path_type=Path)


def data_option(function: F) -> F:
    """``--data DIR`` and ``--split NAME``."""
    data = click.option("--data", required=True, type=FOLDER, metavar="DIR", help="Folder of a data set.")
    split = click.option("--split", metavar="NAME", help="Only this split: train, val, test-seen, test-novel.")
    return data(split(function))


def json_option(function: F) -> F:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON for machines.")(function)


def progress(items: Iterable[T], total: int, what: str, unit: str = "episode") -> Iterator[T]:
    """A progress bar on the error stream; silent where that is no terminal."""
    yield from tqdm(items, total=total, desc=what, unit=unit, file=sys.stderr, disable=None, leave=False)


def next_step(*words: object, other: str = "") -> None:
    """Tell the next command to type, quoted for a shell; empty words are left out. other: what else may follow."""
    click.echo(f"next: hsbench {shlex.join(str(word) for word in words if word not in ('', None))}{other}")


def on_split(split: str | None) -> tuple[str, ...]:
    """``--split NAME`` as words of a command, where there is one."""
    return ("--split", split) if split else ()


def new_file(option: str, path: Path, *endings: str) -> None:
    """Check a file to be written before any work: UsageError unless it ends so, is not there, and in no data set."""
    from hsbench.io.dataset_index import require_outside

    if path.suffix.lower() not in endings:
        raise click.UsageError(f"{option} {path}: expected a file that ends in {' or '.join(endings)}")
    if path.exists():
        raise click.UsageError(f"{option} {path}: exists already; choose another name or remove it first")
    require_outside(path)


def note_own_data(spec: TaskSpec, dataset: str) -> bool:
    """Say on the error stream where a task has no board for a data set. Raises SchemaError for another task's."""
    from hsbench.tasks.registry import scored_on

    official = scored_on(spec, dataset)
    if not official:
        names = " and ".join(spec.datasets)
        click.echo(f"note: {dataset} is data of one's own: boards of {spec.name} take {names}", err=True)
    return official


def print_json(value: object) -> None:
    """A value as JSON on standard output."""
    click.echo(json_bytes(value).decode(), nl=False)


def number(value: float | None, digits: int = 4) -> str:
    """A score for people: a dash where undefined."""
    return "-" if value is None else f"{value:.{digits}f}"


def interval(low: float | None, high: float | None, digits: int = 4) -> str:
    """An interval for people, or why there is none."""
    return "(no interval)" if low is None or high is None else f"[{low:.{digits}f}, {high:.{digits}f}]"
