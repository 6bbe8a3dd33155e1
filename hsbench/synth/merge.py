"""Joining data sets that were made in parts: by ``--shard i/n``, or on several machines."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hsbench.errors import DataError
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import sha256_file
from hsbench.io.dataset_index import (
    DATASET_FILE,
    EPISODES_FOLDER,
    MANIFEST_FILE,
    is_indexed,
    require_outside,
    unit_folders,
    write_index,
)
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json


def merge(shards: Sequence[Path], out: Path) -> Iterator[str]:
    """Bring the episodes of all shards under ``out``, yielding the id of each, then write the index.

    Files are linked where the disk is the same, else copied; the shards stay as they are. A stopped merge goes on when
    it is asked for again, and a further shard may be added later. Nothing is written before all shards are known to be
    finished parts of one data set: DataError names the first that is not, or the first episode that two hold
    differently.
    """
    begun = (out / DATASET_FILE).exists()
    if not begun and out.exists() and any(out.iterdir()):
        raise DataError(f"{out} is not empty and holds no {DATASET_FILE}; expected a new folder or one that merge made")
    roots = [*shards, *([out] if begun else [])]
    description = _common_description(roots)
    for shard in shards:
        if not is_indexed(shard):
            raise DataError(f"{shard} is not finished (run the command that makes it again: it goes on where it was)")
    units = _distinct_units(roots)
    require_outside(out)
    (out / EPISODES_FOLDER).mkdir(parents=True, exist_ok=True)
    with sole_writer(out):
        write_json(out / DATASET_FILE, description)
        for name, unit in units.items():
            target = out / EPISODES_FOLDER / name
            if not target.is_dir():
                with atomic_folder(target) as staging:
                    shutil.copytree(unit, staging, copy_function=_link, dirs_exist_ok=True)
            yield name
        write_index(out)


def _common_description(roots: Sequence[Path]) -> Any:
    """What ``dataset.json`` says in all of them. Raises DataError where two differ."""
    first, *_ = roots
    description = _description(first)
    for root in roots[1:]:
        other = _description(root)
        for key in sorted({*description, *other}):
            if description.get(key) != other.get(key):
                raise DataError(
                    f"{first} and {root} are of different data sets: {key} is {_short(description.get(key))} and "
                    f"{_short(other.get(key))}; expected shards of one recipe, seed, version and renderer"
                )
    return description


def _description(root: Path) -> Any:
    if not (root / DATASET_FILE).is_file():
        raise DataError(f"{root} holds no {DATASET_FILE} (is this a data set?)")
    return read_json(root / DATASET_FILE)


def _distinct_units(roots: Sequence[Path]) -> dict[str, Path]:
    """Where the files of each episode lie, by id. Raises DataError where two shards hold different ones of a name."""
    units: dict[str, Path] = {}
    for root in roots:
        for unit in unit_folders(root):
            known = units.setdefault(unit.name, unit)
            if known != unit and sha256_file(known / MANIFEST_FILE) != sha256_file(unit / MANIFEST_FILE):
                raise DataError(f"{known} and {unit} hold different episodes of one name (was one made elsewhere?)")
    return dict(sorted(units.items()))


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 20 else f"{text[:16]}..."


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:  # another disk, or one without links
        shutil.copyfile(source, target)
