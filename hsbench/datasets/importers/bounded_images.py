"""Pictures of captures, decoded only after their header has said how large they are."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.io.decoding import decode_image
from hsbench.io.reading import read_limited
from hsbench.typing import AnyArray, UInt8Array, UInt16Array

MAX_BYTES = 64 << 20
MAX_SIDE_PX = 4096
_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"
_SIZE_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # start of frame, ITU-T T.81 table B.1
_BARE_MARKERS = frozenset({0x01, *range(0xD0, 0xD9)})  # markers without a length: TEM, RST, SOI
_SCAN, _END = 0xDA, 0xD9
_LAST = bytes((0xFF, _END))
TRAILER_BYTES = 4096
"""Within so many bytes of a JPEG's end its last marker must stand: some cameras write something behind it."""


def read_colour(path: Path) -> UInt8Array:
    """(h, w, 3) uint8 rgb of a PNG or JPEG. Raises DataError naming the file, before a huge picture is decoded."""
    data = read_limited(path, MAX_BYTES, "another file?")
    size = _png_size(data) if data.startswith(_PNG) else _jpeg_size(data) if data.startswith(_JPEG) else None
    if size is None:
        raise DataError(f"{path}: is no PNG or JPEG with a size; expected a colour picture (an incomplete copy?)")
    _check_size(path, *size)
    if data.startswith(_JPEG) and _LAST not in data[-TRAILER_BYTES:]:  # a decoder would fill the rest with grey
        raise DataError(f"{path}: JPEG without an end; expected a whole picture (an incomplete copy?)")
    return np.ascontiguousarray(_decoded(path, data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)[..., ::-1])


def read_grey16(path: Path) -> UInt16Array:
    """(h, w) uint16 of a one-channel 16-bit PNG. Raises DataError naming the file for anything else."""
    data = read_limited(path, MAX_BYTES, "another file?")
    size = _png_size(data) if data.startswith(_PNG) else None
    if size is None:
        raise DataError(f"{path}: is no PNG; expected a 16-bit depth PNG (an incomplete copy?)")
    _check_size(path, *size)
    if data[24:26] != b"\x10\x00":
        raise DataError(f"{path}: PNG of {data[24]} bits, colour type {data[25]}; expected 16-bit grey")
    pixels = _decoded(path, data, cv2.IMREAD_UNCHANGED)
    if pixels.dtype != np.uint16 or pixels.ndim != 2:
        raise DataError(f"{path}: damaged PNG; expected 16-bit grey pixels")
    return pixels


def _decoded(path: Path, data: bytes, flags: int) -> AnyArray:
    pixels, complaint = decode_image(data, flags)
    if pixels is None:
        raise DataError(f"{path}: damaged picture; it cannot be decoded{complaint} (an incomplete copy?)")
    return pixels


def _png_size(data: bytes) -> tuple[int, int] | None:
    """(width, height) in the first chunk, None where there is none."""
    if data[12:16] != b"IHDR" or len(data) < 33:
        return None
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    """(width, height) in the frame header, None where the picture starts or ends before one."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker in _SIZE_MARKERS:
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        if marker in (_SCAN, _END):
            return None
        if marker == 0xFF:  # fill byte
            at += 1
        elif marker in _BARE_MARKERS:
            at += 2
        else:
            at += 2 + int(struct.unpack(">H", data[at + 2 : at + 4])[0])
    return None


def _check_size(path: Path, width: int, height: int) -> None:
    if not (0 < width <= MAX_SIDE_PX and 0 < height <= MAX_SIDE_PX):
        raise DataError(f"{path}: picture of {width} x {height} px; expected 1 to {MAX_SIDE_PX} px a side")
