"""Annotated truth into the data set that holds the capture: pictures and poses stay as they are, byte for byte."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from hsbench.errors import DataError
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, MANIFEST_FILE, read_index, write_index
from hsbench.io.episodes import read_episode, write_episode
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Episode, EpisodeTruth, FrameList

GENERATED = "recipe_sha256"
"""What ``dataset.json`` of generated data has and of a capture has not."""


def open_capture(root: Path, episode_id: str) -> Episode:
    """An episode of a data set of captures, with its truth. Raises DataError where it is generated or not there."""
    description = read_json(root / DATASET_FILE)
    if not isinstance(description, dict) or GENERATED in description:
        raise DataError(f"{root} is generated and has exact truth; expected a data set of imported captures")
    known = [row["episode_id"] for row in read_index(root)]
    if episode_id not in known:
        raise DataError(f"{root} has no episode {ascii(episode_id)[:60]}; found {', '.join(known)[:200] or 'none'}")
    return read_episode(root / EPISODES_FOLDER / episode_id, truth=True)


def scene_id_of(root: Path, episode_id: str) -> str:
    """The scene of an episode, as the index tells."""
    return next(str(row["scene_id"]) for row in read_index(root) if row["episode_id"] == episode_id)


def check_unlabelled(episode: Episode, fields: tuple[str, ...], replaced: bool) -> None:
    """Raise DataError where an episode has truth of one of the fields already, unless it is to be ``replaced``."""
    held = [name for name in fields if episode.truth is not None and getattr(episode.truth, name) is not None]
    if held and not replaced:
        raise DataError(f"episode {episode.episode_id} has truth of {', '.join(held)} already; replace it: --replace")


def store_truth(root: Path, episode_id: str, truth: EpisodeTruth) -> None:
    """Make ``truth`` all the truth of an episode on disk, and renew the hashes of the data set.

    A stop before the end leaves hashes that do not fit, which ``hsbench verify`` tells; storing it again mends them.
    """
    unit = root / EPISODES_FOLDER / episode_id
    episode = read_episode(unit, frames=False)
    with sole_writer(root):
        with atomic_folder(unit / "truth", replace=True) as folder:
            staged = folder / "staged"
            write_episode(staged, replace(episode, frames=FrameList(), truth=truth), episode_id, "")
            for path in sorted((staged / "truth").iterdir()):
                path.rename(folder / path.name)
            shutil.rmtree(staged)
        write_json(unit / MANIFEST_FILE, manifest(unit, exclude=[MANIFEST_FILE]))
        write_index(root)
