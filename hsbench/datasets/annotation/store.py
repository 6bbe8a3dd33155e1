"""Annotated truth into the data set that holds the capture: pictures and poses stay as they are, byte for byte.

``truth/annotation.json`` says of each part of truth that a person drew where it comes from: the file, its sha256, and
the figures of its quality, such as how well pictures fit through which labels were carried over.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from hsbench.errors import DataError
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import manifest, sha256_file
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, MANIFEST_FILE, read_index, write_index
from hsbench.io.episodes import read_episode, write_episode
from hsbench.io.locks import sole_writer
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Episode, EpisodeTruth, FrameList

RECORD_FILE = "annotation.json"

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


def drawn_record(drawn: Path, figures: Mapping[str, Any]) -> dict[str, Any]:
    """What is kept of a part of truth: the file that a person drew, its hash, and figures of quality."""
    return {"file": drawn.name, "sha256": sha256_file(drawn), **figures}


def read_record(root: Path, episode_id: str) -> dict[str, Any]:
    """Part of truth -> its ``drawn_record``; empty where nobody drew anything. Raises DataError for damage."""
    path = root / EPISODES_FOLDER / episode_id / "truth" / RECORD_FILE
    if not path.exists():
        return {}
    found = read_json(path)
    if not isinstance(found, dict):
        raise DataError(f"{path}: a {type(found).__name__}; expected an object of parts of truth")
    return found


def store_truth(
    root: Path, episode_id: str, truth: EpisodeTruth, drawn: Collection[str], record: Mapping[str, Any]
) -> None:
    """Make ``truth`` all the truth of an episode on disk, and renew the hashes of the data set.

    drawn: the parts of it, fields of EpisodeTruth, that come from what ``record`` says; what is kept of others stays.
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
            write_json(folder / RECORD_FILE, read_record(root, episode_id) | dict.fromkeys(drawn, record))
        write_json(unit / MANIFEST_FILE, manifest(unit, exclude=[MANIFEST_FILE]))
        write_index(root)
