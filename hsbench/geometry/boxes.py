"""Boxes in space: volumes, corners, and how much two of them share.

Conventions
-----------
Metres, radians, right-handed frames with z up. One box a row; sizes are full sizes, never halves.

| kind | columns | row |
|---|---|---|
| aligned | 6 | centre x y z, size along x y z |
| upright | 7 | centre x y z, size l w h, yaw: l lies along +x turned by yaw about +z, h along z |
| oriented | 15 | centre x y z, size l w h, rotation world_R_box row by row: its columns are the axes of l, w, h |

Rows may be of any real dtype; all arithmetic is float64. Rotations are accepted where R R^T is the identity to 1e-6
(float32 matrices are) and are then made orthonormal to the last bit, so that a box always meets itself fully.

Measures
--------
IoU = V(a and b) / V(a or b), in [0, 1]. Boxes that only touch share 0.
GIoU = IoU - (V(C) - V(a or b)) / V(C), in (-1, 1], where C is the smallest box along the axes (aligned), the smallest
upright prism (upright: hull of the footprints x common z range), or the convex hull (oriented) that holds both. An
upright pair therefore has a GIoU at most that of the same boxes as oriented ones.

Swapping a and b transposes the result, bit for bit. Boxes that a plane parts share exactly 0. The error of an IoU is
about 1e-15 times the longest over the shortest side of the pair, and up to 1e-13 where faces nearly coincide at an
angle of about 0.01 rad; coordinates far away add their own resolution (1e-10 m at 1e6 m) and nothing else, since each
pair is moved to its own origin before anything is cut. Nothing is compared with a tolerance (``box_faces`` says why
none is needed), hence no band of relative rotations or distances in which results jump.

Differences from other scorers
------------------------------
* VoteNet's ``box3d_iou`` and rotate-IoU kernels cut a polygon with a strict inside test and divide by a vanishing
  cross product: 5000 yawed boxes against themselves give 1412 right values, 3037 wrong (-603 .. +261), 551 NaN or
  exceptions. Here all are 1. Boxes that share a face or a footprint are wrong there in either direction.
* KITTI-360 adds 0.01 to a denominator: self IoU down to .384 for small boxes; here always 1, hence higher.
* PyTorch3D's ``box3d_overlap`` returns IoU above 1, self IoU .5 far from the origin, and silent nonsense for corners
  in another order. Here IoU is at most 1, no result depends on where the origin is, and rows hold no corners.
* Cutting face by face with a tolerance (Objectron's rule: Sutherland-Hodgman and a hull, 1e-6) is right for identical
  boxes; a trial of the kind was off by .3 to .5 at relative rotations of 1e-12 to 1e-7 rad, and by .13 after a shift of
  1e6 m, in either direction. Here nothing jumps.
* Invalid boxes (not finite, a size <= 0, no rotation) are errors here; elsewhere they score 0, NaN or nonsense.

Cost
----
One thread, unless ``iou_oriented`` is given more. A kernel compiles once a machine and is cached. ``*_pairs`` compare
row i with row i. ``giou_oriented`` asks Qhull for every hull (about 0.1 ms a pair); everything else is compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry import box_hulls, box_overlap
from hsbench.typing import AnyArray, BoolArray, FloatArray

ALIGNED, UPRIGHT, ORIENTED = 6, 7, 15
"""Columns of a row of each kind: what ``checked`` takes and what tells the kinds apart."""

SMALLEST_M, LARGEST_M = 1e-9, 1e9
"""Sizes and coordinates beyond these are no metres; between them no volume under- or overflows."""

ORTHONORMAL = 1e-6
"""Largest entry of R R^T - I that is taken for a rotation."""

NAMES = {ALIGNED: "aligned", UPRIGHT: "upright", ORIENTED: "oriented"}
COLUMNS = {
    ALIGNED: "centre x y z, size x y z",
    UPRIGHT: "centre x y z, size l w h, yaw",
    ORIENTED: "centre x y z, size l w h, row-major rotation",
}
_SIGNS = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_FIELDS = ("centre x", "centre y", "centre z", "size l", "size w", "size h")


# ---------------------------------------------------------------- measures


def iou_aligned(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 6), b: (M, 6) aligned boxes -> (N, M) IoU. Raises SchemaError for invalid boxes, as all here do."""
    return _measure(a, b, ALIGNED)


