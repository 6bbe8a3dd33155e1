"""A data set as WebDataset shards: tar files whose members of one sample stand together.

    SPLIT-000000.tar
      EPISODE/000000.json            ids, frame, time stamp, sensor
      EPISODE/000000.rgb.png         colour          EPISODE/000000.depth.png       16 bit, millimetres, 0 = none
      EPISODE/000000.poses.json      observed poses of exactly this time, a list
    and with truth
      .clean_depth.png  .instance.png  .semantic.png  .true_poses.json

A sample is a frame, its key ``EPISODE/000000``. The same data give the same bytes: members have no owner and no date.
"""

from __future__ import annotations

import io
import tarfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.exports.frames import export_folder, pictures, pose_json, require_content, rows_at, split_of
from hsbench.io.atomic import json_bytes
from hsbench.io.images import encode_png
from hsbench.schema import codec
from hsbench.schema.episode import Episode
from hsbench.schema.poses import PoseTable

SHARD_BYTES = 256 << 20
"""A shard that has grown to this is followed by another."""


def write_webdataset(data: Dataset, out: Path) -> Iterator[str]:
    """Write the new folder ``out``, episode by episode; yields their ids. The folder appears at the end, whole.

    Raises DataError if the folder exists or lies inside of a data set, or the data have no frame.
    """
    require_content(sum(row["n_frames"] for row in data.rows), "frame", data.root)
    with export_folder(out) as folder:
        shards: dict[str, _Shards] = {}
        try:
            for row, episode in zip(data.rows, data, strict=True):
                split = split_of(row)
                if split not in shards:
                    shards[split] = _Shards(folder, split)
                for index in range(len(episode.frames)):
                    shards[split].write(f"{episode.episode_id}/{index:06d}", _sample(episode, row, index))
                yield episode.episode_id
        finally:
            for shard in shards.values():
                shard.close()


class _Shards:
    """The tar files of one split."""

    def __init__(self, folder: Path, split: str) -> None:
        self._folder, self._split = folder, split
        self._count = self._bytes = 0
        self._archive: tarfile.TarFile | None = None

    def write(self, key: str, sample: Mapping[str, bytes]) -> None:
        """Append a sample, whole in one file."""
        if self._archive is not None and self._bytes >= SHARD_BYTES:
            self.close()
        if self._archive is None:
            path = self._folder / f"{self._split}-{self._count:06d}.tar"
            self._archive = tarfile.TarFile(path, "w", format=tarfile.USTAR_FORMAT)
            self._count, self._bytes = self._count + 1, 0
        for extension, content in sample.items():
            member = tarfile.TarInfo(f"{key}.{extension}")
            member.size = len(content)
            self._archive.addfile(member, io.BytesIO(content))
            self._bytes += len(content)

    def close(self) -> None:
        """Finish the file under way."""
        if self._archive is not None:
            self._archive.close()
        self._archive = None


def _sample(episode: Episode, row: Mapping[str, Any], index: int) -> dict[str, bytes]:
    timestamp_ns = int(episode.frames.timestamps_ns[index])
    facts = {
        "episode_id": episode.episode_id,
        "scene_id": row["scene_id"],
        "split": row["split"],
        "frame": index,
        "timestamp_ns": timestamp_ns,
        "sensor": codec.sensor_to_json(episode.sensor),
    }
    found = {"json": json_bytes(facts)}
    found |= {f"{name}.png": encode_png(picture) for name, picture in pictures(episode, index).items()}
    if episode.poses is not None:
        found["poses.json"] = _poses(episode.poses, timestamp_ns)
    if episode.truth is not None and episode.truth.poses is not None:
        found["true_poses.json"] = _poses(episode.truth.poses.poses, timestamp_ns)
    return found


def _poses(poses: PoseTable, timestamp_ns: int) -> bytes:
    return json_bytes([pose_json(poses, row) for row in rows_at(poses, timestamp_ns)])
