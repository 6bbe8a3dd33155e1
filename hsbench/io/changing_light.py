"""A still room under changing light: a picture of each of its lights, and how much of each there is in every frame.

Beside the background of a recording, ``recording/`` then holds

- ``light_0.png``, ``light_1.png`` ...: (3 h, w) 16-bit pictures of the lights, red above green above blue; a value v is
  exposed light (v / 4096)^2
- ``light.npz``: ``weight`` float32 (n, K, 3), strength and colour of each light in each frame; ``exposure`` float32
  (n,); ``display`` uint8 (65536,), the byte that shows light (i / 4096)^2 at place i

The background of a frame is display[min(4096 sqrt(sum over k of exposure * weight[k] * light[k]), 65535)], computed in
float32 in this order and cut to whole numbers, without the lights whose weights are all 0: the same bytes everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.errors import DataError, SchemaError
from hsbench.io.arrays import ArraySpec, read_npz, write_npz
from hsbench.io.images import read_uint16, write_png
from hsbench.schema.poses import require
from hsbench.typing import AnyArray, Float32Array, UInt8Array, UInt16Array

ROOT_STEPS = 4096  # values of the root of light up to 1
VALUES = 65536  # of uint16
TABLE = "light.npz"
MAX_TABLE_BYTES = 1 << 30


@dataclass(frozen=True, eq=False)
class ChangingLight:
    """The background's colours in n frames.

    lights: K pictures (h, w, 3) uint16 (``encode_light``). weight: (n, K, 3) float32. exposure: (n,) float32.
    display: (65536,) uint8.
    """

    lights: tuple[UInt16Array, ...]
    weight: Float32Array
    exposure: Float32Array
    display: UInt8Array

    def __post_init__(self) -> None:
        require(self.weight, "light.weight", (None, len(self.lights), 3), np.float32)
        require(self.exposure, "light.exposure", (len(self.weight),), np.float32)
        require(self.display, "light.display", (VALUES,), np.uint8)
        if not (np.isfinite(self.weight).all() and np.isfinite(self.exposure).all()):
            raise SchemaError("light.weight or light.exposure holds NaN or infinity; expected strengths >= 0")
        if (self.weight < 0).any() or (self.exposure < 0).any():
            raise SchemaError("light.weight or light.exposure holds negative values; expected strengths >= 0")
        if not self.lights:
            raise SchemaError("changing light has no light; expected at least one picture")
        for k, light in enumerate(self.lights):
            require(light, f"light {k}", (*self.lights[0].shape[:2], 3), np.uint16)

    def rgb(self, frame: int, rows: slice = slice(None), columns: slice = slice(None)) -> UInt8Array:
        """(h, w, 3) sRGB of the background in a frame, or of some rows and columns of it."""
        return self.shown(frame, {k: self.lights[k][rows, columns] for k in self.shining(frame)})

    def shining(self, frame: int) -> list[int]:
        """The lights that there are in a frame."""
        return [int(k) for k in np.flatnonzero(self.weight[frame].any(axis=1))] or [0]

    def shown(self, frame: int, lights: Mapping[int, UInt16Array]) -> UInt8Array:
        """(h, w, 3) sRGB under the light of a frame. lights: pictures (h, w, 3) uint16 of those that shine."""
        from hsbench.io.light_sums import add_light, shown  # numba is slow to load, and most recordings need none

        shining = self.shining(frame)
        factor = self.exposure[frame] * self.weight[frame, shining]
        total = np.zeros(lights[shining[0]].shape, dtype=np.float32)
        for k, own in zip(shining, factor, strict=True):
            add_light(total, lights[k], own, ROOT_STEPS)
        return shown(total, self.display, ROOT_STEPS)


def encode_light(light: AnyArray) -> UInt16Array:
    """Exposed light >= 0 -> uint16 on a scale of roots; light above 255.9 is cut."""
    return np.rint(np.sqrt(np.minimum(light, ((VALUES - 1) / ROOT_STEPS) ** 2)) * ROOT_STEPS).astype(np.uint16)


def write_light(folder: Path, light: ChangingLight) -> None:
    """Write the files above into an existing folder."""
    for k, picture in enumerate(light.lights):
        write_png(folder / _picture_name(k), picture.transpose(2, 0, 1).reshape(-1, picture.shape[1]))
    write_npz(folder / TABLE, weight=light.weight, exposure=light.exposure, display=light.display)


def read_light(folder: Path, shape: tuple[int, ...], frames: int) -> ChangingLight | None:
    """What ``write_light`` wrote for ``frames`` pictures of ``shape`` (h, w), or None where a folder has none.

    Raises DataError for missing or damaged files, SchemaError for values that do not fit.
    """
    path = folder / TABLE
    if not path.exists():
        return None
    specs = {
        "weight": ArraySpec((frames, None, 3), "float32"),
        "exposure": ArraySpec((frames,), "float32"),
        "display": ArraySpec((VALUES,), "uint8"),
    }
    table = read_npz(path, specs, MAX_TABLE_BYTES)
    height, width = shape
    lights = []
    for k in range(table["weight"].shape[1]):
        values = read_uint16(folder / _picture_name(k))
        if values.shape != (3 * height, width):
            raise DataError(f"{folder / _picture_name(k)} has shape {values.shape}; expected {(3 * height, width)}")
        lights.append(np.ascontiguousarray(values.reshape(3, height, width).transpose(1, 2, 0)))
    return ChangingLight(tuple(lights), table["weight"], table["exposure"], table["display"])


def _picture_name(number: int) -> str:
    return f"light_{number}.png"
