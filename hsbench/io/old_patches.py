"""Patches as schema 0.3 and before stored them: whole pixels in the table itself, a row group a frame. Read only.

``patches.parquet`` has ``mask`` (row-major bits of the whole window, lowest first) and of its pixels, row-major,
``rgb`` (3 bytes each), ``depth_mm`` and ``instance`` (little-endian uint16). The last of 0.3 have all time stamps in
the metadata, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError
from hsbench.typing import IntArray, UInt8Array, UInt16Array

OLD_SCHEMA = pa.schema(
    [
        ("frame", pa.int32()),
        ("timestamp_ns", pa.int64()),
        ("row", pa.int32()),
        ("column", pa.int32()),
        ("height", pa.int32()),
        ("width", pa.int32()),
        ("mask", pa.binary()),
        ("rgb", pa.binary()),
        ("depth_mm", pa.binary()),
        ("instance", pa.binary()),
    ]
)
STAMPS_KEY = "timestamps_ns"


@dataclass(frozen=True, eq=False)
class OldPatches:
    """The patches of an old recording; as ``PatchTable``. file: the opened table at ``path``, of ``OLD_SCHEMA``."""

    path: Path
    file: pq.ParquetFile

    def __post_init__(self) -> None:
        metadata = self.file.metadata
        if metadata.num_row_groups != metadata.num_rows:
            raise DataError(
                f"{self.path} has {metadata.num_row_groups} row groups, {metadata.num_rows} rows; expected one each"
            )

    @cached_property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64."""
        listed = (self.file.metadata.metadata or {}).get(STAMPS_KEY.encode())
        if listed is None:
            return _timestamps(self.path, lambda: self.file.read(columns=["timestamp_ns"]))
        try:
            stamps = np.array(listed.split(), dtype=np.int64)
        except (ValueError, OverflowError) as error:
            raise DataError(f"{self.path} metadata {STAMPS_KEY} is {listed[:40]!r}; expected whole numbers") from error
        if len(stamps) != self.file.num_row_groups:
            raise DataError(
                f"{self.path} metadata {STAMPS_KEY} has {len(stamps)} numbers, the table another number of rows"
            )
        return stamps

    def lay_over(self, frame: int, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array) -> None:
        """Set the pixels of a patch in pictures (h, w) of the background. Raises DataError where it is damaged."""
        try:
            (row,) = self.file.read_row_group(frame).to_pylist()
            _lay_over(row, rgb, depth_mm, instance)
        except (OSError, pa.ArrowException, TypeError, ValueError) as error:
            raise DataError(f"{self.path} frame {frame} cannot be read: {str(error).splitlines()[0]}") from error


def _lay_over(row: dict[str, Any], rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array) -> None:
    """Raises ValueError or TypeError where the row does not fit."""
    top, left, height, width = row["row"], row["column"], row["height"], row["width"]
    rows, columns = depth_mm.shape
    if not (0 <= top <= top + height <= rows and 0 <= left <= left + width <= columns):
        raise ValueError(f"window {height} x {width} at ({top}, {left}) leaves the image of {rows} x {columns}")
    bits = np.frombuffer(row["mask"], dtype=np.uint8)
    if len(bits) != -(-height * width // 8):
        raise ValueError(f"mask has {len(bits)} bytes for {height} x {width} pixels")
    if height * width % 8 and bits[-1] >> height * width % 8:
        raise ValueError(f"mask names pixels beyond its {height} x {width}")
    mask = np.unpackbits(bits, count=height * width, bitorder="little").reshape(height, width).astype(bool)
    count, window = np.count_nonzero(mask), np.s_[top : top + height, left : left + width]
    rgb[window][mask] = np.frombuffer(row["rgb"], dtype=np.uint8).reshape(count, 3)
    depth_mm[window][mask] = np.frombuffer(row["depth_mm"], dtype="<u2").reshape(count)
    instance[window][mask] = np.frombuffer(row["instance"], dtype="<u2").reshape(count)


def _timestamps(path: Path, read: Callable[[], pa.Table]) -> IntArray:
    """(n,) int64: column timestamp_ns of what ``read`` reads. Raises DataError naming the file."""
    try:
        column = read()["timestamp_ns"].combine_chunks()
    except (OSError, KeyError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
    if column.null_count or column.type != pa.int64():
        raise DataError(f"{path} column timestamp_ns is {column.type} with {column.null_count} nulls; expected int64")
    return np.array(column.to_numpy(zero_copy_only=False), dtype=np.int64)
