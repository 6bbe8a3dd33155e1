"""Masks as COCO's run lengths: column by column, runs of 0 and 1 in turn, the first of 0."""

from __future__ import annotations

import numpy as np

from hsbench.typing import BoolArray

BITS, MORE, SIGN = 5, 0x20, 0x10
FIRST_LETTER = 48  # "0": each letter carries 5 bits and says whether more follow
BEFORE = 2  # from the third run on, a run is written as its difference from the one before the last


def encode(mask: BoolArray) -> dict[str, object]:
    """(h, w) bool -> ``{"size": [h, w], "counts": text}``, the compressed form that COCO's tools read and write."""
    flat = np.concatenate([[False], mask.ravel(order="F")])
    starts = np.flatnonzero(flat[1:] != flat[:-1])
    runs = np.diff(np.concatenate([[0], starts, [mask.size]]))
    runs[BEFORE + 1 :] -= runs[1:-BEFORE].copy()
    return {"size": [int(n) for n in mask.shape], "counts": "".join(map(_letters, runs.tolist()))}


def _letters(value: int) -> str:
    """A signed number, lowest bits first, until what is left is the sign alone."""
    text = ""
    while True:
        piece, value = value & 0x1F, value >> BITS
        done = value == (-1 if piece & SIGN else 0)
        text += chr(FIRST_LETTER + (piece | (0 if done else MORE)))
        if done:
            return text
