"""The scenes of a data set as binary glTF, a file an episode."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.exports.frames import export_folder, require_content
from hsbench.errors import DataError
from hsbench.io.atomic import write_bytes
from hsbench.io.scene_glb import glb_bytes


def write_glb(data: Dataset, out: Path) -> Iterator[str]:
    """Write ``out/EPISODE.glb`` of each episode; yields their ids. The folder appears at the end, whole.

    Raises DataError if it exists or lies inside of a data set, and where there is no episode, or one without a scene:
    scenes are truth.
    """
    require_content(len(data), "episode", data.root)
    with export_folder(out) as folder:
        for episode in data:
            if episode.truth is None or episode.truth.scene is None:
                raise DataError(f"episode {episode.episode_id} has no scene to export (a scene is truth: load with it)")
            write_bytes(folder / f"{episode.episode_id}.glb", glb_bytes(episode.truth.scene))
            yield episode.episode_id
