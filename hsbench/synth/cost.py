"""What a recipe's units cost in time and on disk, as measured: ``cost.toml`` in its folder.

A table for each of ``all``, ``reference`` and ``none`` (pictures) gives ``time_s`` and ``size_mb`` of a mean unit made
by one process. A recipe without the file has costs that nobody knows yet.
"""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path

from hsbench.errors import DataError
from hsbench.synth.config import settings
from hsbench.synth.recipes import Recipe, frame_step

COST_FILE = "cost.toml"
BYTES_PER_MB = 1_000_000
ROOM_TO_SPARE = 1.1  # units differ


@dataclass(frozen=True)
class Cost:
    """Seconds of one process, and megabytes (1e6 bytes) on disk."""

    time_s: float
    size_mb: float

    def times(self, count: float) -> Cost:
        """Of so many."""
        return Cost(self.time_s * count, self.size_mb * count)


def unit_cost(recipe: Recipe, frames: str) -> Cost | None:
    """The cost of a unit with such pictures (see ``frame_step``), None where the recipe has no ``cost.toml``.

    Raises DataError where the file lacks a table, SchemaError for unknown keys.
    """
    path = recipe.folder / COST_FILE
    if not path.is_file():
        return None
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        none, reference, whole = (settings(Cost, tables[name], name) for name in ("none", "reference", "all"))
    except (tomllib.TOMLDecodeError, KeyError, TypeError) as error:
        raise DataError(f"{path}: {error}; expected tables none, reference, all with time_s and size_mb") from error
    if frames == "none":
        return none
    step = frame_step(frames)
    share = 1 / step if step else 0.0
    return Cost(
        reference.time_s + share * (whole.time_s - reference.time_s),
        reference.size_mb + share * (whole.size_mb - reference.size_mb),
    )


def require_room(out: Path, needed_mb: float) -> None:
    """Raise DataError where the disk that is to hold ``out`` has less room than that, and a tenth."""
    there = next(folder for folder in (out, *out.absolute().parents) if folder.exists())
    free_mb = shutil.disk_usage(there).free / BYTES_PER_MB
    if needed_mb * ROOM_TO_SPARE > free_mb:
        raise DataError(
            f"{out} would take about {sized(needed_mb)}, and {there} has {sized(free_mb)} free "
            "(another --out, fewer --episodes, or --frames every:N)"
        )


def lasting(time_s: float) -> str:
    """A duration for people: ``40 s``, ``7 min``, ``12.5 h``."""
    if time_s < 100:
        return f"{time_s:.0f} s"
    return f"{time_s / 60:.0f} min" if time_s < 6000 else f"{time_s / 3600:.1f} h"


def sized(size_mb: float) -> str:
    """A size for people: ``5.1 MB``, ``120 MB``, ``1.5 GB``."""
    if size_mb < 1000:
        return f"{size_mb:.1f} MB" if size_mb < 10 else f"{size_mb:.0f} MB"
    return f"{size_mb / 1000:.1f} GB" if size_mb < 10_000 else f"{size_mb / 1000:.0f} GB"
