"""A short film of an episode: animated WebP, which every browser shows, or MP4."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.io.atomic import write_bytes
from hsbench.typing import UInt8Array

SUFFIXES = (".webp", ".mp4")
WEBP_QUALITY = 80


def write_clip(path: Path, pictures: Iterable[UInt8Array], rate_hz: float) -> None:
    """Write (h, w, 3) rgb pictures of one size, ``rate_hz`` a second, as ``.webp`` or ``.mp4``.

    Raises DataError for another suffix, for no picture, or where OpenCV cannot write the format.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise DataError(f"{path} ends in {suffix or 'nothing'}; expected {' or '.join(SUFFIXES)}")
    even = (_even(picture) for picture in pictures)
    with tempfile.TemporaryDirectory(prefix="hsbench-clip-") as folder:
        staged = Path(folder) / f"clip{suffix}"
        written = _webp(staged, even, rate_hz) if suffix == ".webp" else _mp4(staged, even, rate_hz)
        if not written:
            raise DataError(f"{path}: there is no picture to make a clip of")
        if not staged.is_file() or not staged.stat().st_size:
            raise DataError(f"{path}: this OpenCV ({cv2.__version__}) cannot write {suffix}")
        write_bytes(path, staged.read_bytes())


def _even(picture: UInt8Array) -> UInt8Array:
    """A picture in OpenCV's colour order, its sides even as video codecs want them."""
    height, width = picture.shape[:2]
    return np.ascontiguousarray(picture[: height - height % 2, : width - width % 2, ::-1])


def _webp(path: Path, pictures: Iterator[UInt8Array], rate_hz: float) -> int:
    animation = cv2.Animation()
    animation.frames = list(pictures)
    animation.durations = [round(1000 / rate_hz)] * len(animation.frames)
    if animation.frames:
        cv2.imwriteanimation(os.fspath(path), animation, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])
    return len(animation.frames)


def _mp4(path: Path, pictures: Iterator[UInt8Array], rate_hz: float) -> int:
    count, writer = 0, None
    for picture in pictures:
        if writer is None:
            size = (picture.shape[1], picture.shape[0])
            writer = cv2.VideoWriter(os.fspath(path), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, size)
        writer.write(picture)
        count += 1
    if writer is not None:
        writer.release()
    return count
