"""The Croissant description of a data set as a folder of its own: of its inputs alone, or with truth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.exports.frames import export_folder
from hsbench.io.atomic import write_json
from hsbench.io.dataset_index import CROISSANT_FILE, described


def write_croissant(data: Dataset, out: Path) -> Iterator[str]:
    """Write ``out/croissant.json``, with truth if ``data`` was loaded with it; yields the ids of what it describes.

    Its paths are those of the data set's own folder, to which it belongs. Raises DataError if ``out`` exists or lies
    inside of a data set.
    """
    with export_folder(out) as folder:
        write_json(folder / CROISSANT_FILE, described(data.root, data.truth))
        yield from data.episode_ids
