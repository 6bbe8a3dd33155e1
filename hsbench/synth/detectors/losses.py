"""What a detector loses though it could see it: single joints, a body in one look, and a body for a while."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np

from hsbench.geometry.numerics import quantise_m
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.poses import JointState
from hsbench.synth.detectors.config import DetectorConfig
from hsbench.synth.detectors.drift import drifting
from hsbench.synth.seeds import Seeds
from hsbench.typing import BoolArray, IntArray, UInt8Array

S_PER_MIN = 60.0


def reported_states(state: UInt8Array, timestamp_ns: IntArray, config: DetectorConfig, seeds: Seeds) -> UInt8Array:
    """(N, J) what could be seen of a body -> (N, J) what the detector reports of it: the rest is MISSING.

    Each joint has a normal variable that drifts, and is reported while that is below the quantile of its share: so
    that a joint comes and goes for as long as errors drift.
    """
    if config.guessed_share == 1.0 and config.joint_loss_share == 0.0:
        return state
    ease = drifting(timestamp_ns, state.shape[1], config.drift_s, seeds.rng("joints"))
    hidden = state == JointState.INFERRED
    limit = np.where(hidden, _quantile(config.guessed_share), _quantile(1.0 - config.joint_loss_share))
    return np.where(ease < limit, state, JointState.MISSING).astype(np.uint8)


def missed(timestamp_ns: IntArray, config: DetectorConfig, seeds: Seeds) -> BoolArray:
    """(N,) whether the detector misses a body at ascending times, in single looks or in bursts."""
    lost = seeds.rng("misses").random(len(timestamp_ns)) < config.miss_share
    if len(timestamp_ns):
        rng = seeds.rng("bursts")
        start_ns, end_ns = int(timestamp_ns[0]), int(timestamp_ns[-1])
        for first_ns, last_ns in spells(start_ns, end_ns, config.bursts_per_min, config.burst_s, rng):
            lost |= (timestamp_ns >= first_ns) & (timestamp_ns < last_ns)
    return lost


def spells(
    start_ns: int, end_ns: int, per_min: float, length_s: tuple[float, float], rng: np.random.Generator
) -> list[tuple[int, int]]:
    """Spells [first, last) in ns that begin in start .. end: their ends and next beginnings are exponentially apart.

    Those of a longer time begin with those of a shorter one.
    """
    found: list[tuple[int, int]] = []
    if per_min == 0:
        return found
    at_s = 0.0
    while True:
        at_s = float(quantise_m(at_s + rng.exponential(S_PER_MIN / per_min)))
        length = float(quantise_m(rng.uniform(*length_s)))
        first_ns = start_ns + round(at_s * NS_PER_S)
        if first_ns > end_ns:
            return found
        found.append((first_ns, first_ns + round(length * NS_PER_S)))
        at_s += length


def _quantile(share: float) -> float:
    """The value below which a standard normal variable lies with this probability."""
    if share in (0.0, 1.0):
        return np.inf if share else -np.inf
    return NormalDist().inv_cdf(share)
