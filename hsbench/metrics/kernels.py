"""Compiled counting loops. Imported by the functions that need them, so that ``import hsbench.metrics`` stays light.

All of them only add integers: order, chunks and threads change nothing. They release the interpreter lock, and each
works on its own part and its own table. Inputs are checked by the callers.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from hsbench.typing import AnyArray, IntArray, UInt8Array

BLOCK = 248
"""Words added up before their bytes are read: a byte counts to 255. Loops of a fixed length run in wide registers."""


@numba.njit(cache=True, nogil=True)
def pair_counts(first: UInt8Array, second: UInt8Array) -> AnyArray:
    """(N,) and (N,) contiguous uint8 -> (65536,) uint32: how often each pair occurs, at first * 256 + second; N < 2^32.

    Eight pixels are read as a word and laid side by side as 16-bit pairs. Four tables take turns: equal pixels are
    neighbours, and a counter just written is slow to read again.
    """
    tables = np.zeros((4, 65536), dtype=np.uint32)
    t0, t1, t2, t3 = tables[0], tables[1], tables[2], tables[3]
    one, even, odd = np.uint32(1), np.uint64(0x00FF00FF00FF00FF), np.uint64(0xFF00FF00FF00FF00)
    pair, byte = np.uint64(0xFFFF), np.uint64(8)
    whole = len(first) // 8 * 8
    first_words, second_words = first[:whole].view(np.uint64), second[:whole].view(np.uint64)
    for i in range(len(first_words)):
        a, b = first_words[i], second_words[i]
        x = ((a & even) << byte) | (b & even)
        y = (a & odd) | ((b & odd) >> byte)
        t0[x & pair] += one
        t1[(x >> np.uint64(16)) & pair] += one
        t2[(x >> np.uint64(32)) & pair] += one
        t3[x >> np.uint64(48)] += one
        t0[y & pair] += one
        t1[(y >> np.uint64(16)) & pair] += one
        t2[(y >> np.uint64(32)) & pair] += one
        t3[y >> np.uint64(48)] += one
    for i in range(whole, len(first)):
        t0[(np.uint64(first[i]) << byte) | np.uint64(second[i])] += one
    return t0 + t1 + t2 + t3


@numba.njit(cache=True, nogil=True)
def count_two(truth: AnyArray, prediction: AnyArray) -> tuple[int, int, int]:
    """(W,) uint64 words of eight bools each -> number of true bytes in truth AND prediction, truth, prediction."""
    both, truths, predictions = 0, 0, 0
    whole = len(truth) // BLOCK * BLOCK
    for start in range(0, whole, BLOCK):
        t, p = truth[start : start + BLOCK], prediction[start : start + BLOCK]
        sum_both, sum_truth, sum_prediction = np.uint64(0), np.uint64(0), np.uint64(0)
        for i in range(BLOCK):
            sum_both += t[i] & p[i]
            sum_truth += t[i]
            sum_prediction += p[i]
        both += byte_sum(sum_both)
        truths += byte_sum(sum_truth)
        predictions += byte_sum(sum_prediction)
    for i in range(whole, len(truth)):
        both += byte_sum(truth[i] & prediction[i])
        truths += byte_sum(truth[i])
        predictions += byte_sum(prediction[i])
    return both, truths, predictions


@numba.njit(cache=True, nogil=True)
def count_three(truth: AnyArray, prediction: AnyArray, mask: AnyArray) -> tuple[int, int, int, int]:
    """As ``count_two`` within a mask, and the number of true bytes in the mask."""
    both, truths, predictions, inside = 0, 0, 0, 0
    whole = len(truth) // BLOCK * BLOCK
    for start in range(0, whole, BLOCK):
        stop = start + BLOCK
        t, p, m = truth[start:stop], prediction[start:stop], mask[start:stop]
        sum_both, sum_truth, sum_prediction, sum_mask = np.uint64(0), np.uint64(0), np.uint64(0), np.uint64(0)
        for i in range(BLOCK):
            sum_both += t[i] & p[i] & m[i]
            sum_truth += t[i] & m[i]
            sum_prediction += p[i] & m[i]
            sum_mask += m[i]
        both += byte_sum(sum_both)
        truths += byte_sum(sum_truth)
        predictions += byte_sum(sum_prediction)
        inside += byte_sum(sum_mask)
    for i in range(whole, len(truth)):
        both += byte_sum(truth[i] & prediction[i] & mask[i])
        truths += byte_sum(truth[i] & mask[i])
        predictions += byte_sum(prediction[i] & mask[i])
        inside += byte_sum(mask[i])
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
