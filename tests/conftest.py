"""Fixtures that several folders share: a short recipe outside the repository and one small data set made from it.

Both are made once a run, whichever test process comes first; tests that change something take a copy.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hsbench.io.resources import resource
from hsbench.io.splits import read_splits
from hsbench.synth.generate import Job, generate

SHORT = {"life": {"duration_s": 12.0}, "camera": {"width_px": 160, "height_px": 120, "focal_px": 113.0}}
"""What the short recipe changes: 12 s instead of two minutes, and pictures of a sixteenth of the pixels."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that read the shared data set come last: while one process makes it, every other that asks for it waits."""
    late = {item.path for item in items if "rgbd" in getattr(item, "fixturenames", ())}
    items.sort(key=lambda item: item.path in late)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], None]], Path]:
    """(name, make) -> a folder that ``make`` filled, by one process of the run for all."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent

    def folder(name: str, make: Callable[[Path], None]) -> Path:
        target = base / f"shared-{name}"
        with (base / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not target.exists():
                partial = base / f"partial-{name}-{os.getpid()}"
                partial.mkdir()
                make(partial)
                partial.rename(target)
        return target

    return folder


def write_recipe(folder: Path, changes: dict[str, dict[str, object]]) -> None:
    """Copy the bundled recipe of a new folder's name into it, with other settings."""
    bundled = resource("generators") / folder.name
    config = tomllib.loads((bundled / "config.toml").read_text(encoding="utf-8"))
    for section, table in changes.items():
        config[section] = {**config[section], **table}
    folder.mkdir(parents=True)
    shutil.copy(bundled / f"{folder.name}.py", folder)
    text = "".join(
        f"[{section}]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items())
        for section, table in config.items()
    )
    (folder / "config.toml").write_text(text, encoding="utf-8")


def exhaust(steps: Iterator[object]) -> None:
    """Run an iterator to its end."""
    for _ in steps:
        pass


WriteRecipe = Callable[[Path, dict[str, dict[str, object]]], None]


@pytest.fixture(scope="session", name="write_recipe")
def _write_recipe() -> WriteRecipe:
    """``write_recipe(folder, changes)``, for tests that need settings of their own."""
    return write_recipe


@pytest.fixture(scope="session")
def short_recipe(made_once: Callable[[str, Callable[[Path], None]], Path]) -> Path:
    """The folder of recipe rgbd-activity at 12 s an episode, outside the repository."""
    home = made_once("recipe", lambda folder: write_recipe(folder / "rgbd-activity", SHORT))
    return home / "rgbd-activity"


@pytest.fixture(scope="session")
def rgbd(made_once: Callable[[str, Callable[[Path], None]], Path], short_recipe: Path) -> Path:
    """A data set of size mini: 2 train, 2 val, 1 test-seen, 1 test-novel; drawn by the ray caster. Read only."""
    job = Job(str(short_recipe), 0, tuple(read_splits("rgbd-activity").numbers("mini")), "all", "raycast")
    return made_once("rgbd", lambda folder: exhaust(generate(job, folder / "data"))) / "data"


@pytest.fixture
def rgbd_copy(rgbd: Path, tmp_path: Path) -> Path:
    """A copy of the data set that a test may damage."""
    return Path(shutil.copytree(rgbd, tmp_path / "copy"))
