"""Making episodes of a data set again from its recipe, and comparing: does it hold what the recipe makes?

Geometry, motion, truth and poses must be equal: the same bytes, or the same values where another version of a library
wrote them. Pictures depend on the machine's OpenGL and are compared by statistics.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from hsbench.errors import DataError
from hsbench.io.arrays import load_npz
from hsbench.io.checksums import sha256_file
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, MANIFEST_FILE, read_index
from hsbench.io.episodes import read_episode, read_parquet
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Frames
from hsbench.synth.executors import Executor
from hsbench.synth.generate import Job, episode_id, make_units, raise_failures
from hsbench.synth.recipes import Recipe, find_recipe
from hsbench.synth.render import RendererName
from hsbench.synth.seeds import Seeds

FRAMES_COMPARED = 5
GREY_LEVELS = 2.0
"""Mean difference of a picture's channels, of 255. OpenGL and the ray caster differed by .002 in one room, another
room by 56."""
DEPTH_SHARE = 0.99
"""Of the pixels, that differ by at most ``DEPTH_M`` or have no depth in both. In those rooms, 99.999 % and .3 %."""
DEPTH_M = 0.005
PICTURES = "recording/"


def remade_faults(
    root: Path, count: int, seed: int, executor: Executor, recipe: str | None = None
) -> Iterator[list[str]]:
    """Make ``count`` random units of a generated data set again; yields a list of faults, a line each, for each.

    recipe: the path of its folder, where it is not a bundled one. seed: of the choice. Raises DataError if the data set
    is not generated, and what the recipe raises.
    """
    description, found = _origin(root, recipe)
    units = _units(root, found)
    rng = Seeds(seed).rng("against-recipe")
    chosen = tuple(units[k] for k in sorted(rng.permutation(len(units))[:count]))
    drawn: RendererName = "raycast" if description["renderer"] == "raycast" else "auto"
    job = Job(
        str(found.folder), description["seed"], chosen, description["frames"], drawn, description["splits_version"]
    )
    with TemporaryDirectory(prefix="hsbench-remade-") as folder:
        again = Path(folder) / "data"
        for made in make_units(job, again, executor):
            raise_failures([made])
            yield [
                fault
                for episode in made.episode_ids
                for fault in episode_faults(root / EPISODES_FOLDER / episode, again / EPISODES_FOLDER / episode)
            ]


def is_of_this_version(root: Path, recipe: str | None = None) -> bool:
    """Whether a data set was made by the recipe and the engine that are here."""
    description, found = _origin(root, recipe)
    return bool(found.sha256 == description["recipe_sha256"])


def recipe_of(root: Path, recipe: str | None = None) -> Recipe:
    """The recipe that a data set names. recipe: the path of its folder, where it is not a bundled one."""
    return _origin(root, recipe)[1]


def _origin(root: Path, recipe: str | None) -> tuple[Any, Recipe]:
    """``dataset.json`` and the recipe it names."""
    description = read_json(root / DATASET_FILE)
    if "recipe_sha256" not in description:
        raise DataError(f"{root} was not generated: it has no recipe")
    found = find_recipe(recipe or description["name"])
    if found.name != description["name"]:
        raise DataError(f"{root} is of recipe {description['name']}, not {found.name}")
    return description, found


def _units(root: Path, recipe: Recipe) -> list[tuple[int, str]]:
    """(number, split) of the units that are there; the split is the one they were made for."""
    known = {number: split for size in recipe.splits.scenes for number, split in recipe.splits.numbers(size)}
    there = {row["episode_id"] for row in read_index(root)}
    return [unit for unit in sorted(known.items()) if episode_id(recipe.name, unit[0]) in there]


def episode_faults(unit: Path, again: Path) -> list[str]:
    """How an episode's folder differs from one that was made again."""
    if not unit.is_dir():
        return [f"{unit.name} is missing"]
    names, others = (read_json(folder / MANIFEST_FILE).keys() for folder in (unit, again))
    faults = [f"{unit.name}: {name} is there once only" for name in sorted(names ^ others)]
    faults += [
        f"{unit.name}: {name} differs from what the recipe makes"
        for name in sorted(names & others)
        if not name.startswith(PICTURES) and not _same(unit / name, again / name)
    ]
    if any(name.startswith(PICTURES) for name in names & others):
        pair = (read_episode(folder, depth_noise="none", image_noise="none").frames for folder in (unit, again))
        faults += [f"{unit.name}: {fault}" for fault in _picture_faults(*pair)]
    return faults


def _same(a: Path, b: Path) -> bool:
    if sha256_file(a) == sha256_file(b):
        return True
    if a.suffix == ".parquet":
        return bool(read_parquet(a).equals(read_parquet(b)))
    if a.suffix == ".npz":
        ours, theirs = load_npz(a), load_npz(b)
        return ours.keys() == theirs.keys() and all(np.array_equal(ours[k], theirs[k]) for k in ours)
    return a.name == "index.json" and read_json(a) | {"renderer": None} == read_json(b) | {"renderer": None}


def _picture_faults(frames: Frames, again: Frames) -> Iterator[str]:
    if not np.array_equal(frames.timestamps_ns, again.timestamps_ns):
        yield "its pictures have other time stamps"
        return
    for k in sorted({round(x) for x in np.linspace(0, len(frames) - 1, FRAMES_COMPARED)}):
        ours, theirs = frames[k], again[k]
        if ours.rgb is not None and theirs.rgb is not None:
            levels = float(np.abs(ours.rgb.astype(np.int16) - theirs.rgb).mean())
            if levels > GREY_LEVELS:
                yield f"picture {k} differs by {levels:.1f} grey levels; expected at most {GREY_LEVELS:g}"
        if ours.depth_m is not None and theirs.depth_m is not None:
            share = float(np.mean(np.abs(ours.depth_m - theirs.depth_m) <= DEPTH_M))
            if share < DEPTH_SHARE:
                yield f"depth {k} is equal on {share:.1%} of the pixels; expected at least {DEPTH_SHARE:.0%}"
