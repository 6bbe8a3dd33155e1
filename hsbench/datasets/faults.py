"""Everything that is wrong with a data set, in one run, each fault with what repairs it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.verify import verify_episode, verify_views
from hsbench.errors import DataError, HsbenchError, SchemaError
from hsbench.io.checksums import FileFault
from hsbench.io.dataset_index import (
    CROISSANT_FILE,
    DATASET_FILE,
    EPISODES_FOLDER,
    INDEX_FILE,
    MANIFEST_FILE,
    file_faults,
    read_index,
    unit_faults,
    unit_folders,
)
from hsbench.io.episodes import read_episode
from hsbench.io.strict_json import read_json
from hsbench.schema.migration import is_newer, steps_from

UPGRADE = "pip install --upgrade hsbench"


@dataclass(frozen=True)
class Fault:
    """A line that names what is wrong, and the line that says what repairs it."""

    text: str
    repair: str


def dataset_faults(root: Path) -> Iterator[list[Fault]]:
    """All faults of a data set: of its files, of each episode, and of what several sensors saw of one room.

    Yields a list after each step, of which there are two more than episodes; no fault stops the rest. Raises DataError
    only where there is no folder ``episodes``: that is no data set.
    """
    units = unit_folders(root)
    remake = _Repairs(root, _description(root))
    found, faults = _whole(root, units, remake)
    yield faults
    gone = tuple(fault.name for fault in found if fault.kind in ("missing", "truncated"))
    episodes = Dataset(root, _rows(root, units), truth=True)
    for row in episodes.rows:
        yield _contents(root, row["episode_id"], gone, remake.episode(row["episode_id"]))
    yield [Fault(text, remake.all_of_scene) for found in verify_views(episodes) for text in found]


class _Repairs:
    """What repairs which part of a data set: generated ones are made again, others are brought in again."""

    def __init__(self, root: Path, description: Mapping[str, Any]) -> None:
        self._root = root
        self._others, self._command = "", "import it again"
        if "recipe_sha256" in description:
            self._others = " and the other episodes of its scene"
            self._command = (
                f"run `hsbench generate {description.get('name')} --seed {description.get('seed')} --out {root}` again "
                "with the options that made it: it makes what is missing"
            )
        self.all_of_scene = f"remove the episodes of that room, and {self._command}"

    def episode(self, episode_id: str) -> str:
        """Of anything in the folder of an episode."""
        return f"remove {self._root / EPISODES_FOLDER / episode_id}{self._others}, and {self._command}"

    def file(self, fault: FileFault) -> str:
        """Of a file, by its name from the root."""
        if fault.kind in ("extra", "odd"):
            return f"remove {self._root / fault.name}, or keep it elsewhere"
        if fault.name.startswith(f"{EPISODES_FOLDER}/"):
            return self.episode(fault.name.split("/")[1])
        if fault.name in (INDEX_FILE, MANIFEST_FILE, CROISSANT_FILE):
            return f"remove {INDEX_FILE} and {MANIFEST_FILE}, and {self._command}: that writes both anew"
        return f"fetch {fault.name} again from where the data set came from"


def _whole(root: Path, units: list[Path], repairs: _Repairs) -> tuple[list[FileFault], list[Fault]]:
    """Files that do not fit the manifests, and the faults of these, of the index and of the description."""
    try:
        found = file_faults(root)
    except DataError as error:
        own = FileFault(MANIFEST_FILE, "changed", _inside(root, str(error)))
        if not (root / MANIFEST_FILE).is_file():
            own = FileFault(MANIFEST_FILE, "missing", f"{MANIFEST_FILE}: missing")
        found = [own, *(fault for unit in units for fault in unit_faults(unit))]
    found += [
        FileFault(path.name, "extra", f"{path.name}/: extra, no part of a data set")
        for path in sorted(root.iterdir())
        if path.is_dir() and path.name != EPISODES_FOLDER and not path.name.startswith(".")
    ]
    faults = [Fault(_inside(root, fault.text), repairs.file(fault)) for fault in found]
    named = {fault.name for fault in found}
    try:
        indexed = {row["episode_id"] for row in read_index(root)}
        faults += [
            Fault(
                f"{INDEX_FILE}: no row of {unit.name}; expected one an episode",
                repairs.file(FileFault(INDEX_FILE, "changed", "")),
            )
            for unit in units
            if unit.name not in indexed and f"{EPISODES_FOLDER}/{unit.name}" not in named
        ]
    except HsbenchError as error:
        if INDEX_FILE not in named:
            faults.append(Fault(_inside(root, str(error)), repairs.file(FileFault(INDEX_FILE, "changed", ""))))
    try:
        version = read_json(root / DATASET_FILE)["schema_version"]
        steps_from(version)
    except SchemaError as error:
        again = repairs.file(FileFault(DATASET_FILE, "changed", ""))
        faults.append(Fault(f"{DATASET_FILE}: {error}", UPGRADE if is_newer(version) else again))
    except (DataError, KeyError, TypeError) as error:
        if DATASET_FILE not in named:
            text = f"{DATASET_FILE}: no schema_version; expected that of a data set"
            text = _inside(root, str(error)) if isinstance(error, DataError) else text
            faults.append(Fault(text, repairs.file(FileFault(DATASET_FILE, "changed", ""))))
    return found, faults


def _contents(root: Path, episode_id: str, gone: tuple[str, ...], again: str) -> list[Fault]:
    """Faults of what an episode holds; that it cannot be read for a file that is ``gone`` has been said."""
    folder = root / EPISODES_FOLDER / episode_id
    try:
        return [Fault(text, again) for text in verify_episode(read_episode(folder, truth=True))]
    except HsbenchError as error:
        text = _inside(root, str(error))
        if any(name in text for name in gone):
            return []
        return [Fault(text, UPGRADE if _written_newer(folder) else again)]


def _inside(root: Path, text: str) -> str:
    """A message with the names of files as from the root of the data set."""
    return text.replace(f"{root}/", "")


def _written_newer(folder: Path) -> bool:
    try:
        descriptor = read_json(folder / "episode.json")
    except DataError:
        return False
    return isinstance(descriptor, dict) and is_newer(descriptor.get("schema_version"))


def _description(root: Path) -> Mapping[str, Any]:
    """``dataset.json`` as far as it can be read."""
    try:
        found = read_json(root / DATASET_FILE)
    except DataError:
        return {}
    return found if isinstance(found, dict) else {}


def _rows(root: Path, units: list[Path]) -> tuple[dict[str, Any], ...]:
    """Rows of the index, or where it cannot be read those of the episodes that are there."""
    try:
        return tuple(read_index(root))
    except HsbenchError:
        return tuple({"episode_id": unit.name, "scene_id": unit.name, "n_frames": 0} for unit in units)
