"""Activity maps: where people were, seen from above, as values in 0..1.

Source: S. Fowler, PhD thesis, Surrey 2019, chapter 3: maps in [0, 1] from 0, co-occurrences add up. The disc kernel and
its weight are hsbench defaults held by the caller's configuration.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.typing import Float32Array, FloatArray, IntArray


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
    positions = np.ascontiguousarray(positions, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(positions).all():
        raise ValueError("positions hold NaN or infinity; expected metres (drop missing poses first)")
    counts = np.zeros(shape, dtype=np.int64)
    _stamp(positions, origin_xy[0], origin_xy[1], cell_m, radius_m, counts)
    return np.minimum(1.0, delta * counts).astype(np.float32)


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
