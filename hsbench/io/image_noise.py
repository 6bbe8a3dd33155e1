"""Noise of a colour camera and of the compression of its pictures, as functions of seed and frame, applied on reading.

Light that falls on a sensor frees electrons, at random (Poisson); reading them out adds noise of a fixed width: the
variance of a signal of n electrons is n + read^2 (EMVA standard 1288, release 4, camera model). In the dark a camera
exposes longer up to a point, and then amplifies: what a picture shows as white was fewer electrons, and noise grows.
After that pictures are compressed as JPEG does it.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from hsbench.errors import SchemaError
from hsbench.io.images import encode_jpeg
from hsbench.typing import Float32Array, UInt8Array

SRGB_EXPONENT = 2.4  # of the curve of IEC 61966-2-1, whose linear foot is left to the read noise


@dataclass(frozen=True)
class ImageNoise:
    """A camera. full_electrons: freed in a pixel shown as white, at gain 1. read_electrons: standard deviation.

    longest: exposure up to which it exposes longer, relative to a day's; beyond, it amplifies: gain = exposure /
    longest. quality: of JPEG, 1-100.
    """

    full_electrons: float
    read_electrons: float
    longest: float
    quality: int


CAMERA = ImageNoise(
    # A 1/2.8 inch sensor with pixels of 2.9 um holds some 12 000 electrons and reads with 2 to 3 (EMVA 1288 data
    # sheets of cameras with the Sony IMX290); exposures of 1/100 s by day and 1/25 s at most are ours.
    full_electrons=12000.0,
    read_electrons=2.5,
    longest=4.0,
    quality=85,
)
IMAGE_PRESETS: dict[str, ImageNoise | None] = {"camera": CAMERA, "none": None}
"""Noise by name. ``none`` hands out the clean picture."""


def image_preset(name: str) -> ImageNoise | None:
    """A preset by name. Raises SchemaError for an unknown one."""
    if name not in IMAGE_PRESETS:
        raise SchemaError(f"image noise preset is {name!r}; expected one of {', '.join(IMAGE_PRESETS)}")
    return IMAGE_PRESETS[name]


def photographed(rgb: UInt8Array, noise: ImageNoise | None, exposure: float, seed: int, frame: int) -> UInt8Array:
    """A clean picture (h, w, 3) as the camera stores it. exposure: relative to that of a day."""
    if noise is None:
        return rgb
    return compressed(noisy(rgb, noise, max(exposure / noise.longest, 1.0), image_rng(seed, frame)), noise.quality)


def noisy(rgb: UInt8Array, noise: ImageNoise, gain: float, rng: np.random.Generator) -> UInt8Array:
    """(h, w, 3) with shot and read noise at a gain >= 1."""
    drawn = rng.standard_normal(rgb.shape, dtype=np.float32)
    return np.asarray(np.clip(np.rint(rgb + _deviation(noise, gain)[rgb] * drawn), 0, 255), dtype=np.uint8)


def compressed(rgb: UInt8Array, quality: int) -> UInt8Array:
    """(h, w, 3) after JPEG compression."""
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(rgb, quality), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def image_rng(seed: int, frame: int) -> np.random.Generator:
    """The generator of one frame's noise: Philox keyed by a hash of the episode's seed and the frame."""
    text = f"image-noise\x1f{seed}\x1f{frame}"
    key = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=16).digest(), "little")
    return np.random.Generator(np.random.Philox(key=key))


@lru_cache(maxsize=64)
def _deviation(noise: ImageNoise, gain: float) -> Float32Array:
    """(256,) standard deviation of each byte, in bytes: that of the light times the slope of the display curve."""
    light = (np.arange(256) / 255.0) ** SRGB_EXPONENT
    white = noise.full_electrons / gain
    spread = np.sqrt(light / white + (noise.read_electrons / white) ** 2)
    # Where the curve is steep a straight line misleads: the mean slope over one deviation to either side.
    above, below = ((np.maximum(light + side * spread, 0.0)) ** (1 / SRGB_EXPONENT) for side in (1.0, -1.0))
    return np.asarray(255.0 / 2.0 * (above - below), dtype=np.float32)
