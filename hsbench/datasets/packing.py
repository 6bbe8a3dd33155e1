"""A hidden split: an organiser's data set divided into the inputs that are published and the truth that scores them.

Both parts are ordinary data sets and name the episodes alike. The inputs hold nothing that follows from truth:

- pictures as full frames with their noise in them, instead of backgrounds, patches and clean depth
- episodes, scenes and tracks under new names, in an order that a secret decides; each episode is a scene of its own
- no seed, no hash of a recipe, no name of a renderer, no file times

The truth is the rest: everything under the new names, less seed and recipe. docs/hidden-splits.md says what is safe.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.dataset import Dataset, load
from hsbench.errors import DataError
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import manifest
from hsbench.io.dataset_index import (
    DATASET_FILE,
    EPISODES_FOLDER,
    MANIFEST_FILE,
    require_outside,
    verify_unit,
    write_index,
)
from hsbench.io.episodes import read_parquet, write_episode, write_parquet
from hsbench.io.frame_store import RecordingFrames
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION, codec
from hsbench.schema.episode import Episode, FramesUntil
from hsbench.schema.poses import PoseTable
from hsbench.typing import IntArray

SECRET_BITS = 128
"""Of a secret as it should be drawn: nobody tries so many."""

LEAST_SECRET_BITS = 96
"""A shorter secret is refused; by chance, one drawn of SECRET_BITS is so short once in 2^33."""

PUBLISHED = ("hsbench_version", "name", "splits_version", "licence", "categories")
"""Keys of ``dataset.json`` that both parts keep."""

FILE_TIME_S = 315_532_800  # 1980-01-01, the earliest date that a zip archive can hold


def pack_inputs(data: str | Path, out: Path, secret: int | None = None) -> Iterator[str]:
    """Write the inputs of a data set to the new folder ``out``, which appears at the end; yields each new episode id.

    secret: what decides names, order and noise, the same for ``pack_truth``; the data set's own seed if None.
    Raises DataError if ``out`` exists, an episode is damaged or records depth without noise, or there is no secret that
    cannot be guessed.
    """
    source, hidden = _opened(data, secret)
    with _new_dataset(out, source.description, SCHEMA_VERSION) as episodes:
        for row, episode in zip(source.rows, source, strict=True):
            new = hidden.episodes[row["episode_id"]]
            _require_sound(source, row["episode_id"])
            write_episode(episodes / new, _published(episode, hidden), scene_id=new, split=row["split"])
            yield new


def pack_truth(data: str | Path, out: Path, secret: int | None = None) -> Iterator[str]:
    """As ``pack_inputs``, the rest of the same data set: what its organiser scores with, and never publishes."""
    source, hidden = _opened(data, secret)
    with _new_dataset(out, source.description, source.description["schema_version"]) as episodes:
        for row in source.rows:
            new = hidden.episodes[row["episode_id"]]
            _require_sound(source, row["episode_id"])
            _copy_renamed(source.root / EPISODES_FOLDER / row["episode_id"], episodes / new, row["scene_id"], hidden)
            yield new


@dataclass(frozen=True)
class _Hidden:
    """What a secret decides of a data set. episodes, scenes: their new ids by the known ones."""

    secret: int
    episodes: Mapping[str, str]
    scenes: Mapping[str, str]

    @classmethod
    def of(cls, source: Dataset, secret: int) -> _Hidden:
        return cls(
            secret,
            _shuffled(source.episode_ids, f"{source.name}-hidden", secret),
            _shuffled(set(source.scene_ids), "hidden-scene", secret),
        )

    def noise_seed(self, episode_id: str) -> int:
        """The seed of the noise in the pictures of an episode."""
        return _draw(self.secret, "noise", episode_id)

    def tracks(self, episode_id: str, poses: PoseTable) -> tuple[IntArray, PoseTable]:
        """((M,) order of the rows, the M observed poses in it): tracks are numbered from 1 as they begin.

        Of tracks that begin at one time the secret decides: a detector may have counted false detections before people.
        """
        known, first = np.unique(poses.track_id, return_index=True)
        drawn = [_draw(self.secret, "track", episode_id, str(track)) for track in known.tolist()]
        begun = sorted(range(len(known)), key=lambda k: (int(poses.timestamp_ns[first[k]]), drawn[k]))
        numbers = np.empty(len(known), dtype=np.int32)
        numbers[begun] = np.arange(1, len(known) + 1, dtype=np.int32)
        track_id = numbers[np.searchsorted(known, poses.track_id)]
        order = np.lexsort((track_id, poses.timestamp_ns))
        found = PoseTable(
            poses.skeleton,
            poses.timestamp_ns[order],
            track_id[order],
            poses.joint_state[order],
            None if poses.joints_m is None else poses.joints_m[order],
            None if poses.joints_px is None else poses.joints_px[order],
        )
        return order, found


def _shuffled(names: Collection[str], prefix: str, secret: int) -> dict[str, str]:
    """New names by the known ones: numbers in an order that the secret decides."""
    order = sorted(names, key=lambda name: _draw(secret, "order", name))
    return {name: f"{prefix}-{number:06d}" for number, name in enumerate(order)}


def _draw(secret: int, *names: str) -> int:
    """SECRET_BITS bits that follow from the secret and names, and tell nothing of it."""
    text = "\x1f".join(("pack", str(secret), *names))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=SECRET_BITS // 8).digest(), "little")


def _opened(data: str | Path, secret: int | None) -> tuple[Dataset, _Hidden]:
    """A data set in its new order, and its new names."""
    source = load(data)
    seed = source.description.get("seed")
    for name, value in (("seed", seed), ("secret", secret)):
        if value is not None and value.bit_length() < LEAST_SECRET_BITS:
            raise DataError(
                f"{source.root}: {name} {value} of a hidden split can be guessed; expected {SECRET_BITS} random bits "
                f'(python -c "import secrets; print(secrets.randbits({SECRET_BITS}))")'
            )
    secret = seed if secret is None else secret
    if secret is None:
        raise DataError(f"{source.root} has no seed (an import?); expected --secret N, the same for inputs and truth")
    hidden = _Hidden.of(source, secret)
    rows = sorted(source.rows, key=lambda row: hidden.episodes[row["episode_id"]])
    return replace(source, rows=tuple(rows)), hidden


@contextmanager
def _new_dataset(out: Path, description: Mapping[str, Any], schema_version: str) -> Iterator[Path]:
    """Yield the folder ``episodes`` of a data set that takes its place when it is whole, all its files of one time."""
    require_outside(out)
    with atomic_folder(out) as root:
        (root / EPISODES_FOLDER).mkdir()
        kept = {key: description[key] for key in PUBLISHED if key in description}
        write_json(root / DATASET_FILE, {"schema_version": schema_version, **kept})
        yield root / EPISODES_FOLDER
        write_index(root)
        for path in (*root.rglob("*"), root):
            os.utime(path, (FILE_TIME_S, FILE_TIME_S))


def _require_sound(source: Dataset, episode_id: str) -> None:
    if faults := verify_unit(source.root, episode_id, ""):
        raise DataError(
            f"{faults[0]}; a split packed from it would be of other data (hsbench verify lists every fault)"
        )


def _published(episode: Episode, hidden: _Hidden) -> Episode:
    """What is published of an episode that was read without truth: its pictures in full, with nothing beside them."""
    known_as, frames = episode.episode_id, episode.frames
    if isinstance(frames, RecordingFrames):
        if frames.has_depth and frames.noise_preset == "none":
            raise DataError(f"episode {known_as} has depth without noise; expected noise that hides the clean depth")
        frames = replace(frames, noise_seed=hidden.noise_seed(known_as))
    return replace(
        episode,
        episode_id=hidden.episodes[known_as],
        frames=FramesUntil(frames, len(frames)),  # no background, and no file that would be copied as it is
        poses=None if episode.poses is None else hidden.tracks(known_as, episode.poses)[1],
    )


def _copy_renamed(source: Path, target: Path, scene_id: str, hidden: _Hidden) -> None:
    """Copy the files of an episode, under its new names and with the noise of the published pictures."""
    known_as = source.name
    new = {"episode_id": hidden.episodes[known_as], "scene_id": hidden.scenes[scene_id]}
    with atomic_folder(target) as unit:
        for name in read_json(source / MANIFEST_FILE):
            (unit / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / name, unit / name)
        write_json(unit / "index.json", read_json(unit / "index.json") | new)
        descriptor = read_json(unit / "episode.json") | {"episode_id": new["episode_id"]}
        for noise in ("depth_noise", "image_noise"):
            if descriptor.get(noise) is not None:
                descriptor[noise]["seed"] = hidden.noise_seed(known_as)
        write_json(unit / "episode.json", descriptor)
        if (scene := unit / "truth" / "scene.json").exists():
            write_json(scene, read_json(scene) | {"scene_id": new["scene_id"]})
        if (poses := unit / "inputs" / "poses.parquet").exists():
            order, found = hidden.tracks(known_as, codec.poses_from_table(read_parquet(poses)))
            write_parquet(poses, codec.poses_to_table(found))
            if (match := unit / "truth" / "match.parquet").exists():
                write_parquet(match, read_parquet(match).take(order))
        write_json(unit / MANIFEST_FILE, manifest(unit, exclude=[MANIFEST_FILE]))
