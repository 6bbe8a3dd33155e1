"""Pictures of imported captures: ordinary image files or a video, decoded when indexed.

``inputs/frames/`` of an episode holds ``frames.parquet`` (frame, timestamp_ns), ``background.png`` where what stays
when people are gone was estimated, and either

- ``000000_rgb.jpg`` or ``.png`` and ``000000_depth.png`` (uint16 mm, 0 = none) of every frame, each optional, or
- the video as it was captured, ``video.mp4`` or of another ending; ``frames.parquet`` then has a third column,
  video_frame: the number in the file

JPEG and PNG files are copied byte for byte; what else there is becomes PNG, frames of a video that is not kept JPEG.
"""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError
from hsbench.io.decoding import complaint, heard
from hsbench.io.images import depth_from_mm, depth_to_mm, encode_jpeg, read_rgb, read_uint16, write_png
from hsbench.schema.episode import Frame, Frames
from hsbench.typing import AnyArray, IntArray, UInt8Array

TABLE, BACKGROUND, VIDEO_STEM = "frames.parquet", "background.png", "video"
NUMBER = "video_frame"
COPIED = {".jpg": ".jpg", ".jpeg": ".jpg", ".png": ".png"}
"""Endings of files that are stored as they are, and under which ending."""

VIDEO_ENDINGS = (".avi", ".gif", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".webm", ".wmv")
JPEG_QUALITY = 95  # OpenCV's default; the loss is below that of the video it comes from
READ_ON = 64  # frames: so near ahead, decoding on is quicker than seeking to the last key frame
MAX_SIDE_PX = 8192  # 8K
ONE_THREAD = [cv2.CAP_PROP_N_THREADS, 1]  # a forked process that frees a decoder would wait for its threads for ever
ERRORS = "16"  # AV_LOG_ERROR: what FFmpeg finds wrong goes into our own errors


@dataclass(frozen=True, eq=False)
class FileFrames:
    """Image files of a capture, wherever they lie. rgb, depth: a path a frame, or None; depth is uint16 mm.

    background: (h, w, 3) uint8 rgb, what stays when people are gone, if it was estimated.
    """

    timestamps_ns: IntArray
    rgb: tuple[Path | None, ...]
    depth: tuple[Path | None, ...]
    background: UInt8Array | None = None

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        rgb, depth = self.rgb[index], self.depth[index]
        return Frame(
            int(self.timestamps_ns[index]),
            None if rgb is None else read_rgb(rgb),
            None if depth is None else depth_from_mm(read_uint16(depth)),
        )


@dataclass(frozen=True, eq=False)
class VideoFrames:
    """Frames of a video file by their numbers in it, (n,) int64 ascending. background: as of FileFrames.

    kept: an episode keeps the file itself instead of JPEG pictures: smaller and exact, but slow at random.
    """

    path: Path
    numbers: IntArray
    timestamps_ns: IntArray
    background: UInt8Array | None = None
    kept: bool = False

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        return Frame(int(self.timestamps_ns[index]), self._decoder.frame(int(self.numbers[index])))

    @property
    def _decoder(self) -> VideoDecoder:
        """One decoder a process: a forked one shares the place in the file with its parent."""
        known: VideoDecoder | None = self.__dict__.get("_known_decoder")
        if known is None or known.process != os.getpid():
            known = VideoDecoder(self.path)
            self.__dict__["_known_decoder"] = known
        return known

    def __reduce__(self) -> tuple[type[VideoFrames], tuple[Any, ...]]:
        return type(self), (self.path, self.numbers, self.timestamps_ns, self.background, self.kept)


