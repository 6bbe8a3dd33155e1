"""A data set's folder: ``dataset.json``, ``episodes/<id>/``, and the index and manifest made from the units.

``episodes.parquet`` has a row an episode: episode_id, scene_id, split, duration_s, n_frames, n_poses, renderer.
``croissant.json`` describes both and the units to other tools. ``manifest.json`` has the sha256 of these three files
and of each unit's own manifest.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa

from hsbench.errors import DataError
from hsbench.io.atomic import atomic_file, write_json
from hsbench.io.checksums import FileFault, changed, differences, sha256_file
from hsbench.io.croissant import croissant
from hsbench.io.episodes import read_parquet, write_parquet
from hsbench.io.strict_json import read_json
from hsbench.schema.codec import require_columns

DATASET_FILE = "dataset.json"
EPISODES_FOLDER = "episodes"
INDEX_FILE = "episodes.parquet"
CROISSANT_FILE = "croissant.json"
MANIFEST_FILE = "manifest.json"

INDEX_SCHEMA = pa.schema(
    [
        ("episode_id", pa.string()),
        ("scene_id", pa.string()),
        ("split", pa.string()),
        ("duration_s", pa.float64()),
        ("n_frames", pa.int64()),
        ("n_poses", pa.int64()),
        ("renderer", pa.string()),
    ]
)


def unit_folders(root: Path) -> list[Path]:
    """The finished units of a data set, by name; temporary folders (leading dot) are left out."""
    folder = root / EPISODES_FOLDER
    if not folder.is_dir():
        raise DataError(f"{root} has no folder {EPISODES_FOLDER}/ (is this a data set?)")
    return sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))


def require_outside(path: str | Path) -> None:
    """Raise DataError where ``path`` lies inside of a data set: its manifests vouch for every file there."""
    for folder in Path(path).resolve().parents:
        if (folder / DATASET_FILE).is_file() and (folder / EPISODES_FOLDER).is_dir():
            raise DataError(f"{path} lies inside of the data set {folder}; choose a place outside of it")


def write_index(root: Path) -> None:
    """Write ``episodes.parquet``, ``croissant.json`` and ``manifest.json`` from the units that are there."""
    units = unit_folders(root)
    rows = [read_json(unit / "index.json") for unit in units]
    with atomic_file(root / INDEX_FILE) as temporary:
        write_parquet(temporary, pa.Table.from_pylist(rows, schema=INDEX_SCHEMA))
    write_json(root / CROISSANT_FILE, described(root))
    hashes = {name: sha256_file(root / name) for name in (DATASET_FILE, INDEX_FILE, CROISSANT_FILE)}
    hashes |= {f"{EPISODES_FOLDER}/{unit.name}/{MANIFEST_FILE}": sha256_file(unit / MANIFEST_FILE) for unit in units}
    write_json(root / MANIFEST_FILE, hashes)


def described(root: Path, truth: bool = True) -> dict[str, Any]:
    """``croissant.json`` of an indexed data set, or of its inputs alone."""
    listed = {name: sha256_file(root / name) for name in (DATASET_FILE, INDEX_FILE)}
    return croissant(root, read_json(root / DATASET_FILE), listed, unit_folders(root), truth)


def contents_sha256(root: Path, pictures: bool = True) -> str:
    """Of what a data set's manifests say of its episodes: of two that hold the same, the same.

    It is that of the list which ``find episodes -type f ! -name manifest.json | LC_ALL=C sort | xargs sha256sum``
    prints. pictures: without them, ``recording`` and ``index.json`` are left out, which depend on the renderer.
    """
    listed = [
        (f"{EPISODES_FOLDER}/{unit.name}/{name}", digest)
        for unit in unit_folders(root)
        for name, digest in _read_manifest(unit / MANIFEST_FILE).items()
        if pictures or not (name.startswith("recording/") or name == "index.json")
    ]
    return hashlib.sha256("".join(f"{digest}  {name}\n" for name, digest in sorted(listed)).encode()).hexdigest()


def is_indexed(root: Path) -> bool:
    """Whether index and manifest are there and list exactly the units that are there."""
    if not ((root / INDEX_FILE).is_file() and (root / MANIFEST_FILE).is_file()):
        return False
    return sorted(row["episode_id"] for row in read_index(root)) == [unit.name for unit in unit_folders(root)]


def verify_unit(root: Path, episode_id: str, part: str) -> list[str]:
    """Every fault of an episode's files under ``part`` (such as ``truth/``) against the manifests."""
    unit = root / EPISODES_FOLDER / episode_id
    path = unit / MANIFEST_FILE
    listed = read_json(root / MANIFEST_FILE)
    if listed.get(f"{EPISODES_FOLDER}/{episode_id}/{MANIFEST_FILE}") != sha256_file(path):
        return [f"{path} has changed since the data set was made"]
    wanted = {name: digest for name, digest in read_json(path).items() if name.startswith(part)}
    changed = (name for name, digest in wanted.items() if sha256_file(unit / name) != digest)
    return [f"{unit / name} has changed since it was made" for name in changed]


