"""Generating a data set: units in any order, on any number of processes, resumable, the same bytes.

A unit's episodes are built in a temporary folder and renamed into place, so a kill at any moment costs at most the
units under way; running the same command again makes what is missing.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hsbench import __version__
from hsbench.errors import DataError, HsbenchError
from hsbench.io.atomic import PART, sync_all, write_json
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, is_indexed, write_index
from hsbench.io.episodes import write_episode
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION, Episode
from hsbench.schema.categories import CATEGORIES
from hsbench.synth.recipes import Recipe, Unit, find_recipe, frame_step
from hsbench.synth.render import Renderer, RendererName, open_renderer, resolve
from hsbench.synth.seeds import Seeds
from hsbench.synth.workers import worker_pool

LICENCE = "CC-BY-4.0"


@dataclass(frozen=True)
class Job:
    """What a run makes: a recipe by name or path, the seed, the units (scene number, split), and how.

    frames: which pictures, see ``frame_step``. renderer: ``auto``, ``pyrender`` or ``raycast``.
    Raises SchemaError for another choice of frames.
    """

    recipe: str
    seed: int
    units: tuple[tuple[int, str], ...]
    frames: str = "all"
    renderer: RendererName = "auto"
    splits_version: str = "v0"

    def __post_init__(self) -> None:
        frame_step(self.frames)


def generate(job: Job, out: Path, workers: int = 1) -> Iterator[str]:
    """Make the missing units of a job under ``out``, yielding each episode id when it is there, then write the index.

    A unit that fails costs itself: the others are made, then its failure is raised. It names recipe, seed and scene.
    Raises DataError if ``out`` holds another data set: another recipe, seed, or choice of frames.
    """
    recipe = find_recipe(job.recipe)
    units = [u for u in job.units if not (out / EPISODES_FOLDER / episode_id(recipe.name, u[0])).is_dir()]
    workers = min(workers, len(units))
    if units:  # before anything is written: where nothing can draw, nothing is left behind
        job = replace(job, renderer=_choose_renderer(job, out))
    _open_dataset(out, job, recipe)
    failures: list[Exception] = []
    if units:
        with sole_writer(out):
            _remove_leftovers(out)
            for made in _in_parallel(job, units, out, workers) if workers > 1 else _in_turn(job, units, out):
                if isinstance(made, Exception):
                    failures.append(made)
                else:
                    yield from made
            if len(failures) < len(units):
                write_index(out)
    elif not is_indexed(out):
        write_index(out)
    if len(failures) > 1:
        first = failures[0]
        raise type(first)(f"{first} (and {len(failures) - 1} units more failed; the others are made)") from first
    if failures:
        raise failures[0]


def _choose_renderer(job: Job, out: Path) -> RendererName:
    """The renderer of this run: for ``auto`` the one that a data set begun earlier was drawn by."""
    if job.frames == "none":
        return "auto"
    begun = read_json(out / DATASET_FILE).get("renderer") if (out / DATASET_FILE).is_file() else None
    return resolve(begun if job.renderer == "auto" and begun in ("pyrender", "raycast") else job.renderer)


def _in_turn(job: Job, units: Sequence[tuple[int, str]], out: Path) -> Iterator[list[str] | Exception]:
    """The episode ids of each unit, or why there are none."""
    for unit in units:
        yield _outcome(partial(make_unit, job, unit, out))


def _in_parallel(
    job: Job, units: Sequence[tuple[int, str]], out: Path, workers: int
) -> Iterator[list[str] | Exception]:
    """As ``_in_turn``, in any order. A process that dies takes down all that run beside it: these are made again, each
    in a process of its own, to see whose fault it was.
    """
    waiting = list(units)[::-1]
    try:
        while waiting:
            running: dict[Future[list[str]], tuple[int, str]] = {}
            with worker_pool(workers) as pool:
                while waiting or running:
                    while waiting and len(running) < workers:
                        unit = waiting.pop()
                        running[pool.submit(make_unit, job, unit, out)] = unit
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    outcomes = {future: _outcome(future.result) for future in done}
                    if any(isinstance(made, BrokenProcessPool) for made in outcomes.values()):
                        break
                    for future, made in outcomes.items():
                        del running[future]
                        yield made
            for unit in running.values():
                yield _alone(job, unit, out)
    finally:
        _remove_leftovers(out)


def _alone(job: Job, unit: tuple[int, str], out: Path) -> list[str] | Exception:
    with worker_pool(1) as pool:
        made = _outcome(pool.submit(make_unit, job, unit, out).result)
    if isinstance(made, BrokenProcessPool):
        return DataError(f"{_where(job, unit[0])}: its process died (out of memory, or a crash of the renderer)")
    return made


def _outcome(make: Callable[[], list[str]]) -> list[str] | Exception:
    try:
        return make()
    except Exception as error:
        return error


def _remove_leftovers(out: Path) -> None:
    """Remove what killed runs left half made; the caller is the only writer."""
    for folder in (out / EPISODES_FOLDER).glob(f".*{PART}"):
        shutil.rmtree(folder, ignore_errors=True)


def make_unit(job: Job, unit: tuple[int, str], out: Path) -> list[str]:
    """Make one unit and return the ids of its episodes. A failure names recipe, seed and scene number.

    The first episode bears the unit's own name and takes its place last: where it is, the whole unit is.
    """
    number, split = unit
    renderer = None if job.frames == "none" else _renderer(job.renderer).name
    recipe, episodes = find_recipe(job.recipe), out / EPISODES_FOLDER
    unit_name, known_as = episode_id(recipe.name, number), recipe.known_as(number, split)
    made: list[str] = []
    with _named(job, number), TemporaryDirectory(prefix=".unit-", suffix=PART, dir=episodes) as staging:
        for episode in _built(job, unit):
            write_episode(Path(staging) / episode.episode_id, episode, *known_as, renderer)
            made.append(episode.episode_id)
        if made[:1] != [unit_name]:
            raise DataError(
                f"its first episode is {made[:1]}; expected {unit_name!r} (further ones may be called anything)"
            )
        sync_all()
        for name in reversed(made):
            shutil.rmtree(episodes / name, ignore_errors=True)  # left by a run that was killed between two renames
            (Path(staging) / name).rename(episodes / name)
    return made


def preview(job: Job) -> Iterator[Episode]:
    """The first episode of each unit, in memory, with nothing but the picture at t0: what ``job`` would make."""
    job = replace(job, frames="reference", renderer=resolve(job.renderer))
    for unit in job.units:
        with _named(job, unit[0]):
            yield next(_built(job, unit))


def _built(job: Job, unit: tuple[int, str]) -> Iterator[Episode]:
    recipe = find_recipe(job.recipe)
    number, split = unit
    renderer = None if job.frames == "none" else _renderer(job.renderer)
    seeds = Seeds(job.seed).child("scene").child(number)
    return recipe.build(recipe.config, Unit(seeds, number, split, job.frames, renderer))


@contextmanager
def _named(job: Job, number: int) -> Iterator[None]:
    """Failures inside name recipe, seed and scene number."""
    try:
        yield
    except Exception as error:
        if isinstance(error, HsbenchError):
            raise DataError(f"{_where(job, number)}: {error}") from error
        raise RuntimeError(f"{_where(job, number)}: {type(error).__name__}: {error}") from error


def _where(job: Job, number: int) -> str:
    return f"recipe {find_recipe(job.recipe).name}, seed {job.seed}, scene number {number}"


def episode_id(recipe_name: str, number: int) -> str:
    """The id of the first episode of a unit, and often its only one."""
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
        "renderer": None if job.frames == "none" else job.renderer,
        "licence": LICENCE,
        "categories": [asdict(c) for c in CATEGORIES],
    }
    path = out / DATASET_FILE
    if path.exists():
        found = read_json(path)
        for key in ("name", "recipe_sha256", "seed", "splits_version", "frames", "schema_version", "renderer"):
            if found.get(key) != description[key] and (key, description[key]) != ("renderer", "auto"):
                if key == "recipe_sha256":
                    raise DataError(
                        f"{out} holds a data set with recipe_sha256 of another version of the recipe or the generator "
                        "(choose another --out, or remove the folder)"
                    )
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
