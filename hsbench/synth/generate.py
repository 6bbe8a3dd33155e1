"""Generating a data set: units in any order, on any number of processes, resumable, the same bytes.

A unit is built in a temporary folder and renamed into place, so a kill at any moment costs at most the
units under way; running the same command again makes what is missing.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from hsbench import __version__
from hsbench.errors import DataError, HsbenchError
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, write_index
from hsbench.io.episodes import write_episode
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION
from hsbench.schema.categories import CATEGORIES
from hsbench.synth.recipes import Recipe, Unit, find_recipe
from hsbench.synth.render import Renderer, RendererName, open_renderer, resolve
from hsbench.synth.seeds import Seeds

LICENCE = "CC-BY-4.0"


@dataclass(frozen=True)
class Job:
    """What a run makes: a recipe by name or path, the seed, the units (scene number, split), and how.

    frames: ``all``, ``reference`` or ``none``. renderer: ``auto``, ``pyrender`` or ``raycast``.
    """

    recipe: str
    seed: int
    units: tuple[tuple[int, str], ...]
    frames: str = "all"
    renderer: RendererName = "auto"
    splits_version: str = "v0"


def generate(job: Job, out: Path, workers: int = 1) -> Iterator[str]:
    """Make the missing units of a job under ``out``, yielding each episode id when it is there, then write the index.

    Raises DataError if ``out`` holds another data set: another recipe, seed, or choice of frames.
    """
    recipe = find_recipe(job.recipe)
    _open_dataset(out, job, recipe)
    units = [u for u in job.units if not (out / EPISODES_FOLDER / episode_id(recipe.name, u[0])).is_dir()]
    if workers <= 1 or len(units) <= 1:
        for unit in units:
            yield from make_unit(job, unit, out)
    else:
        if job.frames != "none":
            job = replace(job, renderer=resolve(job.renderer))
        yield from _in_parallel(job, units, out, workers)
    write_index(out)


def _in_parallel(job: Job, units: Sequence[tuple[int, str]], out: Path, workers: int) -> Iterator[str]:
    pool = ProcessPoolExecutor(min(workers, len(units)), mp_context=get_context("spawn"), initializer=_start_worker)
    try:
        futures = [pool.submit(make_unit, job, unit, out) for unit in units]
        for future in as_completed(futures):
            yield from future.result()
    except BrokenProcessPool as error:
        raise DataError(f"a worker died (out of memory?); {out} is whole: run the same command again") from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _start_worker() -> None:
    """Ctrl-C is the parent's business: a worker finishes its unit. One thread draws: software GL threads of several
    processes slow each other down (measured on two cores: two workers gave 1.5x with them, 2.0x without).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.setdefault("LP_NUM_THREADS", "0")


def make_unit(job: Job, unit: tuple[int, str], out: Path) -> list[str]:
    """Make one unit and return the ids of its episodes. A failure names recipe, seed and scene number."""
    recipe = find_recipe(job.recipe)
    number, split = unit
    renderer = None if job.frames == "none" else _renderer(job.renderer)
    seeds = Seeds(job.seed).child("scene").child(number)
    made = []
    try:
        for episode in recipe.build(recipe.config, Unit(seeds, number, split, job.frames, renderer)):
            folder = out / EPISODES_FOLDER / episode.episode_id
            write_episode(folder, episode, f"scene-{number:06d}", split, None if renderer is None else renderer.name)
            made.append(episode.episode_id)
    except Exception as error:
        where = f"recipe {recipe.name}, seed {job.seed}, scene number {number}"
        if isinstance(error, HsbenchError):
            raise DataError(f"{where}: {error}") from error
        raise RuntimeError(f"{where}: {type(error).__name__}: {error}") from error
    return made


def episode_id(recipe_name: str, number: int) -> str:
    """The id of a recipe's only episode of a scene."""
    return f"{recipe_name}-{number:06d}"


@lru_cache(maxsize=1)
def _renderer(name: RendererName) -> Renderer:
    """One renderer a process: closing one ends EGL for all."""
    return open_renderer(name)


def _open_dataset(out: Path, job: Job, recipe: Recipe) -> None:
    """Write ``dataset.json``, or check that what is there is the same data set."""
    description: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "hsbench_version": __version__,
        "name": recipe.name,
        "recipe_sha256": recipe.sha256,
        "seed": job.seed,
        "splits_version": job.splits_version,
        "frames": job.frames,
        "licence": LICENCE,
        "categories": [asdict(c) for c in CATEGORIES],
    }
    path = out / DATASET_FILE
    if path.exists():
        found = read_json(path)
        for key in ("name", "recipe_sha256", "seed", "splits_version", "frames", "schema_version"):
            if found.get(key) != description[key]:
                raise DataError(
                    f"{out} holds a data set with {key} {found.get(key)!r}; this run has {description[key]!r} "
                    "(choose another --out, or remove the folder)"
                )
        return
    if out.exists() and any(out.iterdir()):
        raise DataError(
            f"{out} is not empty and holds no {DATASET_FILE}; expected a new folder or one made by this command"
        )
    (out / EPISODES_FOLDER).mkdir(parents=True, exist_ok=True)
    write_json(path, description)
