"""Compiled loops that take the pixels of a patch out of a picture, and lay them over one.

Apart, since numba is slow to load and data without pictures need none. What they make is described in ``patch_table``.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import BoolArray, UInt8Array, UInt16Array

DEPTH_BIAS = 128  # added to a step of depth, so that the high byte of a small one is 0 whatever its sign


@numba.njit(cache=True, nogil=True)
def taken(
    mask: BoolArray, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array
) -> tuple[UInt8Array, UInt8Array, UInt8Array, UInt8Array, UInt16Array]:
    """Of (h, w) pictures and the N pixels of the mask, row-major: (h, ceil(w / 8)) bits, and steps down the columns.

    (N, 3) of red - green, green and blue - green, (N,) low and (N,) high bytes of depth, (N,) of ids.
    """
    height, width = mask.shape
    count = np.count_nonzero(mask)
    bits = np.zeros((height, (width + 7) // 8), dtype=np.uint8)
    colours, ids = np.empty((count, 3), np.uint8), np.empty(count, np.uint16)
    low, high = np.empty(count, np.uint8), np.empty(count, np.uint8)
    above = np.zeros((width, 5), dtype=np.int64)
    n = 0
    for i in range(height):
        for j in range(width):
            if mask[i, j]:
                bits[i, j >> 3] |= np.uint8(1 << (j & 7))
                last = above[j]
                green = np.int64(rgb[i, j, 1])
                red, blue = rgb[i, j, 0] - green, rgb[i, j, 2] - green
                colours[n, 0], colours[n, 1], colours[n, 2] = red - last[0], green - last[1], blue - last[2]
                depth, number = np.int64(depth_mm[i, j]), np.int64(instance[i, j])
                step = depth - last[3] + DEPTH_BIAS
                low[n], high[n] = step, step >> 8
                ids[n] = number - last[4]
                last[0], last[1], last[2], last[3], last[4] = red, green, blue, depth, number
                n += 1
    return bits, colours, low, high, ids


@numba.njit(cache=True, nogil=True)
def lay_over(
    bits: UInt8Array, colours: UInt8Array, low: UInt8Array, high: UInt8Array, ids: UInt16Array, rgb: UInt8Array,
    depth_mm: UInt16Array, instance: UInt16Array,
) -> None:  # fmt: skip
    """The inverse of ``taken``: set, in place, the pixels of (h, w) pictures that the bits name.

    The caller has made sure that there are as many set bits as pixels, and none beyond the width.
    """
    height, width = depth_mm.shape
    sums = np.zeros((width, 5), dtype=np.int64)
    n = 0
    for i in range(height):
        for byte in range(bits.shape[1]):
            rest = bits[i, byte]
            j = byte * 8
            while rest:
                if rest & 1:
                    own = sums[j]
                    for c in range(3):
                        own[c] += colours[n, c]
                    own[3] += low[n] + (high[n] << 8) - DEPTH_BIAS
                    own[4] += ids[n]
                    rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2] = own[0] + own[1], own[1], own[2] + own[1]
                    depth_mm[i, j], instance[i, j] = own[3], own[4]
                    n += 1
                rest >>= 1
                j += 1
