"""A data set as COCO: pictures, keypoints of people, and with truth boxes and masks of everything in the picture.

    images/EPISODE/000000.png
    annotations/person_keypoints_SPLIT.json        observed poses
    annotations/person_keypoints_true_SPLIT.json   with truth: true poses, and masks of their people
    annotations/instances_SPLIT.json               with truth: box and run-length mask of each object and person

Pixels: COCO counts from the corner of the picture as we do, so the middle of the first pixel is at (0.5, 0.5). A
picture has the poses of exactly its time. Joints keep the names of their skeleton; ``v`` is 0 for missing joints and
joints outside the picture, 1 for inferred ones, 2 for tracked ones. A true joint has 2 where the picture shows its
person, else 1.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.dataset import Dataset
from hsbench.datasets.exports.frames import export_folder, joint_pixels, pictures, require_content, rows_at, split_of
from hsbench.datasets.exports.run_lengths import encode
from hsbench.io.atomic import write_bytes
from hsbench.io.images import encode_png
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.episode import Episode
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.schema.skeletons import SKELETONS
from hsbench.typing import AnyArray, BoolArray

PERSON = len(CATEGORIES) + 1
"""Category id of people in instances, as in semantic pictures."""
PIXEL_DECIMALS = 2
"""Of joints, as in COCO's own files."""

JsonObject = dict[str, Any]


@dataclass(frozen=True)
class _Split:
    """What is gathered of one split."""

    images: list[JsonObject] = field(default_factory=list)
    observed: list[JsonObject] = field(default_factory=list)
    true: list[JsonObject] = field(default_factory=list)
    instances: list[JsonObject] = field(default_factory=list)


def write_coco(data: Dataset, out: Path) -> Iterator[str]:
    """Write the new folder ``out``, episode by episode; yields their ids. The folder appears at the end, whole.

    Frames without colour are left out. Warns where no picture has an annotation. Raises DataError if the folder exists
    or lies inside of a data set, or no frame has colour.
    """
    with export_folder(out) as folder:
        splits: dict[str, _Split] = {}
        clean = replace(
            data, depth_noise="none"
        )  # depth is not written, and drawing its noise would take half the time
        for row, episode in zip(data.rows, clean, strict=True):
            split = splits.setdefault(split_of(row), _Split())
            for index in range(len(episode.frames)):
                _add_frame(split, episode, index, folder / "images")
            yield episode.episode_id
        require_content(sum(len(split.images) for split in splits.values()), "colour picture", data.root)
        if not any(split.observed or split.true or split.instances for split in splits.values()):
            hint = "" if data.truth else " (truth was not asked for)"
            warnings.warn(f"no picture has an annotation: nobody was observed at the time of one{hint}", stacklevel=2)
        description = data.description
        for name, split in splits.items():
            documents = {f"person_keypoints_{name}": (split.observed, _people(split.observed))}
            if data.truth:
                documents[f"person_keypoints_true_{name}"] = (split.true, _people(split.true))
                documents[f"instances_{name}"] = (split.instances, _categories())
            for stem, (annotations, categories) in documents.items():
                _write(folder / "annotations" / f"{stem}.json", description, split.images, annotations, categories)


def _write(
    path: Path,
    description: JsonObject,
    images: list[JsonObject],
    annotations: list[JsonObject],
    categories: list[JsonObject],
) -> None:
    document = {
        "info": {"description": description["name"], "version": description["schema_version"]},
        "licenses": [{"id": 1, "name": description["licence"], "url": ""}],
        "images": images,
        "annotations": [{"id": number, **entry} for number, entry in enumerate(annotations, start=1)],
        "categories": categories,
    }
    write_bytes(path, json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())


def _add_frame(split: _Split, episode: Episode, index: int, images: Path) -> None:
    found = pictures(episode, index)
    if "rgb" not in found:
        return
    height, width = found["rgb"].shape[:2]
    timestamp_ns = int(episode.frames.timestamps_ns[index])
    image_id = len(split.images) + 1
    name = f"{episode.episode_id}/{index:06d}.png"
    write_bytes(images / name, encode_png(found["rgb"]))
    split.images.append(
        {
            "id": image_id,
            "file_name": name,
            "width": width,
            "height": height,
            "license": 1,
            "episode_id": episode.episode_id,
            "frame": index,
            "timestamp_ns": timestamp_ns,
        }
    )
    if episode.poses is not None:
        split.observed.extend(_keypoints(episode, episode.poses, timestamp_ns, image_id, None))
    if episode.truth is not None:
        if episode.truth.poses is not None:
            split.true.extend(
                _keypoints(episode, episode.truth.poses.poses, timestamp_ns, image_id, found.get("instance"))
            )
        if "instance" in found:
            split.instances.extend(_instances(found["instance"], found["semantic"], image_id))


