"""``expected.json`` of a recipe: what its first scenes hold, so that anybody can see that theirs are the same.

Geometry, motion, truth and poses are pinned by the hash of their values, which does not depend on how a version of a
library packs them. Pictures depend on the machine's OpenGL and are pinned by statistics.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from hsbench.errors import DataError
from hsbench.io.arrays import load_npz
from hsbench.io.atomic import json_bytes, write_json
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, MANIFEST_FILE
from hsbench.io.episodes import read_episode, read_parquet
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Frames
from hsbench.synth.generate import episode_id
from hsbench.synth.recipes import Recipe
from hsbench.synth.remake import DEPTH_M, FRAMES_COMPARED, GREY_LEVELS, PICTURES

EXPECTED_FILE = "expected.json"
PINNED_SIZE = "mini"
KINDS = {
    "truth/scene.json": "geometry",
    "truth/scene.npz": "geometry",
    "truth/poses.parquet": "motion",
    "truth/motions.parquet": "motion",
    "truth/events.parquet": "motion",
    "inputs/poses.parquet": "poses",
    "inputs/activity_maps.npz": "poses",
    "truth/match.parquet": "poses",
}
"""File of an episode -> what it is pinned as; all others but pictures are truth."""
INDEX_FILE, OF_PICTURES = "index.json", ("renderer", "n_frames")


def pin(root: Path, recipe: Recipe) -> Path:
    """Write the recipe's ``expected.json`` from a data set that holds the scenes of its smallest size.

    Raises DataError where one is missing, or the data set is of another recipe.
    """
    description = _description(root, recipe)
    numbers = recipe.splits.numbers(PINNED_SIZE)
    names = [path.name for number, _ in numbers for path in _episodes(root, recipe, number)]
    pinned = {name: _pinned(root / EPISODES_FOLDER / name) for name in names}
    path = recipe.folder / EXPECTED_FILE
    write_json(path, {"seed": description["seed"], "renderer": description["renderer"], "episodes": pinned})
    return path


def expected_faults(root: Path, recipe: Recipe) -> Iterator[list[str]]:
    """How each episode that is pinned differs from ``expected.json``; those that the data set lacks are left out.

    Raises DataError where there is no such file, where it is of another seed, or no pinned episode is there.
    """
    description = _description(root, recipe)
    path = recipe.folder / EXPECTED_FILE
    if not path.is_file():
        raise DataError(f"recipe {recipe.name} has no {EXPECTED_FILE} (hsbench verify DATA --pin writes it)")
    expected = read_json(path)
    if expected["seed"] != description["seed"]:
        raise DataError(f"{root} has seed {description['seed']}; {EXPECTED_FILE} is of seed {expected['seed']}")
    there = [name for name in expected["episodes"] if (root / EPISODES_FOLDER / name).is_dir()]
    if not there:
        raise DataError(f"{root} has none of the {len(expected['episodes'])} episodes of {path.name}")
    for name in there:
        yield [f"{name}: {fault}" for fault in _faults(expected["episodes"][name], root / EPISODES_FOLDER / name)]


def _description(root: Path, recipe: Recipe) -> Any:
    description = read_json(root / DATASET_FILE)
    if description["name"] != recipe.name:
        raise DataError(f"{root} is of recipe {description['name']}, not {recipe.name}")
    return description


def _episodes(root: Path, recipe: Recipe, number: int) -> list[Path]:
    first = episode_id(recipe.name, number)
    found = sorted((root / EPISODES_FOLDER).glob(f"{first}*"))
    if not found:
        raise DataError(f"{root} lacks {first}; {EXPECTED_FILE} is made of all scenes of size {PINNED_SIZE}")
    return found


def _pinned(unit: Path) -> dict[str, Any]:
    digests: dict[str, Any] = {}
    for name in sorted(read_json(unit / MANIFEST_FILE)):
        if not name.startswith(PICTURES):
            digest = digests.setdefault(KINDS.get(name, "truth"), hashlib.sha256())
            digest.update(name.encode() + b"\0" + _values_digest(unit / name))
    pinned: dict[str, Any] = {kind: digests[kind].hexdigest() for kind in sorted(digests)}
    if (unit / PICTURES).is_dir():
        pinned["pictures"] = _statistics(read_episode(unit, depth_noise="none", image_noise="none").frames)
    return pinned


def _faults(expected: Mapping[str, Any], unit: Path) -> Iterator[str]:
    found = _pinned(unit)
    for kind in sorted((expected.keys() | found.keys()) - {"pictures"}):
        if expected.get(kind) != found.get(kind):
            yield f"{kind} differs from {EXPECTED_FILE}"
    if "pictures" not in found:
        return
    pictures = {row["timestamp_ns"]: row for row in found["pictures"]}
    for row in expected.get("pictures", ()):
        if row["timestamp_ns"] in pictures:  # fewer where not all were drawn
            yield from _picture_faults(row, pictures[row["timestamp_ns"]])


def _picture_faults(expected: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[str]:
    when = f"picture at {expected['timestamp_ns'] / 1e9:g} s"
    for key, most in (("rgb_mean", GREY_LEVELS), ("rgb_std", GREY_LEVELS), ("depth_mean_m", DEPTH_M)):
        if expected.get(key) is not None and found.get(key) is not None:
            off = float(np.abs(np.subtract(expected[key], found[key])).max())
            if off > most:
                yield f"{when}: {key} is {found[key]}; expected {expected[key]} within {most:g}"


def _statistics(frames: Frames) -> list[dict[str, Any]]:
    """Of frames spread over an episode: means over the picture, rounded, since they are compared within bounds."""
    rows = []
    for k in sorted({round(x) for x in np.linspace(0, len(frames) - 1, FRAMES_COMPARED)}):
        frame = frames[k]
        row: dict[str, Any] = {"timestamp_ns": int(frames.timestamps_ns[k])}
        if frame.rgb is not None:
            row["rgb_mean"] = frame.rgb.mean(axis=(0, 1)).round(2).tolist()
            row["rgb_std"] = frame.rgb.std(axis=(0, 1)).round(2).tolist()
        if frame.depth_m is not None:
            row["depth_mean_m"] = round(float(frame.depth_m.mean(dtype=np.float64)), 4)
        rows.append(row)
    return rows


def _values_digest(path: Path) -> bytes:
    """Of the values in a file, however they are packed."""
    digest = hashlib.sha256()
    if path.suffix == ".parquet":
        table = read_parquet(path)
        for name in table.column_names:
            digest.update(f"{name} {table.schema.field(name).type}".encode())
            _add_column(digest, table.column(name).combine_chunks())
    elif path.suffix == ".npz":
        for name, values in sorted(load_npz(path).items()):
            digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
            digest.update(np.ascontiguousarray(values).tobytes())
    elif path.suffix == ".json":
        value = read_json(path)
        if path.name == INDEX_FILE:
            value = {key: value[key] for key in value if key not in OF_PICTURES}
        digest.update(json_bytes(value))
    else:
        digest.update(path.read_bytes())
    return digest.digest()


def _add_column(digest: hashlib._Hash, column: pa.Array) -> None:
    """Add an Arrow array: which values are null, lengths of lists, and the values."""
    digest.update(np.asarray(pc.is_null(column)).tobytes())
    if pa.types.is_nested(column.type):
        if not pa.types.is_fixed_size_list(column.type):
            digest.update(np.asarray(pc.fill_null(pc.list_value_length(column), 0), dtype=np.int64).tobytes())
        _add_column(digest, pc.list_flatten(column))
    elif pa.types.is_primitive(column.type):
        digest.update(np.ascontiguousarray(pc.drop_null(column).to_numpy(zero_copy_only=False)).tobytes())
    else:
        digest.update(json_bytes(column.to_pylist()))
