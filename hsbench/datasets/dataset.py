"""Data sets on disk as sequences of episodes. Inputs only, unless truth is asked for."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, overload

from hsbench.errors import DataError, SchemaError
from hsbench.io.checksums import sha256_file
from hsbench.io.dataset_index import DATASET_FILE, EPISODES_FOLDER, MANIFEST_FILE, read_index
from hsbench.io.depth_noise import preset
from hsbench.io.episodes import read_episode
from hsbench.io.image_noise import image_preset
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import Episode, EpisodeTruth
from hsbench.schema.migration import steps_from
from hsbench.schema.sensor import CAMERAS_OF_KIND
from hsbench.schema.states import Visibility
from hsbench.typing import UInt8Array

DATA_VARIABLE = "HSBENCH_DATA"


@dataclass(frozen=True)
class Dataset(Sequence[Episode]):
    """Episodes of a folder, read when indexed. Build one with ``load``.

    root: the folder. rows: the chosen rows of its index, in order. truth, until_s, frames, depth_noise,
    image_noise: how an episode is read (see ``load``).
    """

    root: Path
    rows: tuple[dict[str, Any], ...]
    truth: bool = False
    until_s: float | None = None
    frames: bool = True
    depth_noise: str | None = None
    image_noise: str | None = None

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, index: int) -> Episode: ...
    @overload
    def __getitem__(self, index: slice) -> Dataset: ...
    def __getitem__(self, index: int | slice) -> Episode | Dataset:
        """An episode, or with a slice a smaller data set."""
        if isinstance(index, str):
            raise TypeError(f"episodes are indexed by number; for an id use data.episode({index!r})")
        if isinstance(index, slice):
            return replace(self, rows=self.rows[index])
        return self._read(self.rows[index])

    def __iter__(self) -> Iterator[Episode]:
        return (self._read(row) for row in self.rows)

    def episode(self, episode_id: str) -> Episode:
        """The episode of an id. Raises DataError if this selection has none."""
        for row in self.rows:
            if row["episode_id"] == episode_id:
                return self._read(row)
        raise DataError(f"{self.root} has no episode {episode_id!r} in this selection of {len(self)}")

    def where(
        self,
        *,
        split: str | None = None,
        sensor: str | None = None,
        people: int | tuple[int, int] | None = None,
        visibility: Visibility | None = None,
        annotated: Sequence[str] = (),
    ) -> Dataset:
        """The episodes that fit all that is asked for; they may be none.

        sensor: a kind, such as ``rgbd``. people: how many live there, or least and most. visibility: at least one
        object is seen so much. annotated: parts of truth, fields of EpisodeTruth, that an episode has, as one's own
        captures may where only some were annotated. The last three are truth: SchemaError unless the data set was
        loaded with it; DataError where an episode has none to count people or objects by.
        """
        needs_truth = people is not None or visibility is not None or bool(annotated)
        if needs_truth and not self.truth:
            raise SchemaError("people, visibility and annotated are truth; expected a data set loaded with truth=True")
        known = tuple(field.name for field in fields(EpisodeTruth))
        if isinstance(annotated, str) or not set(annotated) <= set(known):
            raise SchemaError(f"annotated is {annotated!r}; expected some of {', '.join(known)}")
        if sensor is not None and sensor not in CAMERAS_OF_KIND:
            raise SchemaError(f"sensor is {sensor!r}; expected one of {', '.join(CAMERAS_OF_KIND)}")
        rows = [row for row in self.rows if split is None or row["split"] == split]
        bare = replace(self, truth=needs_truth, frames=False)
        if sensor is not None:
            rows = [row for row in rows if bare._read(row).sensor.kind == sensor]
        if people is not None:
            least, most = people if isinstance(people, tuple) else (people, people)
            rows = [row for row in rows if least <= _people(bare._read(row)) <= most]
        if visibility is not None:
            rows = [row for row in rows if visibility in _visibility(bare._read(row))]
        if annotated:
            rows = [row for row in rows if _has(bare._read(row), annotated)]
        return replace(self, rows=tuple(rows))

    @property
    def episode_ids(self) -> tuple[str, ...]:
        """Ids of the episodes, in order."""
        return tuple(row["episode_id"] for row in self.rows)

    @property
    def scene_ids(self) -> tuple[str, ...]:
        """Scene of each episode, in order: what intervals resample."""
        return tuple(row["scene_id"] for row in self.rows)

    @property
    def description(self) -> dict[str, Any]:
        """``dataset.json``: name, seed, versions, licence, category table."""
        return dict(read_json(self.root / DATASET_FILE))

    @property
    def name(self) -> str:
        """The data set's name."""
        return str(self.description["name"])

    @property
    def manifest_sha256(self) -> str:
        """The hash that stands for every byte of the data set."""
        return sha256_file(self.root / MANIFEST_FILE)

    def _read(self, row: dict[str, Any]) -> Episode:
        folder = self._folder(row)
        try:
            episode = read_episode(
                folder,
                truth=self.truth,
                frames=self.frames,
                depth_noise=self.depth_noise,
                image_noise=self.image_noise,
            )
        except DataError as error:
            raise DataError(f"{error} (hsbench verify lists all that is damaged)") from error
        return episode if self.until_s is None else episode.until(self.until_s)

    def _folder(self, row: dict[str, Any]) -> Path:
        return self.root / EPISODES_FOLDER / str(row["episode_id"])


