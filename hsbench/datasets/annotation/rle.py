"""Run lengths of masks as COCO writes them: column by column, from the top, beginning with what is outside.

A list of counts, or a text: counts from the fourth on as differences to the second before, each in groups of five
bits, lowest first, a sixth bit that says whether more follow, 48 added to make a printable character; the highest
bit of the last group is the sign.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json
from hsbench.errors import DataError
from hsbench.typing import BoolArray

FIRST_CHARACTER = 48
GROUP_BITS = 5
MORE = 1 << GROUP_BITS
SIGN = 1 << (GROUP_BITS - 1)
MAX_GROUPS = 8
"""Of one count: 40 bits, more than any picture has pixels."""


def encode(mask: BoolArray) -> list[int]:
    """(h, w) bool -> counts."""
    flat = mask.ravel(order="F")
    edges = np.flatnonzero(np.diff(flat, prepend=False)) if flat.size else np.zeros(0, dtype=np.int64)
    return [int(n) for n in np.diff(np.concatenate([[0], edges, [flat.size]]))]


def decode(counts: Any, width_px: int, height_px: int, where: str) -> BoolArray:
    """Counts, a list or a text, -> (h, w) bool. Raises DataError, starting with ``where``, unless they fit the size."""
    size = width_px * height_px
    if isinstance(counts, str):
        values = _from_text(counts, size, where)
    else:
        rows = pose_json.items(counts, where, size + 1)
        values = [pose_json.whole(n, f"{where}[{i}]", 0, size) for i, n in enumerate(rows)]
    if sum(values) != size:
        raise DataError(f"{where} add up to {sum(values)} pixels; expected {width_px} x {height_px} = {size}")
    inside = np.arange(len(values)) % 2 == 1
    return np.ascontiguousarray(np.repeat(inside, values).reshape((height_px, width_px), order="F"))


def _from_text(text: str, size: int, where: str) -> list[int]:
    values: list[int] = []
    value = groups = 0
    for index, character in enumerate(text):
        code = ord(character) - FIRST_CHARACTER
        if not 0 <= code < 2 * MORE or groups == MAX_GROUPS:
            raise DataError(f"{where} has {character!a} at {index}; expected COCO's run lengths")
        value |= (code & (MORE - 1)) << (GROUP_BITS * groups)
        groups += 1
        if code & MORE:
            continue
        if code & SIGN:
            value -= 1 << (GROUP_BITS * groups)
        if len(values) > 2:
            value += values[-2]
        if not 0 <= value <= size or len(values) > size:
            raise DataError(f"{where}: run {len(values)} is {value} long; expected runs of 0 to {size} pixels in all")
        values.append(value)
        value = groups = 0
    if groups:
        raise DataError(f"{where} ends within a number; expected COCO's run lengths (cut off?)")
    return values
