"""Exact float64 rays against triangles, through a tree of boxes: nearest hits and depth images.

A triangle is hit from either side. The three edge functions of a ray are computed from the corners in an order that two
triangles with a common edge share up to the sign, and what rounding may have made of 0 is 0, so that no ray slips
between triangles. The tree decides only what is
looked at: padded boxes never leave out a triangle that is hit, so the answer does not depend on it.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.cameras import CentralCamera
from hsbench.typing import FloatArray, Int32Array, IntArray

LEAF_TRIANGLES = 4
PAD_M = 1e-9  # boxes are wider than their triangles by more than rounding
ROUNDING = 1e-14  # of an edge function over the lengths in it: at a corner the signs of several edges must not disagree
STACK = 64  # a tree that halves its triangles at every level is less deep
ANY = -1


class TriangleTree(NamedTuple):
    """Triangles ordered by a tree of boxes. Build one with ``triangle_tree``.

    corners: (T, 3, 3) metres. piece: (T,) int32 label of each triangle. bounds: (M, 2, 3) box of each node.
    child: (M,) first of the two children of a node, -1 for a leaf. span: (M, 2) first triangle of a node and one after
    its last.
    """

    corners: FloatArray
    piece: Int32Array
    bounds: FloatArray
    child: IntArray
    span: IntArray


def triangle_tree(vertices: FloatArray, triangles: Int32Array, piece: Int32Array | None = None) -> TriangleTree:
    """(V, 3) vertices, (T, 3) triangles and perhaps a label for each -> their tree (median splits, longest side)."""
    corners = np.ascontiguousarray(vertices[triangles], dtype=np.float64)
    order, bounds, child, span = _build(corners)
    labels = np.zeros(len(triangles), np.int32) if piece is None else np.asarray(piece, dtype=np.int32)
    return TriangleTree(corners[order], labels[order], bounds, child, span)


def nearest(
    tree: TriangleTree,
    origins: FloatArray,
    directions: FloatArray,
    start: float,
    piece: Int32Array | None = None,
    end: float = np.inf,
) -> FloatArray:
    """(N, 3) origins and directions -> (N,) the least t at which origin + t direction hits, +inf where none.

    start, end: limits between which t lies. piece: (N,) the label of the only triangles that a ray can hit.
    """
    wanted = np.full(len(origins), ANY, np.int32) if piece is None else np.asarray(piece, dtype=np.int32)
    return np.asarray(
        _nearest(
            tree, np.ascontiguousarray(origins, dtype=np.float64), np.ascontiguousarray(directions, dtype=np.float64),
            start, end, wanted,
        )
    )  # fmt: skip


def depth_image(tree: TriangleTree, camera: CentralCamera, world_T_camera: FloatArray) -> FloatArray:
    """(h, w) float64 depth of the nearest hit at every pixel centre, +inf where none; the tree is in the world."""
    rays = camera.rays().reshape(-1, 3)
    directions = rays @ world_T_camera[:3, :3].T
    origins = np.broadcast_to(world_T_camera[:3, 3], directions.shape)
    return nearest(tree, origins, directions, 0.0).reshape(camera.height_px, camera.width_px)


@numba.njit(cache=True)
def _build(corners: FloatArray) -> tuple[IntArray, FloatArray, IntArray, IntArray]:
    count = len(corners)
    order = np.arange(count)
    most = max(1, 2 * count)
    bounds, child, span = np.empty((most, 2, 3)), np.full(most, -1), np.zeros((most, 2), np.int64)
    span[0, 1] = count
    made, at = 1, 0
    while at < made:
        first, last = span[at]
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for t in order[first:last]:
            for v in range(3):
                for axis in range(3):
                    low[axis] = min(low[axis], corners[t, v, axis])
                    high[axis] = max(high[axis], corners[t, v, axis])
        bounds[at, 0], bounds[at, 1] = low - PAD_M, high + PAD_M
        if last - first > LEAF_TRIANGLES:
            axis = int(np.argmax(high - low))
            here = order[first:last].copy()
            middle = corners[here, 0, axis] + corners[here, 1, axis] + corners[here, 2, axis]
            order[first:last] = here[np.argsort(middle, kind="mergesort")]
            child[at] = made
            half = (first + last) // 2
            span[made, 0], span[made, 1] = first, half
            span[made + 1, 0], span[made + 1, 1] = half, last
            made += 2
        at += 1
    return order, bounds[:made].copy(), child[:made].copy(), span[:made].copy()


@numba.njit(cache=True)
def is_cut(tree: TriangleTree, origin: FloatArray, end: FloatArray) -> bool:
    """Whether the open segment between two points (3,) meets a triangle. For compiled callers."""
    stack = np.empty(STACK, np.int64)
    direction = end - origin
    stack[0], size = 0, 1
    while size:
        size -= 1
        node = stack[size]
        if not _meets(tree.bounds[node], origin, direction, 0.0, 1.0):
            continue
        if tree.child[node] >= 0:
            stack[size], stack[size + 1] = tree.child[node], tree.child[node] + 1
            size += 2
            continue
        for t in range(tree.span[node, 0], tree.span[node, 1]):
            if 0.0 < _hit(tree.corners[t], origin, direction) < 1.0:
                return True
    return False


@numba.njit(cache=True)
def _nearest(
    tree: TriangleTree, origins: FloatArray, directions: FloatArray, start: float, end: float, wanted: Int32Array
) -> FloatArray:
    best = np.full(len(origins), end)
    stack = np.empty(STACK, np.int64)
    for r in range(len(origins)):
        o, d = origins[r], directions[r]
        stack[0], size = 0, 1
        while size:
            size -= 1
            node = stack[size]
            if not _meets(tree.bounds[node], o, d, start, best[r]):
                continue
            if tree.child[node] >= 0:
                stack[size], stack[size + 1] = tree.child[node], tree.child[node] + 1
                size += 2
                continue
            for t in range(tree.span[node, 0], tree.span[node, 1]):
                if wanted[r] == ANY or tree.piece[t] == wanted[r]:
                    hit = _hit(tree.corners[t], o, d)
                    if start < hit < best[r]:
                        best[r] = hit
    return np.where(best < end, best, np.inf)


@numba.njit(cache=True)
def _meets(box: FloatArray, o: FloatArray, d: FloatArray, start: float, end: float) -> bool:
    for axis in range(3):
        if d[axis] == 0.0:
            if o[axis] < box[0, axis] or o[axis] > box[1, axis]:
                return False
            continue
        a, b = (box[0, axis] - o[axis]) / d[axis], (box[1, axis] - o[axis]) / d[axis]
        start, end = max(start, min(a, b)), min(end, max(a, b))
        if start > end:
            return False
    return True


@numba.njit(cache=True)
def _hit(corners: FloatArray, o: FloatArray, d: FloatArray) -> float:
    """How far along the ray its hit is, +inf for none: the weights of the corners are the ray's edge functions."""
    ax, ay, az = corners[0, 0] - o[0], corners[0, 1] - o[1], corners[0, 2] - o[2]
    bx, by, bz = corners[1, 0] - o[0], corners[1, 1] - o[1], corners[1, 2] - o[2]
    cx, cy, cz = corners[2, 0] - o[0], corners[2, 1] - o[1], corners[2, 2] - o[2]
    u = d[0] * (by * cz - bz * cy) + d[1] * (bz * cx - bx * cz) + d[2] * (bx * cy - by * cx)
    v = d[0] * (cy * az - cz * ay) + d[1] * (cz * ax - cx * az) + d[2] * (cx * ay - cy * ax)
    w = d[0] * (ay * bz - az * by) + d[1] * (az * bx - ax * bz) + d[2] * (ax * by - ay * bx)
    size = max(abs(ax), abs(ay), abs(az), abs(bx), abs(by), abs(bz), abs(cx), abs(cy), abs(cz))
    error = ROUNDING * size * size * (abs(d[0]) + abs(d[1]) + abs(d[2]))
    if min(u, v, w) < -error and max(u, v, w) > error:
        return np.inf
    total = u + v + w
    if abs(total) <= 4.0 * error:  # edge on
        return np.inf
    x, y, z = u * ax + v * bx + w * cx, u * ay + v * by + w * cy, u * az + v * bz + w * cz
    return (x * d[0] + y * d[1] + z * d[2]) / (total * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]))
