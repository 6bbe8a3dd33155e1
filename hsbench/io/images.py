"""Images to and from disk: PNG, lossless; rgb order in memory; depth as uint16 millimetres on disk, 0 = none."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.io.decoding import decode_image
from hsbench.typing import AnyArray, Float32Array, UInt8Array, UInt16Array

MM_PER_M = 1000.0
MAX_DEPTH_MM = 65535  # uint16


def read_rgb(path: Path) -> UInt8Array:
    """(h, w, 3) uint8 rgb. Raises DataError if the file is no readable colour image."""
    image = _decoded(path, cv2.IMREAD_COLOR)
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def read_uint16(path: Path) -> UInt16Array:
    """(h, w) uint16. Raises DataError for anything but a one-channel 16-bit image."""
    image = _decoded(path, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise DataError(
            f"{path} is {image.dtype} with shape {image.shape}; expected one 16-bit channel (was it saved as 8 bit?)"
        )
    return np.asarray(image, dtype=np.uint16)


def read_uint8(path: Path) -> UInt8Array:
    """(h, w) uint8. Raises DataError for anything but a one-channel 8-bit image."""
    image = _decoded(path, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint8 or image.ndim != 2:
        raise DataError(f"{path} is {image.dtype} with shape {image.shape}; expected one 8-bit channel")
    return np.asarray(image, dtype=np.uint8)


def write_png(path: Path, image: AnyArray) -> None:
    """Write (h, w, 3) uint8 rgb or (h, w) uint8 or uint16 losslessly."""
    if not cv2.imwrite(str(path), _bgr(image)):
        raise DataError(f"{path} could not be written (does the folder exist, is the disk full?)")


def encode_png(image: AnyArray) -> bytes:
    """PNG bytes of (h, w, 3) uint8 rgb or (h, w) uint8."""
    return _encode(".png", image, [])


def encode_jpeg(image: AnyArray, quality: int = 88) -> bytes:
    """JPEG bytes of (h, w, 3) uint8 rgb."""
    return _encode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])


def depth_to_mm(depth_m: AnyArray) -> UInt16Array:
    """Metres (0 or non-finite = none) -> uint16 millimetres, rounded; beyond 65.5 m becomes none."""
    depth_mm = np.round(np.nan_to_num(np.asarray(depth_m, dtype=np.float64), posinf=0.0, neginf=0.0) * MM_PER_M)
    return np.where((depth_mm < 0) | (depth_mm > MAX_DEPTH_MM), 0, depth_mm).astype(np.uint16)


def depth_from_mm(depth_mm: UInt16Array) -> Float32Array:
    """uint16 millimetres -> float32 metres, each the nearest to the quotient."""
    return depth_mm.astype(np.float32) / np.float32(MM_PER_M)


def _decoded(path: Path, flags: int) -> AnyArray:
    image, complaint = decode_image(path, flags)
    if image is None:
        raise DataError(f"{path} is missing or no readable image{complaint}")
    return image


def _encode(suffix: str, image: AnyArray, options: list[int]) -> bytes:
    done, data = cv2.imencode(suffix, _bgr(image), options)
    if not done:
        raise DataError(f"an image of shape {image.shape} and dtype {image.dtype} could not be encoded as {suffix}")
    return bytes(data.tobytes())


def _bgr(image: AnyArray) -> AnyArray:
    return np.ascontiguousarray(image[..., ::-1]) if image.ndim == 3 else np.ascontiguousarray(image)
