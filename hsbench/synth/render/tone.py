"""From linear light to display bytes and back: the sRGB curve, and a gentle shoulder that no brightness clips."""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import AnyArray, FloatArray, UInt8Array

# IEC 61966-2-1 (sRGB).
_SLOPE, _OFFSET, _EXPONENT, _BREAK = 12.92, 0.055, 2.4, 0.0031308
KNEE = 0.5
"""Above the knee the curve bends towards white and never gets there."""
TOE = 0.02
"""Light of this brightness is shown at half of it: shadows are deepened a little."""


@numba.njit(cache=True, error_model="numpy")
def toned(light: float) -> float:
    """Exposed light >= 0 -> display light below 1: a toe, then nearly the identity, then a rational shoulder."""
    light *= light / (light + TOE)
    over = max(light - KNEE, 0.0) / (1.0 - KNEE)
    return min(light, KNEE) + (1.0 - KNEE) * over / (1.0 + over)


def encode_srgb(light: FloatArray) -> UInt8Array:
    """(...) display light 0..1 -> (...) sRGB bytes."""
    light = np.clip(light, 0.0, 1.0)
    curve = (1 + _OFFSET) * np.maximum(light, _BREAK) ** (1 / _EXPONENT) - _OFFSET
    return np.rint(255.0 * np.where(light <= _BREAK, light * _SLOPE, curve)).astype(np.uint8)


def decode_srgb(colours: AnyArray) -> FloatArray:
    """(...) sRGB bytes -> (...) display light 0..1."""
    value = np.asarray(colours, dtype=np.float64) / 255.0
    return np.where(value <= _SLOPE * _BREAK, value / _SLOPE, ((value + _OFFSET) / (1 + _OFFSET)) ** _EXPONENT)
