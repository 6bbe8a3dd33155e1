"""Boxes in an image: x, y of the upper left corner, width, height, in pixels; and their IoU.

Sizes are differences of coordinates: a box from 3 to 5 is 2 wide. Old tools that count both border pixels
(x2 - x1 + 1) are matched by adding 1 to width and height beforehand.
"""

from __future__ import annotations

import numba
import numpy as np

from hsbench.errors import SchemaError
from hsbench.typing import AnyArray, BoolArray, FloatArray, IntArray

FORMS = ("xywh", "corners")
"""How four columns may be meant: x, y, width, height; or x1, y1, x2, y2."""


def check_form(form: str) -> None:
    """Raise SchemaError for a form that is none of ``FORMS``."""
    if form not in FORMS:
        raise SchemaError(f"form {form!r} is unknown; expected one of {', '.join(FORMS)}")


def as_xywh(boxes: AnyArray, form: str = "xywh") -> FloatArray:
    """(N, 4) boxes of a form of ``FORMS`` -> (N, 4) float64 x, y, width, height. Raises SchemaError on bad boxes."""
    check_form(form)
    rows = np.asarray(boxes, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise SchemaError(f"2D boxes have shape {rows.shape}; expected (N, 4)")
    if form == "corners":
        rows = np.concatenate([rows[:, :2], rows[:, 2:] - rows[:, :2]], axis=1)
    wrong = ~np.isfinite(rows).all(axis=1) | ~(rows[:, 2:] > 0).all(axis=1)
    if wrong.any():
        i = int(np.flatnonzero(wrong)[0])
        hint = "really x, y, w, h?" if form == "corners" else "corners subtracted the wrong way round?"
        raise SchemaError(f"2D box {i} is {boxes[i].tolist()}; expected finite numbers and sizes > 0 ({hint})")
    return rows


def iou_xywh(a: AnyArray, b: AnyArray, crowd: BoolArray | None = None) -> FloatArray:
    """(N, 4) and (M, 4) x, y, w, h -> (N, M) intersection over union.

    crowd: (M,) bool; against a crowd region of ``b`` the union is the area of ``a`` alone, as COCO has it.
    """
    first, second = as_xywh(a), as_xywh(b)
    crowds = np.zeros(len(second), dtype=np.bool_) if crowd is None else np.asarray(crowd, dtype=np.bool_)
    out = np.empty(len(first) * len(second))
    fill_blocks(
        first, second, crowds, np.array([0, len(first)]), np.array([0, len(second)]), np.zeros(1, np.int64), out
    )
    return out.reshape(len(first), len(second))


@numba.njit(cache=True)
def fill_blocks(
    a: FloatArray,
    b: FloatArray,
    crowd: BoolArray,
    a_start: IntArray,
    b_start: IntArray,
    block: IntArray,
    out: FloatArray,
) -> None:
    """IoU of many scenes in one pass: rows a_start[s]:a_start[s + 1] against b_start[s]:b_start[s + 1].

    The (n, m) matrix of scene s is written row by row from out[block[s]]. The order of operations is that of
    pycocotools, so that a value that equals a threshold there equals it here.
    """
    for s in range(len(block)):
        k = block[s]
        for i in range(a_start[s], a_start[s + 1]):
            ax, ay, aw, ah = a[i, 0], a[i, 1], a[i, 2], a[i, 3]
            area = aw * ah
            for j in range(b_start[s], b_start[s + 1]):
                width = min(aw + ax, b[j, 2] + b[j, 0]) - max(ax, b[j, 0])
                height = min(ah + ay, b[j, 3] + b[j, 1]) - max(ay, b[j, 1])
                iou = 0.0
                if width > 0.0 and height > 0.0:
                    shared = width * height
                    iou = shared / (area if crowd[j] else area + b[j, 2] * b[j, 3] - shared)
                out[k] = iou
                k += 1
