"""Compiled loops that take the pixels of a patch out of a picture, and lay them over one.

Apart, since numba is slow to load and data without pictures need none. What they make is described in ``patch_table``.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import AnyArray, BoolArray, UInt8Array, UInt16Array

DEPTH_BIAS = 128  # added to a step of depth, so that the high byte of a small one is 0 whatever its sign


@numba.njit(cache=True, nogil=True)
def runs_of(mask: BoolArray, row: int, column: int, width_px: int) -> AnyArray:
    """(n,) uint32 of a mask (h, w) in a picture, row-major: how many pixels off, on, off ... up to the last on."""
    height, width = mask.shape
    runs = np.empty(2 * height * ((width + 1) // 2), dtype=np.uint32)
    n = done = 0
    for i in range(height):
        start = (row + i) * width_px + column
        for j in range(width):
            if mask[i, j]:
                place = start + j
                if n == 0 or place > done:
                    runs[n], runs[n + 1] = place - done, 0
                    n += 2
                runs[n - 1] += 1
                done = place + 1
    return runs[:n]


@numba.njit(cache=True, nogil=True)
def steps_of(
    mask: BoolArray, rgb: UInt8Array, depth_mm: UInt16Array, instance: UInt16Array
) -> tuple[UInt16Array, UInt8Array, UInt8Array, UInt8Array]:
    """Of pictures (h, w) and the N pixels of the mask, row-major: steps down the columns.

    (N,) of ids, (N, 3) of red - green, green and blue - green, (N,) low and (N,) high bytes of those of depth.
    """
    height, width = mask.shape
    count = np.count_nonzero(mask)
    ids, colours = np.empty(count, np.uint16), np.empty((count, 3), np.uint8)
    low, high = np.empty(count, np.uint8), np.empty(count, np.uint8)
    above = np.zeros((width, 5), dtype=np.int64)
    n = 0
    for i in range(height):
        for j in range(width):
            if mask[i, j]:
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
    return ids, colours, low, high


@numba.njit(cache=True, nogil=True)
def lay_over(
    runs: AnyArray, ids: UInt16Array, colours: UInt8Array, low: UInt8Array, high: UInt8Array, rgb: UInt8Array,
    depth_mm: UInt16Array, instance: UInt16Array,
) -> None:  # fmt: skip
    """Set, in place, the pixels of pictures (h, w) that the runs name: the inverse of ``runs_of`` and ``steps_of``.

    The caller has made sure that the runs name as many pixels as there are, and none beyond the picture.
    """
    width = depth_mm.shape[1]
    sums = np.zeros((width, 5), dtype=np.int64)
    place = n = 0
    for run in range(0, len(runs), 2):
        place += runs[run]
        i, j = divmod(place, width)
        for _ in range(runs[run + 1]):
            if j == width:
                i, j = i + 1, 0
            own = sums[j]
            for c in range(3):
                own[c] += colours[n, c]
            own[3] += low[n] + (high[n] << 8) - DEPTH_BIAS
            own[4] += ids[n]
            rgb[i, j, 0], rgb[i, j, 1], rgb[i, j, 2] = own[0] + own[1], own[1], own[2] + own[1]
            depth_mm[i, j], instance[i, j] = own[3], own[4]
            n += 1
            j += 1
        place += runs[run + 1]
