"""Keypoints in COCO's JSON (cocodataset.org/#format-data): annotations of pictures, or results of a detector.

Annotations are an object with ``images`` (id, file_name, width, height), ``categories`` (the joints' names) and
``annotations`` (image_id, category_id, iscrowd, keypoints). Results are a list of objects with image_id, category_id,
keypoints and score; they say nothing about the pictures, so the annotations they belong to must be given. Keypoints
are x, y, v for each of 17 joints. In annotations v is 0 not labelled, 1 labelled but hidden, 2 labelled and visible:
the states missing, inferred and tracked. In results it is the detector's confidence: missing at 0, tracked above. x
and y count pixels from 0 in the upper left, whole numbers being pixels; their centres are at one half here.

A crowd (iscrowd) is nobody in particular, and an annotation without a labelled joint is no pose: both are counted and
left out. Places among the people of a picture become tracks, which say nothing about who is who in another picture.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import COCO_17
from hsbench.typing import Float32Array, Int32Array, UInt8Array

JOINT_COUNT = len(COCO_17.names)
COCO_NAMES = tuple("_".join(reversed(name.split("_"))) for name in COCO_17.names)
"""The joints as COCO spells them: left_eye where ours is eye_left."""

PERSON = 1
"""COCO's category of people."""

MAX_BYTES = 2**28  # the largest file of COCO 2017, person_keypoints_train2017.json, has 238 MB
MAX_IMAGES = 500_000
MAX_ROWS = 2_000_000
MAX_ID = 2**63 - 1
MAX_SIDE_PX = 65_536
MAX_VALUE_PX = 100_000.0


@dataclass(frozen=True)
class CocoImage:
    """A picture: id, file name, and size in pixels."""

    image_id: int
    file_name: str
    width_px: int
    height_px: int


@dataclass(frozen=True, eq=False)
class CocoKeypoints:
    """R people in pictures, ordered by picture, then track.

    ``images``: ascending by file name, then id; ``image`` (R,) int32, index of a row's picture; ``track_id`` (R,) int32
    from 1 in every picture; ``joints_px`` (R, 17, 2) float32, NaN where missing; ``state`` (R, 17) uint8 of
    ``JointState``; ``crowds`` and ``unlabelled``: what was left out.
    """

    images: tuple[CocoImage, ...]
    image: Int32Array
    track_id: Int32Array
    joints_px: Float32Array
    state: UInt8Array
    crowds: int
    unlabelled: int


def read_annotations(path: str | Path) -> CocoKeypoints:
    """Path of a file of annotations -> pictures and people. Raises DataError, naming file and item, for damage."""
    root = pose_json.load(Path(path), MAX_BYTES)
    if isinstance(root, list):
        raise DataError(f"{path}: is a list; expected annotations with images (are these results? give --images)")
    images = _images(root, path)
    _check_categories(root, path)
    found = pose_json.field(root, "annotations", f"{path}: the file")
    return _collect(path, "annotations", found, images, visibility=True)


def read_results(path: str | Path, images: tuple[CocoImage, ...]) -> CocoKeypoints:
    """Path of a file of results, and the pictures they belong to -> pictures and people. Raises DataError likewise."""
    root = pose_json.load(Path(path), MAX_BYTES)
    if isinstance(root, dict):
        raise DataError(f"{path}: is an object; expected a list of results (are these annotations?)")
    return _collect(path, "results", root, images, visibility=False)


def read_images(path: str | Path) -> tuple[CocoImage, ...]:
    """Path of a file of annotations -> its pictures alone, by file name."""
    return _images(pose_json.load(Path(path), MAX_BYTES), path)


def of_picture(keypoints: CocoKeypoints, index: int) -> CocoKeypoints:
    """The people of one picture, by its index; nobody was left out of it as far as is known."""
    rows = keypoints.image == index
    return CocoKeypoints(
        images=(keypoints.images[index],),
        image=np.zeros(int(rows.sum()), dtype=np.int32),
        track_id=keypoints.track_id[rows],
        joints_px=keypoints.joints_px[rows],
        state=keypoints.state[rows],
        crowds=0,
        unlabelled=0,
    )


