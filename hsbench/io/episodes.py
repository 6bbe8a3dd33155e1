"""Episodes to and from a folder: inputs and truth apart, every file hashed, readable without hsbench.

    episode.json          sensor, times, how frames are stored
    inputs/               poses.parquet, activity_maps.npz, frames/ (imported images or video)
    recording/            pictures of a static camera as background and patches (generated, open splits)
    truth/                scene.json + scene.npz, poses.parquet + match.parquet, events.parquet, motions.parquet,
                          occupancy.json + occupancy.npz, objects.parquet, affordance.npz, view_affordance.png,
                          frames/ (labels that somebody drew into imported images)
    index.json            the episode's row of its data set's index: scene, split, counts
    manifest.json         sha256 of every file above

docs/schema.md lists every column and array.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError, SchemaError
from hsbench.io.arrays import load_npz, write_npz
from hsbench.io.atomic import atomic_folder, write_json
from hsbench.io.checksums import manifest
from hsbench.io.frame_store import (
    Film,
    Recording,
    RecordingFrames,
    RecordingTruth,
    write_recording,
)
from hsbench.io.image_frames import ImageFrames, write_frames
from hsbench.io.images import read_uint8, write_png
from hsbench.io.pixel_labels import LABELS_FILE, PixelLabels, read_pixel_labels, write_pixel_labels
from hsbench.io.strict_json import read_json
from hsbench.schema import SCHEMA_VERSION, codec
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.episode import Episode, EpisodeTruth, FrameList, Frames, FramesTruth
from hsbench.schema.migration import migrated_episode, migrated_scene
from hsbench.schema.scene import PERSON_ID_OFFSET, Scene
from hsbench.typing import UInt8Array

DESCRIPTOR_KEYS = (
    "schema_version", "episode_id", "dataset", "t0_ns", "end_ns", "sensor", "frames", "depth_noise", "image_noise",
)  # fmt: skip
INSTANCE_IDS = 65536  # uint16

T = TypeVar("T")


def write_episode(folder: Path, episode: Episode, scene_id: str, split: str, renderer: str | None = None) -> None:
    """Write an episode as a new folder, whole or not at all, with its row of the index.

    Raises DataError if the folder exists.
    """
    _check_storable(episode)
    with atomic_folder(folder) as unit:
        for part in ("inputs", "truth"):
            (unit / part).mkdir()
        write_json(unit / "episode.json", _describe(episode))
        _write_inputs(unit, episode)
        if episode.truth is not None:
            _write_truth(unit / "truth", episode.truth)
        row = {
            "episode_id": episode.episode_id,
            "scene_id": scene_id,
            "split": split,
            "duration_s": episode.duration_s,
            "n_frames": len(episode.frames),
            "n_poses": 0 if episode.poses is None else len(episode.poses),
            "renderer": renderer,
        }
        write_json(unit / "index.json", row)
        write_json(unit / "manifest.json", manifest(unit))


def _describe(episode: Episode) -> dict[str, Any]:
    frames = episode.frames
    film = isinstance(frames, Film | RecordingFrames)
    return {
        "schema_version": SCHEMA_VERSION,
        "episode_id": episode.episode_id,
        "dataset": episode.dataset,
        "t0_ns": episode.t0_ns,
        "end_ns": episode.end_ns,
        "sensor": codec.sensor_to_json(episode.sensor),
        "frames": "recording" if film else "images" if len(frames) else "none",
        "depth_noise": {"preset": frames.noise_preset, "seed": frames.noise_seed}
        if isinstance(frames, Film | RecordingFrames) and frames.has_depth
        else None,
        "image_noise": {"preset": frames.image_noise, "seed": frames.noise_seed}
        if isinstance(frames, Film | RecordingFrames) and frames.image_noise != "none"
        else None,
    }


def _write_inputs(unit: Path, episode: Episode) -> None:
    if episode.poses is not None:
        write_parquet(unit / "inputs" / "poses.parquet", codec.poses_to_table(episode.poses))
    if episode.activity_maps is not None:
        write_npz(unit / "inputs" / "activity_maps.npz", **codec.activity_maps_to_arrays(episode.activity_maps))
    frames = episode.frames
    if isinstance(frames, Film):
        (unit / "recording").mkdir()
        patches = (frames.patch(i) for i in range(len(frames)))
        write_recording(unit / "recording", frames.background, patches, frames.light)
    elif isinstance(frames, RecordingFrames):
        raise DataError(f"episode {episode.episode_id} is a recording on disk already; copy its folder instead")
    elif len(frames):
        (unit / "inputs" / "frames").mkdir()
        write_frames(unit / "inputs" / "frames", frames)


def _check_storable(episode: Episode) -> None:
    """Raise SchemaError for truth that has no place on disk: nothing is dropped in silence."""
    truth = episode.truth
    if truth is None:
        return
    if truth.objects is not None:
        described = 0 if truth.scene is None else len(truth.scene.objects)
        if len(truth.objects.object_id) != described:
            raise SchemaError(
                f"episode {episode.episode_id} has truth of {len(truth.objects.object_id)} objects; "
                f"expected the scene's {described}"
            )
    if truth.frames is not None and not isinstance(episode.frames, Film | RecordingFrames):
        if not isinstance(truth.frames, PixelLabels):
            raise SchemaError(
                f"episode {episode.episode_id} has truth of frames that are no recording; expected it to follow from"
                " one, or labels of pixels"
            )
        if len(episode.frames) and list(truth.frames.timestamps_ns) != episode.frames.timestamps_ns.tolist():
            raise SchemaError(f"episode {episode.episode_id} has labels of other frames; expected its own time stamps")


def _write_truth(folder: Path, truth: EpisodeTruth) -> None:
    if truth.scene is not None:
        description, geometry = codec.scene_to_plain(truth.scene)
        write_json(folder / "scene.json", description)
        write_npz(folder / "scene.npz", **geometry)
        if truth.objects is not None:
            write_parquet(folder / "objects.parquet", codec.objects_to_table(truth.objects, truth.scene))
    if truth.poses is not None:
        poses, match = codec.true_poses_to_tables(truth.poses)
        write_parquet(folder / "poses.parquet", poses)
        write_parquet(folder / "match.parquet", match)
    if truth.events is not None:
        write_parquet(folder / "events.parquet", codec.events_to_table(truth.events))
    if truth.motions is not None:
        write_parquet(folder / "motions.parquet", codec.motions_to_table(truth.motions))
    if truth.occupancy is not None:
        write_json(folder / "occupancy.json", codec.grid_to_json(truth.occupancy.grid))
        write_npz(folder / "occupancy.npz", **codec.occupancy_to_arrays(truth.occupancy))
    if truth.sensor is not None:
        write_json(folder / "sensor.json", codec.sensor_to_json(truth.sensor))
    if truth.view_affordance is not None:
        write_png(folder / "view_affordance.png", truth.view_affordance)
    if isinstance(truth.frames, PixelLabels):
        write_pixel_labels(folder / "frames", truth.frames)
    if truth.affordance is not None:
        write_npz(folder / "affordance.npz", **codec.affordance_to_arrays(truth.affordance))


def read_episode(
    folder: Path,
    *,
    truth: bool = False,
    frames: bool = True,
    depth_noise: str | None = None,
    image_noise: str | None = None,
) -> Episode:
    """An episode from its folder; tables are read, frames decoded when indexed.

    truth: also hand out everything under ``truth``. frames: False leaves pictures out (the ``poses`` track).
    depth_noise, image_noise: presets in place of the recorded ones, where there are any. Raises DataError for missing
    or damaged files, SchemaError for values that do not fit. Older schema versions are migrated as they are read.
    """
    descriptor = read_json(folder / "episode.json")
    try:
        version = descriptor.get("schema_version")
        descriptor = codec.exact_keys(migrated_episode(descriptor), "episode", DESCRIPTOR_KEYS)
        for name in ("t0_ns", "end_ns"):
            if type(descriptor[name]) is not int:
                raise SchemaError(f"{name} is {descriptor[name]!r}; expected whole nanoseconds")
        poses = _optional(folder / "inputs" / "poses.parquet", lambda p: codec.poses_from_table(read_parquet(p)))
        maps = _optional(
            folder / "inputs" / "activity_maps.npz", lambda p: codec.activity_maps_from_arrays(load_npz(p))
        )
        noises = tuple(
            found if found is None or preset is None else {**found, "preset": preset}
            for found, preset in ((descriptor["depth_noise"], depth_noise), (descriptor["image_noise"], image_noise))
        )
        return Episode(
            descriptor["episode_id"],
            descriptor["dataset"],
            codec.sensor_from_json(descriptor["sensor"]),
            _read_frames(folder, descriptor["frames"], *noises) if frames else FrameList(),
            poses,
            descriptor["t0_ns"],
            descriptor["end_ns"],
            maps,
            _read_truth(folder, version, descriptor["frames"] == "recording") if truth else None,
        )
    except SchemaError as error:
        raise SchemaError(f"{folder}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError) as error:
        found = str(error).partition("\n")[0]
        raise DataError(
            f"{folder}: {type(error).__name__} on {found}; expected an episode of schema {SCHEMA_VERSION}"
        ) from error


def _read_frames(folder: Path, kind: str, depth: dict[str, Any] | None, image: dict[str, Any] | None) -> Frames:
    """depth, image: preset and seed of the noise; None: no such sensor, and no such noise."""
    if kind == "recording":
        recording = Recording(folder / "recording")
        seeds = [noise["seed"] for noise in (depth, image) if noise is not None]
        presets = ["none" if noise is None else noise["preset"] for noise in (depth, image)]
        return RecordingFrames(recording, seeds[0] if seeds else 0, presets[0], depth is not None, presets[1])
    if kind == "images":
        return ImageFrames(folder / "inputs" / "frames")
    if kind == "none":
        return FrameList()
    raise SchemaError(f"frames is {kind!r}; expected recording, images or none")


def _read_truth(folder: Path, version: object, recorded: bool) -> EpisodeTruth:
    root = folder / "truth"
    scene = _optional(
        root / "scene.json",
        lambda p: codec.scene_from_plain(migrated_scene(read_json(p), version), load_npz(p.with_suffix(".npz"))),
    )
    frames: FramesTruth | None = _optional(root / "frames" / LABELS_FILE, lambda p: read_pixel_labels(p.parent))
    if recorded and scene is not None:
        frames = RecordingTruth(Recording(folder / "recording"), category_of_instance(scene))
    return EpisodeTruth(
        scene=scene,
        poses=_optional(
            root / "poses.parquet",
            lambda p: codec.true_poses_from_tables(read_parquet(p), read_parquet(root / "match.parquet")),
        ),
        events=_optional(root / "events.parquet", lambda p: codec.events_from_table(read_parquet(p))),
        occupancy=_optional(
            root / "occupancy.json",
            lambda p: codec.occupancy_from_arrays(load_npz(p.with_suffix(".npz")), codec.grid_from_json(read_json(p))),
        ),
        objects=_optional(root / "objects.parquet", lambda p: codec.objects_from_table(read_parquet(p))),
        affordance=_optional(root / "affordance.npz", lambda p: codec.affordance_from_arrays(load_npz(p))),
        motions=_optional(root / "motions.parquet", lambda p: codec.motions_from_table(read_parquet(p))),
        frames=frames,
        view_affordance=_optional(root / "view_affordance.png", read_uint8),
        sensor=_optional(root / "sensor.json", lambda p: codec.sensor_from_json(read_json(p))),
    )


def category_of_instance(scene: Scene) -> UInt8Array:
    """(65536,) uint8: category id of every instance id; people get the id after the last category."""
    table = np.zeros(INSTANCE_IDS, dtype=np.uint8)
    for item in scene.objects:
        table[item.object_id] = item.category.category_id
    table[PERSON_ID_OFFSET + 1 :] = len(CATEGORIES) + 1
    return table


def _optional(path: Path, read: Callable[[Path], T]) -> T | None:
    return read(path) if path.exists() else None


def read_parquet(path: Path) -> pa.Table:
    """A Parquet file. Raises DataError where it is missing or damaged."""
    try:
        return pq.read_table(path)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error


def write_parquet(path: Path, table: pa.Table) -> None:
    """Write a table, compressed, with the same bytes for the same values."""
    pq.write_table(table, path, compression="zstd", use_dictionary=False)