def load(
    name_or_path: str | Path,
    split: str | None = None,
    *,
    truth: bool = False,
    until_s: float | None = None,
    frames: bool = True,
    depth_noise: str | None = None,
    image_noise: str | None = None,
) -> Dataset:
    """A data set by the path of its folder, or by name inside the folder that ``$HSBENCH_DATA`` names.

    split: only its episodes. truth: hand out truth too. until_s: inputs as after so many seconds of watching.
    frames: False leaves pictures out. depth_noise, image_noise: presets in place of the recorded ones (``none`` is an
    oracle).
    Raises DataError if there is no such data set, or the split has no episode in it; SchemaError where its schema is
    not known, such as a newer one.
    """
    if until_s is not None and not (isinstance(until_s, int | float) and until_s >= 0):
        raise SchemaError(f"until_s is {until_s!r}; expected seconds >= 0")
    if depth_noise is not None:
        preset(depth_noise)
    if image_noise is not None:
        image_preset(image_noise)
    root = _find(name_or_path)
    rows = read_index(root)
    _check_version(root / DATASET_FILE)
    if split is not None:
        known = sorted({row["split"] for row in rows})
        rows = [row for row in rows if row["split"] == split]
        if not rows:
            raise DataError(f"{root} has no episode of split {split!r}; found {', '.join(known) or 'none'}")
    return Dataset(root, tuple(rows), truth, until_s, frames, depth_noise, image_noise)


def _check_version(path: Path) -> None:
    description = read_json(path)
    try:
        steps_from(description.get("schema_version") if isinstance(description, dict) else None)
    except SchemaError as error:
        raise SchemaError(f"{path}: {error}") from error


def _has(episode: Episode, parts: Sequence[str]) -> bool:
    return episode.truth is not None and all(getattr(episode.truth, name) is not None for name in parts)


def _people(episode: Episode) -> int:
    if episode.truth is None or episode.truth.poses is None:
        raise DataError(f"episode {episode.episode_id} has no true poses to count people by")
    return len(set(episode.truth.poses.poses.track_id.tolist()))


def _visibility(episode: Episode) -> UInt8Array:
    if episode.truth is None or episode.truth.objects is None:
        raise DataError(f"episode {episode.episode_id} has no truth of how much is seen of its objects")
    return episode.truth.objects.visibility


def _find(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.is_dir():
        return path
    home = os.environ.get(DATA_VARIABLE)
    if home and path.name == str(name_or_path) and (Path(home) / path).is_dir():
        return Path(home) / path
    raise DataError(f"{name_or_path} is no folder (generate it first, or name a data set under ${DATA_VARIABLE})")
