"""What the exports share: a frame as plain pictures, the poses of its very time, and names of splits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.atomic import atomic_folder
from hsbench.io.dataset_index import require_outside
from hsbench.io.images import depth_to_mm
from hsbench.schema.episode import Episode
from hsbench.schema.poses import JointState, PoseTable
from hsbench.typing import AnyArray, FloatArray

UNSPLIT = "unsplit"
"""What exports call the split of data that have none, as imports."""


@contextmanager
def export_folder(out: Path) -> Iterator[Path]:
    """Yield a folder to fill, which becomes ``out`` at the end, whole.

    Raises DataError if ``out`` exists or lies inside of a data set.
    """
    require_outside(out)
    with atomic_folder(out) as folder:
        yield folder


def split_of(row: dict[str, Any]) -> str:
    """The split of a row of the index, as exports name it."""
    return str(row["split"]) or UNSPLIT


def pictures(episode: Episode, index: int) -> dict[str, AnyArray]:
    """The pictures of a frame by name; what a frame has not is left out.

    Input: ``rgb`` (h, w, 3) uint8, ``depth`` (h, w) uint16 millimetres, 0 = none. With truth also ``clean_depth``
    likewise, ``instance`` (h, w) uint16 and ``semantic`` (h, w) uint8.
    """
    frame = episode.frames[index]
    found: dict[str, AnyArray | None] = {"rgb": frame.rgb, "depth": _millimetres(frame.depth_m)}
    if episode.truth is not None and episode.truth.frames is not None:
        truth = episode.truth.frames[index]
        found |= {
            "clean_depth": _millimetres(truth.depth_m),
            "instance": truth.instance,
            "semantic": truth.semantic,
        }
    return {name: picture for name, picture in found.items() if picture is not None}


def rows_at(poses: PoseTable | None, timestamp_ns: int) -> range:
    """The rows of the poses of exactly this time."""
    if poses is None:
        return range(0)
    first, last = (int(np.searchsorted(poses.timestamp_ns, timestamp_ns, side)) for side in ("left", "right"))
    return range(first, last)


def joint_pixels(episode: Episode, poses: PoseTable, rows: range) -> FloatArray:
    """(len(rows), J, 2) where joints lie in the picture: as observed, or projected from 3D. NaN where missing, behind
    the camera, or where the height of the sensor is not known.
    """
    if poses.joints_px is not None:
        return poses.joints_px[rows.start : rows.stop].astype(np.float64)
    assert poses.joints_m is not None  # one of them is there
    points = poses.joints_m[rows.start : rows.stop].astype(np.float64)
    sensor = episode.placed_sensor
    if isinstance(sensor.camera, TopDownCamera):
        return sensor.camera.project(points)[0]
    if sensor.height_m is None:
        return np.full((*points.shape[:2], 2), np.nan)
    return sensor.camera.project(apply(invert(sensor.world_T_camera), points))[0]


def pose_json(poses: PoseTable, row: int) -> dict[str, Any]:
    """One pose as JSON values; the coordinates of missing joints are null."""
    missing = poses.joint_state[row] == JointState.MISSING
    plain: dict[str, Any] = {
        "track_id": int(poses.track_id[row]),
        "skeleton": poses.skeleton,
        "joint_state": poses.joint_state[row].tolist(),
    }
    for name, joints in (("joints_m", poses.joints_m), ("joints_px", poses.joints_px)):
        if joints is not None:
            plain[name] = [
                None if gone else point for gone, point in zip(missing.tolist(), joints[row].tolist(), strict=True)
            ]
    return plain


def require_content(count: int, what: str, data: object) -> None:
    """Raise DataError where an export would be empty."""
    if not count:
        raise DataError(f"{data} has no {what} to export (generated with --frames none, or is the split empty?)")


def _millimetres(depth_m: AnyArray | None) -> AnyArray | None:
    return None if depth_m is None else depth_to_mm(depth_m)
