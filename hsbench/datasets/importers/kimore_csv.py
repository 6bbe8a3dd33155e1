"""Kinect v2 body recordings of KIMORE (vrai.dii.univpm.it/content/kimore-dataset): ``JointPosition*.csv``.

Text, no header, blank lines in front; a line is one frame of one person: x, y, z, state for each of the 25 joints of
the Kinect SDK in its order, 100 fields and a comma after the last. Frame and states are those of ``kinect_csv``. The
time stamps lie in another file, ``TimeStamp*.csv``, which is not read: frames are taken to come at 30 Hz.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsbench.datasets.importers.kinect_bodies import KinectBodies, checked_joints
from hsbench.datasets.importers.kinect_csv import JOINT_COUNT, MAX_BYTES, MAX_FRAMES
from hsbench.errors import DataError
from hsbench.io.reading import read_limited
from hsbench.schema.episode import NS_PER_S

RATE_HZ = 30
FIELD_COUNT = 4 * JOINT_COUNT


def read_kimore_csv(path: str | Path) -> KinectBodies:
    """Path of a recording -> its one body a frame, track 1.

    Raises DataError, naming the line, for a wrong number of fields, values that are no numbers or no metres, and
    unknown states.
    """
    data = read_limited(Path(path), MAX_BYTES, "split the recording")
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: byte {error.start} is not ASCII; expected text (a binary or UTF-16 file?)") from error
    # Counted before the lines are cut, so that memory stays within what the limit allows.
    blank = text[: len(text) - len(text.lstrip())].count("\n")
    text = text.strip()
    if not text:
        raise DataError(f"{path}: is empty; expected one line of {FIELD_COUNT} fields a frame")
    frame_count = text.count("\n") + 1
    if frame_count > MAX_FRAMES:
        raise DataError(f"{path}: {frame_count:,} lines; expected at most {MAX_FRAMES:,} frames (split the recording)")
    joints_kinect_m = np.empty((frame_count, JOINT_COUNT, 3))
    state = np.empty((frame_count, JOINT_COUNT), dtype=np.uint8)
    for index, line in enumerate(text.split("\n")):
        where = f"{path}: line {blank + index + 1}"
        fields = line.strip().removesuffix(",").split(",", FIELD_COUNT)
        if len(fields) != FIELD_COUNT:
            found = f"{len(fields)} fields" if len(fields) < FIELD_COUNT else f"more than {FIELD_COUNT} fields"
            raise DataError(f"{where}: {found}; expected 25 x (x, y, z, state) (with times: import kinect-csv)")
        try:
            values = np.array(fields, dtype=np.float64).reshape(JOINT_COUNT, 4)
        except ValueError as error:
            raise DataError(f"{where}: {str(error)[:80]}; expected numbers only") from error
        joints_kinect_m[index], state[index] = checked_joints(where, values[:, :3], values[:, 3])
    timestamp_ns = np.round(np.arange(frame_count) * (NS_PER_S / RATE_HZ)).astype(np.int64)
    tracks = np.ones(frame_count, dtype=np.int32)
    return KinectBodies(timestamp_ns, tracks, joints_kinect_m, state, int(timestamp_ns[-1]))
