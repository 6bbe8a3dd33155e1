"""Random series over irregular times, a row of them for each look at a body.

The series is a Matern process of order 3/2: as smooth as motion, correlation (1 + a) exp(-a) after a = dt / time_s.
With its scaled derivative it is a Markov chain, which steps exactly over any time (Rasmussen and Williams, "Gaussian
Processes for Machine Learning", MIT Press 2006, B.2).
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.schema.episode import NS_PER_S
from hsbench.typing import FloatArray, IntArray

STEP_DECIMALS = 12  # of what a step keeps and adds
LONGEST = 50.0  # in correlation times: nothing is left of what was before


def drifting(timestamp_ns: IntArray, columns: int, time_s: float, rng: np.random.Generator) -> FloatArray:
    """(N,) ascending times -> (N, columns) standard normal series with correlation (1 + a) exp(-a), a = dt / time_s.

    The first rows do not depend on how many follow.
    """
    white = rng.standard_normal((len(timestamp_ns), 2, columns))
    a = np.minimum(np.diff(timestamp_ns, prepend=timestamp_ns[:1]) / NS_PER_S / time_s, LONGEST)
    a[:1] = LONGEST
    keep = np.exp(-a) * np.array([[1.0 + a, a], [-a, 1.0 - a]])
    lost = np.einsum("ijn,kjn->ikn", keep, keep)
    fresh = np.zeros((3, len(a)))
    fresh[0] = np.sqrt(np.maximum(1.0 - lost[0, 0], 0.0))
    fresh[1] = np.where(fresh[0] > 0, -lost[0, 1] / np.where(fresh[0] > 0, fresh[0], 1.0), 0.0)
    fresh[2] = np.sqrt(np.maximum(1.0 - lost[1, 1] - fresh[1] ** 2, 0.0))
    steps = np.concatenate([keep.reshape(4, -1), fresh]).T
    return np.asarray(_walk(white, np.ascontiguousarray(np.round(steps, STEP_DECIMALS))))


@numba.njit(cache=True)
def _walk(white: FloatArray, steps: FloatArray) -> FloatArray:
    """(N, 2, C) white noise, (N, 7) steps: what is kept (2 x 2) and what is added (lower triangle) -> (N, C)."""
    out = np.empty((white.shape[0], white.shape[2]))
    slope = np.zeros(white.shape[2])
    for t in range(len(out)):
        xx, xv, vx, vv, fx, fm, fv = steps[t]
        for k in range(out.shape[1]):
            before = out[t - 1, k] if t > 0 else 0.0
            out[t, k] = xx * before + xv * slope[k] + fx * white[t, 0, k]
            slope[k] = vx * before + vv * slope[k] + fm * white[t, 0, k] + fv * white[t, 1, k]
    return out
