"""Compiled loops that take the pixels of a patch out of a picture, and lay them over one.

Apart, since numba is slow to load and data without pictures need none. Bits of a mask are row-major, little bit order.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import BoolArray, UInt8Array, UInt16Array


@numba.njit(cache=True)
def taken(
    mask: BoolArray, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array
) -> tuple[UInt8Array, UInt8Array, UInt16Array, UInt16Array]:
    """Of (h, w) pictures: the bits of the mask, and (N, 3) rgb, (N,) depth and (N,) ids of its N pixels, row-major."""
    height, width = mask.shape
    count = np.count_nonzero(mask)
    bits = np.zeros((mask.size + 7) // 8, dtype=np.uint8)
    colours, depths, ids = np.empty((count, 3), np.uint8), np.empty(count, np.uint16), np.empty(count, np.uint16)
    n = 0
    for i in range(height):
        for j in range(width):
            if mask[i, j]:
                place = i * width + j
                bits[place >> 3] |= np.uint8(1 << (place & 7))
                for c in range(3):
                    colours[n, c] = rgb[i, j, c]
                depths[n], ids[n] = depth_mm[i, j], instance[i, j]
                n += 1
    return bits, colours, depths, ids


@numba.njit(cache=True)
def lay_over(
    bits: UInt8Array, colours: UInt8Array, depths: UInt16Array, ids: UInt16Array, rgb: UInt8Array,
    depth_mm: UInt16Array, instance: UInt16Array,
) -> None:  # fmt: skip
    """The inverse of ``taken``: set, in place, the pixels of (h, w) pictures that the bits name.

    The caller has made sure that there are as many set bits as pixels, and none beyond h * w.
    """
    width = depth_mm.shape[1]
    n = 0
    for byte in range(len(bits)):
        if bits[byte] == 0:
            continue
        for bit in range(8):
            if bits[byte] >> bit & 1:
                i, j = divmod(byte * 8 + bit, width)
                for c in range(3):
                    rgb[i, j, c] = colours[n, c]
                depth_mm[i, j], instance[i, j] = depths[n], ids[n]
                n += 1
