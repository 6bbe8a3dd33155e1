"""Generating a data set: units in any order, on any number of processes, resumable, the same bytes.

A unit's episodes are built in a temporary folder and renamed into place, so a kill at any moment costs at most the
units under way; running the same command again makes what is missing.
"""

from __future__ import annotations

import errno
import os
import shutil
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hsbench import __version__
from hsbench.errors import DataError, HsbenchError
from hsbench.io.atomic import PART, sync_all, write_json
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, is_indexed, unit_folders, write_index
from hsbench.io.episodes import write_episode
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION, Episode
from hsbench.schema.categories import CATEGORIES
from hsbench.synth.executors import Executor, local
from hsbench.synth.recipes import Recipe, Unit, find_recipe, frame_step
from hsbench.synth.render import Renderer, RendererName, open_renderer, resolve
from hsbench.synth.seeds import Seeds

LICENCE = "CC-BY-4.0"
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)


@dataclass(frozen=True)
class Job:
    """What a run makes: a recipe by name or path, the seed, the units (scene number, split), and how.

    frames: which pictures, see ``frame_step``. renderer: ``auto``, ``pyrender`` or ``raycast``.
    threads: of each worker, that draw people.
    Raises SchemaError for another choice of frames.
    """

    recipe: str
    seed: int
    units: tuple[tuple[int, str], ...]
    frames: str = "all"
    renderer: RendererName = "auto"
    splits_version: str = "v0"
    threads: int = 1

    def __post_init__(self) -> None:
        frame_step(self.frames)


@dataclass(frozen=True)
class Made:
    """What became of a unit: the ids of its episodes, seconds and bytes they took; or why there are none."""

    unit: tuple[int, str]
    episode_ids: tuple[str, ...] = ()
    time_s: float = 0.0
    size_bytes: int = 0
    error: Exception | None = None


class PlaceError(DataError):
    """Nothing can be written where the data set lies; no other unit would fare better."""


def generate(job: Job, out: Path, workers: int = 1) -> Iterator[str]:
    """Make the missing units of a job under ``out``, yielding each episode id when it is there, then write the index.

    A unit that fails costs itself: the others are made, then its failure is raised. It names recipe, seed and scene.
    Raises DataError if ``out`` holds another data set: another recipe, seed, or choice of frames.
    """
    failed = []
    for made in make_units(job, out, local(min(workers, len(job.units)))):
        failed += [] if made.error is None else [made]
        yield from made.episode_ids
    raise_failures(failed)


def make_units(job: Job, out: Path, executor: Executor, keep_going: bool = True) -> Generator[Made, None, None]:
    """Make the missing units of a job under ``out``, yielding each as it is done, then write the index.

    A unit that fails costs itself, unless ``keep_going`` is False: then nothing is begun after it. Raises DataError if
    ``out`` holds another data set, PlaceError where nothing can be written; what is there then is whole.
    """
    recipe = find_recipe(job.recipe)
    units = missing_units(job, out)
    if units:  # before anything is written: where nothing can draw, nothing is left behind
        executor.check()
        job = replace(job, renderer=_choose_renderer(job, out))
    _open_dataset(out, job, recipe)
    if not units:
        if not is_indexed(out):
            write_index(out)
        return
    with sole_writer(out):
        _remove_leftovers(out)
        try:
            with closing(_made(job, units, out, executor)) as all_made:
                for made in all_made:
                    yield made
                    if made.error is not None and not keep_going:
                        break
        finally:
            _remove_leftovers(out)
        if unit_folders(out):
            write_index(out)


def missing_units(job: Job, out: Path) -> list[tuple[int, str]]:
    """The units of a job that are not there yet."""
    name, episodes = find_recipe(job.recipe).name, out / EPISODES_FOLDER
    return [unit for unit in job.units if not (episodes / episode_id(name, unit[0])).is_dir()]


def raise_failures(failed: Sequence[Made]) -> None:
    """Raise the first failure, with the scene numbers of the others; return if there is none."""
    errors = [made.error for made in failed if made.error is not None]
    if len(errors) > 1:
        numbers = ", ".join(str(made.unit[0]) for made in failed[1:])
        others = f"(and {len(errors) - 1} units more failed: scene numbers {numbers}; the others are made)"
        raise type(errors[0])(f"{errors[0]} {others}") from errors[0]
    if errors:
        raise errors[0]


