"""Which cuboids together explain a room best: a mixed integer linear program, solved with HiGHS.

    min   sum_i U_i x_i  +  l_O sum_ij O_ij z_ij  -  sum_k w_k y_k
    s.t.  z_ij >= x_i + x_j - 1,   x_i + x_j <= 1 where two share too much,   y_k <= sum_{i covers k} x_i
          x_i in {0, 1},   0 <= y_k, z_ij <= 1

Unary costs, overlaps and coverage are the terms that the source names (S. Fowler, PhD thesis, University of Surrey,
2019, chapter 3); their weights are ours. The nearest public relative is Jiang and Xiao, CVPR 2013.

Voxels that the same candidates cover count as one y_k. Pairs that exclude each other are joined to cliques of which at
most one is chosen: fewer rows, and a bound that is much closer to the answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array, csr_array, hstack, vstack

from hsbench.baselines.occlusion.candidates import shared, volumes
from hsbench.baselines.occlusion.config import CuboidConfig
from hsbench.typing import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Choice:
    """chosen: (C,) bool. gap: proven relative distance to the best choice, 0 = none is better, NaN = not known."""

    chosen: BoolArray
    gap: float


def choose(cuboids: IntArray, cost: FloatArray, weight: FloatArray, config: CuboidConfig) -> Choice:
    """The best of (C, 3, 2) cuboids with unary costs (C,), given the weight (nx, ny, nz) of covering each voxel.

    Raises RuntimeError if HiGHS finds nothing at all, which choosing no cuboid forbids.
    """
    count = len(cuboids)
    if not count:
        return Choice(np.zeros(0, dtype=np.bool_), 0.0)
    covers, gain = coverage(cuboids, weight)
    share = shared(cuboids) / np.minimum.outer(volumes(cuboids), volumes(cuboids))
    np.fill_diagonal(share, 0.0)
    if config.greedy:
        return _greedy(np.asarray(covers.T @ gain) - cost, share > config.exclusion)
    cliques = exclusive(share > config.exclusion)
    first, second = np.nonzero(np.triu((share > config.least_overlap) & (share <= config.exclusion)))
    sets, pairs = len(gain), len(first)
    both = config.overlap_cost * shared(cuboids)[first, second]
    rows = [csr_array((0, count + sets + pairs))]
    upper = []
    if sets:  # y_k - sum x_i <= 0
        one = coo_array((np.ones(sets), (np.arange(sets), np.arange(sets))), shape=(sets, sets))
        rows.append(_row_block([-covers, one, csr_array((sets, pairs))]))
        upper.append(np.zeros(sets))
    if len(cliques):
        rows.append(_row_block([_membership(cliques, count), csr_array((len(cliques), sets + pairs))]))
        upper.append(np.ones(len(cliques)))
    if pairs:  # x_i + x_j - z_ij <= 1
        ones, at = np.ones(pairs), np.arange(pairs)
        ends = coo_array((np.r_[ones, ones], (np.r_[at, at], np.r_[first, second])), shape=(pairs, count))
        rows.append(_row_block([ends, csr_array((pairs, sets)), coo_array((-ones, (at, at)), shape=(pairs, pairs))]))
        upper.append(np.ones(pairs))
    limits = np.concatenate(upper) if upper else np.zeros(0)
    found = milp(
        np.concatenate([cost, -gain, both]),
        integrality=np.r_[np.ones(count), np.zeros(sets + pairs)],
        bounds=Bounds(0.0, 1.0),
        constraints=LinearConstraint(vstack(rows), -np.inf, limits) if len(limits) else (),
        options={"mip_rel_gap": config.gap, "time_limit": config.limit_s},
    )
    if found.x is None:
        raise RuntimeError(f"HiGHS: {found.message}; expected at least the choice of no cuboid")
    return Choice(found.x[:count] > 0.5, float(found.mip_gap or 0.0))


def _greedy(worth: FloatArray, conflict: BoolArray) -> Choice:
    """Non-maximum suppression: by falling worth, as long as it is positive, what nothing chosen before excludes."""
    chosen = np.zeros(len(worth), dtype=np.bool_)
    for k in np.argsort(-worth, kind="stable"):
        chosen[k] = worth[k] > 0.0 and not (conflict[k] & chosen).any()
    return Choice(chosen, np.nan)


def _row_block(blocks: list[csr_array]) -> csr_array:
    return csr_array(hstack(blocks))


def coverage(cuboids: IntArray, weight: FloatArray) -> tuple[csr_array, FloatArray]:
    """((S, C) which candidates cover each set of voxels, (S,) the weight of the set): voxels alike are one set."""
    inside = np.zeros((*weight.shape, -(-len(cuboids) // 8)), dtype=np.uint8)
    for k, ((x0, x1), (y0, y1), (z0, z1)) in enumerate(cuboids):
        inside[x0:x1, y0:y1, z0:z1, k // 8] |= np.uint8(1 << k % 8)
    held = (weight > 0) & inside.any(axis=3)
    rows, which = np.unique(inside[held], axis=0, return_inverse=True)
    gain: FloatArray = np.bincount(which.ravel(), weights=weight[held], minlength=len(rows)).astype(np.float64)
    return csr_array(np.unpackbits(rows, axis=1, count=len(cuboids), bitorder="little").astype(np.float64)), gain


def exclusive(conflict: BoolArray) -> list[IntArray]:
    """Cliques of a symmetric (C, C) relation that hold each of its pairs at least once, grown greedily."""
    left, cliques = np.triu(conflict), []
    for i in range(len(conflict)):
        while left[i].any():
            clique = [i, int(np.flatnonzero(left[i])[0])]
            common = conflict[clique[0]] & conflict[clique[1]]
            while common.any():
                new = left[clique][:, common].sum(axis=0)  # pairs that joining one of them would settle
                nearest = np.flatnonzero(common)[np.argmax(new)]
                clique.append(int(nearest))
                common &= conflict[nearest]
            members = np.array(sorted(clique))
            left[np.ix_(members, members)] = False
            cliques.append(members)
    return cliques


def _membership(cliques: list[IntArray], count: int) -> csr_array:
    row = np.repeat(np.arange(len(cliques)), [len(clique) for clique in cliques])
    return csr_array((np.ones(len(row)), (row, np.concatenate(cliques))), shape=(len(cliques), count))
