"""A data set folder of captures: made for the first of them, added to by each import.

An import is whole or leaves nothing: what it made is removed again where anything stops it.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

from hsbench import __version__
from hsbench.errors import DataError
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import (
    CROISSANT_FILE,
    DATASET_FILE,
    EPISODES_FOLDER,
    INDEX_FILE,
    MANIFEST_FILE,
    require_outside,
    unit_folders,
    write_index,
)
from hsbench.io.episodes import write_episode
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.episode import Episode


def add_capture(out: Path, episode: Episode, licence: str = "as the source") -> None:
    """Write one episode as ``add_captures`` does."""
    add_captures(out, [episode], licence=licence)


def add_captures(
    out: Path, episodes: Sequence[Episode], scene_id: str | None = None, licence: str = "as the source"
) -> None:
    """Write episodes into the data set folder ``out``, which is made if need be, and renew its index.

    scene_id: of the place that all of them show; default: each its own, named as its episode. Raises DataError if the
    folder holds another data set or lies inside of one, or an episode is there already.
    """
    with _data_set(out, episodes[0].dataset, licence), sole_writer(out):
        before = set(unit_folders(out))
        try:
            for episode in episodes:
                folder = out / EPISODES_FOLDER / episode.episode_id
                write_episode(folder, episode, scene_id or episode.episode_id, "")
            write_index(out)
        except BaseException:
            for folder in set(unit_folders(out)) - before:
                shutil.rmtree(folder)
            write_index(out)
            raise


@contextmanager
def _data_set(out: Path, name: str, licence: str) -> Iterator[None]:
    """The data set ``name`` at ``out``; one that was made for this is unmade where it is left by an exception."""
    path = out / DATASET_FILE
    if path.exists():
        description = read_json(path)
        found = description.get("name") if isinstance(description, dict) else None
        if found != name:
            raise DataError(f"{out} holds data set {found!r}; expected {name!r} (choose another --out)")
        yield
        return
    if out.exists() and any(out.iterdir()):
        raise DataError(
            f"{out} is not empty and holds no {DATASET_FILE}; expected a new folder or a data set of imports"
        )
    require_outside(out)
    absent = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        (out / EPISODES_FOLDER).mkdir(parents=True)
        description = {
            "schema_version": SCHEMA_VERSION,
            "hsbench_version": __version__,
            "name": name,
            "splits_version": "none",
            "licence": licence,
            "categories": [asdict(c) for c in CATEGORIES],
        }
        write_json(path, description)
        yield
    except BaseException:
        for file in (DATASET_FILE, INDEX_FILE, CROISSANT_FILE, MANIFEST_FILE):
            (out / file).unlink(missing_ok=True)
        with suppress(OSError):  # something else came to lie there meanwhile
            for folder in (out / EPISODES_FOLDER, *absent):
                folder.rmdir()
        raise
