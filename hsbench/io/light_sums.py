"""Sums of pictures of light, compiled; in float32 throughout, so that plain numpy gives the same bytes."""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import Float32Array, UInt8Array, UInt16Array


@numba.njit(cache=True, error_model="numpy")
def add_light(total: Float32Array, light: UInt16Array, factor: Float32Array, root_steps: int) -> None:
    """Add a picture of light times a factor (3,) to a sum, in place, in float32 throughout."""
    step = np.float32(1.0 / root_steps)
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            for c in range(3):
                root = np.float32(light[i, j, c]) * step
                total[i, j, c] += np.float32(root * root) * factor[c]


@numba.njit(cache=True, error_model="numpy")
def shown(total: Float32Array, display: UInt8Array, root_steps: int) -> UInt8Array:
    """(h, w, 3) bytes of light (h, w, 3): ``display`` has one for each step of its root."""
    last = np.float32(len(display) - 1)
    rgb = np.empty(total.shape, dtype=np.uint8)
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            for c in range(3):
                root = np.sqrt(total[i, j, c]) * np.float32(root_steps)
                rgb[i, j, c] = display[int(min(root, last))]
    return rgb