def _keypoints(
    episode: Episode, poses: PoseTable, timestamp_ns: int, image_id: int, instance: AnyArray | None
) -> Iterator[JsonObject]:
    """Annotations of the poses of a time that have a joint in the picture, or a person in ``instance``."""
    rows = rows_at(poses, timestamp_ns)
    joints = joint_pixels(episode, poses, rows).round(PIXEL_DECIMALS)
    for row, pixels in zip(rows, joints, strict=True):
        state = poses.joint_state[row]
        inside = episode.sensor.camera.contains(pixels) & (state != JointState.MISSING)
        mask = None if instance is None else np.asarray(instance == PERSON_ID_OFFSET + poses.track_id[row])
        if not inside.any() and (mask is None or not mask.any()):
            continue
        labels = np.where(inside, state, 0) if mask is None else _shown(pixels, inside, mask)
        points = np.where(inside[:, None], pixels, 0.0)
        yield {
            "image_id": image_id,
            "category_id": _skeleton_id(poses.skeleton),
            "keypoints": [x for (u, v), label in zip(points, labels, strict=True) for x in (u, v, int(label))],
            "num_keypoints": int(np.count_nonzero(labels)),
            "iscrowd": 0,
            "track_id": int(poses.track_id[row]),
            **(_extent(pixels[inside]) if mask is None or not mask.any() else _region(mask)),
        }


def _shown(pixels: AnyArray, inside: BoolArray, mask: BoolArray) -> AnyArray:
    """(J,) 2 where the mask holds the joint's pixel, 1 elsewhere in the picture, 0 outside."""
    columns, rows = np.where(inside[:, None], pixels, 0.0).astype(np.int64).T
    return np.where(inside, np.where(mask[rows, columns], 2, 1), 0)


def _extent(pixels: AnyArray) -> JsonObject:
    """Box of joints, and no mask."""
    (x, y), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    width, height = round(right - x, PIXEL_DECIMALS), round(bottom - y, PIXEL_DECIMALS)
    return {"bbox": [float(x), float(y), float(width), float(height)], "area": float(width * height)}


def _region(mask: BoolArray) -> JsonObject:
    """Mask, its box and its area in pixels."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    x, y = int(columns[0]), int(rows[0])
    return {
        "segmentation": encode(mask),
        "bbox": [float(x), float(y), float(columns[-1] + 1 - x), float(rows[-1] + 1 - y)],
        "area": float(np.count_nonzero(mask)),
    }


def _instances(instance: AnyArray, semantic: AnyArray, image_id: int) -> Iterator[JsonObject]:
    ids, first = np.unique(instance, return_index=True)
    for object_id, category_id in zip(ids.tolist(), semantic.ravel()[first].tolist(), strict=True):
        if object_id:
            yield {
                "image_id": image_id,
                "category_id": category_id,
                "object_id": object_id,
                "iscrowd": 0,
                **_region(np.asarray(instance == object_id)),
            }


def _categories() -> list[JsonObject]:
    known: list[JsonObject] = [{"id": c.category_id, "name": c.name, "supercategory": c.group} for c in CATEGORIES]
    return [*known, {"id": PERSON, "name": "person", "supercategory": "person"}]


def _people(annotations: list[JsonObject]) -> list[JsonObject]:
    """A category ``person`` for each skeleton in use."""
    used = {entry["category_id"] for entry in annotations}
    return [
        {
            "id": _skeleton_id(name),
            "name": "person",
            "supercategory": "person",
            "keypoints": list(skeleton.names),
            "skeleton": [[a + 1, b + 1] for a, b in skeleton.bones],
            "hsbench_skeleton": name,
        }
        for name, skeleton in SKELETONS.items()
        if _skeleton_id(name) in used
    ]


def _skeleton_id(name: str) -> int:
    return list(SKELETONS).index(name) + 1
