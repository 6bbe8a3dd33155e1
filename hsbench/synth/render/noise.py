"""Hashed numbers and smooth noise for textures: pure functions of integer cells and metres, compiled.

Nothing but additions, multiplications and shifts, so that every machine gets the same values.
"""

from __future__ import annotations

import math

import numba
import numpy as np

# Odd 64-bit multipliers (splitmix64's and xxHash's published constants) and the shifts of splitmix64's finaliser.
_STEP_I = np.uint64(0x9E3779B97F4A7C15)
_STEP_J = np.uint64(0xC2B2AE3D27D4EB4F)
_STEP_K = np.uint64(0x165667B19E3779F9)
_STEP_SEED = np.uint64(0xD6E8FEB86659FD93)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIT = 2.0**-53


# With signatures: else numba compiles a version for every literal seed, 64 in all, which took 8 s more.
@numba.njit("float64(int64, int64, int64, int64)", cache=True, error_model="numpy")
def cell_value(i: int, j: int, k: int, seed: int) -> float:
    """A number in [0, 1) that belongs to an integer cell and a seed."""
    h = np.uint64(i) * _STEP_I ^ np.uint64(j) * _STEP_J ^ np.uint64(k) * _STEP_K ^ np.uint64(seed) * _STEP_SEED
    h = (h ^ (h >> _S30)) * _MIX_1
    h = (h ^ (h >> _S27)) * _MIX_2
    return float((h ^ (h >> _S31)) >> _S11) * _UNIT


@numba.njit("float64(float64)", cache=True, error_model="numpy")
def ease(t: float) -> float:
    """0..1 -> 0..1 with flat ends."""
    return t * t * (3.0 - 2.0 * t)


@numba.njit("float64(float64, float64, float64)", cache=True, error_model="numpy")
def lerp(a: float, b: float, t: float) -> float:
    """From a (t = 0) to b (t = 1)."""
    return a + (b - a) * t


@numba.njit("float64(float64, float64, float64, int64)", cache=True, error_model="numpy")
def noise(x: float, y: float, z: float, seed: int) -> float:
    """Value noise in [-1, 1] with cells of side 1: numbers at the corners, joined smoothly."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = ease(x - i), ease(y - j), ease(z - k)
    low = lerp(
        lerp(cell_value(i, j, k, seed), cell_value(i + 1, j, k, seed), u),
        lerp(cell_value(i, j + 1, k, seed), cell_value(i + 1, j + 1, k, seed), u),
        v,
    )
    high = lerp(
        lerp(cell_value(i, j, k + 1, seed), cell_value(i + 1, j, k + 1, seed), u),
        lerp(cell_value(i, j + 1, k + 1, seed), cell_value(i + 1, j + 1, k + 1, seed), u),
        v,
    )
    return 2.0 * lerp(low, high, w) - 1.0


@numba.njit("float64(float64, float64, int64)", cache=True, error_model="numpy")
def noise2(x: float, y: float, seed: int) -> float:
    """Value noise of two coordinates, in [-1, 1]."""
    i, j = math.floor(x), math.floor(y)
    u, v = ease(x - i), ease(y - j)
    return (
        2.0
        * lerp(
            lerp(cell_value(i, j, 0, seed), cell_value(i + 1, j, 0, seed), u),
            lerp(cell_value(i, j + 1, 0, seed), cell_value(i + 1, j + 1, 0, seed), u),
            v,
        )
        - 1.0
    )


@numba.njit(cache=True, error_model="numpy")
def visible(period: float, footprint: float) -> float:
    """How much of a pattern is left at pixels of this footprint: all while a period has 3 pixels, nothing at 1."""
    if footprint <= 0.0:
        return 1.0
    return min(max(0.5 * (period / footprint - 1.0), 0.0), 1.0)


@numba.njit(cache=True, error_model="numpy")
def lines(x: float, period: float, width: float, footprint: float) -> float:
    """Share of a pixel's footprint about x that lies on lines: [0, width) of every period. Exact box filter."""
    half = 0.5 * max(footprint, 1e-6)
    share = (_lines_until(x + half, period, width) - _lines_until(x - half, period, width)) / (2.0 * half)
    return min(max(share, 0.0), 1.0)


@numba.njit(cache=True, error_model="numpy")
def _lines_until(x: float, period: float, width: float) -> float:
    whole = math.floor(x / period)
    return whole * width + min(x - whole * period, width)
