"""Which detection hits which truth: the three ways of matching, compiled, all scenes and classes in one pass.

Detections come sorted by key (class and scene), then as the protocol orders them; truths by the same key. ``iou`` is
read at row[d] + column[t]. Nothing depends on how many scenes are scored in one call.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from hsbench.typing import BoolArray, FloatArray, IntArray

HIT = 1
FALSE = 0
NEITHER = -1
"""Outcomes of a detection: hits a truth, hits none, or does not count (its truth is difficult, or it is left out)."""


@numba.njit(cache=True)
def match_best(
    iou: FloatArray,
    row: IntArray,
    column: IntArray,
    order: IntArray,
    key: IntArray,
    truth_order: IntArray,
    truth_key: IntArray,
    difficult: BoolArray,
    thresholds: FloatArray,
    strict: bool,
    slack: float,
    outcome: NDArray[np.int8],
    hit_by: IntArray,
) -> None:
    """Each detection goes to its truth of highest IoU, the first among equals, whether taken or not.

    order, key: (n,) detections and their keys, sorted; truth_order, truth_key alike. slack: up to which an IoU equals
    another, or a threshold. outcome: (T, D) int8, written for the detections in ``order``. hit_by: (T, G), filled with
    -1, becomes the detection that hit a truth.
    """
    first = 0
    for i in range(len(order)):
        d = order[i]
        while first < len(truth_key) and truth_key[first] < key[i]:
            first += 1
        best, overlap = -1, 0.0
        j = first
        while j < len(truth_key) and truth_key[j] == key[i]:
            value = iou[row[d] + column[truth_order[j]]]
            if value > overlap + slack:
                best, overlap = truth_order[j], value
            j += 1
        for k in range(len(thresholds)):
            if best < 0 or overlap < thresholds[k] - slack or (strict and overlap == thresholds[k]):
                outcome[k, d] = FALSE
            elif difficult[best]:
                outcome[k, d] = NEITHER
            elif hit_by[k, best] < 0:
                outcome[k, d] = HIT
                hit_by[k, best] = d
            else:
                outcome[k, d] = FALSE


@numba.njit(cache=True)
def match_untaken(
    iou: FloatArray,
    row: IntArray,
    column: IntArray,
    order: IntArray,
    key: IntArray,
    truth_order: IntArray,
    truth_key: IntArray,
    ignored: BoolArray,
    crowd: BoolArray,
    outside: BoolArray,
    thresholds: FloatArray,
    limit: int,
    outcome: NDArray[np.int8],
    rank: IntArray,
) -> None:
    """Each detection goes to its best truth that is not taken, one that counts before one that is ignored.

    As COCO: among equals the last truth wins; a crowd is never taken; an unmatched detection outside the range does
    not count. ignored: (A, G), outside: (A, D) per range. outcome: (D, A, T). rank: (D,) place of a detection in its
    class and scene, from 0; those from ``limit`` on are NEITHER.
    """
    ranges, steps = len(ignored), len(thresholds)
    taken = np.zeros((ranges, steps, 64), dtype=np.bool_)
    first, last, place = 0, 0, 0
    for i in range(len(order)):
        d = order[i]
        if i == 0 or key[i] != key[i - 1]:
            first, place = last, 0
            while first < len(truth_key) and truth_key[first] < key[i]:
                first += 1
            last = first
            while last < len(truth_key) and truth_key[last] == key[i]:
                last += 1
            if last - first > taken.shape[2]:
                taken = np.zeros((ranges, steps, 2 * (last - first)), dtype=np.bool_)
            else:
                taken[:, :, : last - first] = False
        rank[d] = place
        place += 1
        if rank[d] >= limit:
            outcome[d] = NEITHER
            continue
        largest = 0.0
        for j in range(first, last):
            largest = max(largest, iou[row[d] + column[truth_order[j]]])
        for a in range(ranges):
            for k in range(steps):
                need = min(thresholds[k], 1.0 - 1e-10)
                best = -1
                if largest >= need:
                    for j in range(first, last):
                        t = truth_order[j]
                        if not ignored[a, t] and not taken[a, k, j - first] and iou[row[d] + column[t]] >= need:
                            best, need = j, iou[row[d] + column[t]]
                    if best < 0:
                        for j in range(first, last):
                            t = truth_order[j]
                            free = crowd[t] or not taken[a, k, j - first]
                            if ignored[a, t] and free and iou[row[d] + column[t]] >= need:
                                best, need = j, iou[row[d] + column[t]]
                if best < 0:
                    outcome[d, a, k] = NEITHER if outside[a, d] else FALSE
                else:
                    taken[a, k, best - first] = True
                    outcome[d, a, k] = NEITHER if ignored[a, truth_order[best]] else HIT


@numba.njit(cache=True)
def match_pairs(iou: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """(N, M) IoU of one scene -> pairs (detection, truth, IoU), 1-1, the largest IoU left taken first, while > 0.

    Among equals the first truth, then the first detection (column-major, as MATLAB's max).
    """
    n, m = iou.shape
    most = min(n, m)
    detection, truth, overlap = np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most)
    used, hit = np.zeros(n, np.bool_), np.zeros(m, np.bool_)
    count = 0
    while count < most:
        best = 0.0
        for t in range(m):
            if hit[t]:
                continue
            for d in range(n):
                if not used[d] and iou[d, t] > best:
                    best = iou[d, t]
                    detection[count], truth[count] = d, t
        if best == 0.0:
            break
        used[detection[count]], hit[truth[count]], overlap[count] = True, True, best
        count += 1
    return detection[:count], truth[:count], overlap[:count]


@numba.njit(cache=True)
def accumulate(
    order: IntArray,
    class_start: IntArray,
    outcome: NDArray[np.int8],
    rank: IntArray,
    truths: IntArray,
    limits: IntArray,
    levels: FloatArray,
    ap: FloatArray,
    recall: FloatArray,
) -> None:
    """AP by sampling the envelope, and recall, for every range, threshold and class, as COCO rounds them.

    order: (n,) detections by class, then by descending score; class_start: (K + 1,). outcome: (D, A, T). rank: (D,).
    truths: (A, K) that count. limits: (M,). levels: the sampled recalls, which must come from numpy's linspace: the
    compiled one rounds otherwise. ap: (A, T, K) and recall: (A, M, T, K) are written, NaN where no truth counts.
    """
    cells = outcome.shape[1] * outcome.shape[2]
    outcomes = outcome.reshape(len(outcome), cells)
    aps = ap.reshape(cells, -1)
    longest = 0
    for c in range(len(class_start) - 1):
        longest = max(longest, class_start[c + 1] - class_start[c])
    precision = np.empty((cells, longest))
    tp, fp = np.empty(cells, np.int64), np.empty(cells, np.int64)
    hits = np.empty((len(limits), cells), np.int64)
    tiny = np.spacing(1.0)
    for c in range(len(class_start) - 1):
        tp[:], fp[:], hits[:] = 0, 0, 0
        for i in range(class_start[c], class_start[c + 1]):
            d = order[i]
            for x in range(cells):
                if outcomes[d, x] == FALSE:
                    fp[x] += 1
                elif outcomes[d, x] == HIT:
                    # only here can the envelope step: between hits precision falls
                    tp[x] += 1
                    precision[x, tp[x] - 1] = tp[x] / (float(fp[x] + tp[x]) + tiny)
                    for m in range(len(limits)):
                        hits[m, x] += rank[d] < limits[m]
        for x in range(cells):
            a, k = x // outcome.shape[2], x % outcome.shape[2]
            positives = truths[a, c]
            if positives == 0:
                aps[x, c] = np.nan
                recall[a, :, k, c] = np.nan
                continue
            for m in range(len(limits)):
                recall[a, m, k, c] = hits[m, x] / positives
            for i in range(tp[x] - 2, -1, -1):
                precision[x, i] = max(precision[x, i], precision[x, i + 1])
            total, i = 0.0, 0
            for level in levels:
                while i < tp[x] and (i + 1) / positives < level:
                    i += 1
                if i == tp[x]:
                    break
                total += precision[x, i]
            aps[x, c] = total / len(levels)
