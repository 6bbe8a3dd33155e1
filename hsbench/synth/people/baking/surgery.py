"""Surgery on half a body: cutting along curves, laying hems, sewing loops together, closing pockets, mirroring.

A vertex is a weighted mean of vertices of the base mesh, so that the same operation holds for every shape: positions
are ``rows @ base``. Half a body is its left side, x >= 0; what lies on the middle plane is never moved off it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from hsbench.typing import BoolArray, FloatArray, IntArray

ON_CURVE = 1e-9  # a vertex nearer to a curve than this is moved to its positive side


@dataclass(frozen=True, eq=False)
class Piece:
    """rows: (V, N) sparse shares of the base mesh's vertices. triangles: (T, 3), outward. region: (T,) of each."""

    rows: sparse.csr_matrix
    triangles: IntArray
    region: IntArray

    @classmethod
    def of(cls, size: int, triangles: IntArray, region: int) -> Piece:
        """Triangles of a base mesh of ``size`` vertices."""
        return cls(sparse.identity(size, format="csr"), triangles, np.full(len(triangles), region)).pruned()

    def at(self, base: FloatArray) -> FloatArray:
        """(V, ...) values at the vertices from (N, ...) values at the base mesh's."""
        return np.asarray(self.rows @ base)

    def centres(self, base: FloatArray) -> FloatArray:
        """(T, 3) middles of the triangles."""
        return np.asarray(self.at(base)[self.triangles].mean(axis=1))

    def keep(self, mask: BoolArray) -> Piece:
        """Only the triangles of a (T,) mask, and their vertices."""
        return Piece(self.rows, self.triangles[mask], self.region[mask]).pruned()

    def pruned(self) -> Piece:
        """Without vertices that no triangle uses."""
        used, inverse = np.unique(self.triangles, return_inverse=True)
        return Piece(self.rows[used], inverse.reshape(-1, 3), self.region)

    def painted(self, region: int, mask: BoolArray) -> Piece:
        """With another region where a (T,) mask holds."""
        return Piece(self.rows, self.triangles, np.where(mask, region, self.region))

    def region_at(self) -> IntArray:
        """(V,) the last region at each vertex."""
        at = np.zeros(self.rows.shape[0], dtype=np.int64)
        for corner in range(3):
            np.maximum.at(at, self.triangles[:, corner], self.region)
        return at

    def moved(self, chosen: BoolArray, rows: sparse.csr_matrix) -> Piece:
        """With other rows for the (V,) chosen vertices."""
        new = self.rows.tolil()
        new[np.flatnonzero(chosen)] = rows
        return Piece(new.tocsr(), self.triangles, self.region)


def joined(pieces: Sequence[Piece]) -> Piece:
    """Several pieces as one, unconnected."""
    first = np.cumsum([0, *(piece.rows.shape[0] for piece in pieces)])
    return Piece(
        sparse.vstack([piece.rows for piece in pieces], format="csr"),
        np.concatenate([piece.triangles + start for piece, start in zip(pieces, first, strict=False)]),
        np.concatenate([piece.region for piece in pieces]),
    )


def cut(piece: Piece, field: FloatArray) -> Piece:
    """Split triangles where a (V,) field crosses zero, so that no triangle has vertices strictly on both sides."""
    field = np.where(np.abs(field) < ON_CURVE, ON_CURVE, field)
    count = piece.rows.shape[0]
    made: dict[tuple[int, int], int] = {}

    def crossing(i: int, j: int) -> int:
        return made.setdefault((min(i, j), max(i, j)), count + len(made))

    triangles: list[tuple[int, int, int]] = []
    region: list[int] = []
    for (a, b, c), label in zip(piece.triangles.tolist(), piece.region.tolist(), strict=True):
        above = [field[a] > 0, field[b] > 0, field[c] > 0]
        if all(above) or not any(above):
            triangles.append((a, b, c))
            region.append(label)
            continue
        lone = above.index(sum(above) == 1)
        a, b, c = ((a, b, c), (b, c, a), (c, a, b))[lone]
        p, q = crossing(a, b), crossing(a, c)
        triangles += [(a, p, q), (p, b, c), (p, c, q)]
        region += [label] * 3
    ends = np.array(list(made), dtype=np.int64).reshape(-1, 2)
    share = field[ends[:, 0]] / (field[ends[:, 0]] - field[ends[:, 1]])
    new = sparse.diags(1 - share) @ piece.rows[ends[:, 0]] + sparse.diags(share) @ piece.rows[ends[:, 1]]
    return Piece(sparse.vstack([piece.rows, new], format="csr"), np.array(triangles), np.array(region))


def hem(piece: Piece, outer: Sequence[int], inner: Sequence[int], edge: int) -> Piece:
    """Part the surface where regions ``outer`` meet ``inner``: the rims get vertices of their own and a step between.

    The step has region ``edge`` and no width until one of its rims is moved. Raises ValueError where they do not meet.
    """
    is_outer = np.isin(piece.region, outer)
    is_inner = np.isin(piece.region, inner)
    face_of = half_edges(piece.triangles)
    rim = [(i, j) for (i, j), face in face_of.items() if is_outer[face] and is_inner[face_of.get((j, i), face)]]
    if not rim:
        raise ValueError(f"regions {outer} and {inner} have no line in common; expected them to meet")
    count = piece.rows.shape[0]
    twin = {vertex: count + k for k, vertex in enumerate(sorted({i for pair in rim for i in pair}))}
    lookup = np.arange(count)
    lookup[list(twin)] = list(twin.values())
    triangles = np.where(is_inner[:, None], lookup[piece.triangles], piece.triangles)
    step = [t for i, j in rim for t in ((j, i, twin[i]), (j, twin[i], twin[j]))]
    return Piece(
        sparse.vstack([piece.rows, piece.rows[list(twin)]], format="csr"),
        np.concatenate([triangles, np.array(step)]),
        np.concatenate([piece.region, np.full(len(step), edge)]),
    )


