"""Quantisation: values are rounded to .1 mm and .01 degree before anything branches on them or is stored."""

from __future__ import annotations

import math

import numpy as np

from hsbench.typing import AnyArray, FloatArray

LENGTH_DECIMALS = 4  # .1 mm
ANGLE_DECIMALS_DEG = 2  # .01 degree


def quantise_m(length_m: AnyArray | float) -> FloatArray:
    """Lengths in metres rounded to .1 mm (float64, -0 becomes 0)."""
    return np.asarray(np.round(length_m, LENGTH_DECIMALS) + 0.0, dtype=np.float64)


def quantise_angle(angle_rad: float) -> float:
    """An angle in radians rounded to .01 degree."""
    return math.radians(round(math.degrees(angle_rad), ANGLE_DECIMALS_DEG))