def _collect(path: str | Path, name: str, found: Any, images: tuple[CocoImage, ...], visibility: bool) -> CocoKeypoints:
    index_of = {image.image_id: index for index, image in enumerate(images)}
    left_out: Counter[str] = Counter()
    rows, where = [], []
    for at, item in _people(path, name, found, left_out):
        image_id = pose_json.whole(pose_json.field(item, "image_id", at), f"{at}.image_id", 0, MAX_ID)
        if image_id not in index_of:
            raise DataError(f"{at}.image_id is {image_id}; expected one of the {len(images)} pictures")
        keypoints = pose_json.field(item, "keypoints", at)
        values = pose_json.numbers(keypoints, f"{at}.keypoints", 3 * JOINT_COUNT, MAX_VALUE_PX).reshape(-1, 3)
        flags = values[:, 2]
        if visibility and not (known := (flags == 0) | (flags == 1) | (flags == 2)).all():
            joint = int(np.argmin(known))
            raise DataError(f"{at}: {COCO_NAMES[joint]} has visibility {flags[joint]:g}; expected 0, 1 or 2 (results?)")
        if (flags < 0).any():
            raise DataError(f"{at}: {COCO_NAMES[int(np.argmin(flags))]} has a negative confidence; expected 0 or more")
        if not flags.any():
            left_out["unlabelled"] += 1
            continue
        rows.append(values)
        where.append(index_of[image_id])
    if not rows:
        raise DataError(f"{path}: no person with a joint in {len(images)} pictures; expected somebody")
    order = np.argsort(np.array(where, dtype=np.int32), kind="stable")
    image = np.array(where, dtype=np.int32)[order]
    first = np.searchsorted(image, image)
    values = np.stack(rows)[order]
    flags = values[..., 2]
    state = flags if visibility else np.where(flags > 0, JointState.TRACKED, JointState.MISSING)
    return CocoKeypoints(
        images=images,
        image=image,
        track_id=(np.arange(len(image)) - first + 1).astype(np.int32),
        joints_px=np.where(flags[..., None] > 0, values[..., :2] + 0.5, np.nan).astype(np.float32),
        state=state.astype(np.uint8),
        crowds=left_out["crowds"],
        unlabelled=left_out["unlabelled"],
    )


def _people(path: str | Path, name: str, found: Any, left_out: Counter[str]) -> Iterator[tuple[str, Any]]:
    """(place for messages, item) of what is a person; crowds are counted, other categories passed over."""
    for index, item in enumerate(pose_json.items(found, f"{path}: {name}", MAX_ROWS)):
        at = f"{path}: {name}[{index}]"
        if pose_json.whole(pose_json.field(item, "category_id", at), f"{at}.category_id", 0, MAX_ID) != PERSON:
            continue
        if pose_json.whole(item.get("iscrowd", 0), f"{at}.iscrowd", 0, 1):
            left_out["crowds"] += 1
        else:
            yield at, item


def _images(root: Any, path: str | Path) -> tuple[CocoImage, ...]:
    found = pose_json.items(pose_json.field(root, "images", f"{path}: the file"), f"{path}: images", MAX_IMAGES)
    images = []
    for index, item in enumerate(found):
        at = f"{path}: images[{index}]"
        width_px, height_px = (
            pose_json.whole(pose_json.field(item, side, at), f"{at}.{side}", 1, MAX_SIDE_PX)
            for side in ("width", "height")
        )
        name = pose_json.text(pose_json.field(item, "file_name", at), f"{at}.file_name")
        image_id = pose_json.whole(pose_json.field(item, "id", at), f"{at}.id", 0, MAX_ID)
        images.append(CocoImage(image_id, name, width_px, height_px))
    twice = [image_id for image_id, count in Counter(image.image_id for image in images).items() if count > 1]
    if twice:
        raise DataError(f"{path}: images have id {twice[0]} twice; expected different ids")
    return tuple(sorted(images, key=lambda image: (image.file_name, image.image_id)))


def _check_categories(root: Any, path: str | Path) -> None:
    """Raise DataError unless people have the 17 joints of COCO in its order."""
    categories = pose_json.items(
        pose_json.field(root, "categories", f"{path}: the file"), f"{path}: categories", MAX_IMAGES
    )
    for index, item in enumerate(categories):
        at = f"{path}: categories[{index}]"
        if pose_json.field(item, "id", at) == PERSON:
            names = pose_json.items(pose_json.field(item, "keypoints", at), f"{at}.keypoints", MAX_ROWS)
            if names != list(COCO_NAMES):
                raise DataError(
                    f"{at} has {len(names)} joints other than COCO's 17; expected {COCO_NAMES[0]} to {COCO_NAMES[-1]}"
                )
            return
    raise DataError(f"{path}: categories lack id {PERSON}, person; expected COCO's keypoints")
