"""The scenes of a data set as binary glTF, a file an episode."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hsbench.datasets.dataset import Dataset
from hsbench.errors import DataError
from hsbench.io.atomic import atomic_folder, write_bytes
from hsbench.io.scene_glb import glb_bytes


def write_glb(data: Dataset, out: Path) -> Iterator[str]:
    """Write ``out/EPISODE.glb`` of each episode; yields their ids. The folder appears at the end, whole.

    Raises DataError if it exists, or an episode has no scene: scenes are truth.
    """
    with atomic_folder(out) as folder:
        for episode in data:
            if episode.truth is None or episode.truth.scene is None:
                raise DataError(f"episode {episode.episode_id} has no scene to export (a scene is truth: load with it)")
            write_bytes(folder / f"{episode.episode_id}.glb", glb_bytes(episode.truth.scene))
            yield episode.episode_id
