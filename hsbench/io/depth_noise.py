"""Depth noise as a function of the seed an episode was given and the frame, applied when a frame is read.

One recording serves every noise level. Sources of the constants:

[N] Nguyen, Izadi, Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012:
    axial error by distance and angle, lateral error by angle, in pixels.
[K] Khoshelham, Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12,
    2012: the projector of a Kinect stands 7.5 cm beside its camera, so that it lights what the camera sees in part.
[M] Data sheet of the Kinect v2: specified for 0.5-4.5 m, readings to 8 m.

What has no source is ours: holes along depth edges, and how much is lost on glancing and on dark surfaces, which
Sarbolandi, Lefloch, Kolb, "Kinect range sensing: structured-light versus time-of-flight Kinect", CVIU 139, 2015, show
for both kinds of Kinect without a model.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, BoolArray, Float32Array, UInt8Array

NORMAL_STEPS = 2**16  # equally likely values that stand for the normal distribution: it ends at 4.3 standard deviations


@dataclass(frozen=True)
class DepthNoise:
    """A noise model; effects whose constants are left out do not occur.

    With theta the angle between a surface's normal and the line of sight, counted up to 60 degrees,
    sigma_m(z, theta) = axial_base_m + axial_square_per_m * (z - axial_offset_m)^2
                        + axial_angle * theta^2 / ((pi/2 - theta)^2 sqrt(z)),
    and lateral_px + lateral_angle_px * theta / (pi/2 - theta) is the standard deviation of the shift of the sampled
    pixel.
    near_m, far_m: readings outside are lost.
    edge_step_m, edge_loss: share of pixels lost where the 3 x 3 neighbourhood spans more than the step.
    focal_widths: focal length in widths of the picture; 0: angles are not known, and none is lost in shade.
    baseline_m: the sensor's light stands so far to the right of its camera; what it does not light is lost.
    glancing_rad: none is lost for a smaller theta than the first, all for a larger one than the second, the share
    between them linear.
    dark_signal: the reading is lost with a probability of 1 / (1 + (signal / dark_signal)^4), where signal is the
    brightness 0..1 of the surface, in the place of its reflectance in the infrared, times cos(theta) / z^2.
    """

    axial_base_m: float
    axial_square_per_m: float
    axial_offset_m: float
    lateral_px: float
    near_m: float
    far_m: float
    edge_step_m: float
    edge_loss: float
    axial_angle: float = 0.0
    lateral_angle_px: float = 0.0
    focal_widths: float = 0.0
    baseline_m: float = 0.0
    glancing_rad: tuple[float, float] = (math.pi, math.pi)
    dark_signal: float = 0.0


KINECT = DepthNoise(
    axial_base_m=0.0012,  # [N]
    axial_square_per_m=0.0019,  # [N]
    axial_offset_m=0.4,  # [N]
    lateral_px=0.8,  # [N]
    near_m=0.5,  # [M]
    far_m=8.0,  # [M]
    edge_step_m=0.08,
    edge_loss=0.5,
    axial_angle=0.0001,  # [N]
    lateral_angle_px=0.035,  # [N]
    focal_widths=0.706,  # 70.6 degrees across [M]
    baseline_m=0.075,  # [K]
)
MILD = replace(
    KINECT,
    axial_base_m=0.0006,
    axial_square_per_m=0.00095,
    lateral_px=0.4,
    edge_loss=0.25,
    baseline_m=0.0,
)
HARSH = replace(
    KINECT,
    axial_base_m=0.0024,
    axial_square_per_m=0.0038,
    lateral_px=1.6,
    far_m=4.5,  # [M]: the specified range
    edge_step_m=0.05,
    edge_loss=0.9,
    glancing_rad=(math.radians(75.0), math.radians(85.0)),
    dark_signal=0.0015,
)
PRESETS: dict[str, DepthNoise | None] = {"kinect": KINECT, "mild": MILD, "harsh": HARSH, "none": None}
"""Noise by name: ``mild`` has half of a Kinect's errors and no shade; ``harsh`` twice, and loses glancing and dark
surfaces (both ours). ``none`` hands out clean depth: an oracle, not an input of any task.
"""


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


def add_noise(
    depth_m: AnyArray, noise: DepthNoise | None, rng: np.random.Generator, rgb: UInt8Array | None = None
) -> Float32Array:
    """Clean (h, w) metres, 0 = none -> noisy float32 metres, whole millimetres, 0 where the reading is lost.

    rgb: (h, w, 3) sRGB of the same pixels; without it no surface is too dark.
    """
    clean = np.ascontiguousarray(depth_m, dtype=np.float32)
    if noise is None:
        return clean
    from hsbench.io.depth_kernels import readings, shaded, viewing_angle  # numba is slow to load

    focal_px = noise.focal_widths * clean.shape[1]
    angle = viewing_angle(clean, focal_px) if focal_px else np.zeros_like(clean)
    drawn = np.frombuffer(rng.bytes(3 * 2 * clean.size), dtype="<u2").astype(np.uint16, copy=False)
    noisy = readings(
        clean,
        angle,
        drawn.reshape(3, *clean.shape),
        normal_table(),
        (noise.lateral_px, noise.lateral_angle_px),
        (noise.axial_base_m, noise.axial_square_per_m, noise.axial_offset_m, noise.axial_angle),
        noise.near_m,
        noise.far_m,
    )
    edge = np.flatnonzero(_on_edge(clean, noise.edge_step_m))
    noisy.reshape(-1)[edge[rng.random(len(edge), dtype=np.float32) < noise.edge_loss]] = 0.0
    first, last = noise.glancing_rad
    if first < math.pi / 2:
        noisy[rng.random(clean.shape, dtype=np.float32) < (angle - first) / (last - first)] = 0.0
    if noise.dark_signal and rgb is not None:
        signal = _brightness(rgb) * np.cos(angle) / np.maximum(clean, noise.near_m) ** 2
        noisy[rng.random(clean.shape, dtype=np.float32) < 1.0 / (1.0 + (signal / noise.dark_signal) ** 4)] = 0.0
    if noise.baseline_m:
        noisy[shaded(clean, focal_px * noise.baseline_m)] = 0.0
    return noisy


@cache
def normal_table() -> Float32Array:
    """(NORMAL_STEPS,) quantiles of the standard normal distribution in the middles of as many equal shares."""
    from scipy.special import ndtri

    return ndtri((np.arange(NORMAL_STEPS) + 0.5) / NORMAL_STEPS).astype(np.float32)


def _on_edge(depth_m: Float32Array, step_m: float) -> BoolArray:
    kernel = np.ones((3, 3), dtype=np.uint8)
    return np.asarray(cv2.dilate(depth_m, kernel) - cv2.erode(depth_m, kernel) > step_m)


def _brightness(rgb: UInt8Array) -> Float32Array:
    """(h, w) luminance 0..1, linear (a power of 2.2 for the curve of sRGB)."""
    linear = ((np.arange(256) / 255.0) ** 2.2).astype(np.float32)
    return linear[rgb] @ np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
