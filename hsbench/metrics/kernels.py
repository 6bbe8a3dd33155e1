"""Compiled counting loops. Imported by the functions that need them, so that ``import hsbench.metrics`` stays light.

All of them only add integers: order, chunks and threads change nothing. They release the interpreter lock, and each
works on its own part and its own table. Inputs are checked by the callers.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from hsbench.typing import AnyArray, IntArray, UInt8Array

WORDS_PER_BLOCK = 255  # a byte counts to 255


@numba.njit(cache=True, nogil=True)
def pair_counts(first: UInt8Array, second: UInt8Array) -> AnyArray:
    """(N,) and (N,) uint8 -> (65536,) uint32: how often each pair occurs, at first * 256 + second; N < 2^32.

    Four tables take turns: equal pixels lie side by side, and a counter just written is slow to read again.
    """
    tables = np.zeros((4, 65536), dtype=np.uint32)
    t0, t1, t2, t3 = tables[0], tables[1], tables[2], tables[3]
    whole = len(first) // 4 * 4
    for i in range(0, whole, 4):
        t0[(np.uint32(first[i]) << np.uint32(8)) | np.uint32(second[i])] += np.uint32(1)
        t1[(np.uint32(first[i + 1]) << np.uint32(8)) | np.uint32(second[i + 1])] += np.uint32(1)
        t2[(np.uint32(first[i + 2]) << np.uint32(8)) | np.uint32(second[i + 2])] += np.uint32(1)
        t3[(np.uint32(first[i + 3]) << np.uint32(8)) | np.uint32(second[i + 3])] += np.uint32(1)
    for i in range(whole, len(first)):
        t0[(np.uint32(first[i]) << np.uint32(8)) | np.uint32(second[i])] += np.uint32(1)
    return t0 + t1 + t2 + t3


@numba.njit(cache=True, nogil=True)
def count_two(truth: AnyArray, prediction: AnyArray) -> tuple[int, int, int]:
    """(W,) uint64 words of eight bools each -> number of true bytes in truth AND prediction, truth, prediction."""
    both, truths, predictions = 0, 0, 0
    for start in range(0, len(truth), WORDS_PER_BLOCK):
        sum_both, sum_truth, sum_prediction = np.uint64(0), np.uint64(0), np.uint64(0)
        for i in range(start, min(start + WORDS_PER_BLOCK, len(truth))):
            sum_both += truth[i] & prediction[i]
            sum_truth += truth[i]
            sum_prediction += prediction[i]
        both += byte_sum(sum_both)
        truths += byte_sum(sum_truth)
        predictions += byte_sum(sum_prediction)
    return both, truths, predictions


@numba.njit(cache=True, nogil=True)
def count_three(truth: AnyArray, prediction: AnyArray, mask: AnyArray) -> tuple[int, int, int, int]:
    """As ``count_two`` within a mask, and the number of true bytes in the mask."""
    both, truths, predictions, inside = 0, 0, 0, 0
    for start in range(0, len(truth), WORDS_PER_BLOCK):
        sum_both, sum_truth, sum_prediction, sum_mask = np.uint64(0), np.uint64(0), np.uint64(0), np.uint64(0)
        for i in range(start, min(start + WORDS_PER_BLOCK, len(truth))):
            solid = truth[i] & mask[i]
            sum_both += solid & prediction[i]
            sum_truth += solid
            sum_prediction += prediction[i] & mask[i]
            sum_mask += mask[i]
        both += byte_sum(sum_both)
        truths += byte_sum(sum_truth)
        predictions += byte_sum(sum_prediction)
        inside += byte_sum(sum_mask)
    return both, truths, predictions, inside


@numba.njit(cache=True, nogil=True, inline="always")
def byte_sum(word: Any) -> Any:
    """The sum of a word's eight bytes: even and odd bytes as 16-bit lanes, added up by a multiplication."""
    lanes = (word & np.uint64(0x00FF00FF00FF00FF)) + ((word >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF))
    return np.int64((lanes * np.uint64(0x0001000100010001)) >> np.uint64(48))


@numba.njit(cache=True, nogil=True)
def edit_distance(first: IntArray, second: IntArray) -> int:
    """(M,) and (N,) int64 -> Levenshtein distance: insertions, deletions and substitutions cost 1 each."""
    row = np.arange(len(second) + 1)
    for i in range(len(first)):
        diagonal, row[0] = row[0], i + 1
        for j in range(len(second)):
            above = row[j + 1]
            substituted = diagonal + (first[i] != second[j])
            row[j + 1] = min(substituted, above + 1, row[j] + 1)
            diagonal = above
    return int(row[-1])