def read_index(root: Path) -> list[dict[str, Any]]:
    """The rows of the index. Raises DataError where it is missing, damaged or lacks a column."""
    path = root / INDEX_FILE
    if not path.exists():
        hint = (
            "is this a data set?" if not (root / DATASET_FILE).exists() else "was its generation stopped? run it again"
        )
        raise DataError(f"{path} is missing ({hint})")
    table = read_parquet(path)
    require_columns(table, str(path), tuple(INDEX_SCHEMA.names))
    return list(table.to_pylist())


def verify_files(root: Path) -> list[str]:
    """Every fault of a data set's files against its manifests: missing, changed, or not listed."""
    return [fault.text for fault in file_faults(root)]


def file_faults(root: Path) -> list[FileFault]:
    """As ``verify_files``, with the kind of each fault. Raises DataError where the root has no readable manifest."""
    listed = _read_manifest(root / MANIFEST_FILE)
    faults = []
    for name, digest in listed.items():
        path = root / name
        if not path.is_file():
            gone = path.relative_to(root) if path.parent.is_dir() else path.parent.relative_to(root)
            faults.append(FileFault(gone.as_posix(), "missing", f"{gone.as_posix()}: missing"))
        elif (fault := changed(root, name, digest)) is not None:
            faults.append(fault)
    for place in (root, root / EPISODES_FOLDER):
        files = sorted(p.relative_to(root).as_posix() for p in place.iterdir() if not p.is_dir())
        extra = (name for name in files if name not in {*listed, MANIFEST_FILE})
        faults += [FileFault(name, "extra", f"{name}: extra, not in {MANIFEST_FILE}") for name in extra]
    for unit in unit_folders(root):
        name = f"{EPISODES_FOLDER}/{unit.name}"
        if f"{name}/{MANIFEST_FILE}" not in listed:
            faults.append(FileFault(name, "extra", f"{name}: extra, not in {MANIFEST_FILE} (was it added by hand?)"))
        elif (unit / MANIFEST_FILE).is_file():
            faults += unit_faults(unit)
    return faults


def unit_faults(unit: Path) -> list[FileFault]:
    """Every fault of an episode's files against its own manifest, named from the root of the data set."""
    place = f"{EPISODES_FOLDER}/{unit.name}"
    try:
        expected = _read_manifest(unit / MANIFEST_FILE)
    except DataError as error:
        return [FileFault(f"{place}/{MANIFEST_FILE}", "changed", str(error))]
    return [
        replace(fault, name=f"{place}/{fault.name}", text=f"{place}/{fault.text}")
        for fault in differences(unit, expected, exclude=[MANIFEST_FILE])
    ]


def _read_manifest(path: Path) -> dict[str, str]:
    value = read_json(path)
    if not isinstance(value, dict) or not all(isinstance(v, str) for v in value.values()):
        raise DataError(f"{path} is no manifest; expected an object of file names and their sha256")
    return value
