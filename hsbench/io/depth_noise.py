"""Depth noise as a function of the seed an episode was given and the frame, applied when a frame is read.

One recording serves every noise level. The axial error grows with the square of distance and the lateral
error is a fraction of a pixel, after Nguyen, Izadi, Lovell, "Modeling Kinect sensor noise for improved 3D
reconstruction and tracking", 3DIMPVT 2012. Range limits are those of a Kinect v2's datasheet (.5-4.5 m is
its specified range; it gives readings to 8 m). Holes along depth edges are an hsbench default.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import cv2
import numpy as np

from hsbench.errors import SchemaError
from hsbench.io.images import MM_PER_M
from hsbench.typing import AnyArray, Float32Array


@dataclass(frozen=True)
class DepthNoise:
    """A noise model.

    sigma_m(z) = axial_base_m + axial_square_per_m * (z - axial_offset_m)^2.
    lateral_px: standard deviation of the shift of the sampled pixel.
    near_m, far_m: readings outside are lost.
    edge_step_m, edge_loss: share of pixels lost where the 3 x 3 neighbourhood spans more than the step.
    """

    axial_base_m: float
    axial_square_per_m: float
    axial_offset_m: float
    lateral_px: float
    near_m: float
    far_m: float
    edge_step_m: float
    edge_loss: float


KINECT = DepthNoise(
    axial_base_m=0.0012,
    axial_square_per_m=0.0019,
    axial_offset_m=0.4,
    lateral_px=0.8,
    near_m=0.5,
    far_m=8.0,
    edge_step_m=0.08,
    edge_loss=0.5,
)

PRESETS: dict[str, DepthNoise | None] = {"kinect": KINECT, "none": None}
"""Noise by name. ``none`` hands out clean depth: an oracle, not an input of any task."""


def preset(name: str) -> DepthNoise | None:
    """A preset by name. Raises SchemaError for an unknown one."""
    if name not in PRESETS:
        raise SchemaError(f"depth noise preset is {name!r}; expected one of {', '.join(PRESETS)}")
    return PRESETS[name]


def noise_rng(seed: int, frame: int) -> np.random.Generator:
    """The generator of one frame's noise: Philox keyed by a hash of the episode's seed and the frame."""
    text = f"depth-noise\x1f{seed}\x1f{frame}"
    key = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=16).digest(), "little")
    return np.random.Generator(np.random.Philox(key=key))


def add_noise(depth_m: AnyArray, noise: DepthNoise | None, rng: np.random.Generator) -> Float32Array:
    """Clean (h, w) metres, 0 = none -> noisy float32 metres, whole millimetres, 0 where the reading is lost."""
    clean = np.ascontiguousarray(depth_m, dtype=np.float32)
    if noise is None:
        return clean
    shape = clean.shape
    shift = np.rint(rng.standard_normal((2, *shape), dtype=np.float32) * noise.lateral_px).astype(np.int32)
    row = np.clip(np.arange(shape[0], dtype=np.int32)[:, None] + shift[0], 0, shape[0] - 1)
    column = np.clip(np.arange(shape[1], dtype=np.int32)[None, :] + shift[1], 0, shape[1] - 1)
    depth = clean[row, column]
    sigma = noise.axial_base_m + noise.axial_square_per_m * (depth - noise.axial_offset_m) ** 2
    noisy = depth + sigma * rng.standard_normal(shape, dtype=np.float32)
    kernel = np.ones((3, 3), dtype=np.uint8)
    edge = cv2.dilate(clean, kernel) - cv2.erode(clean, kernel) > noise.edge_step_m
    lost = (
        (depth < noise.near_m)
        | (depth > noise.far_m)
        | (edge & (rng.random(shape, dtype=np.float32) < noise.edge_loss))
    )
    noisy[lost] = 0.0
    return (np.rint(noisy * MM_PER_M) / MM_PER_M).astype(np.float32)
