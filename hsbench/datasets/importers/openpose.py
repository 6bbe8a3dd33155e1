"""OpenPose's JSON output (github.com/CMU-Perceptual-Computing-Lab/openpose): 2D people, one file a picture.

A file is ``{"version": ..., "people": [{"pose_keypoints_2d": [x, y, confidence, ...], ...}]}``; version 1.0 calls the
key ``pose_keypoints``. 25 joints are BODY_25, 18 are COCO-18; a joint of 0, 0, 0 was not found. A recording is a
folder of ``<name>_<frame, 12 digits>_keypoints.json``, or one such file; a picture without people has an empty list.
Faces, hands and 3D keypoints have no place in the schema and are not read.

Coordinates (flag ``--keypoint_scale``) are pixels, whose whole numbers are centres of pixels, or run from 0 to 1, or
from -1 to 1, between the centres of the first and the last pixel (keypointScaler.cpp divides by the size less one).
Files do not say which; ``find_scale`` tells them apart by their range.

State: 0 missing at confidence 0; 1 inferred up to ``TRACKED_CONFIDENCE``; 2 tracked above.
Identities (``person_id``) are -1 unless OpenPose tracked people; then a track is the place in the list of people, which
says nothing about who is who from picture to picture.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError, SchemaError
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.skeletons import BODY_25, COCO_18, Skeleton
from hsbench.typing import Float32Array, FloatArray, Int32Array, IntArray, UInt8Array

KEYS = ("pose_keypoints_2d", "pose_keypoints")
SKELETONS = {3 * len(skeleton.names): skeleton for skeleton in (BODY_25, COCO_18)}
TRACKED_CONFIDENCE = 0.05
"""OpenPose's ``--render_threshold``: it draws what it is surer of."""

SCALES = ("pixel", "unit", "signed")
NORMALISED_LIMIT = 1.01  # of |x| and |y|: joints lie within the picture, but for rounding

MAX_FRAMES = 216_000  # two hours at 30 Hz
MAX_PEOPLE = 1000  # in a picture
MAX_ROWS = 1_000_000
MAX_BYTES = 2**22  # of one picture's file; a person with face and hands takes 6 kB
MAX_VALUE = 100_000.0
MAX_DURATION_S = 366 * 86_400.0  # a year of time-lapse; 292 years are the most that int64 can hold

_FRAME_FILE = re.compile(r"(?P<name>.*)_(?P<frame>\d{12})_keypoints\.json", re.ASCII)


@dataclass(frozen=True, eq=False)
class OpenPoseRecording:
    """R people in F pictures, ordered by picture, then track.

    ``frames`` (F,) int64 numbers of the pictures, ascending; ``frame`` (R,) int64, the number of a row's picture;
    ``track_id`` (R,) int32; ``keypoints`` (R, J, 3) float64 x, y, confidence as in the file; ``has_identities``:
    whether tracks are OpenPose's identities.
    """

    skeleton: Skeleton
    frames: IntArray
    frame: IntArray
    track_id: Int32Array
    keypoints: FloatArray
    has_identities: bool


def read_openpose(path: str | Path) -> OpenPoseRecording:
    """Path of a file, or of a folder of ``<name>_<12 digits>_keypoints.json`` -> the people in it.

    Raises DataError, naming file and person, for damaged files, other skeletons than BODY_25 and COCO-18, different
    ones in one recording, values that are no numbers, and recordings without anybody.
    """
    files = _frame_files(Path(path)) if Path(path).is_dir() else [(0, Path(path))]
    frame: list[int] = []
    identities: list[int] = []
    places: list[int] = []
    rows: list[FloatArray] = []
    for number, file in files:
        for place, (identity, values) in enumerate(_people(file), start=1):
            if rows and len(values) != len(rows[0]):
                raise DataError(f"{file}: {len(values)} joints; expected {len(rows[0])} as before (two models?)")
            if values[:, 2].any():  # OpenPose may keep a person of whom it shows nothing
                frame.append(number)
                identities.append(identity)
                places.append(place)
                rows.append(values)
        if len(rows) > MAX_ROWS:
            raise DataError(
                f"{file}: more than {MAX_ROWS:,} people so far; expected at most that (split the recording)"
            )
    if not rows:
        raise DataError(f"{path}: no person in {len(files)} pictures; expected somebody")
    has_identities = min(identities) >= 0
    tracks = np.array([i + 1 for i in identities] if has_identities else places, dtype=np.int32)
    order = np.lexsort((tracks, np.array(frame)))
    numbers = np.array(frame, dtype=np.int64)[order]
    same = (np.diff(numbers) == 0) & (np.diff(tracks[order]) == 0)
    if same.any():
        row = int(np.argmax(same))
        raise DataError(
            f"{path}: picture {numbers[row]} has person_id {tracks[order][row] - 1} twice; expected it once"
        )
    return OpenPoseRecording(
        skeleton=SKELETONS[3 * len(rows[0])],
        frames=np.array([number for number, _ in files], dtype=np.int64),
        frame=numbers,
        track_id=tracks[order],
        keypoints=np.stack(rows)[order],
        has_identities=has_identities,
    )


