"""Pictures of a static camera: one background and, per frame, the pixels that differ. Lossless, random access.

``recording/`` of an episode holds

- ``background_rgb.png``, ``background_depth.png`` (uint16 mm), ``background_instance.png`` (uint16 ids)
- ``patches.parquet``: a row a frame, a row group a row: frame, timestamp_ns, row, column, height, width of the
  patch, ``mask`` (row-major bits, little bit order), and of the masked pixels in row-major order ``rgb``
  (3 bytes each), ``depth_mm`` and ``instance`` (little-endian uint16); all time stamps stand in its metadata, too, so
  that thousands of row groups need not be read for them

Where the light changes, pictures of the lights take the place of ``background_rgb.png`` in every frame
(``changing_light``), and a patch is what differs from the background of its own frame.

A recording is clean signal: noise is added on reading. It is for open splits only.
Imported footage is stored as ordinary images instead (``image_frames``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.errors import DataError
from hsbench.io.changing_light import ChangingLight, read_light, write_light
from hsbench.io.depth_noise import add_noise, noise_rng, preset
from hsbench.io.image_noise import image_preset, photographed
from hsbench.io.images import depth_from_mm, read_rgb, read_uint16, write_png
from hsbench.schema.episode import Frame, FrameTruth
from hsbench.typing import AnyArray, BoolArray, IntArray, UInt8Array, UInt16Array

PATCH_SCHEMA = pa.schema(
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
class Picture:
    """One clean image: rgb (h, w, 3) uint8, depth_mm (h, w) uint16, instance (h, w) uint16."""

    rgb: UInt8Array
    depth_mm: UInt16Array
    instance: UInt16Array


@dataclass(frozen=True, eq=False)
class Patch:
    """What differs from the background of one time: a window at (row, column), where ``mask`` (h, w) is true."""

    timestamp_ns: int
    row: int
    column: int
    mask: BoolArray
    picture: Picture


def write_recording(
    folder: Path, background: Picture, patches: Iterable[Patch], light: ChangingLight | None = None
) -> None:
    """Write a recording into an existing folder, patch by patch. light: a row a patch; None where it stays."""
    write_png(folder / "background_rgb.png", background.rgb)
    write_png(folder / "background_depth.png", background.depth_mm)
    write_png(folder / "background_instance.png", background.instance)
    if light is not None:
        write_light(folder, light)
    options = {"compression": "zstd", "use_dictionary": False, "write_statistics": False}
    with pq.ParquetWriter(folder / "patches.parquet", PATCH_SCHEMA, **options) as writer:
        stamps = []
        for frame, patch in enumerate(patches):
            writer.write_batch(pa.RecordBatch.from_pylist([_row(frame, patch)], schema=PATCH_SCHEMA))
            stamps.append(str(patch.timestamp_ns))
        writer.add_key_value_metadata({STAMPS_KEY: " ".join(stamps)})


def _row(frame: int, patch: Patch) -> dict[str, Any]:
    from hsbench.io.patch_pixels import taken  # numba is slow to load, and data without pictures need none

    picture = patch.picture
    bits, rgb, depth_mm, instance = taken(patch.mask, picture.rgb, picture.depth_mm, picture.instance)
    return {
        "frame": frame,
        "timestamp_ns": patch.timestamp_ns,
        "row": patch.row,
        "column": patch.column,
        "height": patch.mask.shape[0],
        "width": patch.mask.shape[1],
        "mask": bits.tobytes(),
        "rgb": rgb.tobytes(),
        "depth_mm": depth_mm.astype("<u2", copy=False).tobytes(),
        "instance": instance.astype("<u2", copy=False).tobytes(),
    }


@dataclass(frozen=True, eq=False)
class Film:
    """A recording in the making: frames of an episode that is being generated, rendered when asked for.

    background: at t0. patch: index -> Patch of the frame. light: where it changes. Other fields as RecordingFrames.
    """

    background: Picture
    timestamps_ns: IntArray
    patch: Callable[[int], Patch]
    noise_seed: int
    noise_preset: str
    has_depth: bool = True
    image_noise: str = "none"
    light: ChangingLight | None = None

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def picture(self, index: int) -> Picture:
        """The clean picture of a frame."""
        index = range(len(self))[index]
        patch = self.patch(index)
        picture = _background(self.background, self.light, index)
        window = _window(patch)
        picture.rgb[window][patch.mask] = patch.picture.rgb[patch.mask]
        picture.depth_mm[window][patch.mask] = patch.picture.depth_mm[patch.mask]
        picture.instance[window][patch.mask] = patch.picture.instance[patch.mask]
        return picture

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        return _input_frame(self, self.picture(index), self.light, index)


def _background(at_t0: Picture, light: ChangingLight | None, index: int) -> Picture:
    """The picture of a frame without people, to be drawn on."""
    rgb = at_t0.rgb.copy() if light is None else light.rgb(index)
    return Picture(rgb, at_t0.depth_mm.copy(), at_t0.instance.copy())


def _window(patch: Patch) -> tuple[slice, slice]:
    height, width = patch.mask.shape
    return slice(patch.row, patch.row + height), slice(patch.column, patch.column + width)


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording on disk, opened on first use; safe to send to other processes."""

    folder: Path

    @cached_property
    def background(self) -> Picture:
        """The picture without people, at t0."""
        return Picture(
            read_rgb(self.folder / "background_rgb.png"),
            read_uint16(self.folder / "background_depth.png"),
            read_uint16(self.folder / "background_instance.png"),
        )

    @cached_property
    def light(self) -> ChangingLight | None:
        """The light of every frame, None where it stays as at t0."""
        return read_light(self.folder, self.background.depth_mm.shape, len(self.timestamps_ns))

    @cached_property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps of the frames."""
        path = self.folder / "patches.parquet"
        listed = (self._patches.metadata.metadata or {}).get(STAMPS_KEY.encode())
        if listed is None:  # recordings of schema 0.3 and before need not have it
            return _timestamps(path, lambda: self._patches.read(columns=["timestamp_ns"]))
        try:
            stamps = np.array(listed.split(), dtype=np.int64)
        except (ValueError, OverflowError) as error:
            raise DataError(f"{path} metadata {STAMPS_KEY} is {listed[:40]!r}; expected whole numbers") from error
        if len(stamps) != self._patches.num_row_groups:
            raise DataError(f"{path} metadata {STAMPS_KEY} has {len(stamps)} numbers, the table another number of rows")
        return stamps

    @cached_property
    def _patches(self) -> pq.ParquetFile:
        path = self.folder / "patches.parquet"
        try:
            patches = pq.ParquetFile(path)
        except (OSError, ValueError, pa.ArrowException) as error:
            raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
        if not patches.schema_arrow.equals(PATCH_SCHEMA):
            raise DataError(f"{path} has columns {patches.schema_arrow}; expected {PATCH_SCHEMA}".replace("\n", ", "))
        if patches.num_row_groups != patches.metadata.num_rows:
            raise DataError(
                f"{path} has {patches.num_row_groups} row groups, {patches.metadata.num_rows} rows; expected one each"
            )
        return patches

    def picture(self, frame: int) -> Picture:
        """The clean picture of a frame. Raises IndexError beyond the last, DataError where the patch is damaged."""
        frame = range(len(self.timestamps_ns))[frame]
        picture = _background(self.background, self.light, frame)
        try:
            (row,) = self._patches.read_row_group(frame).to_pylist()
            _lay_over(picture, row)
        except (OSError, pa.ArrowException, TypeError, ValueError) as error:
            raise DataError(
                f"{self.folder / 'patches.parquet'} frame {frame} cannot be read: {str(error).splitlines()[0]}"
            ) from error
        return picture

    def __reduce__(self) -> tuple[type[Recording], tuple[Path]]:
        return type(self), (self.folder,)


def _lay_over(picture: Picture, row: dict[str, Any]) -> None:
    """Set the masked pixels of a row of the table. Raises ValueError or TypeError where the row does not fit."""
    from hsbench.io.patch_pixels import lay_over

    top, left, height, width = row["row"], row["column"], row["height"], row["width"]
    rows, columns = picture.depth_mm.shape
    if not (0 <= top <= top + height <= rows and 0 <= left <= left + width <= columns):
        raise ValueError(f"window {height} x {width} at ({top}, {left}) leaves the image of {rows} x {columns}")
    bits = np.frombuffer(row["mask"], dtype=np.uint8)
    if len(bits) != -(-height * width // 8):
        raise ValueError(f"mask has {len(bits)} bytes for {height} x {width} pixels")
    count = int(np.bitwise_count(bits).sum())
    if height * width % 8 and bits[-1] >> height * width % 8:
        raise ValueError(f"mask names pixels beyond its {height} x {width}")
    rgb = np.frombuffer(row["rgb"], dtype=np.uint8).reshape(count, 3)
    depth_mm, instance = (np.frombuffer(row[name], dtype="<u2").reshape(count) for name in ("depth_mm", "instance"))
    window = slice(top, top + height), slice(left, left + width)
    lay_over(
        bits, rgb, depth_mm.astype(np.uint16, copy=False), instance.astype(np.uint16, copy=False),
        picture.rgb[window], picture.depth_mm[window], picture.instance[window],
    )  # fmt: skip


def _timestamps(path: Path, read: Callable[[], pa.Table]) -> IntArray:
    """(n,) int64: column timestamp_ns of what ``read`` reads. Raises DataError naming the file."""
    try:
        column = read()["timestamp_ns"].combine_chunks()
    except (OSError, KeyError, ValueError, pa.ArrowException) as error:
        raise DataError(f"{path} cannot be read: {str(error).splitlines()[0]}") from error
    if column.null_count or column.type != pa.int64():
        raise DataError(f"{path} column timestamp_ns is {column.type} with {column.null_count} nulls; expected int64")
    return np.array(column.to_numpy(zero_copy_only=False), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class RecordingFrames:
    """A recording as input: rgb, and depth (or none at all for a camera without depth), with seeded noise.

    noise_preset: of depth. image_noise: preset of ``image_noise``.
    """

    _recording: Recording  # clean signal, so no input
    noise_seed: int
    noise_preset: str
    has_depth: bool = True
    image_noise: str = "none"

    @property
    def timestamps_ns(self) -> IntArray:
        """(n,) int64 time stamps."""
        return self._recording.timestamps_ns

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        return _input_frame(self, self._recording.picture(index), self._recording.light, index)


def _input_frame(frames: Film | RecordingFrames, picture: Picture, light: ChangingLight | None, index: int) -> Frame:
    """What the sensor gives of a clean picture."""
    depth_m = None
    if frames.has_depth:
        rng = noise_rng(frames.noise_seed, index)
        depth_m = add_noise(depth_from_mm(picture.depth_mm), preset(frames.noise_preset), rng, picture.rgb)
    exposure = 1.0 if light is None else float(light.exposure[index])
    rgb = photographed(picture.rgb, image_preset(frames.image_noise), exposure, frames.noise_seed, index)
    return Frame(int(frames.timestamps_ns[index]), rgb, depth_m)


@dataclass(frozen=True, eq=False)
class RecordingTruth:
    """A recording as truth: clean depth, instance ids, and categories looked up by ``category_of`` (65536,) uint8."""

    recording: Recording
    category_of: AnyArray

    def __len__(self) -> int:
        return len(self.recording.timestamps_ns)

    def __getitem__(self, index: int) -> FrameTruth:
        index = range(len(self))[index]
        picture = self.recording.picture(index)
        return FrameTruth(
            int(self.recording.timestamps_ns[index]),
            depth_from_mm(picture.depth_mm),
            picture.instance,
            self.category_of[picture.instance],
        )