def _choose_renderer(job: Job, out: Path) -> RendererName:
    """The renderer of this run: for ``auto`` the one that a data set begun earlier was drawn by."""
    if job.frames == "none":
        return "auto"
    begun = read_json(out / DATASET_FILE).get("renderer") if (out / DATASET_FILE).is_file() else None
    return resolve(begun if job.renderer == "auto" and begun in ("pyrender", "raycast") else job.renderer)


def _made(job: Job, units: Sequence[tuple[int, str]], out: Path, executor: Executor) -> Generator[Made, None, None]:
    """What became of each unit, in any order. Raises PlaceError."""
    recipe = find_recipe(job.recipe)
    if not recipe.is_bundled:
        job = replace(job, recipe=str(recipe.folder))  # a worker elsewhere has another working folder
    make = partial(make_unit, job, out=out.resolve(), sha256=recipe.sha256)
    with closing(executor.outcomes(make, units)) as outcomes:
        for unit, outcome in outcomes:
            if isinstance(outcome, PlaceError):
                raise outcome
            where = _where(job, unit[0])
            if isinstance(outcome, Exception) and not str(outcome).startswith(where):  # a dead process cannot say it
                outcome = DataError(f"{where}: {str(outcome) or type(outcome).__name__}")
            yield Made(unit, error=outcome) if isinstance(outcome, Exception) else outcome


def _remove_leftovers(out: Path) -> None:
    """Remove what killed runs left half made; the caller is the only writer."""
    for folder in (out / EPISODES_FOLDER).glob(f".*{PART}"):
        shutil.rmtree(folder, ignore_errors=True)
    for file in out.glob(f".*{PART}"):
        file.unlink(missing_ok=True)


def make_unit(job: Job, unit: tuple[int, str], out: Path, sha256: str) -> Made:
    """Make one unit. A failure names recipe, seed and scene number.

    The first episode bears the unit's own name and takes its place last: where it is, the whole unit is.
    sha256: of recipe and engine. Raises DataError where this process has others, PlaceError, and what ``build`` raises.
    """
    began_s = time.monotonic()
    number, split = unit
    recipe, episodes = find_recipe(job.recipe), out / EPISODES_FOLDER
    unit_name, known_as = episode_id(recipe.name, number), recipe.known_as(number, split)
    made: list[str] = []
    with _named(job, number), TemporaryDirectory(prefix=".unit-", suffix=PART, dir=episodes) as staging:
        if recipe.sha256 != sha256:
            raise DataError("its worker has another version of the recipe or of hsbench than the one who asks")
        renderer = None if job.frames == "none" else _renderer(job.renderer).name
        for episode in _built(job, unit):
            write_episode(Path(staging) / episode.episode_id, episode, *known_as, renderer)
            made.append(episode.episode_id)
        if made[:1] != [unit_name]:
            raise DataError(
                f"its first episode is {made[:1]}; expected {unit_name!r} (further ones may be called anything)"
            )
        size_bytes = sum(path.stat().st_size for path in Path(staging).rglob("*") if path.is_file())
        sync_all()
        for name in reversed(made):
            shutil.rmtree(episodes / name, ignore_errors=True)  # left by a run that was killed between two renames
            (Path(staging) / name).rename(episodes / name)
    return Made(unit, tuple(made), time.monotonic() - began_s, size_bytes)


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
    return recipe.build(recipe.config, Unit(seeds, number, split, job.frames, renderer, job.threads))


@contextmanager
def _named(job: Job, number: int) -> Iterator[None]:
    """Failures inside name recipe, seed and scene number. Raises PlaceError where the disk is at fault."""
    try:
        yield
    except (Exception, SystemExit) as error:
        if (fault := _fault_of_place(error)) is not None:
            raise PlaceError(f"{_where(job, number)}: cannot write: {fault} (the same command goes on)") from error
        if isinstance(error, HsbenchError):
            raise DataError(f"{_where(job, number)}: {error}") from error
        raise RuntimeError(f"{_where(job, number)}: {type(error).__name__}: {error}") from error


def _fault_of_place(error: BaseException | None) -> str | None:
    """What is wrong with the disk, if that is behind an error."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in NO_ROOM:
            return os.strerror(error.errno)
        error = error.__cause__ or error.__context__
    return None


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
    elif out.exists() and any(not (p.name.startswith(".") and p.name.endswith(PART)) for p in out.iterdir()):
        raise DataError(
            f"{out} is not empty and holds no {DATASET_FILE}; expected a new folder or one made by this command"
        )
    else:
        write_json(path, description)
    (out / EPISODES_FOLDER).mkdir(exist_ok=True)
