"""What a data set holds, counted: bytes on disk from the file system, classes from the tables alone."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError
from hsbench.io.arrays import load_npz
from hsbench.io.dataset_index import EPISODES_FOLDER
from hsbench.io.scene_folder import SCENE_FILE, read_scene
from hsbench.io.splits import SPLITS
from hsbench.schema.states import Action, Affordance

KINDS = ("pictures", "poses", "truth", "other")
"""Files of an episode: recordings and images; observed poses; everything under ``truth/``; descriptions."""


@dataclass(frozen=True)
class SplitCounts:
    """What a split holds. hours: of watching. bytes_on_disk: of ``KINDS``."""

    episodes: int
    scenes: int
    hours: float
    frames: int
    poses: int
    bytes_on_disk: dict[str, int]


@dataclass(frozen=True)
class Classes:
    """Class balance of episodes, from their truth.

    people: true persons, summed over episodes; largest_group: most of them in one. objects: number by category.
    actions: true poses by action. affordance_cells: cells of the map from above by label; labelled_cells: with any.
    """

    people: int = 0
    largest_group: int = 0
    objects: Counter[str] = field(default_factory=Counter)
    actions: Counter[str] = field(default_factory=Counter)
    affordance_cells: Counter[str] = field(default_factory=Counter)
    labelled_cells: int = 0

    def __add__(self, other: Classes) -> Classes:
        return Classes(
            self.people + other.people,
            max(self.largest_group, other.largest_group),
            self.objects + other.objects,
            self.actions + other.actions,
            self.affordance_cells + other.affordance_cells,
            self.labelled_cells + other.labelled_cells,
        )


def split_counts(data: Dataset) -> dict[str, SplitCounts]:
    """Counts of each split, from the index and the sizes of files; splits in their usual order."""
    rows: dict[str, list[dict[str, Any]]] = {}
    for row in data.rows:
        rows.setdefault(row["split"], []).append(row)
    order = {name: number for number, name in enumerate(SPLITS)}
    return {
        name: SplitCounts(
            len(rows[name]),
            len({row["scene_id"] for row in rows[name]}),
            round(sum(row["duration_s"] for row in rows[name]) / 3600, 3),
            sum(row["n_frames"] for row in rows[name]),
            sum(row["n_poses"] for row in rows[name]),
            _bytes([data.root / EPISODES_FOLDER / row["episode_id"] for row in rows[name]]),
        )
        for name in sorted(rows, key=lambda name: (order.get(name, len(order)), name))
    }


def class_balance(data: Dataset) -> Iterator[Classes]:
    """The classes of each episode; add them up. Raises DataError for a damaged table."""
    for row in data.rows:
        yield _classes(data.root / EPISODES_FOLDER / row["episode_id"] / "truth")


def _bytes(folders: Sequence[Path]) -> dict[str, int]:
    total = dict.fromkeys(KINDS, 0)
    for folder in folders:
        for place, _, names in os.walk(folder):
            inside = Path(place).relative_to(folder).parts
            for name in names:
                total[_kind(inside, name)] += (Path(place) / name).stat().st_size
    return total


def _kind(inside: tuple[str, ...], name: str) -> str:
    if inside[:1] == ("recording",) or inside[:2] == ("inputs", "frames"):
        return "pictures"
    if inside[:1] == ("truth",):
        return "truth"
    return "poses" if inside == ("inputs",) and name == "poses.parquet" else "other"


def _classes(truth: Path) -> Classes:
    people, actions = 0, Counter[str]()
    if (truth / "poses.parquet").exists():
        poses = _columns(truth / "poses.parquet", "track_id", "action")
        people = len(np.unique(poses["track_id"]))
        numbers, counts = np.unique(poses["action"], return_counts=True)
        actions = Counter(dict(zip((Action(n).name.lower() for n in numbers), counts.tolist(), strict=True)))
    objects = Counter[str]()
    if (truth / "objects.parquet").exists():
        objects = Counter(_columns(truth / "objects.parquet", "category")["category"].to_pylist())
    elif (truth / SCENE_FILE).exists():  # boxes of a capture, of which nobody said how much is seen
        objects = Counter(item.category_name for item in read_scene(truth.parent).objects)
    cells, labelled = Counter[str](), 0
    if (truth / "affordance.npz").exists():
        arrays = load_npz(truth / "affordance.npz")
        labels = arrays["labels"][~arrays["ignored"]]
        labelled = int(np.count_nonzero(labels))
        cells = Counter({bit.name.lower(): int(np.count_nonzero(labels >> bit & 1)) for bit in Affordance})
    return Classes(people, people, objects, actions, cells, labelled)


def _columns(path: Path, *names: str) -> pa.Table:
    try:
        return pq.read_table(path, columns=list(names)).combine_chunks()
    except (OSError, ValueError, KeyError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