def iou_upright(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 7), b: (M, 7) upright boxes -> (N, M) IoU."""
    return _measure(a, b, UPRIGHT)


def iou_oriented(a: AnyArray, b: AnyArray, *, threads: int = 1) -> FloatArray:
    """a: (N, 15), b: (M, 15) oriented boxes -> (N, M) IoU. The number of threads never changes the result."""
    return _measure(a, b, ORIENTED, threads=threads)


def iou_aligned_pairs(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 6), b: (N, 6) aligned boxes -> (N,) IoU of row i with row i."""
    return _measure(a, b, ALIGNED, paired=True)


def iou_upright_pairs(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 7), b: (N, 7) upright boxes -> (N,) IoU of row i with row i."""
    return _measure(a, b, UPRIGHT, paired=True)


def iou_oriented_pairs(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 15), b: (N, 15) oriented boxes -> (N,) IoU of row i with row i."""
    return _measure(a, b, ORIENTED, paired=True)


def giou_aligned(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 6), b: (M, 6) aligned boxes -> (N, M) GIoU (Rezatofighi et al., CVPR 2019); C is an aligned box."""
    return _giou(checked(a, ALIGNED, "a"), checked(b, ALIGNED, "b"), box_hulls.aligned)


def giou_upright(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 7), b: (M, 7) upright boxes -> (N, M) GIoU; C is an upright prism."""
    return _giou(checked(a, UPRIGHT, "a"), checked(b, UPRIGHT, "b"), box_hulls.upright)


def giou_oriented(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 15), b: (M, 15) oriented boxes -> (N, M) GIoU; C is the convex hull."""
    a, b = checked(a, ORIENTED, "a"), checked(b, ORIENTED, "b")
    return _giou(a, b, lambda p, q: box_hulls.oriented(as_oriented(p), as_oriented(q)))


def intersection_aligned(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 6), b: (M, 6) aligned boxes -> (N, M) common volume in cubic metres."""
    return _measure(a, b, ALIGNED, ratio=False)


