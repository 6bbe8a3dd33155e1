"""From linear light to display bytes and back: the sRGB curve, and a tone curve that no brightness clips."""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import AnyArray, FloatArray, UInt8Array

# IEC 61966-2-1 (sRGB).
_SLOPE, _OFFSET, _EXPONENT, _BREAK = 12.92, 0.055, 2.4, 0.0031308
HALF_LIGHT, CONTRAST = 0.65, 1.2
"""Light that is shown at half of the range, and how steeply the curve rises there (of the logarithm of light).

Up to about half it stays close to the identity, shadows a little deeper; above, a step of brightness keeps a fair share
of its contrast for long, so that a pattern in the sun is still seen.
"""


@numba.njit(cache=True, error_model="numpy")
def toned(light: float) -> float:
    """Exposed light >= 0 -> display light below 1, and never above the light itself.

    The curve by which eyes answer light they are adapted to (Naka and Rushton 1966).
    """
    answer = (light / HALF_LIGHT) ** CONTRAST
    return answer / (1.0 + answer)


def encode_srgb(light: FloatArray) -> UInt8Array:
    """(...) display light 0..1 -> (...) sRGB bytes."""
    light = np.clip(light, 0.0, 1.0)
    curve = (1 + _OFFSET) * np.maximum(light, _BREAK) ** (1 / _EXPONENT) - _OFFSET
    return np.rint(255.0 * np.where(light <= _BREAK, light * _SLOPE, curve)).astype(np.uint8)


def decode_srgb(colours: AnyArray) -> FloatArray:
    """(...) sRGB bytes -> (...) display light 0..1."""
    value = np.asarray(colours, dtype=np.float64) / 255.0
    return np.where(value <= _SLOPE * _BREAK, value / _SLOPE, ((value + _OFFSET) / (1 + _OFFSET)) ** _EXPONENT)
