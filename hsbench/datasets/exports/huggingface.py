"""A data set as a folder for Hugging Face ``datasets``: Parquet with typed features, opened without a network.

    README.md                      its head names the configurations and their splits
    frames/SPLIT-00000.parquet     a row a frame: pictures as PNG
    poses/  episodes/              observed poses, a row each; episodes with sensor and activity maps
    true_poses/  events/  objects/ with truth

A configuration without rows is left out. Columns are named as in docs/schema.md; ``split`` names have _ for -.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.exports.features import (
    CLASSES,
    FLOAT,
    IMAGE,
    INTEGER,
    TEXT,
    Feature,
    class_label,
    nested,
    schema_of,
    sequence,
    value,
)
from hsbench.datasets.exports.frames import export_folder, pictures, require_content, split_of
from hsbench.io.atomic import write_text
from hsbench.io.images import encode_png
from hsbench.schema import codec
from hsbench.schema.episode import Episode, EpisodeTruth
from hsbench.schema.poses import PoseTable
from hsbench.schema.states import Action, Evidence, Visibility

SHARD_BYTES = 256 << 20
"""A file that has grown to this is followed by another."""
ROWS_A_GROUP = 64
"""Frames in memory at a time."""

Columns = dict[str, Feature]

FRAMES: Columns = {
    "episode_id": TEXT,
    "scene_id": TEXT,
    "frame": value("int32"),
    "timestamp_ns": INTEGER,
    "rgb": IMAGE,
    "depth": IMAGE,
}
TRUE_FRAMES: Columns = {"clean_depth": IMAGE, "instance": IMAGE, "semantic": IMAGE}
POSES: Columns = {
    "episode_id": TEXT,
    "timestamp_ns": INTEGER,
    "track_id": value("int32"),
    "skeleton": TEXT,
    "joint_state": sequence(value("uint8")),
    "joints_m": sequence(sequence(FLOAT, 3)),
    "joints_px": sequence(sequence(FLOAT, 2)),
}
EPISODES: Columns = {
    "episode_id": TEXT,
    "scene_id": TEXT,
    "t0_ns": INTEGER,
    "end_ns": INTEGER,
    "n_frames": INTEGER,
    "n_poses": INTEGER,
    "sensor": TEXT,
    "activity_maps": sequence(sequence(sequence(FLOAT))),
    "activity_channels": sequence(TEXT),
    "activity_cell_m": value("float64"),
}
TRUE_EPISODES: Columns = {
    "affordance": IMAGE,
    "affordance_ignored": IMAGE,
    "affordance_cell_m": value("float64"),
    "view_affordance": IMAGE,
}
EVENTS: Columns = {
    "episode_id": TEXT,
    "person_id": value("int32"),
    "activity": TEXT,
    "object_id": value("int32"),
    "part": TEXT,
    "start_ns": INTEGER,
    "end_ns": INTEGER,
    "contact": TEXT,
}
OBJECTS: Columns = {
    "episode_id": TEXT,
    "object_id": value("int32"),
    "category_id": CLASSES,
    **{name: value("float64") for name in ("x_m", "y_m", "z_m", "length_m", "width_m", "height_m", "yaw_rad")},
    "visible_px": INTEGER,
    "amodal_px": INTEGER,
    "visibility": class_label(Visibility),
    "evidence": class_label(Evidence),
    "skirted_share": FLOAT,
}


def configurations(truth: bool) -> dict[str, Columns]:
    """Columns of every configuration, with or without truth."""
    if not truth:
        return {"frames": FRAMES, "poses": POSES, "episodes": EPISODES}
    return {
        "frames": FRAMES | TRUE_FRAMES,
        "poses": POSES | {"true_row": INTEGER},
        "episodes": EPISODES | TRUE_EPISODES,
        "true_poses": POSES | {"action": class_label(Action)},
        "events": EVENTS,
        "objects": OBJECTS,
    }


def write_huggingface(data: Dataset, out: Path) -> Iterator[str]:
    """Write the new folder ``out``, episode by episode; yields their ids. The folder appears at the end, whole.

    Raises DataError if the folder exists or lies inside of a data set, or there is no episode.
    """
    require_content(len(data), "episode", data.root)
    columns = configurations(data.truth)
    with export_folder(out) as folder:
        shards: dict[tuple[str, str], _Shards] = {}
        try:
            for row, episode in zip(data.rows, data, strict=True):
                split = split_of(row).replace("-", "_")
                for name, table in _tables(episode, row, columns):
                    key = name, split
                    if key not in shards:
                        shards[key] = _Shards(folder / name, split, schema_of(columns[name]))
                    shards[key].write(table)
                yield episode.episode_id
        finally:
            for shard in shards.values():
                shard.close()
        write_text(folder / "README.md", _card(data, shards))


class _Shards:
    """The Parquet files of one configuration and split."""

    def __init__(self, folder: Path, split: str, schema: pa.Schema) -> None:
        self._folder, self._split, self._schema = folder, split, schema
        self._count = self._bytes = 0
        self._writer: pq.ParquetWriter | None = None
        folder.mkdir(exist_ok=True)

    def write(self, table: pa.Table) -> None:
        """Append the rows of a table, as a row group of their own."""
        if self._writer is not None and self._bytes >= SHARD_BYTES:
            self.close()
        if self._writer is None:
            path = self._folder / f"{self._split}-{self._count:05d}.parquet"
            self._writer = pq.ParquetWriter(path, self._schema, compression="zstd", use_dictionary=False)
            self._count, self._bytes = self._count + 1, 0
        self._writer.write_table(table)
        self._bytes += table.nbytes

    def close(self) -> None:
        """Finish the file under way."""
        if self._writer is not None:
            self._writer.close()
        self._writer = None


def _tables(episode: Episode, row: Mapping[str, Any], columns: Mapping[str, Columns]) -> Iterator[tuple[str, pa.Table]]:
    """(configuration, table) of everything an episode has, in their columns."""
    for first in range(0, len(episode.frames), ROWS_A_GROUP):
        indices = range(first, min(first + ROWS_A_GROUP, len(episode.frames)))
        yield "frames", _table([_frame_row(episode, row, k) for k in indices], columns["frames"])
    truth = episode.truth
    if episode.poses is not None and len(episode.poses):
        extra = {} if truth is None else {"true_row": _matches(truth, len(episode.poses))}
        yield "poses", _pose_table(episode.episode_id, episode.poses, extra, columns["poses"])
    yield "episodes", _table([_episode_row(episode, row)], columns["episodes"])
    if truth is None:
        return
    if truth.poses is not None and len(truth.poses.poses):
        extra = {"action": truth.poses.action.astype(np.int64)}
        yield "true_poses", _pose_table(episode.episode_id, truth.poses.poses, extra, columns["true_poses"])
    if truth.events is not None and len(truth.events):
        yield "events", _with_id(codec.events_to_table(truth.events), episode.episode_id, columns["events"])
    if truth.objects is not None and truth.scene is not None and truth.scene.objects:
        objects = codec.objects_to_table(truth.objects, truth.scene)
        yield "objects", _with_id(objects, episode.episode_id, columns["objects"])


def _frame_row(episode: Episode, row: Mapping[str, Any], index: int) -> dict[str, Any]:
    return {
        "episode_id": episode.episode_id,
        "scene_id": row["scene_id"],
        "frame": index,
        "timestamp_ns": int(episode.frames.timestamps_ns[index]),
        **{name: _png(picture) for name, picture in pictures(episode, index).items()},
    }


def _episode_row(episode: Episode, row: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {
        "episode_id": episode.episode_id,
        "scene_id": row["scene_id"],
        "t0_ns": episode.t0_ns,
        "end_ns": episode.end_ns,
        "n_frames": len(episode.frames),
        "n_poses": 0 if episode.poses is None else len(episode.poses),
        "sensor": json.dumps(codec.sensor_to_json(episode.sensor), sort_keys=True),
    }
    if (maps := episode.activity_maps) is not None:
        found |= {
            "activity_maps": maps.maps.tolist(),
            "activity_channels": list(maps.channels),
            "activity_cell_m": maps.cell_m,
        }
    if episode.truth is not None and (affordance := episode.truth.affordance) is not None:
        found |= {
            "affordance": _png(affordance.labels),
            "affordance_ignored": _png(affordance.ignored.astype(np.uint8)),
            "affordance_cell_m": affordance.cell_m,
        }
    if episode.truth is not None and episode.truth.view_affordance is not None:
        found["view_affordance"] = _png(episode.truth.view_affordance)
    return found


def _pose_table(episode_id: str, poses: PoseTable, extra: Mapping[str, Any], columns: Columns) -> pa.Table:
    n = len(poses)
    arrays = {
        "episode_id": pa.repeat(episode_id, n),
        "timestamp_ns": pa.array(poses.timestamp_ns),
        "track_id": pa.array(poses.track_id),
        "skeleton": pa.repeat(poses.skeleton, n),
        "joint_state": nested(poses.joint_state),
        "joints_m": pa.nulls(n) if poses.joints_m is None else nested(poses.joints_m),
        "joints_px": pa.nulls(n) if poses.joints_px is None else nested(poses.joints_px),
        **{name: pa.array(values) for name, values in extra.items()},
    }
    return pa.table({name: arrays[name] for name in columns}).cast(schema_of(columns))


def _with_id(table: pa.Table, episode_id: str, columns: Columns) -> pa.Table:
    table = table.append_column("episode_id", pa.repeat(episode_id, len(table)))
    return table.select(list(columns)).cast(schema_of(columns))


def _matches(truth: EpisodeTruth, count: int) -> Any:
    """(count,) int64 rows of true poses; null where truth does not know them."""
    return pa.nulls(count, pa.int64()) if truth.poses is None else truth.poses.match


def _table(rows: list[dict[str, Any]], columns: Columns) -> pa.Table:
    return pa.Table.from_pylist(rows, schema=schema_of(columns))


def _png(picture: Any) -> dict[str, Any]:
    return {"bytes": encode_png(picture), "path": None}


def _card(data: Dataset, shards: Mapping[tuple[str, str], _Shards]) -> str:
    """README.md: configurations in YAML, then a paragraph for people."""
    description = data.description
    names = list(dict.fromkeys(name for name, _ in shards))
    lines = ["---", f"pretty_name: {json.dumps(description['name'])}", "configs:"]
    for name in names:
        lines += [f"- config_name: {name}", *(["  default: true"] if name == names[0] else []), "  data_files:"]
        for split in sorted(split for found, split in shards if found == name):
            lines += [f"  - split: {split}", f"    path: {name}/{split}-*.parquet"]
    lines += [
        "---",
        "",
        f"# {description['name']}",
        "",
        f"Exported by hsbench {description['hsbench_version']} (schema {description['schema_version']}), "
        f"{'with truth' if data.truth else 'inputs only'}. Licence: {description['licence']}.",
        "",
        "Depth is in millimetres, 0 = none; times are nanoseconds; frames and units are those of hsbench.",
        "",
    ]
    return "\n".join(lines)
