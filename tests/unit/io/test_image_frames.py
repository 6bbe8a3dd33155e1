"""Imported pictures: files come back byte for byte, videos frame by frame in any order and in other processes."""

from __future__ import annotations

import multiprocessing
import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest

from hsbench.errors import DataError
from hsbench.io.image_frames import (
    FileFrames,
    ImageFrames,
    VideoDecoder,
    VideoFrames,
    open_video,
    write_frames,
)
from hsbench.io.images import encode_jpeg, read_rgb, write_png
from hsbench.schema.episode import Frame, FrameList, Frames
from hsbench.typing import UInt8Array

COUNT, HEIGHT, WIDTH = 200, 48, 64


def numbered(number: int) -> UInt8Array:
    """A picture whose blocks spell its number in bits, so that compression cannot hide which it is."""
    bits = (number >> np.arange(8)) & 1
    return np.broadcast_to(np.repeat(bits * 200 + 20, WIDTH // 8)[None, :, None], (HEIGHT, WIDTH, 3)).astype(np.uint8)


def number_of(rgb: UInt8Array) -> int:
    middle = rgb[HEIGHT // 2, WIDTH // 16 :: WIDTH // 8, 1] > 120
    return int((middle << np.arange(8)).sum())


def write_video(path: Path, pictures: list[UInt8Array], rate_hz: float = 10.0) -> Path:
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), rate_hz, (width, height))
    assert writer.isOpened()
    for picture in pictures:
        writer.write(np.ascontiguousarray(picture[..., ::-1]))
    writer.release()
    return path


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_video(tmp_path_factory.mktemp("video") / "film.mp4", [numbered(n) for n in range(COUNT)])


def of_video(path: Path, kept: bool = False) -> VideoFrames:
    numbers = np.arange(3, COUNT, 2, dtype=np.int64)
    return VideoFrames(path, numbers, numbers * 100, kept=kept)


def stored(folder: Path, frames: Frames) -> ImageFrames:
    folder.mkdir()
    write_frames(folder, frames)
    return ImageFrames(folder)


def test_video_frames_come_in_any_order(video: Path) -> None:
    frames = of_video(video)
    rng = np.random.default_rng(0)
    for index in [0, 0, 1, 96, 97, 2, -1, *rng.integers(0, len(frames), 30).tolist()]:
        frame = frames[index]
        assert number_of(frame.rgb) == frames.numbers[index]
        assert frame.timestamp_ns == frames.numbers[index] * 100
    with pytest.raises(IndexError):
        frames[len(frames)]


@pytest.mark.parametrize("kept", [False, True])
def test_video_is_stored_as_pictures_or_as_it_is(tmp_path: Path, video: Path, kept: bool) -> None:
    source = of_video(video, kept)
    frames = stored(tmp_path / "frames", source)
    names = sorted(path.name for path in (tmp_path / "frames").iterdir())
    assert names == (
        ["frames.parquet", "video.mp4"]
        if kept
        else sorted(["frames.parquet", *(f"{n:06d}_rgb.jpg" for n in range(len(source)))])
    )
    assert [number_of(frames[i].rgb) for i in range(len(frames))] == source.numbers.tolist()
    assert frames.timestamps_ns.tolist() == source.timestamps_ns.tolist()
    if kept:
        assert (tmp_path / "frames" / "video.mp4").read_bytes() == video.read_bytes()
        assert number_of(pickle.loads(pickle.dumps(frames))[40].rgb) == 83


def _decode(frames: Frames, index: int, answers: multiprocessing.SimpleQueue[int]) -> None:
    rgb = frames[index].rgb
    assert rgb is not None
    answers.put(number_of(rgb))


def test_a_forked_process_decodes_by_itself(video: Path) -> None:
    frames = of_video(video)
    assert number_of(frames[5].rgb) == 13
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    child = context.Process(target=_decode, args=(frames, 30, answers), daemon=True)
    child.start()
    child.join(30)
    assert child.exitcode == 0
    assert answers.get() == 63
    assert number_of(frames[6].rgb) == 15


def test_files_are_copied_and_others_become_png(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    rgb = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
    depth = rng.integers(0, 9000, (12, 16), dtype=np.uint16)
    paths = [tmp_path / name for name in ("a.JPEG", "b.png", "c.bmp")]
    paths[0].write_bytes(encode_jpeg(rgb))
    for path in paths[1:]:
        write_png(path, rgb)
    write_png(tmp_path / "depth.png", depth)
    source = FileFrames(
        np.array([0, 5, 7, 9]), (*paths, None), (None, tmp_path / "depth.png", None, tmp_path / "depth.png"), rgb
    )
    frames = stored(tmp_path / "frames", source)
    assert (tmp_path / "frames" / "000000_rgb.jpg").read_bytes() == paths[0].read_bytes()
    assert (tmp_path / "frames" / "000001_rgb.png").read_bytes() == paths[1].read_bytes()
    assert np.array_equal(read_rgb(tmp_path / "frames" / "000002_rgb.png"), rgb)
    assert np.array_equal(frames.background, rgb)
    assert frames.timestamps_ns.tolist() == [0, 5, 7, 9]
    for ours, theirs in zip(frames, source, strict=True):
        for a, b in ((ours.rgb, theirs.rgb), (ours.depth_m, theirs.depth_m)):
            assert np.array_equal(a, b) if b is not None else a is None
    assert np.array_equal(np.rint(frames[1].depth_m * 1000), depth)


def test_frames_in_memory_come_back_exactly(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    rgb = rng.integers(0, 256, (6, 7, 3), dtype=np.uint8)
    depth_m = (rng.integers(0, 9000, (6, 7)) / 1000).astype(np.float32)
    source = FrameList((Frame(3, rgb, depth_m), Frame(9, None, depth_m), Frame(12, rgb, None)))
    frames = stored(tmp_path / "frames", source)
    assert frames.timestamps_ns.tolist() == [3, 9, 12]
    assert [(f.rgb is None, f.depth_m is None) for f in frames] == [(False, False), (True, False), (False, True)]
    assert np.array_equal(frames[-3].rgb, rgb)
    assert np.array_equal(frames[1].depth_m, depth_m)
    assert frames.background is None


def test_damage_is_refused_in_one_line(tmp_path: Path, video: Path) -> None:
    with pytest.raises(DataError, match=r"none\.mp4 is missing"):
        open_video(tmp_path / "none.mp4")
    with pytest.raises(DataError, match=r"film\.txt: expected a video that ends in"):
        open_video(_with(tmp_path / "film.txt", b"x"))
    for data in (b"", b"no video at all", video.read_bytes()[:200]):
        with pytest.raises(DataError, match=r"cut\.mp4 is no readable video"):
            open_video(_with(tmp_path / "cut.mp4", data))
    decoder = VideoDecoder(video)
    with pytest.raises(DataError, match=rf"film\.mp4 frame {COUNT} cannot be decoded"):
        decoder.frame(COUNT)
    assert number_of(decoder.frame(7)) == 7
    frames = stored(tmp_path / "frames", of_video(video, kept=True))
    table = tmp_path / "frames" / "frames.parquet"
    table.write_bytes(table.read_bytes()[:-9])
    with pytest.raises(DataError, match=r"frames\.parquet cannot be read"):
        len(frames)
    write_frames(tmp_path / "frames", of_video(video, kept=True))
    (tmp_path / "frames" / "video.avi").touch()
    with pytest.raises(DataError, match=r"2 files video\.\*; expected one"):
        ImageFrames(tmp_path / "frames")[0]


def _with(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path
