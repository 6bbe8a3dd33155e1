"""What a static camera showed without the people: the median over some pictures of an episode."""

from __future__ import annotations

import numpy as np

from hsbench.errors import DataError
from hsbench.schema.episode import Episode, Frames
from hsbench.typing import Float32Array, IntArray, UInt8Array

MOST_FRAMES = 15
"""Pictures a median is taken of: whoever is in one place in fewer than half of them does not show."""


def background_rgb(episode: Episode) -> UInt8Array:
    """(h, w, 3) uint8, the lower median of each colour over up to ``MOST_FRAMES`` pictures, evenly spread.

    Raises DataError where the episode has no colour pictures.
    """
    frames = episode.frames
    found = [frame.rgb for frame in map(frames.__getitem__, _spread(frames).tolist()) if frame.rgb is not None]
    if not found:
        raise DataError(f"episode {episode.episode_id} has no colour pictures; expected some to compare")
    middle = (len(found) - 1) // 2
    pictures = np.stack(found)
    pictures.partition(middle, axis=0)
    return pictures[middle]


def background_depth(episode: Episode) -> Float32Array:
    """(h, w) float32 metres, the lower median of each pixel's readings over up to ``MOST_FRAMES`` pictures; 0 = none.

    Raises DataError where the episode has no depth pictures.
    """
    frames = episode.frames
    found = [f.depth_m for f in map(frames.__getitem__, _spread(frames).tolist()) if f.depth_m is not None]
    if not found:
        raise DataError(f"episode {episode.episode_id} has no depth pictures; expected those of an RGB-D camera")
    depth_m = np.stack(found)
    readings = (depth_m > 0).sum(axis=0)
    ordered = np.sort(np.where(depth_m > 0, depth_m, np.inf), axis=0)
    middle = np.take_along_axis(ordered, np.maximum(readings - 1, 0)[None] // 2, axis=0)[0]
    return np.where(readings > 0, middle, 0.0).astype(np.float32)


def _spread(frames: Frames) -> IntArray:
    """Indices of up to ``MOST_FRAMES`` frames from the first to the last."""
    count = min(len(frames), MOST_FRAMES)
    return np.round(np.linspace(0, len(frames) - 1, count)).astype(np.int64)
