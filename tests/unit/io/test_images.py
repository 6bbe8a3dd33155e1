"""Images: lossless, rgb in memory, millimetres on disk; what is no image is said so."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from hsbench.errors import DataError
from hsbench.io.images import (
    depth_from_mm,
    depth_to_mm,
    encode_jpeg,
    encode_png,
    read_rgb,
    read_uint16,
    write_png,
)


def png_by_hand(rows: bytes, width: int, height: int, bits: int, colour: int) -> bytes:
    """A PNG as its specification says; ``rows`` with their filter bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def test_red_is_first(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png_by_hand(b"\0" + bytes([200, 10, 3, 1, 2, 255]), 2, 1, 8, 2))
    assert read_rgb(path).tolist() == [[[200, 10, 3], [1, 2, 255]]]


def test_sixteen_bits_are_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png_by_hand(b"\0" + struct.pack(">3H", 0, 1000, 65535), 3, 1, 16, 0))
    assert read_uint16(path).tolist() == [[0, 1000, 65535]]


def test_round_trips(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    path = tmp_path / "a.png"
    rgb = rng.integers(0, 256, (7, 11, 3), dtype=np.uint8)
    write_png(path, rgb)
    assert np.array_equal(read_rgb(path), rgb)
    assert np.array_equal(cv2.imdecode(np.frombuffer(encode_png(rgb), np.uint8), cv2.IMREAD_COLOR)[..., ::-1], rgb)
    wide = rng.integers(0, 65536, (7, 11), dtype=np.uint16)
    write_png(path, wide)
    assert np.array_equal(read_uint16(path), wide)
    grey = rng.integers(0, 256, (7, 11), dtype=np.uint8)
    write_png(path, grey)
    assert np.array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), grey)


def test_jpeg_keeps_colours_nearly(tmp_path: Path) -> None:
    rgb = np.broadcast_to(np.array([220, 40, 90], np.uint8), (16, 16, 3))
    (tmp_path / "a.jpg").write_bytes(encode_jpeg(rgb))
    assert np.abs(read_rgb(tmp_path / "a.jpg").astype(int) - rgb).max() <= 6


def test_every_depth_survives_the_way_to_metres_and_back() -> None:
    every = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    metres = depth_from_mm(every)
    assert metres.dtype == np.float32
    assert np.array_equal(depth_to_mm(metres), every)


def test_depth_that_is_none_or_out_of_range_is_zero() -> None:
    depth = np.array([[0.0, np.nan, np.inf, -np.inf, -0.1, 65.5349, 65.5351, 65.536, 1e9, 0.0004, 0.0006]])
    assert depth_to_mm(depth).tolist() == [[0, 0, 0, 0, 0, 65535, 65535, 0, 0, 0, 1]]


def test_what_is_no_image_is_named(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no image")
    write_png(tmp_path / "whole.png", np.zeros((40, 40, 3), np.uint8))
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:40])
    for name in ("none.png", "text.png", "cut.png"):
        for read in (read_rgb, read_uint16):
            with pytest.raises(DataError, match=name):
                read(tmp_path / name)


@pytest.mark.parametrize("image", [np.zeros((4, 5), np.uint8), np.zeros((4, 5, 3), np.uint16)])
def test_eight_bits_or_colour_are_no_depth(tmp_path: Path, image: np.ndarray) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), image)
    with pytest.raises(DataError, match=r"expected one 16-bit channel"):
        read_uint16(tmp_path / "a.png")


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="could not be written"):
        write_png(tmp_path / "none" / "a.png", np.zeros((4, 5), np.uint16))
