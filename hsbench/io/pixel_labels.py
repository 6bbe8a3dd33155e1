"""Labels of pixels that somebody drew into imported pictures, as truth of their frames.

``truth/frames/`` of an episode holds ``labels.json``, {"timestamps_ns": [...], "things": [{"instance_id", "name",
"category"}, ...]}: the source's name and the category of ours of each id; and ``000000_instance.png`` (uint16 ids, 0 =
none) of every frame that was labelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hsbench.errors import DataError, SchemaError
from hsbench.io.atomic import write_json
from hsbench.io.images import read_uint16, write_png
from hsbench.io.plain import from_plain, to_plain
from hsbench.io.strict_json import read_json
from hsbench.schema.categories import category
from hsbench.schema.episode import FrameTruth
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.typing import UInt8Array, UInt16Array

LABELS_FILE = "labels.json"


@dataclass(frozen=True)
class Thing:
    """What an id stands for. Raises SchemaError for an id that is none of a thing, and for unknown categories."""

    instance_id: int
    name: str
    category: str

    def __post_init__(self) -> None:
        if not 0 < self.instance_id < PERSON_ID_OFFSET:
            raise SchemaError(f"thing {self.name!a} has id {self.instance_id}; expected 1 to {PERSON_ID_OFFSET - 1}")
        category(self.category)


@dataclass(frozen=True, eq=False)
class PixelLabels:
    """Instances and, by the category of each, semantics of frames, decoded when indexed.

    instance: of each frame (h, w) uint16, the file of it, or None where nobody labelled it.
    """

    timestamps_ns: tuple[int, ...]
    things: tuple[Thing, ...]
    instance: tuple[UInt16Array | Path | None, ...]

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> FrameTruth:
        found, timestamp_ns = self.instance[index], self.timestamps_ns[index]
        if found is None:
            return FrameTruth(timestamp_ns)
        ids = read_uint16(found) if isinstance(found, Path) else found
        known = np.array([0, *(thing.instance_id for thing in self.things)])
        if not np.isin(unique := np.unique(ids), known).all():
            where = found if isinstance(found, Path) else f"frame {index}"
            raise DataError(f"{where} has id {np.setdiff1d(unique, known)[0]}; expected 0 or one of {LABELS_FILE}")
        return FrameTruth(timestamp_ns, instance=ids, semantic=self._categories[ids])

    @cached_property
    def _categories(self) -> UInt8Array:
        table = np.zeros(PERSON_ID_OFFSET, dtype=np.uint8)
        for thing in self.things:
            table[thing.instance_id] = category(thing.category).category_id
        return table


def write_pixel_labels(folder: Path, labels: PixelLabels) -> None:
    """Write labels as a new folder ``folder``."""
    folder.mkdir()
    write_json(folder / LABELS_FILE, to_plain(_Told(labels.timestamps_ns, labels.things)))
    for index in range(len(labels)):
        if (ids := labels[index].instance) is not None:
            write_png(_file(folder, index), ids)


def read_pixel_labels(folder: Path) -> PixelLabels:
    """The labels in a folder, whose pictures are decoded when indexed. Raises DataError naming the file."""
    path = folder / LABELS_FILE
    told = from_plain(_Told, read_json(path), str(path))
    if len({thing.instance_id for thing in told.things}) < len(told.things):
        raise DataError(f"{path}: an id stands for several things; expected one each")
    files = (_file(folder, index) for index in range(len(told.timestamps_ns)))
    return PixelLabels(told.timestamps_ns, told.things, tuple(file if file.exists() else None for file in files))


@dataclass(frozen=True)
class _Told:
    """``labels.json``."""

    timestamps_ns: tuple[int, ...]
    things: tuple[Thing, ...]


def _file(folder: Path, index: int) -> Path:
    return folder / f"{index:06d}_instance.png"