def intersection_upright(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 7), b: (M, 7) upright boxes -> (N, M) common volume in cubic metres."""
    return _measure(a, b, UPRIGHT, ratio=False)


def intersection_oriented(a: AnyArray, b: AnyArray) -> FloatArray:
    """a: (N, 15), b: (M, 15) oriented boxes -> (N, M) common volume in cubic metres."""
    return _measure(a, b, ORIENTED, ratio=False)


# ---------------------------------------------------------------- single boxes


def volumes(boxes: AnyArray) -> FloatArray:
    """boxes: (N, 6), (N, 7) or (N, 15) of any kind -> (N,) volumes in cubic metres."""
    return _volume(checked(boxes)[:, 3:6] / 2)


def corners(boxes: AnyArray) -> FloatArray:
    """boxes: (N, 6), (N, 7) or (N, 15) of any kind -> (N, 8, 3) corners in metres.

    Corner 4 i + 2 j + k lies on the low (0) or high (1) side i of l, j of w, k of h.
    """
    boxes = as_oriented(boxes)
    offsets = _SIGNS * (boxes[:, None, 3:6] / 2)
    return np.asarray(offsets @ boxes[:, 6:].reshape(-1, 3, 3).transpose(0, 2, 1) + boxes[:, None, :3])


def as_oriented(boxes: AnyArray) -> FloatArray:
    """boxes: (N, 6), (N, 7) or (N, 15) of any kind -> (N, 15) the same boxes, rotations orthonormal."""
    boxes = checked(boxes)
    if boxes.shape[1] == ORIENTED:
        return np.column_stack([boxes[:, :6], _orthonormal(boxes[:, 6:])])
    yaw = boxes[:, 6] if boxes.shape[1] == UPRIGHT else np.zeros(len(boxes))
    c, s, zero = np.cos(yaw), np.sin(yaw), np.zeros(len(boxes))
    return np.column_stack([boxes[:, :6], c, -s, zero, s, c, zero, zero, zero, zero + 1.0])


def checked(boxes: AnyArray, kind: int | None = None, name: str = "boxes") -> FloatArray:
    """boxes: (N, 6), (N, 7) or (N, 15) -> the same as contiguous float64, once they are found valid.

    kind: ``ALIGNED``, ``UPRIGHT`` or ``ORIENTED``; None takes any, told by its columns. name: how errors call them.
    Raises SchemaError naming the first bad row: wrong shape or dtype, not finite, a size that is not positive, beyond
    ``SMALLEST_M`` .. ``LARGEST_M``, or a rotation that is none.
    """
    array = np.asarray(boxes)
    kinds = tuple(NAMES) if kind is None else (kind,)
    if array.ndim != 2 or array.shape[1] not in kinds:
        expected = " or ".join(f"(N, {k}) {NAMES[k]} boxes: {COLUMNS[k]}" for k in kinds)
        raise SchemaError(f"{name} has shape {array.shape}; expected {expected}{_shape_hint(array)}")
    if array.dtype.kind not in "fiu":
        raise SchemaError(f"{name} has dtype {array.dtype}; expected real numbers in metres and radians")
    checked = np.ascontiguousarray(array, dtype=np.float64)
    _check_finite(checked, name)
    _check_sizes(checked, name)
    if checked.shape[1] == ORIENTED:
        _check_rotations(checked, name)
    return checked


# ---------------------------------------------------------------- from rows to kernels


def _measure(
    a: AnyArray, b: AnyArray, kind: int, ratio: bool = True, paired: bool = False, threads: int = 1
) -> FloatArray:
    """IoU, or common volume unless ``ratio``: (N, M), or (N,) where ``paired``."""
    prepared, fill = _KERNELS[kind]
    rows_a, rows_b = prepared(checked(a, kind, "a")), prepared(checked(b, kind, "b"))
    if paired and len(rows_a) != len(rows_b):
        raise SchemaError(f"a has {len(rows_a)} boxes and b {len(rows_b)}; expected pairs (all with all? drop _pairs)")
    if threads < 1:
        raise SchemaError(f"threads is {threads}; expected at least 1")
    out = np.empty((len(rows_a), 1 if paired else len(rows_b)))
    if threads == 1:
        fill(rows_a, rows_b, paired, ratio, out)
    else:
        with ThreadPoolExecutor(threads) as pool:
            parts = zip(np.array_split(rows_a, threads), np.array_split(out, threads), strict=True)
            tasks = [pool.submit(fill, part, rows_b, paired, ratio, into) for part, into in parts]
            for task in tasks:
                task.result()
    return out[:, 0] if paired else out


def _giou(a: FloatArray, b: FloatArray, hulls: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    common = _measure(a, b, a.shape[1], ratio=False)
    union = _volume(a[:, 3:6] / 2)[:, None] + _volume(b[:, 3:6] / 2) - common
    hull = np.maximum(hulls(a, b), union)
    return np.asarray(common / union - (hull - union) / hull)


def _prepared_aligned(boxes: FloatArray) -> FloatArray:
    """(N, 6) -> (N, 7): centre, half size, volume."""
    half = boxes[:, 3:] / 2
    return np.column_stack([boxes[:, :3], half, _volume(half)])


def _prepared_upright(boxes: FloatArray) -> FloatArray:
    """(N, 7) -> (N, 10): centre, half size, cosine and sine of yaw, radius of the footprint, volume."""
    half, yaw = boxes[:, 3:6] / 2, boxes[:, 6]
    return np.column_stack(
        [boxes[:, :3], half, np.cos(yaw), np.sin(yaw), np.hypot(half[:, 0], half[:, 1]), _volume(half)]
    )


def _prepared_oriented(boxes: FloatArray) -> FloatArray:
    """(N, 15) -> (N, 17): centre, half size, orthonormal rotation, radius, volume."""
    half = boxes[:, 3:6] / 2
    radius = np.sqrt((half**2).sum(axis=1))
    return np.column_stack([boxes[:, :3], half, _orthonormal(boxes[:, 6:]), radius, _volume(half)])


_KERNELS: dict[int, tuple[Callable[[FloatArray], FloatArray], Callable[..., None]]] = {
    ALIGNED: (_prepared_aligned, box_overlap.fill_aligned),
    UPRIGHT: (_prepared_upright, box_overlap.fill_upright),
    ORIENTED: (_prepared_oriented, box_overlap.fill_oriented),
}


def _volume(half: FloatArray) -> FloatArray:
    return np.asarray(8.0 * half[:, 0] * half[:, 1] * half[:, 2])


def _orthonormal(rotations: FloatArray) -> FloatArray:
    """(N, 9) nearly orthonormal matrices -> (N, 9) the nearest rotations: Newton's iteration for the polar factor,
    each step squaring an error of at most 1e-6.
    """
    R = rotations.reshape(-1, 3, 3)
    for _ in range(2):
        R = R @ (1.5 * np.eye(3) - 0.5 * R.transpose(0, 2, 1) @ R)
    return R.reshape(-1, 9)


# ---------------------------------------------------------------- checks


def _check_finite(boxes: FloatArray, name: str) -> None:
    bad = _first(~np.isfinite(boxes))
    if bad is not None:
        row, column = bad
        field = (*_FIELDS, "yaw" if boxes.shape[1] == UPRIGHT else "its rotation")[min(column, len(_FIELDS))]
        raise SchemaError(f"{name}[{row}] holds {boxes[row, column]} in {field}; expected finite metres and radians")


def _check_sizes(boxes: FloatArray, name: str) -> None:
    sizes = boxes[:, 3:6]
    bad = _first(sizes <= 0)
    if bad is not None:
        raise SchemaError(
            f"{name}[{bad[0]}] has size {_row(sizes[bad[0]])}; expected full sizes > 0 m"
            " (two opposite corners instead of centre and size?)"
        )
    bad = _first((sizes < SMALLEST_M) | (sizes > LARGEST_M))
    if bad is not None:
        raise SchemaError(
            f"{name}[{bad[0]}] has size {_row(sizes[bad[0]])}; expected {SMALLEST_M:g} .. {LARGEST_M:g} m"
            " (uninitialised, or the logarithm of a size?)"
        )
    bad = _first(np.abs(boxes[:, :3]) > LARGEST_M)
    if bad is not None:
        raise SchemaError(
            f"{name}[{bad[0]}] has centre {_row(boxes[bad[0], :3])}; expected metres within {LARGEST_M:g} of the origin"
        )


def _check_rotations(boxes: FloatArray, name: str) -> None:
    R = boxes[:, 6:].reshape(-1, 3, 3)
    # entries beyond 2 are no rotation's; cut there, since their squares could overflow
    error = np.abs(np.clip(R, -2, 2) @ np.clip(R, -2, 2).transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = _first(error[:, None] > ORTHONORMAL)
    if bad is not None:
        hint = "rounded for print?" if error[bad[0]] < 1e-2 else "scaled, or a quaternion, or Euler angles?"
        raise SchemaError(
            f"{name}[{bad[0]}] has a rotation with R R^T off the identity by {error[bad[0]]:.2g};"
            f" expected at most {ORTHONORMAL:g} ({hint})"
        )
    bad = _first(np.einsum("ni,ni->n", np.cross(R[:, 0], R[:, 1]), R[:, 2])[:, None] < 0)
    if bad is not None:
        raise SchemaError(
            f"{name}[{bad[0]}] has a rotation of determinant -1; expected +1 (a left-handed frame, or an axis flipped?)"
        )


def _shape_hint(array: AnyArray) -> str:
    if array.ndim == 1 and array.size == 0:
        return " (no boxes? give shape (0, columns))"
    if array.ndim == 1 and array.size in NAMES:
        return " (a single box? give box[None])"
    if array.shape[-2:] == (8, 3):
        return " (corners? give centre, size and rotation)"
    if array.ndim == 2 and array.shape[1] in NAMES:
        return f" (these look like {NAMES[array.shape[1]]} boxes: use the functions named so)"
    if array.ndim == 2 and array.shape[1] in (8, 9):
        return " (score or class in the row? cut them off)"
    if array.ndim == 2 and array.shape[0] in NAMES:
        return " (transposed?)"
    return ""


def _first(bad: BoolArray) -> tuple[int, int] | None:
    """Row and column of the first True, None where there is none."""
    if not bad.any():
        return None
    row = int(bad.any(axis=1).argmax())
    return row, int(bad[row].argmax())


def _row(values: FloatArray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
