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
from hsbench.io.strict_json import read_json
from hsbench.schema.migration import is_newer, steps_from

UPGRADE = "a newer hsbench wrote it: pip install --upgrade hsbench"


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
    yield _whole(root, units, remake)
    episodes = Dataset(root, _rows(root, units), truth=True)
    for index, row in enumerate(episodes.rows):
        yield _contents(episodes, index, remake.episode(row["episode_id"]))
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


def _whole(root: Path, units: list[Path], repairs: _Repairs) -> list[Fault]:
    """Faults of files against the manifests, of the index and of the description."""
    try:
        found = file_faults(root)
    except DataError as error:
        found = [FileFault(MANIFEST_FILE, "changed", str(error)), *(f for unit in units for f in unit_faults(unit))]
    found += [
        FileFault(path.name, "extra", f"{path.name}/: extra, no part of a data set")
        for path in sorted(root.iterdir())
        if path.is_dir() and path.name != EPISODES_FOLDER and not path.name.startswith(".")
    ]
    faults = [Fault(fault.text, repairs.file(fault)) for fault in found]
    named = {fault.name for fault in found}
    try:
        indexed = {row["episode_id"] for row in read_index(root)}
        faults += [
            Fault(f"{INDEX_FILE} has no row of {unit.name}", repairs.file(FileFault(INDEX_FILE, "changed", "")))
            for unit in units
            if unit.name not in indexed and f"{EPISODES_FOLDER}/{unit.name}" not in named
        ]
    except HsbenchError as error:
        if INDEX_FILE not in named:
            faults.append(Fault(str(error), repairs.file(FileFault(INDEX_FILE, "changed", ""))))
    try:
        version = read_json(root / DATASET_FILE)["schema_version"]
        steps_from(version)
    except SchemaError as error:
        again = repairs.file(FileFault(DATASET_FILE, "changed", ""))
        faults.append(Fault(f"{DATASET_FILE}: {error}", UPGRADE if is_newer(version) else again))
    except (DataError, KeyError, TypeError) as error:
        if DATASET_FILE not in named:
            text = str(error) if isinstance(error, DataError) else f"{DATASET_FILE} has no schema_version"
            faults.append(Fault(text, repairs.file(FileFault(DATASET_FILE, "changed", ""))))
    return faults


def _contents(episodes: Dataset, index: int, again: str) -> list[Fault]:
    try:
        return [Fault(text, again) for text in verify_episode(episodes[index])]
    except HsbenchError as error:
        return [Fault(str(error), UPGRADE if _written_newer(episodes, index) else again)]


def _written_newer(episodes: Dataset, index: int) -> bool:
    try:
        descriptor = read_json(episodes.root / EPISODES_FOLDER / episodes.rows[index]["episode_id"] / "episode.json")
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
