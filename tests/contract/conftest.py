"""One small data set of each recipe that a task is scored on: the mini scenes of val, no pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hsbench.io.splits import read_splits
from hsbench.synth.generate import Job, generate

DataOf = Callable[[str], Path]


@pytest.fixture(scope="session")
def data_of(made_once: Callable[[str, Callable[[Path], None]], Path], rgbd: Path) -> DataOf:
    """Name of a data set -> a folder with a few episodes of it."""

    def folder(name: str) -> Path:
        return rgbd if name == "rgbd-activity" else made_once(f"task-{name}", lambda made: _make(name, made)) / "data"

    return folder


def _make(name: str, folder: Path) -> None:
    units = tuple(unit for unit in read_splits(name).numbers("mini") if unit[1] == "val")
    for _ in generate(Job(name, 0, units, "none", "raycast"), folder / "data"):
        pass