class VideoDecoder:
    """A video file being decoded. Raises DataError where it is missing or none."""

    def __init__(self, path: Path) -> None:
        self.path, self.process, self._next = path, os.getpid(), 0
        self._capture = open_video(path)

    def frame(self, number: int) -> UInt8Array:
        """(h, w, 3) uint8 rgb of a frame by its number. Raises DataError if it cannot be decoded."""
        with heard() as lines:
            if not self._next <= number <= self._next + READ_ON:
                self._capture.set(cv2.CAP_PROP_POS_FRAMES, number)
                self._next = number
            while self._next < number and self._capture.grab():
                self._next += 1
            done, picture = self._capture.read() if self._next == number else (False, None)
        if not done or picture is None:
            self._next = -READ_ON - 1  # where the decoder stands is not known: seek next time
            raise DataError(f"{self.path} frame {number} cannot be decoded{complaint(lines)} (an incomplete copy?)")
        self._next += 1
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def open_video(path: Path) -> cv2.VideoCapture:
    """A video file, opened. Raises DataError if it is missing, no video, or larger than 8,192 pixels a side."""
    if not path.is_file():
        raise DataError(f"{path} is missing or no file; expected a video")
    if path.suffix.lower() not in VIDEO_ENDINGS:
        raise DataError(f"{path}: expected a video that ends in {', '.join(VIDEO_ENDINGS)}")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", ERRORS)
    with heard() as lines:
        capture = cv2.VideoCapture(str(path.resolve()), cv2.CAP_FFMPEG, ONE_THREAD)
    width, height = (capture.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    if not capture.isOpened():
        hint = "an incomplete copy, or a codec that FFmpeg lacks?"
        raise DataError(f"{path} is no readable video{complaint(lines)} ({hint})")
    if not 0 < max(width, height) <= MAX_SIDE_PX:
        raise DataError(f"{path} has pictures of {width:g} x {height:g} px; expected 1 to {MAX_SIDE_PX:,} a side")
    return capture


@dataclass(frozen=True, eq=False)
class ImageFrames:
    """The pictures of an imported episode, in its ``inputs/frames`` folder."""

    folder: Path

    @cached_property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps."""
        return _column(self.folder / TABLE, "timestamp_ns")

    @property
    def background(self) -> UInt8Array | None:
        """(h, w, 3) uint8 rgb: what stays when people are gone; None where nobody estimated it."""
        path = self.folder / BACKGROUND
        return read_rgb(path) if path.exists() else None

    @cached_property
    def _video(self) -> VideoFrames | None:
        files = sorted(self.folder.glob(f"{VIDEO_STEM}.*"))
        if len(files) > 1:
            raise DataError(f"{self.folder} holds {len(files)} files {VIDEO_STEM}.*; expected one at most")
        return VideoFrames(files[0], _column(self.folder / TABLE, NUMBER), self.timestamps_ns) if files else None

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        if self._video is not None:
            return self._video[index]
        found = (self.folder / f"{index:06d}_rgb{ending}" for ending in dict.fromkeys(COPIED.values()))
        rgb = next((path for path in found if path.exists()), None)
        depth = self.folder / f"{index:06d}_depth.png"
        return Frame(
            int(self.timestamps_ns[index]),
            None if rgb is None else read_rgb(rgb),
            depth_from_mm(read_uint16(depth)) if depth.exists() else None,
        )

    def __reduce__(self) -> tuple[type[ImageFrames], tuple[Path]]:
        return type(self), (self.folder,)


def write_frames(folder: Path, frames: Frames) -> None:
    """Write frames into an existing folder, one at a time."""
    background = getattr(frames, "background", None)
    if background is not None:
        write_png(folder / BACKGROUND, background)
    columns: dict[str, AnyArray] = {
        "frame": np.arange(len(frames), dtype=np.int32),
        "timestamp_ns": np.asarray(frames.timestamps_ns, dtype=np.int64),
    }
    if isinstance(frames, VideoFrames) and frames.kept:
        shutil.copyfile(frames.path, folder / f"{VIDEO_STEM}{frames.path.suffix.lower()}")
        columns[NUMBER] = frames.numbers
    else:
        for index in range(len(frames)):
            _write_image(folder, index, frames)
    pq.write_table(pa.table(columns), folder / TABLE)


def _write_image(folder: Path, index: int, frames: Frames) -> None:
    rgb, depth = folder / f"{index:06d}_rgb", folder / f"{index:06d}_depth.png"
    if isinstance(frames, FileFrames):
        _copy(frames.rgb[index], rgb)
        found = frames.depth[index]
        if found is not None:
            write_png(depth, read_uint16(found))
        return
    frame = frames[index]
    if frame.rgb is not None and isinstance(frames, VideoFrames):
        rgb.with_suffix(".jpg").write_bytes(encode_jpeg(frame.rgb, JPEG_QUALITY))
    elif frame.rgb is not None:
        write_png(rgb.with_suffix(".png"), frame.rgb)
    if frame.depth_m is not None:
        write_png(depth, depth_to_mm(frame.depth_m))


def _copy(source: Path | None, target: Path) -> None:
    """Put an image file under another name, as it is if it is JPEG or PNG, else as PNG."""
    if source is None:
        return
    ending = COPIED.get(source.suffix.lower())
    if ending is None:
        write_png(target.with_suffix(".png"), read_rgb(source))
    else:
        shutil.copyfile(source, target.with_suffix(ending))


def _column(path: Path, name: str) -> IntArray:
    """(n,) int64 column of a table. Raises DataError naming the file."""
    try:
        column = pq.read_table(path, columns=[name])[name].combine_chunks()
    except (OSError, KeyError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
    if column.null_count or column.type != pa.int64():
        raise DataError(f"{path} column {name} is {column.type} with {column.null_count} nulls; expected int64")
    return np.array(column.to_numpy(zero_copy_only=False), dtype=np.int64)
