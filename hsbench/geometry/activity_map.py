"""Activity maps: where people were, seen from above, as values in 0..1.

Source: S. Fowler, PhD thesis, Surrey 2019: maps in [0, 1] from 0, co-occurrences add up (chapter 3, RGB-D); maps of 360
poses are smoothed (chapter 4). The kernels, a disc and a Gaussian, and their weights are hsbench defaults held by the
caller's configuration.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import Float32Array, FloatArray, IntArray

BLUR_REACH = 4.0  # standard deviations at which a Gaussian ends: what is left out is below 1 / 2980 of its peak


def rasterise(
    positions: FloatArray,
    origin_xy: tuple[float, float],
    shape: tuple[int, int],
    cell_m: float,
    radius_m: float,
    delta: float,
) -> Float32Array:
    """(N, 2) positions in metres -> (nx, ny) float32 map M = min(1, delta * number of discs over the cell centre).

    origin_xy is the minimum corner of cell (0, 0); radius_m the disc's radius. Positions outside the map add
    what their disc covers of it. Non-finite positions raise ValueError.
    """
    positions = _checked(positions)
    counts = np.zeros(shape, dtype=np.int64)
    _stamp(positions, origin_xy[0], origin_xy[1], cell_m, radius_m, counts)
    return np.minimum(1.0, delta * counts).astype(np.float32)


def rasterise_blurred(
    positions: FloatArray,
    channel: IntArray,
    channels: int,
    origin_xy: tuple[float, float],
    shape: tuple[int, int],
    cell_m: float,
    sigma_m: float,
    delta: float,
) -> Float32Array:
    """(N, 2) positions in metres, (N,) the channel of each -> (channels, nx, ny) float32 maps
    M = min(1, delta * sum of exp(-d^2 / 2 sigma_m^2)), d from each position of the channel to the cell's centre.

    The exact position counts, not its cell. A Gaussian ends ``BLUR_REACH`` sigma from its middle along x and y.
    Frame as ``rasterise``. Raises ValueError for positions that are not finite or channels outside 0..channels - 1.
    """
    positions = _checked(positions)
    channel = np.asarray(channel, dtype=np.int64).reshape(-1)
    if len(channel) != len(positions) or (len(channel) and not 0 <= channel.min() <= channel.max() < channels):
        raise ValueError(f"channel has {len(channel)} entries; expected {len(positions)} within 0..{channels - 1}")
    sums = np.zeros((channels, *shape))
    _blur(positions, channel, origin_xy[0], origin_xy[1], cell_m, sigma_m, sums)
    return np.minimum(1.0, delta * sums).astype(np.float32)


def _checked(positions: FloatArray) -> FloatArray:
    positions = np.ascontiguousarray(positions, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(positions).all():
        raise ValueError("positions hold NaN or infinity; expected metres (drop missing poses first)")
    return positions


@numba.njit(cache=True)
def _stamp(positions: FloatArray, x0: float, y0: float, cell: float, radius: float, counts: IntArray) -> None:
    reach = radius / cell
    for n in range(len(positions)):
        # cell coordinates in which cell (i, j) has its centre at (i, j)
        x = (positions[n, 0] - x0) / cell - 0.5
        y = (positions[n, 1] - y0) / cell - 0.5
        for i in range(max(0, int(np.ceil(x - reach))), min(counts.shape[0] - 1, int(np.floor(x + reach))) + 1):
            for j in range(max(0, int(np.ceil(y - reach))), min(counts.shape[1] - 1, int(np.floor(y + reach))) + 1):
                if (i - x) ** 2 + (j - y) ** 2 <= reach * reach:
                    counts[i, j] += 1


@numba.njit(cache=True)
def _blur(
    positions: FloatArray, channel: IntArray, x0: float, y0: float, cell: float, sigma: float, sums: FloatArray
) -> None:
    reach = BLUR_REACH * sigma / cell
    falloff = 0.5 * (cell / sigma) ** 2
    along_y = np.empty(2 * int(np.ceil(reach)) + 2)
    for n in range(len(positions)):
        x = (positions[n, 0] - x0) / cell - 0.5
        y = (positions[n, 1] - y0) / cell - 0.5
        first, last = max(0, int(np.ceil(y - reach))), min(sums.shape[2] - 1, int(np.floor(y + reach)))
        if last < first:  # an empty slice below must not begin from the end
            continue
        for j in range(first, last + 1):
            along_y[j - first] = np.exp(-falloff * (j - y) ** 2)
        for i in range(max(0, int(np.ceil(x - reach))), min(sums.shape[1] - 1, int(np.floor(x + reach))) + 1):
            along_x = np.exp(-falloff * (i - x) ** 2)
            row = sums[channel[n], i, first : last + 1]
            for j in range(len(row)):
                row[j] += along_x * along_y[j]
