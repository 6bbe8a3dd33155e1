"""Footage of a fixed camera as time-lapse episodes: a video file, or a folder of pictures.

Every steady view becomes an episode (``footage_views``), all on the clock of the footage, whose first picture is at 0.
The median background of each is kept beside its frames. People found by OpenPose or in COCO's JSON may come along.
What is left out (unreadable pictures, pictures taken while the camera moved) is counted and named.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from hsbench.datasets.importers import coco_keypoints, openpose
from hsbench.datasets.importers.bounded_images import read_colour
from hsbench.datasets.importers.footage_times import natural_key, picture_times
from hsbench.datasets.importers.footage_views import median_background, steady_views
from hsbench.datasets.importers.pose_captures import FOCAL_PER_SIDE
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.io.decoding import heard
from hsbench.io.image_frames import VIDEO_ENDINGS, FileFrames, VideoFrames, open_video
from hsbench.io.images import read_rgb
from hsbench.schema.episode import NS_PER_S, Episode
from hsbench.schema.poses import PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import COCO_17
from hsbench.typing import IntArray, UInt8Array

DATASET = "footage"
PICTURE_ENDINGS = (".jpeg", ".jpg", ".png")
MAX_PICTURES = 1_000_000  # two months at a picture in five seconds
MIN_READABLE = 0.5
SHOWN = 8  # names or numbers in one note


@dataclass(frozen=True, eq=False)
class Footage:
    """The pictures of one camera, in order of time; notes: what its user should hear, a line each."""

    path: Path
    frames: FileFrames | VideoFrames
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.frames)

    def name(self, index: int) -> str:
        """What a picture is called in messages: its file, or its number in the video."""
        if isinstance(self.frames, VideoFrames):
            return str(self.frames.numbers[index])
        file = self.frames.rgb[index]
        return "" if file is None else file.name


def read_footage(path: Path, rate_hz: float | None = None) -> Footage:
    """A video file, or a folder of pictures; nothing is decoded for good yet.

    rate_hz: pictures a second, in place of a video's own times or of those that names or EXIF data of pictures tell.
    Raises DataError, naming the file, where there is nothing to read or no time to tell.
    """
    return _folder(path, rate_hz) if path.is_dir() else _video(path, rate_hz)


def footage_episodes(
    footage: Footage,
    name: str,
    *,
    poses: PoseTable | None = None,
    split: bool = True,
    kept: bool = False,
    focal_px: float | None = None,
    dataset: str = DATASET,
) -> tuple[list[Episode], tuple[str, ...]]:
    """(an episode for each steady view, named ``name``, or ``name-00``, ``name-01`` ... of several; notes).

    poses: of the whole footage. split: False takes everything for one view. kept: store a video as it is. focal_px:
    default 1.2 times the longer side. dataset: its name. Raises DataError where most pictures are unreadable, and,
    without splitting, for pictures of different sizes.
    """
    unreadable: dict[int, str] = {}
    sizes: dict[int, tuple[int, int]] = {}
    views = steady_views(_pictures(footage, unreadable, sizes))
    notes = list(footage.notes)
    if len(sizes) < MIN_READABLE * len(footage) or not sizes:
        fault = next(iter(unreadable.values()), f"{footage.path} holds no picture")
        raise DataError(f"{len(unreadable)} of {len(footage)} pictures are unreadable, such as: {fault}")
    if unreadable:
        notes.append(f"{len(unreadable)} pictures are unreadable and left out: {_shown(footage, list(unreadable))}")
    if not split:
        if len(set(sizes.values())) > 1:
            raise DataError(f"{footage.path}: pictures of {len(set(sizes.values()))} sizes; expected one view")
        views = [np.array(sorted(sizes), dtype=np.int64)]
    between = sorted(set(sizes).difference(*(view.tolist() for view in views)))
    if between:
        notes.append(f"{len(between)} pictures between two views are left out: {_shown(footage, between)}")
    starts = footage.frames.timestamps_ns[[view[0] for view in views]]
    if len(views) > 1:
        moved = ", ".join(f"{start / NS_PER_S:.1f}" for start in starts[1 : SHOWN + 1])
        notes.append(
            f"{len(views)} views, so {len(views)} episodes: the camera moved, or the film was cut, at {moved} s"
        )
    names = [name] if len(views) == 1 else [f"{name}-{k:02d}" for k in range(len(views))]
    episodes = [
        _episode(_chosen(footage.frames, view, kept), sizes[int(view[0])], episode_id, dataset, poses, focal_px)
        for view, episode_id in zip(views, names, strict=True)
    ]
    if poses is not None:
        lost = len(poses) - sum(0 if e.poses is None else len(e.poses) for e in episodes)
        if lost:
            notes.append(f"{lost} poses belong to pictures that are left out, and are left out too")
    return episodes, tuple(notes)


def bounded_rgb(path: Path) -> UInt8Array:
    """(h, w, 3) uint8 rgb as episodes read it, turned as EXIF says. Raises DataError, for a huge one undecoded."""
    read_colour(path)
    return read_rgb(path)


def openpose_poses(footage: Footage, recording: openpose.OpenPoseRecording, scale: str) -> PoseTable:
    """OpenPose's people at the times of their pictures; its frame numbers count the pictures of the footage from 0.

    Raises DataError for numbers that the footage lacks.
    """
    place_of = {int(number): place for place, number in enumerate(_numbers(footage))}
    missing = sorted({int(n) for n in recording.frame} - place_of.keys())
    if missing:
        raise DataError(
            f"OpenPose's frame {missing[0]} is none of the {len(footage)} pictures of {footage.path}"
            f" ({len(missing)} such; expected numbers from 0 to {max(place_of)})"
        )
    times = footage.frames.timestamps_ns[[place_of[int(n)] for n in recording.frame]]
    pixels = openpose.to_pixels(recording.keypoints, scale, *_size(footage))
    states = openpose.joint_states(recording.keypoints[..., 2])
    return PoseTable(recording.skeleton.name, times, recording.track_id, states, joints_px=pixels)


def coco_poses(footage: Footage, keypoints: coco_keypoints.CocoKeypoints) -> PoseTable:
    """People of COCO's JSON at the times of the pictures of the same file names.

    Raises DataError for a video, whose frames have no names, for names that the folder lacks, and for other sizes.
    """
    if isinstance(footage.frames, VideoFrames):
        raise DataError(f"{footage.path} is a video; expected a folder, whose pictures have the names that COCO gives")
    place_of = {footage.name(index): index for index in range(len(footage))}
    places = []
    for image in (keypoints.images[index] for index in keypoints.image):
        name = Path(image.file_name).name
        if name not in place_of:
            raise DataError(f"{footage.path} holds no {name}; expected every picture with somebody that COCO lists")
        places.append(place_of[name])
    order = np.lexsort((keypoints.track_id, np.array(places)))
    times = footage.frames.timestamps_ns[np.array(places)[order]]
    return PoseTable(
        COCO_17.name, times, keypoints.track_id[order], keypoints.state[order], joints_px=keypoints.joints_px[order]
    )


def _numbers(footage: Footage) -> IntArray:
    frames = footage.frames
    return frames.numbers if isinstance(frames, VideoFrames) else np.arange(len(frames))


def _size(footage: Footage) -> tuple[int, int]:
    """Width and height of the first picture that can be read."""
    for index in range(len(footage)):
        try:
            rgb = footage.frames[index].rgb
        except DataError:
            continue
        if rgb is not None:
            return rgb.shape[1], rgb.shape[0]
    raise DataError(f"{footage.path}: no picture can be read")


def _episode(
    frames: FileFrames | VideoFrames,
    size: tuple[int, int],
    episode_id: str,
    dataset: str,
    poses: PoseTable | None,
    focal_px: float | None,
) -> Episode:
    height_px, width_px = size
    focal = FOCAL_PER_SIDE * max(size) if focal_px is None else focal_px
    camera = PinholeCamera(width_px, height_px, focal, focal, width_px / 2, height_px / 2)
    stamps = frames.timestamps_ns
    own = None if poses is None else poses.select(np.isin(poses.timestamp_ns, stamps))
    frames = replace(frames, background=median_background(frames))
    sensor = Sensor("monocular", camera, None)
    return Episode(episode_id, dataset, sensor, frames, own, int(stamps[0]), int(stamps[-1]))


def _chosen(frames: FileFrames | VideoFrames, view: IntArray, kept: bool) -> FileFrames | VideoFrames:
    if isinstance(frames, VideoFrames):
        return VideoFrames(frames.path, frames.numbers[view], frames.timestamps_ns[view], kept=kept)
    rgb, depth = (tuple(files[i] for i in view) for files in (frames.rgb, frames.depth))
    return FileFrames(frames.timestamps_ns[view], rgb, depth)


def _pictures(
    footage: Footage, unreadable: dict[int, str], sizes: dict[int, tuple[int, int]]
) -> Iterator[UInt8Array | None]:
    """Every picture in order, None where it is unreadable; faults and sizes (height, width) are noted down."""
    for index in range(len(footage)):
        try:
            file = footage.frames.rgb[index] if isinstance(footage.frames, FileFrames) else None
            rgb = footage.frames[index].rgb if file is None else bounded_rgb(file)
        except DataError as error:
            unreadable[index] = str(error)
            yield None
            continue
        assert rgb is not None
        sizes[index] = (rgb.shape[0], rgb.shape[1])
        yield rgb


def _shown(footage: Footage, indices: Sequence[int]) -> str:
    more = f" and {len(indices) - SHOWN} more" if len(indices) > SHOWN else ""
    return ", ".join(footage.name(index) for index in indices[:SHOWN]) + more


def _folder(path: Path, rate_hz: float | None) -> Footage:
    files = sorted((f for f in path.iterdir() if f.suffix.lower() in PICTURE_ENDINGS and f.is_file()), key=natural_key)
    others = sorted(f.name for f in path.iterdir() if f.suffix.lower() in VIDEO_ENDINGS)
    if not files:
        hint = f" (name the video: {others[0]})" if others else ""
        raise DataError(f"{path} holds no picture that ends in {', '.join(PICTURE_ENDINGS)}{hint}")
    if len(files) > MAX_PICTURES:
        raise DataError(f"{path} holds {len(files):,} pictures; expected at most {MAX_PICTURES:,} (split it)")
    order, times, notes = picture_times(files, rate_hz)
    return Footage(path, FileFrames(times, tuple(files[i] for i in order), (None,) * len(files)), tuple(notes))


def _video(path: Path, rate_hz: float | None) -> Footage:
    """The frames that FFmpeg finds, at the times it gives, if they ascend, else at the stated rate."""
    capture = open_video(path)
    stated = capture.get(cv2.CAP_PROP_FRAME_COUNT)
    own_rate_hz = capture.get(cv2.CAP_PROP_FPS)
    times_ms: list[float] = []
    with heard():
        while len(times_ms) <= MAX_PICTURES and capture.grab():
            times_ms.append(capture.get(cv2.CAP_PROP_POS_MSEC))
    if not 0 < len(times_ms) <= MAX_PICTURES:
        raise DataError(f"{path} has {len(times_ms):,} frames or more; expected 1 to {MAX_PICTURES:,} that decode")
    numbers = np.arange(len(times_ms), dtype=np.int64)
    notes = []
    if stated > len(times_ms):
        notes.append(
            f"{stated:.0f} frames are stated, {len(times_ms)} decode; the rest is missing (an incomplete copy?)"
        )
    times = np.round((np.array(times_ms) - times_ms[0]) * (NS_PER_S / 1000)).astype(np.int64)
    if rate_hz is None and not (np.isfinite(times_ms).all() and (np.diff(times) > 0).all()):
        if not 0 < own_rate_hz < NS_PER_S:
            raise DataError(f"{path} has no rising times and no rate; give --rate")
        notes.append(f"its times do not rise; {own_rate_hz:g} frames a second are taken instead")
        rate_hz = own_rate_hz
    if rate_hz is not None:
        times = openpose.frame_times(numbers, rate_hz)
    return Footage(path, VideoFrames(path, numbers, times), tuple(notes))
