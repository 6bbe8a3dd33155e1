"""Kinect v2 body recordings as CSV, as KinectReader of the LabanotationSuite writes them (github.com/microsoft, MIT).

Text, no header, one frame of one person a line: the time in ticks of 100 ns, then x, y, z, state for each of the
25 joints of the Kinect SDK in its order: 101 fields, usually with a comma after the last. Time has no absolute
meaning, frames come at about 30 Hz with gaps, and a recording made frame by frame has steps of any length.
State: 0 not tracked (the position means nothing and is returned as NaN), 1 inferred, 2 tracked.

Frames. *kinect* is the SDK's camera space: metres, x to the sensor's own left, y up, z away from the sensor. It is
right-handed, so nothing in it is mirrored; only the SDK's *pictures* are, since they draw x to the right. A
person who faces the sensor has the left shoulder at smaller x. Our camera frame (x right, y down, z forward) is
half a turn about z away, a proper rotation: left and right stay the person's own left and right.

The file does not say where the floor is. ``estimate_camera`` finds height and tilt from a standing person:
- frames count where hips, knees, ankles, feet and neck are tracked, both knees are straighter than 150 degrees
  and the neck is at least 1 m from the ankles;
- tilt: the median angle between the sensor's y axis and the line from mid-ankle to neck, in the y-z plane: people
  stand plumb. A lean of the person is taken for tilt, so expect errors of a few degrees;
- height: the median drop from the sensor to the lower foot joint, which is taken to touch the floor.
An error of the tilt turns the scene about the feet: near them the floor stays right, far from them it does not.
Recordings without a standing person need the height and tilt from whoever set the sensor up.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry import transforms
from hsbench.geometry.cameras import world_T_camera
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

JOINT_COUNT = 25
FIELD_COUNT = 1 + 4 * JOINT_COUNT
TICK_NS = 100
MISSING, INFERRED, TRACKED = 0, 1, 2

MAX_FRAMES = 216_000  # two hours at 30 Hz
MAX_BYTES = 2**28
MAX_TICKS = (2**63 - 1) // TICK_NS
# The sensor runs at 30 Hz; a third of its period still leaves room for jitter.
MIN_MEDIAN_STEP_NS = 11_000_000
# The sensor sees to 8 m.
MAX_COORDINATE_M = 10.0

STRAIGHT_KNEE_RAD = np.deg2rad(150.0)
MIN_NECK_ABOVE_ANKLES_M = 1.0
MIN_STANDING_FRAMES = 10

_NECK, _HIPS, _KNEES, _ANKLES, _FEET = 2, [12, 16], [13, 17], [14, 18], [15, 19]
# A proper rotation, half a turn about z, and its own inverse.
_CAMERA_T_KINECT = transforms.rigid(np.diag([-1.0, -1.0, 1.0]), (0.0, 0.0, 0.0))


@dataclass(frozen=True, eq=False)
class KinectRecording:
    """One person over N frames.

    ``timestamp_ns`` (N,) int64, increasing; ``joints_kinect_m`` (N, 25, 3) float64 in the kinect frame, NaN where
    not tracked; ``state`` (N, 25) uint8: 0 missing, 1 inferred, 2 tracked.
    """

    timestamp_ns: IntArray
    joints_kinect_m: FloatArray
    state: UInt8Array


def read_kinect_csv(path: str | Path) -> KinectRecording:
    """Path of a recording -> its times, joints and states.

    Raises DataError, naming the line, for a wrong number of fields, values that are no numbers or no metres,
    unknown states, and times that do not increase.
    """
    text = _read_text(path)
    if not text.strip():
        raise DataError(f"{path}: is empty; expected one line of {FIELD_COUNT} fields a frame")
    # Counted before the lines are cut, so that memory stays within what the limit allows.
    line_count = text.rstrip().count("\n") + 1
    if line_count > MAX_FRAMES:
        raise DataError(f"{path}: {line_count:,} lines; expected at most {MAX_FRAMES:,} frames (split the recording)")
    lines = text.rstrip().split("\n")
    ticks = np.empty(len(lines), dtype=np.int64)
    values = np.empty((len(lines), JOINT_COUNT, 4), dtype=np.float64)
    for index, line in enumerate(lines):
        ticks[index], values[index] = _parse_line(f"{path}: line {index + 1}", line)
    steps_ns = np.diff(ticks) * TICK_NS
    if (steps_ns <= 0).any():
        line_number = int(np.argmax(steps_ns <= 0)) + 2
        found = f"time goes from {ticks[line_number - 2]} to {ticks[line_number - 1]}"
        raise DataError(f"{path}: line {line_number}: {found}; expected increasing times (two recordings in one file?)")
    if len(steps_ns) and np.median(steps_ns) < MIN_MEDIAN_STEP_NS:
        found = f"the median step is {np.median(np.diff(ticks)):g} ticks of 100 ns"
        raise DataError(f"{path}: {found}; expected about 333,333 (are these milli- or microseconds?)")
    state = values[:, :, 3].astype(np.uint8)
    joints_kinect_m = np.where(state[:, :, None] == MISSING, np.nan, values[:, :, :3])
    return KinectRecording(ticks * TICK_NS, joints_kinect_m, state)


def to_camera_frame(points_kinect: FloatArray) -> FloatArray:
    """(..., 3) points in the kinect frame -> (..., 3) in our camera frame: x right, y down, z forward."""
    return transforms.apply(_CAMERA_T_KINECT, points_kinect)


def to_episode_frame(points_kinect: FloatArray, height_m: float, tilt_rad: float) -> FloatArray:
    """(..., 3) points in the kinect frame -> (..., 3) in the episode frame (floor below the sensor, z up, x ahead).

    ``height_m`` is the sensor's height above the floor, ``tilt_rad`` its tilt, positive looking down.
    """
    return transforms.apply(world_T_camera(height_m, tilt_rad) @ _CAMERA_T_KINECT, points_kinect)


def estimate_camera(recording: KinectRecording) -> tuple[float, float]:
    """A recording -> (``height_m``, ``tilt_rad``) of its sensor, by the method in this module's docstring.

    Raises DataError if too few frames show a standing person with tracked feet.
    """
    standing = _standing(recording)
    if standing.sum() < MIN_STANDING_FRAMES:
        raise DataError(
            f"recording has {int(standing.sum())} frames of a standing person with tracked feet; expected at least"
            f" {MIN_STANDING_FRAMES} to find the floor (give the sensor's height and tilt instead)"
        )
    joints = recording.joints_kinect_m[standing]
    upward = joints[:, _NECK] - joints[:, _ANKLES].mean(axis=1)
    # Looking down, the sensor sees the head nearer than the feet.
    tilt_rad = float(np.median(np.arctan2(-upward[:, 2], upward[:, 1])))
    feet_level = to_episode_frame(joints[:, _FEET], 0.0, tilt_rad)
    return -float(np.median(feet_level[:, :, 2].min(axis=1))), tilt_rad


def _standing(recording: KinectRecording) -> BoolArray:
    """(N,) whether a frame shows a standing person whose legs and neck are tracked."""
    joints = recording.joints_kinect_m
    needed = [_NECK, *_HIPS, *_KNEES, *_ANKLES, *_FEET]
    tracked = (recording.state[:, needed] == TRACKED).all(axis=1)
    thigh, shin = joints[:, _HIPS] - joints[:, _KNEES], joints[:, _ANKLES] - joints[:, _KNEES]
    lengths = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
    # Compared without dividing, so that joints on one spot and NaN give False and no warning.
    straight = ((thigh * shin).sum(axis=-1) <= np.cos(STRAIGHT_KNEE_RAD) * lengths) & (lengths > 0)
    upward = joints[:, _NECK] - joints[:, _ANKLES].mean(axis=1)
    return np.asarray(tracked & straight.all(axis=1) & (upward[:, 1] >= MIN_NECK_ABOVE_ANKLES_M))


def _parse_line(where: str, line: str) -> tuple[int, FloatArray]:
    """One line -> (ticks, (25, 4) x y z state)."""
    # One split more than fields is enough to see that there are too many, however long the line.
    fields = line.strip().removesuffix(",").split(",", FIELD_COUNT)
    if len(fields) != FIELD_COUNT:
        found = f"{len(fields)} fields" if len(fields) < FIELD_COUNT else f"more than {FIELD_COUNT} fields"
        raise DataError(
            f"{where}: {found}; expected {FIELD_COUNT}: time and 25 x (x, y, z, state)"
            " (an incomplete copy, or another recorder's format?)"
        )
    try:
        ticks, values = int(fields[0]), np.array(fields[1:], dtype=np.float64).reshape(JOINT_COUNT, 4)
    except ValueError as error:
        raise DataError(f"{where}: {error}; expected numbers only (a header line? this format has none)") from error
    if not 0 <= ticks <= MAX_TICKS:
        raise DataError(f"{where}: time is {ticks}; expected 0 to {MAX_TICKS} ticks of 100 ns")
    if not np.isin(values[:, 3], (MISSING, INFERRED, TRACKED)).all():
        joint = int(np.argmin(np.isin(values[:, 3], (MISSING, INFERRED, TRACKED))))
        raise DataError(f"{where}: joint {joint} has state {values[joint, 3]:g}; expected 0, 1 or 2 (shifted columns?)")
    position = values[values[:, 3] != MISSING, :3]
    if not (np.abs(position) <= MAX_COORDINATE_M).all():
        worst = float(np.abs(position).max())
        raise DataError(f"{where}: a coordinate of {worst:g} m; expected at most {MAX_COORDINATE_M:g} (millimetres?)")
    return ticks, values


def _read_text(path: str | Path) -> str:
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise DataError(f"{path}: larger than {MAX_BYTES:,} bytes; expected at most that (split the recording)")
    try:
        return data.decode("ascii")
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: byte {error.start} is not ASCII; expected text (a binary or UTF-16 file?)") from error
