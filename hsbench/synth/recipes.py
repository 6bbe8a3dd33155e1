"""Recipes: a folder with ``<name>.py`` (``build(config, unit)``), ``config.toml`` and a data sheet, by name or path.

A recipe is code and is run as such: use only recipes you trust.
"""

from __future__ import annotations

import hashlib
import importlib.util
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from hsbench.errors import DataError, SchemaError
from hsbench.io.resources import resource
from hsbench.io.scene_folder import SCENE_FILE, SCENE_FILES
from hsbench.io.splits import Splits, read_splits, splits_in
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Episode
from hsbench.synth.render import Renderer
from hsbench.synth.seeds import Seeds
from hsbench.typing import IntArray

SPLIT_STRIDE = 1000  # splits begin at multiples of it
IMPORTED_SPLIT = "test-novel"
SPLITS_FILE = "splits.json"
ENGINE_PACKAGES = ("geometry", "schema", "io", "truth", "synth")


@dataclass(frozen=True, eq=False)
class Unit:
    """One unit of generation: a scene number and everything its episodes follow from.

    seeds: the node of (seed, scene number), the same for every recipe, so that one room can be filmed by several
    sensors; frames: which pictures are made, see ``frame_step``; where none are, there is no renderer. threads: of a
    worker, that draw.
    """

    seeds: Seeds
    number: int
    split: str
    frames: str
    renderer: Renderer | None
    threads: int = 1

    @property
    def scene_id(self) -> str:
        """The scene's name in all data sets."""
        return scene_id(self.number)

    def filmed(self, timestamps_ns: IntArray) -> IntArray:
        """Those of an episode's (n,) frame times, from t0 on, of which pictures are made."""
        return timestamps_ns[:: frame_step(self.frames) or len(timestamps_ns)]


def scene_id(number: int) -> str:
    """The name of a generated scene in all data sets."""
    return f"scene-{number:06d}"


def is_watched_long(number: int, split: str, scenes: tuple[int, int]) -> bool:
    """Whether a scene is among the first and last of val or of a test, counted from 0, that are watched for longer."""
    first, last = scenes
    return split not in ("", "train") and first <= number % SPLIT_STRIDE <= last


def frame_step(frames: str) -> int:
    """1 for ``all``, N for ``every:N`` (of the frames, the one at t0 among them), 0 for ``reference`` (t0 alone) and
    ``none``. Raises SchemaError for anything else.
    """
    if frames in ("all", "reference", "none"):
        return int(frames == "all")
    kind, _, step = frames.partition(":")
    if kind != "every" or not (step.isascii() and step.isdigit() and int(step) > 0):
        raise SchemaError(f"frames is {frames!r}; expected all, every:N (N from 1 on), reference or none")
    return int(step)


@dataclass(frozen=True, eq=False)
class Recipe:
    """A recipe on disk: its name, folder, settings, ``build``, and a hash of everything that decides what it makes:
    its code and settings, and the code of the engine.

    imported: the id of the imported scene that it films, None where it makes its own.
    """

    name: str
    folder: Path
    config: Mapping[str, Any]
    sha256: str
    build: Callable[[Mapping[str, Any], Unit], Iterator[Episode]]
    imported: str | None = None

    @property
    def is_bundled(self) -> bool:
        """Whether it comes with hsbench: wherever that is installed, its name finds it."""
        return self.folder.parent == resource("generators").resolve()

    @property
    def splits(self) -> Splits:
        """``splits.json`` of the folder, else the bundled splits of that name. Raises DataError if there are none."""
        own = self.folder / SPLITS_FILE
        return splits_in(own) if own.is_file() else read_splits(self.name)

    def known_as(self, number: int, split: str) -> tuple[str, str]:
        """(scene id, split) of a unit in the index. An imported room is one scene, and new to whoever trained."""
        return (scene_id(number), split) if self.imported is None else (self.imported, IMPORTED_SPLIT)


@lru_cache(maxsize=8)
def find_recipe(name_or_path: str) -> Recipe:
    """A recipe by its name among the bundled ones, or by the path of its folder.

    Raises DataError if there is none, or it lacks ``<name>.py``, ``config.toml`` or a function ``build``.
    """
    folder, bundled = Path(name_or_path), resource("generators") / name_or_path
    if bundled.is_dir() and not (folder / f"{folder.name}.py").is_file():  # a data set here may have a recipe's name
        folder = bundled
    if not folder.is_dir():
        known = sorted(p.name for p in resource("generators").iterdir() if p.is_dir())
        raise DataError(f"recipe {name_or_path!r} is neither a folder nor one of {', '.join(known)}")
    folder = folder.resolve()
    name = folder.name
    code, config = folder / f"{name}.py", folder / "config.toml"
    for path in (code, config):
        if not path.is_file():
            raise DataError(
                f"recipe {name} has no {path.name} in {folder} (a recipe has {name}.py, config.toml, README.md)"
            )
    digest = hashlib.sha256()
    for path in (code, config, *_engine_files()):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    spec = importlib.util.spec_from_file_location(f"hsbench_recipe_{name.replace('-', '_')}", code)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    build = getattr(module, "build", None)
    if not callable(build):
        raise DataError(f"recipe {name}: {code.name} has no function build(config, unit)")
    try:
        table = tomllib.loads(config.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"{config} is no readable TOML: {error}") from error
    imported = None
    if "scene" in table:
        scene = _imported_scene(folder, table["scene"], digest)
        table["scene"], imported = str(scene), str(read_json(scene / SCENE_FILE)["scene_id"])
    return Recipe(name, folder, table, digest.hexdigest(), build, imported)


def _imported_scene(folder: Path, scene: object, digest: hashlib._Hash) -> Path:
    """The scene folder that a recipe names, relative to its own folder; what is in it decides what is made, too."""
    path = folder / str(scene)
    if not isinstance(scene, str) or not (path / SCENE_FILE).is_file():
        raise DataError(f"recipe {folder.name}: scene is {scene!r}; expected a folder that hsbench import scene made")
    for name in SCENE_FILES:
        digest.update(name.encode() + b"\0" + (path / name).read_bytes() + b"\0")
    return path.resolve()


def _engine_files() -> list[Path]:
    """The sources and assets that episodes follow from, in a fixed order."""
    package = Path(__file__).resolve().parents[1]
    return sorted(p for name in ENGINE_PACKAGES for kind in ("*.py", "*.npz") for p in (package / name).rglob(kind))
