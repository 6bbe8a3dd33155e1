"""Skeleton recordings of PiGraphs (graphics.stanford.edu/projects/pigraphs), of one Kinect v2 before a scanned room.

JSON, ``<scene>_<camera>_<time>.json``: ``camera``, 16 numbers, row major, that map the kinect frame (see
``kinect_csv``) to the scan's (metres, z up); ``skeletons``, ascending by ``timestamp`` in ticks of 100 ns
(Recording.cpp), each with ``trackingId``, ``jointPositions`` 25 x 3 in the kinect frame and ``jointConfidences`` 25.
Orientations, hands, activities and lean have no place in the schema and are not read; nor are scans (.ply), grids, and
videos.

``jointConfidences`` are the SDK's tracking states: 0 missing, 1 inferred, 2 tracked; a file whose largest is 1 has them
halved. No position of ours was checked on a real recording: the layout is that of the source's reader.

The episode frame comes from the camera's pose, so that tilt and roll are the file's. The floor is taken to lie where
the lower of two tracked feet is in the median frame: people who stand, walk and sit have one on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.datasets.importers.kinect_bodies import KINECT_T_CAMERA, KinectBodies, checked_joints, track_numbers
from hsbench.datasets.importers.kinect_csv import JOINT_COUNT, MAX_TICKS, TICK_NS, TRACKED
from hsbench.datasets.importers.upright import below_camera
from hsbench.errors import DataError
from hsbench.geometry import transforms
from hsbench.typing import FloatArray

MAX_BYTES = 2**27
MAX_SKELETONS = 216_000  # two hours of one person at 30 Hz
MAX_ID = 2**64 - 1
MAX_VALUE = 1_000.0  # of a position in metres, or a camera's entry: far beyond a scanned room
POSE_TOLERANCE = 1e-3  # stored as float32, and estimated by registration
MIN_FEET_FRAMES = 10

_FEET = [15, 19]


@dataclass(frozen=True, eq=False)
class PigraphsRecording:
    """``bodies`` in the kinect frame, from time 0 on, and the sensor's pose ``scan_T_kinect`` (4, 4) in the scan."""

    recording_id: str
    bodies: KinectBodies
    scan_T_kinect: FloatArray


def read_pigraphs(path: str | Path) -> PigraphsRecording:
    """Path of a recording -> its bodies and its sensor's pose.

    Raises DataError, naming the file and the skeleton, for damage, a pose that is not rigid, and no skeletons.
    """
    root = pose_json.load(Path(path), MAX_BYTES)
    whole_file = f"{path}: the file"
    recording_id = pose_json.text(pose_json.field(root, "id", whole_file), f"{path}: id")
    camera = pose_json.numbers(pose_json.field(root, "camera", whole_file), f"{path}: camera", 16, MAX_VALUE)
    found = pose_json.items(pose_json.field(root, "skeletons", whole_file), f"{path}: skeletons", MAX_SKELETONS)
    if not found:
        raise DataError(f"{path}: skeletons is empty; expected somebody")
    ticks, identities, rows = [], [], []
    for index, item in enumerate(found):
        at = f"{path}: skeletons[{index}]"
        ticks.append(pose_json.whole(pose_json.field(item, "timestamp", at), f"{at}.timestamp", 0, MAX_TICKS))
        identities.append(pose_json.whole(pose_json.field(item, "trackingId", at), f"{at}.trackingId", 0, MAX_ID))
        rows.append(_joints(item, at))
        if index and ticks[-1] < ticks[-2]:
            raise DataError(f"{at}: time goes from {ticks[-2]} to {ticks[-1]}; expected ascending ticks of 100 ns")
    times = np.array(ticks, dtype=np.int64) - ticks[0]
    tracks = track_numbers(identities)
    order = np.lexsort((tracks, times))
    values = _scaled_states(np.stack(rows)[order])
    checked = [checked_joints(f"{path}: skeletons[{i}]", v[:, :3], v[:, 3]) for i, v in zip(order, values, strict=True)]
    times, tracks = times[order] * TICK_NS, tracks[order]
    same = (np.diff(times) == 0) & (np.diff(tracks) == 0)
    if same.any():
        raise DataError(f"{path}: skeletons[{order[int(np.argmax(same)) + 1]}] repeats a trackingId at one time")
    bodies = KinectBodies(
        timestamp_ns=times,
        track_id=tracks,
        joints_kinect_m=np.stack([joints for joints, _ in checked]),
        state=np.stack([state for _, state in checked]),
        end_ns=int(times[-1]),
    )
    return PigraphsRecording(recording_id, bodies, _rigid_pose(path, camera.reshape(4, 4)))


def floor_level(recording: PigraphsRecording) -> float:
    """Height (z) of the floor in the scan, by the method in this module's docstring.

    Raises DataError if too few rows have both feet tracked.
    """
    both = (recording.bodies.state[:, _FEET] == TRACKED).all(axis=1)
    if both.sum() < MIN_FEET_FRAMES:
        raise DataError(
            f"recording {recording.recording_id} has {int(both.sum())} rows with both feet tracked; expected at least"
            f" {MIN_FEET_FRAMES} to find the floor (give its z in the scan instead)"
        )
    feet_scan = transforms.apply(recording.scan_T_kinect, recording.bodies.joints_kinect_m[both][:, _FEET])
    return float(np.median(feet_scan[..., 2].min(axis=1)))


def to_episode_frame(recording: PigraphsRecording, floor_m: float) -> tuple[FloatArray, FloatArray]:
    """A recording and z of the floor in its scan -> (``episode_T_kinect`` (4, 4), ``episode_T_camera`` (4, 4)).

    Raises DataError if the sensor looks straight up or down, where no heading exists.
    """
    episode_T_kinect = below_camera(recording.scan_T_kinect, floor_m) @ recording.scan_T_kinect
    return episode_T_kinect, episode_T_kinect @ KINECT_T_CAMERA


def _joints(item: Any, at: str) -> FloatArray:
    """(25, 4) x y z and confidence of a skeleton."""
    positions = pose_json.items(pose_json.field(item, "jointPositions", at), f"{at}.jointPositions", JOINT_COUNT)
    if len(positions) != JOINT_COUNT:
        raise DataError(f"{at}.jointPositions has {len(positions)} joints; expected {JOINT_COUNT}")
    xyz = [pose_json.numbers(p, f"{at}.jointPositions[{j}]", 3, MAX_VALUE) for j, p in enumerate(positions)]
    found = pose_json.field(item, "jointConfidences", at)
    confidence = pose_json.numbers(found, f"{at}.jointConfidences", JOINT_COUNT, TRACKED)
    return np.concatenate([np.stack(xyz), confidence[:, None]], axis=1)


def _scaled_states(values: FloatArray) -> FloatArray:
    """(R, 25, 4) with confidences as tracking states: doubled if none exceeds 1."""
    doubled = 2.0 if values[..., 3].max() <= 1.0 else 1.0
    return values * np.array([1.0, 1.0, 1.0, doubled])


def _rigid_pose(path: str | Path, matrix: FloatArray) -> FloatArray:
    """The rigid pose nearest to a stored one, which is one up to rounding."""
    if not transforms.is_rigid(matrix, POSE_TOLERANCE):
        hint = "stored column major?" if transforms.is_rigid(matrix.T, POSE_TOLERANCE) else "a different format?"
        raise DataError(f"{path}: camera {matrix.round(3).tolist()} is not rigid; expected camera to scan ({hint})")
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    return transforms.rigid(u @ vt, matrix[:3, 3])
