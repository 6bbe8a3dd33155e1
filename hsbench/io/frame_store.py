"""Pictures of a static camera: one background and, per frame, the pixels that differ. Lossless, random access.

``recording/`` of an episode holds

- ``background_rgb.png``, ``background_depth.png`` (uint16 mm), ``background_instance.png`` (uint16 ids)
- ``patches.parquet`` and ``patches.zst``: where each frame differs from it, and how (``patch_table``)

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

import pyarrow as pa
import pyarrow.parquet as pq

from hsbench.io.changing_light import ChangingLight, read_light, write_light
from hsbench.io.depth_noise import add_noise, noise_rng, preset
from hsbench.io.image_noise import image_preset, photographed
from hsbench.io.images import depth_from_mm, read_rgb, read_uint16, write_png
from hsbench.io.old_patches import OLD_SCHEMA, OldPatches
from hsbench.io.patch_table import PATCH_SCHEMA, PIXELS, TABLE, PatchTable, open_table, packed, read_patches
from hsbench.schema.episode import Frame, FrameTruth
from hsbench.typing import AnyArray, BoolArray, IntArray, UInt8Array, UInt16Array


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
    width_px, rows, start = background.depth_mm.shape[1], [], 0
    with (folder / PIXELS).open("wb") as file:
        for frame, patch in enumerate(patches):
            own = patch.picture
            data, counts = packed(patch.mask, own.rgb, own.depth_mm, own.instance, patch.row, patch.column, width_px)
            file.write(data)
            rows.append({"frame": frame, "timestamp_ns": patch.timestamp_ns, "start": start, **counts})
            start += len(data)
    table = pa.Table.from_pylist(rows, schema=PATCH_SCHEMA)
    pq.write_table(table, folder / TABLE, compression="zstd", use_dictionary=False, write_statistics=False)


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
        return self._patches.timestamps_ns

    @cached_property
    def _patches(self) -> PatchTable | OldPatches:
        table = open_table(self.folder)
        if table.schema_arrow.equals(OLD_SCHEMA):
            return OldPatches(self.folder / TABLE, table)
        return read_patches(self.folder, table)

    def picture(self, frame: int) -> Picture:
        """The clean picture of a frame. Raises IndexError beyond the last, DataError where the patch is damaged."""
        frame = range(len(self.timestamps_ns))[frame]
        picture = _background(self.background, self.light, frame)
        self._patches.lay_over(frame, picture.rgb, picture.depth_mm, picture.instance)
        return picture

    def __reduce__(self) -> tuple[type[Recording], tuple[Path]]:
        return type(self), (self.folder,)


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
