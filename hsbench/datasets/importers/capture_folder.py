"""Captures of one's own as episodes: a documented folder for RGB-D, 360 and time-lapse recordings of human activity.

The layouts are ours: no public layout is known of the captured data sets of the method's source (S. Fowler, 2019).

    capture.json      what the pictures do not say; its keys depend on the kind, as the classes below
    rgb/              PNG or JPEG pictures in the order of their names
    depth/            rgbd: a 16-bit PNG for each picture, of the same stem, millimetres, 0 = none, on the same pixels
    poses.csv         rgbd, optional: one person as Kinect v2 joints (docs/formats/kinect-csv.md)
    openpose/         360 and timelapse, optional: OpenPose's JSON, its frame numbers counting from 0

Assumed: the camera stands still; pictures are not mirrored and not distorted; a panorama is upright and full.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from hsbench.datasets.importers import kinect_csv, openpose
from hsbench.datasets.importers.bounded_images import read_grey16
from hsbench.datasets.importers.footage import Footage, bounded_rgb, footage_episodes, openpose_poses, read_footage
from hsbench.datasets.importers.footage_views import median_background, steady_views
from hsbench.datasets.importers.kinect_bodies import KINECT_T_CAMERA
from hsbench.datasets.importers.openpose import read_openpose
from hsbench.errors import DataError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, world_T_camera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.image_frames import FileFrames
from hsbench.io.plain import from_plain
from hsbench.io.strict_json import read_json
from hsbench.schema.episode import NS_PER_S, Episode, EpisodeTruth
from hsbench.schema.poses import PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import KINECT_V2
from hsbench.typing import UInt8Array

DESCRIPTION, PICTURES, DEPTH, KINECT, OPENPOSE = "capture.json", "rgb", "depth", "poses.csv", "openpose"
ROOM_DEPTH_M = (0.2, 20.0)
"""Where the median of the depth of a room lies; beyond, the unit is another."""

ASSUMED = {
    "rgbd": "colour and depth lie on the same pixels and share a clock with the poses; height, tilt and roll are right",
    "360": "panoramas are full and upright, and straight ahead is in their middle column",
    "timelapse": "nobody knows where the camera is",
}

T = TypeVar("T")


@dataclass(frozen=True)
class RgbdCapture:
    """``capture.json`` of kind rgbd. rate_hz: pictures a second, null where names or EXIF data tell the times. camera:
    of the pictures, colour and depth alike. tilt_deg: positive looks down. poses_start_s: when ``poses.csv`` begins.
    """

    rate_hz: float | None
    camera: PinholeCamera
    height_m: float
    tilt_deg: float
    roll_deg: float
    poses_start_s: float


@dataclass(frozen=True)
class PanoramaCapture:
    """``capture.json`` of kind 360. height_m: of the camera, kept as truth; null where it is not known. poses_rate_hz:
    the rate that OpenPose's frame numbers count at; null: they count the pictures.
    """

    rate_hz: float | None
    height_m: float | None
    poses_rate_hz: float | None


@dataclass(frozen=True)
class TimelapseCapture:
    """``capture.json`` of kind timelapse. focal_px: null where it is not known."""

    rate_hz: float | None
    focal_px: float | None


def capture_episodes(kind: str, folder: Path, name: str) -> tuple[list[Episode], tuple[str, ...]]:
    """(episodes, notes) of a folder of kind ``rgbd``, ``360`` or ``timelapse``.

    One episode; a time-lapse whose camera was moved gives several. Raises DataError, naming the file, for what is
    missing, damaged or not as assumed.
    """
    if kind not in KINDS:
        raise DataError(f"kind {kind!r} is unknown; expected one of {', '.join(KINDS)}")
    if not folder.is_dir():
        raise DataError(f"{folder} is no folder; expected a capture of kind {kind} (docs/formats/capture.md)")
    episodes, notes = KINDS[kind](folder, name)
    return episodes, (*notes, f"assumed: {ASSUMED[kind]}; pictures are not mirrored and not distorted")


def _rgbd(folder: Path, name: str) -> tuple[list[Episode], tuple[str, ...]]:
    told = _description(RgbdCapture, folder)
    height_px, width_px = told.camera.height_px, told.camera.width_px
    footage = _pictures(folder, told.rate_hz)
    frames = footage.frames
    assert isinstance(frames, FileFrames)
    by_stem = {path.stem: path for path in sorted((folder / DEPTH).glob("*.png"))}
    stems = [path.stem for path in frames.rgb if path is not None]
    unpaired = sorted(set(stems) ^ set(by_stem))
    if unpaired:
        raise DataError(f"{folder}: {len(unpaired)} pictures lack their other half, such as {unpaired[0]}; expected"
                        f" {DEPTH}/<name>.png for each picture of {PICTURES}")  # fmt: skip
    medians = []
    for path in by_stem.values():
        depth = read_grey16(path)
        if depth.shape != (height_px, width_px):
            raise DataError(f"{path}: {depth.shape[1]} x {depth.shape[0]} px; expected {width_px} x {height_px}")
        if depth.any():
            medians.append(float(np.median(depth[depth > 0])) / 1000)
    if not medians or not ROOM_DEPTH_M[0] <= np.median(medians) <= ROOM_DEPTH_M[1]:
        seen = f"{np.median(medians):.3g} m at the median" if medians else "nowhere a reading"
        raise DataError(f"{folder / DEPTH}: {seen}; expected a room in millimetres (another unit?)")
    _check_still(footage, (height_px, width_px))
    sensor = Sensor("rgbd", told.camera, told.height_m, math.radians(told.tilt_deg), math.radians(told.roll_deg))
    poses = _kinect(folder / KINECT, sensor, told.poses_start_s) if (folder / KINECT).is_file() else None
    stamps = frames.timestamps_ns
    ends = [int(stamps[-1]), *([] if poses is None else [int(poses.timestamp_ns[-1])])]
    paired = FileFrames(stamps, frames.rgb, tuple(by_stem[stem] for stem in stems))
    return [Episode(name, "capture-rgbd", sensor, paired, poses, 0, max(ends))], footage.notes


def _panorama(folder: Path, name: str) -> tuple[list[Episode], tuple[str, ...]]:
    told = _description(PanoramaCapture, folder)
    footage = _pictures(folder, told.rate_hz)
    frames = footage.frames
    assert isinstance(frames, FileFrames)
    first = next(path for path in frames.rgb if path is not None)
    height_px, width_px = bounded_rgb(first).shape[:2]
    if width_px != 2 * height_px:
        raise DataError(f"{first}: {width_px} x {height_px} px; expected a panorama twice as wide as high")
    _check_still(footage, (height_px, width_px))
    camera = EquirectangularCamera(width_px, height_px)
    poses = None
    if (folder / OPENPOSE).is_dir():
        found = read_openpose(folder / OPENPOSE)
        scale = openpose.find_scale(found.keypoints)
        if told.poses_rate_hz is None:
            poses = openpose_poses(footage, found, scale)
        else:
            times = openpose.frame_times(found.frame, told.poses_rate_hz)
            pixels = openpose.to_pixels(found.keypoints, scale, width_px, height_px)
            states = openpose.joint_states(found.keypoints[..., 2])
            poses = PoseTable(found.skeleton.name, times, found.track_id, states, joints_px=pixels)
    truth = None
    if told.height_m is not None:
        truth = EpisodeTruth(sensor=Sensor("equirectangular", camera, told.height_m))
    kept = FileFrames(frames.timestamps_ns, frames.rgb, frames.depth, median_background(frames))
    ends = [int(frames.timestamps_ns[-1]), *([] if poses is None else [int(poses.timestamp_ns[-1])])]
    sensor = Sensor("equirectangular", camera, None)
    return [Episode(name, "capture-360", sensor, kept, poses, 0, max(ends), truth=truth)], footage.notes


def _timelapse(folder: Path, name: str) -> tuple[list[Episode], tuple[str, ...]]:
    told = _description(TimelapseCapture, folder)
    footage = _pictures(folder, told.rate_hz)
    poses = None
    if (folder / OPENPOSE).is_dir():
        found = read_openpose(folder / OPENPOSE)
        poses = openpose_poses(footage, found, openpose.find_scale(found.keypoints))
    return footage_episodes(footage, name, poses=poses, focal_px=told.focal_px, dataset="capture-timelapse")


KINDS = {"rgbd": _rgbd, "360": _panorama, "timelapse": _timelapse}


def _description(kind: type[T], folder: Path) -> T:
    path = folder / DESCRIPTION
    found = from_plain(kind, read_json(path), str(path))
    rates = [getattr(found, key) for key in ("rate_hz", "poses_rate_hz") if getattr(found, key, None) is not None]
    for rate_hz in rates:
        if not 0 < rate_hz < NS_PER_S:
            raise DataError(f"{path}: a rate is {rate_hz:g}; expected pictures a second, or null")
    return found


def _pictures(folder: Path, rate_hz: float | None) -> Footage:
    if not (folder / PICTURES).is_dir():
        raise DataError(f"{folder} has no folder {PICTURES}; expected the pictures there")
    return read_footage(folder / PICTURES, rate_hz)


def _check_still(footage: Footage, size: tuple[int, int]) -> None:
    """Raise DataError for an unreadable picture, another size, and a camera that moved."""
    frames = footage.frames
    assert isinstance(frames, FileFrames)
    views = steady_views(_colour(path, size) for path in frames.rgb if path is not None)
    if len(views) > 1:
        raise DataError(
            f"{footage.path}: the camera moved at {footage.name(int(views[1][0]))}; expected a folder a view"
        )


def _colour(path: Path, size: tuple[int, int]) -> UInt8Array:
    rgb = bounded_rgb(path)
    if rgb.shape[:2] != size:
        raise DataError(f"{path}: {rgb.shape[1]} x {rgb.shape[0]} px; expected {size[1]} x {size[0]}")
    return rgb


def _kinect(path: Path, sensor: Sensor, start_s: float) -> PoseTable:
    """One person's joints in the episode frame, from ``start_s`` on."""
    if not 0 <= start_s < openpose.MAX_DURATION_S:
        raise DataError(f"{path.parent / DESCRIPTION}: poses_start_s is {start_s:g}; expected seconds, 0 or more")
    recording = kinect_csv.read_kinect_csv(path)
    assert sensor.height_m is not None
    episode_T_kinect = world_T_camera(sensor.height_m, sensor.tilt_rad, sensor.roll_rad) @ invert(KINECT_T_CAMERA)
    joints = apply(episode_T_kinect, recording.joints_kinect_m).astype(np.float32)
    stamps = recording.timestamp_ns - recording.timestamp_ns[0] + round(start_s * NS_PER_S)
    return PoseTable(KINECT_V2.name, stamps, np.ones(len(stamps), dtype=np.int32), recording.state, joints)
