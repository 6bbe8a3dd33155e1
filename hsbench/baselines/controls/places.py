"""What can be told of a place: the number of a bin, from which ``best_iou`` learns where a label is.

``presence`` bins places by how much of the time people were there, ``colour`` by the colour of a pixel.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt

from hsbench.errors import DataError
from hsbench.geometry.activity_map import rasterise
from hsbench.schema.episode import Episode
from hsbench.typing import FloatArray, IntArray, UInt8Array

LEVELS = 16  # of presence, each twice as long as the one before; the last ends with all of the time
DISTANCES = 16  # bins of cells without presence, one a cell of distance
PRESENCE_BINS = LEVELS + DISTANCES
COLOUR_BITS = 2  # of each channel that are kept
COLOURS = 1 << 3 * COLOUR_BITS


def presence(
    places: FloatArray,
    share: float,
    origin: tuple[float, float],
    shape: tuple[int, int],
    cell: float,
    radius: float,
) -> IntArray:
    """(N, 2) places, each held for a share of the observation -> (nx, ny) number of the bin of each cell.

    Bins 0 .. ``LEVELS`` - 1: by the share of time that discs of ``radius`` covered the cell, which false detections do
    not make larger in a longer observation. The others, of cells that none covered: by the distance in cells from one
    that was; the last is all that is farther away.
    """
    held = rasterise(places, origin, shape, cell, radius, share).astype(np.float64)
    present = held > 0
    if not present.any():
        return np.full(shape, PRESENCE_BINS - 1, dtype=np.int64)
    level = LEVELS - 1 + np.ceil(np.log2(np.where(present, held, 1.0)))
    distance = LEVELS - 1 + np.minimum(np.ceil(distance_transform_edt(~present)), DISTANCES)
    return np.where(present, np.maximum(level, 0), distance).astype(np.int64)


def picture(episode: Episode) -> UInt8Array:
    """(h, w, 3) colours of the first frame. Raises DataError where there is none."""
    rgb = episode.frames[0].rgb if len(episode.frames) else None
    if rgb is None:
        raise DataError(f"episode {episode.episode_id} has no picture; methods that use frames need the one at t0")
    return rgb


def colour(rgb: UInt8Array) -> IntArray:
    """(..., 3) uint8 -> (...) number of the colour, 0 .. ``COLOURS`` - 1: the first bits of each channel."""
    red, green, blue = np.moveaxis((rgb >> (8 - COLOUR_BITS)).astype(np.int64), -1, 0)
    return np.asarray((red << 2 * COLOUR_BITS) | (green << COLOUR_BITS) | blue)
