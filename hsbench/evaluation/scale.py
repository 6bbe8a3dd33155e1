"""The scale-free variant of a score: the answer enlarged or reduced about the camera by the factor that suits it best.

A camera of unknown height leaves the scale of a room open. One of ``FACTORS`` is chosen for an episode, that with the
largest value. Values within ``SLACK`` are equal; of equal ones the factor nearest to 1 is taken, then the smaller. Such
a score is never mixed with the metric one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsbench.typing import IntArray

STEPS = 20
"""Steps of the logarithm on either side of factor 1."""

FACTORS = tuple(2.0 ** (step / STEPS) for step in range(-STEPS, STEPS + 1))
"""41 factors, .5 to 2."""

SLACK = 1e-12


def source(count: int, camera: float, factor: float) -> IntArray:
    """(count,) index along one axis from which each cell of the scaled answer is taken, -1 where from outside.

    camera: where the camera stands on the axis, in cells from its begin. The middle of a cell is divided by the factor;
    on a border the cell of the larger index is taken.
    """
    index = np.floor((np.arange(count) + 0.5 - camera) / factor + camera).astype(np.int64)
    return np.where((index >= 0) & (index < count), index, -1)


def best(values: Sequence[float]) -> int:
    """Index of the factor to take, from the value at each; NaN is no value."""
    known = np.nan_to_num(np.asarray(values, dtype=np.float64), nan=-np.inf)
    equal = np.flatnonzero(known >= known.max() - SLACK) if np.isfinite(known.max()) else np.arange(len(known))
    return int(min(equal, key=lambda k: (abs(k - STEPS), k)))
