"""Patches of a recording on disk: when they are, and their pixels, each patch packed alone. Lossless.

- ``patches.parquet``, a row a frame: frame, timestamp_ns; ``runs`` and ``pixels``, how many there are of either below;
  ``start`` and ``size``, in bytes, of what ``patches.zst`` holds of the frame
- ``patches.zst``, for each frame five Zstandard frames, which decompress as one to
    runs      (runs,) uint32: pixels of the picture, row-major, that are as in the background, then that are not, and so
              on up to the last that is not
    instance  (pixels,) uint16: steps, modulo 65536, of the pixels that are not
    colour    (pixels, 3) uint8: steps of red - green, of green and of blue - green, modulo 256
    depth     (pixels,) uint8, the low bytes of steps in millimetres + 128, modulo 65536; (pixels,) uint8, the high ones

A step is what a pixel is more than the nearest one above it in its column that is not as in the background, or more
than 0: so a pixel is the sum of the steps down its column. People are tall and narrow, and steps down them are small.
All numbers are little-endian.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError
from hsbench.typing import BoolArray, IntArray, UInt8Array, UInt16Array

TABLE, PIXELS = "patches.parquet", "patches.zst"
PATCH_SCHEMA = pa.schema(
    [
        ("frame", pa.int32()),
        ("timestamp_ns", pa.int64()),
        ("runs", pa.int32()),
        ("pixels", pa.int32()),
        ("start", pa.int64()),
        ("size", pa.int32()),
    ]
)
CODEC = "zstd"
LEVEL = 1  # level 6 makes patches 4 % smaller in four times the time, docs/schema.md
RUN_BYTES, PIXEL_BYTES = 4, 7


def packed(
    mask: BoolArray, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array, row: int, column: int, width_px: int
) -> tuple[bytes, dict[str, int]]:
    """What ``patches.zst`` holds of a patch, and the counts of its row of the table.

    mask and pictures: (h, w), the window at (row, column) of a picture ``width_px`` wide.
    """
    from hsbench.io.patch_pixels import runs_of, steps_of  # numba is slow to load, and data without pictures need none

    runs = runs_of(mask, row, column, width_px)
    ids, colours, low, high = steps_of(mask, rgb, depth_mm, instance)
    codec = pa.Codec(CODEC, compression_level=LEVEL)
    parts = (runs.astype("<u4", copy=False), ids.astype("<u2", copy=False), colours, low, high)
    data = b"".join(codec.compress(part.tobytes(), asbytes=True) for part in parts)
    return data, {"runs": len(runs), "pixels": len(ids), "size": len(data)}


@dataclass(frozen=True, eq=False)
class PatchTable:
    """The patches of a recording of n frames, opened.

    columns: (n,) integers by name of column. Their bytes in ``patches.zst`` follow one another up to its end.
    """

    pixels_path: Path
    columns: dict[str, IntArray]

    @property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64."""
        return self.columns["timestamp_ns"]

    def lay_over(self, frame: int, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array) -> None:
        """Set the pixels of a patch in pictures (h, w) of the background. Raises DataError where it is damaged."""
        try:
            self._lay_over({name: int(values[frame]) for name, values in self.columns.items()}, rgb, depth_mm, instance)
        except (OSError, pa.ArrowException, ValueError) as error:
            raise DataError(f"{self.pixels_path} frame {frame} cannot be read: {str(error).splitlines()[0]}") from error

    def _lay_over(self, row: dict[str, int], rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array) -> None:
        from hsbench.io.patch_pixels import lay_over

        n_runs, count = row["runs"], row["pixels"]
        if not 0 <= count <= depth_mm.size or not 0 <= n_runs <= 2 * count or n_runs % 2:
            raise ValueError(f"{n_runs} runs and {count} pixels of a picture of {depth_mm.size}")
        stored = self._file.read_at(row["size"], row["start"])
        data = pa.decompress(stored, RUN_BYTES * n_runs + PIXEL_BYTES * count, CODEC)
        runs = np.frombuffer(data, "<u4", n_runs)
        if runs.sum(dtype=np.int64) > depth_mm.size or runs[1::2].sum(dtype=np.int64) != count:
            raise ValueError(f"runs name {runs[1::2].sum()} pixels up to {runs.sum()}; expected {count} of the picture")
        ids = np.frombuffer(data, "<u2", count, RUN_BYTES * n_runs)
        rest = np.frombuffer(data, np.uint8, 5 * count, len(data) - 5 * count)
        lay_over(
            runs.astype(np.uint32, copy=False), ids.astype(np.uint16, copy=False), rest[: 3 * count].reshape(count, 3),
            rest[3 * count : 4 * count], rest[4 * count :], rgb, depth_mm, instance,
        )  # fmt: skip

    @cached_property
    def _file(self) -> Any:
        return pa.OSFile(str(self.pixels_path))


def open_table(folder: Path) -> pq.ParquetFile:
    """``patches.parquet`` of a recording. Raises DataError where it is missing or damaged."""
    try:
        return pq.ParquetFile(folder / TABLE)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{folder / TABLE} cannot be read: {str(error).splitlines()[0]}") from error


def read_patches(folder: Path, file: pq.ParquetFile) -> PatchTable:
    """The patches of a recording. file: its table. Raises DataError for a missing or damaged file, and names it."""
    path, pixels_path = folder / TABLE, folder / PIXELS
    columns = _columns(path, file)
    ends = np.cumsum(columns["size"])
    if (columns["size"] < 0).any() or not np.array_equal(columns["start"], ends - columns["size"]):
        raise DataError(f"{path} columns start and size do not follow on one another; expected patches without gaps")
    if not pixels_path.is_file():
        raise DataError(f"{pixels_path} is missing; expected the pixels of {len(ends)} patches")
    length, told = pixels_path.stat().st_size, int(columns["size"].sum())
    if length != told:
        raise DataError(f"{pixels_path} has {length} bytes; expected the {told} of {TABLE} (was a copy cut short?)")
    return PatchTable(pixels_path, columns)


def _columns(path: Path, file: pq.ParquetFile) -> dict[str, IntArray]:
    if not file.schema_arrow.equals(PATCH_SCHEMA):
        raise DataError(f"{path} has columns {file.schema_arrow}; expected {PATCH_SCHEMA}".replace("\n", ", "))
    try:
        table = file.read()
    except (OSError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
    for name in PATCH_SCHEMA.names:
        if table[name].null_count:
            raise DataError(f"{path} column {name} has {table[name].null_count} nulls; expected numbers")
    return {name: np.array(table[name].to_numpy(), dtype=np.int64) for name in PATCH_SCHEMA.names}