def sew(piece: Piece, points: FloatArray, first: Sequence[int], second: Sequence[int], edge: int) -> Piece:
    """Fill the gap between two borders of a piece with triangles of region ``edge``.

    first, second: vertices in the order of ``borders``, from end to end of the gap (a closed loop ends where it
    starts). They run in opposite directions, as borders of one gap do. points: (V, 3), for the shorter diagonals.
    """
    a, b = list(first), list(second)[::-1]
    if a[0] == a[-1]:
        b = _rotated(b, int(np.argmin(np.sum((points[b] - points[a[0]]) ** 2, axis=1))))
    triangles, i, j = [], 0, 0
    while i < len(a) - 1 or j < len(b) - 1:
        ahead_a = np.sum((points[a[min(i + 1, len(a) - 1)]] - points[b[j]]) ** 2)
        ahead_b = np.sum((points[a[i]] - points[b[min(j + 1, len(b) - 1)]]) ** 2)
        if j == len(b) - 1 or (i < len(a) - 1 and ahead_a <= ahead_b):
            triangles.append((a[i + 1], a[i], b[j]))
            i += 1
        else:
            triangles.append((b[j], b[j + 1], a[i]))
            j += 1
    region = np.concatenate([piece.region, np.full(len(triangles), edge)])
    return Piece(piece.rows, np.concatenate([piece.triangles, np.array(triangles)]), region)


def filled(piece: Piece, loop: Sequence[int], region: int) -> Piece:
    """A closed chain of ``borders`` (last = first) filled with a fan."""
    fan = np.array([(loop[0], b, a) for a, b in pairwise(loop[1:-1])])
    region_now = np.concatenate([piece.region, np.full(len(fan), region)])
    return Piece(piece.rows, np.concatenate([piece.triangles, fan]), region_now)


def _rotated(loop: list[int], start: int) -> list[int]:
    """A closed loop (last = first) that starts elsewhere."""
    return [*loop[start:-1], *loop[: start + 1]] if start < len(loop) - 1 else loop


def borders(triangles: IntArray, middle: BoolArray) -> list[list[int]]:
    """Chains of vertices along edges that have one triangle, in its direction; a closed one ends where it starts.

    Edges between two of the (V,) vertices in the middle plane are none. In order of their starts.
    """
    face_of = half_edges(triangles)
    ahead = {i: j for i, j in sorted(face_of) if (j, i) not in face_of and not (middle[i] and middle[j])}
    ends = set(ahead.values())
    chains = []
    for start in [*(i for i in ahead if i not in ends), *ahead]:
        chain = [start]
        while chain[-1] in ahead:
            chain.append(ahead.pop(chain[-1]))
        if len(chain) > 1:
            chains.append(chain)
    return chains


def half_edges(triangles: IntArray) -> dict[tuple[int, int], int]:
    """The triangle on the left of every directed edge."""
    return {(t[k], t[(k + 1) % 3]): face for face, t in enumerate(np.asarray(triangles).tolist()) for k in range(3)}


def laplacian(triangles: IntArray, count: int) -> sparse.csr_matrix:
    """(V, V) sparse mean of the neighbours of every vertex."""
    i, j = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    links = sparse.coo_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(count, count)).tocsr()
    links.data[:] = 1.0
    return sparse.diags(1.0 / np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1.0)) @ links


def smoothed(piece: Piece, amount: FloatArray, rounds: int) -> Piece:
    """Vertices drawn towards the mean of their neighbours by (V,) shares, so many times."""
    mean = laplacian(piece.triangles, piece.rows.shape[0])
    rows = piece.rows
    for _ in range(rounds):
        rows = sparse.diags(1 - amount) @ rows + sparse.diags(amount) @ (mean @ rows)
    return Piece(rows.tocsr(), piece.triangles, piece.region)


def membrane(piece: Piece, hidden: BoolArray) -> Piece:
    """The (V,) hidden vertices spread between the others like a soap film: pockets become lids (Tutte 1963)."""
    mean = laplacian(piece.triangles, piece.rows.shape[0])
    inside, around = np.flatnonzero(hidden), np.flatnonzero(~hidden)
    system = sparse.identity(len(inside), format="csc") - mean[inside][:, inside]
    rim = around[np.asarray(mean[inside][:, around].sum(axis=0)).ravel() > 0]
    shares = spsolve(system.tocsc(), mean[inside][:, rim].toarray())
    return piece.moved(hidden, sparse.csr_matrix(np.round(shares, 9)) @ piece.rows[rim])


def normals(points: FloatArray, triangles: IntArray, middle: BoolArray) -> FloatArray:
    """(V, 3) unit normals of half a body, area-weighted; those of the (V,) middle ones lie in the middle plane."""
    face = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    total = np.zeros_like(points)
    for corner in range(3):
        np.add.at(total, triangles[:, corner], face)
    total[middle, 0] = 0.0
    length = np.sqrt(np.sum(total**2, axis=1, keepdims=True))
    return np.asarray(total / np.where(length > 0, length, 1.0))