def find_scale(keypoints: FloatArray) -> str:
    """(R, J, 3) keypoints as in a file -> ``pixel``, ``unit`` (0 to 1) or ``signed`` (-1 to 1), by their range.

    Coordinates from -1 to 1 of people who never leave the lower right quarter of the picture look like ``unit``.
    """
    xy = keypoints[keypoints[..., 2] > 0, :2]
    if np.abs(xy).max(initial=0.0) > NORMALISED_LIMIT:
        return "pixel"
    return "signed" if xy.min(initial=0.0) < 1.0 - NORMALISED_LIMIT else "unit"


def to_pixels(keypoints: FloatArray, scale: str, width_px: int, height_px: int) -> Float32Array:
    """(R, J, 3) keypoints as in a file -> (R, J, 2) float32 pixels (first pixel's centre at 0.5), NaN where missing."""
    if scale not in SCALES:
        raise SchemaError(f"scale is {scale!r}; expected one of {', '.join(SCALES)}")
    last = np.array([width_px - 1, height_px - 1], dtype=np.float64)
    xy = keypoints[..., :2]
    index = {"pixel": xy, "unit": xy * last, "signed": (xy + 1.0) / 2.0 * last}[scale]
    return np.where(keypoints[..., 2:] > 0, index + 0.5, np.nan).astype(np.float32)


def joint_states(confidence: FloatArray) -> UInt8Array:
    """(...) confidences -> (...) uint8 of ``JointState``."""
    states = np.where(confidence > TRACKED_CONFIDENCE, JointState.TRACKED, JointState.INFERRED)
    return np.where(confidence > 0, states, JointState.MISSING).astype(np.uint8)


def poses(recording: OpenPoseRecording, scale: str, size_px: tuple[int, int], rate_hz: float) -> PoseTable:
    """The people as poses in pixels; the first picture, with or without people, is at time 0."""
    return PoseTable(
        recording.skeleton.name,
        frame_times(recording.frame - recording.frames[0], rate_hz),
        recording.track_id,
        joint_states(recording.keypoints[..., 2]),
        joints_px=to_pixels(recording.keypoints, scale, *size_px),
    )


def frame_times(frame: IntArray, rate_hz: float) -> IntArray:
    """(n,) numbers of pictures at a rate -> (n,) int64 ns, rounded to whole ones. Raises DataError for years."""
    time_s = frame / rate_hz
    if time_s.max(initial=0.0) > MAX_DURATION_S:
        raise DataError(
            f"{frame.max():,} pictures at {rate_hz:g} Hz last more than a year; expected less (another rate?)"
        )
    return np.round(time_s * NS_PER_S).astype(np.int64)


def _frame_files(folder: Path) -> list[tuple[int, Path]]:
    """(number, file) of the pictures of one recording, by number."""
    found = []
    names = set()
    for file in sorted(folder.glob("*_keypoints.json")):
        match = _FRAME_FILE.fullmatch(file.name)
        if match is None:
            raise DataError(f"{file}: has no frame number; expected <name>_<12 digits>_keypoints.json")
        names.add(match["name"])
        found.append((int(match["frame"]), file))
        if len(names) > 1:
            raise DataError(f"{file}: another recording than {found[0][1].name}; expected one recording a folder")
        if len(found) > MAX_FRAMES:
            raise DataError(f"{folder}: more than {MAX_FRAMES:,} pictures; expected at most that (split the recording)")
    if not found:
        raise DataError(
            f"{folder}: holds no <name>_<12 digits>_keypoints.json; expected OpenPose's --write_json folder"
        )
    return sorted(found)


def _people(file: Path) -> list[tuple[int, FloatArray]]:
    """(identity or -1, (J, 3) keypoints) of every person in a file."""
    root = pose_json.load(file, MAX_BYTES)
    people = pose_json.items(pose_json.field(root, "people", f"{file}: the file"), f"{file}: people", MAX_PEOPLE)
    return [_person(person, f"{file}: people[{index}]") for index, person in enumerate(people)]


def _person(person: Any, where: str) -> tuple[int, FloatArray]:
    key = KEYS[1] if isinstance(person, dict) and KEYS[0] not in person and KEYS[1] in person else KEYS[0]
    found = pose_json.items(pose_json.field(person, key, where), f"{where}.{key}", max(SKELETONS))
    if len(found) not in SKELETONS:
        wanted = " or ".join(f"{count} ({skeleton.name})" for count, skeleton in SKELETONS.items())
        raise DataError(f"{where}.{key} has {len(found)} values; expected {wanted}")
    values = pose_json.numbers(found, f"{where}.{key}", len(found), MAX_VALUE).reshape(-1, 3)
    if (values[:, 2] < 0).any():
        joint = int(np.argmax(values[:, 2] < 0))
        raise DataError(f"{where}.{key}: joint {joint} has confidence {values[joint, 2]:g}; expected 0 or more")
    identity = person.get("person_id", [-1])
    if isinstance(identity, list) and len(identity) == 1:
        identity = identity[0]
    return pose_json.whole(identity, f"{where}.person_id", -1, 2**31 - 2), values
