"""Rectilinear regions of a plan: unions of rectangles in whole millimetres, on the grid of their coordinates.

Whole numbers keep plans exact: neighbours share coordinates to the bit, and no tolerance is needed anywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.typing import BoolArray, FloatArray, IntArray

Rect = tuple[int, int, int, int]
"""x0, y0, x1, y1 in millimetres, x0 < x1 and y0 < y1."""

MM_PER_M = 1000


@dataclass(frozen=True, eq=False)
class Lines:
    """The grid between ascending coordinates xs (nx + 1,) and ys (ny + 1,), millimetres; masks on it are (nx, ny)."""

    xs: IntArray
    ys: IntArray

    @classmethod
    def of(cls, xs: Iterable[int], ys: Iterable[int]) -> Lines:
        """The lines through all these coordinates."""
        return cls(np.unique(np.array([*xs], dtype=np.int64)), np.unique(np.array([*ys], dtype=np.int64)))

    @classmethod
    def around(cls, rects: Sequence[Rect]) -> Lines:
        """The lines through all sides of the rectangles."""
        return cls.of((r[k] for r in rects for k in (0, 2)), (r[k] for r in rects for k in (1, 3)))

    def mask(self, rects: Iterable[Rect]) -> BoolArray:
        """(nx, ny) bool: the cells in any of the rectangles, whose sides lie on lines."""
        inside = np.zeros((len(self.xs) - 1, len(self.ys) - 1), dtype=np.bool_)
        for x0, y0, x1, y1 in rects:
            (i, k), (j, m) = np.searchsorted(self.xs, (x0, x1)), np.searchsorted(self.ys, (y0, y1))
            inside[i:k, j:m] = True
        return inside

    def rectangles(self, mask: BoolArray, along_x: bool = True) -> list[Rect]:
        """Few disjoint rectangles that make up a mask, grown along x first, or along y."""
        rest = mask.copy() if along_x else mask.T.copy()
        us, vs = (self.xs, self.ys) if along_x else (self.ys, self.xs)
        found: list[Rect] = []
        for j, i in np.argwhere(rest.T):
            if not rest[i, j]:
                continue
            k = i + int(np.argmin(np.append(rest[i:, j], False)))
            m = j + int(np.argmin(np.append(rest[i:k, j:].all(axis=0), False)))
            rest[i:k, j:m] = False
            u0, v0, u1, v1 = int(us[i]), int(vs[j]), int(us[k]), int(vs[m])
            found.append((u0, v0, u1, v1) if along_x else (v0, u0, v1, u1))
        return found

    def outline(self, mask: BoolArray) -> IntArray:
        """(n, 2) counter-clockwise corners of a region in one piece, without holes or touching corners."""
        full = np.pad(mask, 1)
        after: dict[tuple[int, int], tuple[int, int]] = {}
        for i, j in np.argwhere(full):
            # Each side between inside and outside, with the inside on its left.
            sides = ((0, -1, 0, 0, 1, 0), (1, 0, 1, 0, 1, 1), (0, 1, 1, 1, 0, 1), (-1, 0, 0, 1, 0, 0))
            for di, dj, a, b, c, d in sides:
                if not full[i + di, j + dj]:
                    after[(int(i + a), int(j + b))] = (int(i + c), int(j + d))
        start = at = min(after)
        corners = []
        while True:
            following = after[at]
            corners.append(at)
            at = following
            if at == start:
                break
        points = np.array([(self.xs[i - 1], self.ys[j - 1]) for i, j in corners], dtype=np.int64)
        straight = np.all(
            np.sign(points - np.roll(points, 1, axis=0)) == np.sign(np.roll(points, -1, axis=0) - points), axis=1
        )
        return points[~straight]


def outline_of(rects: Sequence[Rect], cuts: Sequence[Rect] = ()) -> IntArray:
    """(n, 2) counter-clockwise corners, millimetres, of rectangles without the cuts; one piece, no holes."""
    lines = Lines.around((*rects, *cuts))
    return lines.outline(lines.mask(rects) & ~lines.mask(cuts))


def rectangles_of(outline_mm: IntArray) -> list[Rect]:
    """Few disjoint rectangles that make up a rectilinear polygon (n, 2)."""
    lines = Lines.of(outline_mm[:, 0], outline_mm[:, 1])
    return lines.rectangles(inside(outline_mm, lines))


def inside(outline_mm: IntArray, lines: Lines) -> BoolArray:
    """(nx, ny) bool: the cells of a grid, through all corners at least, that lie in a rectilinear polygon (n, 2)."""
    # Upright sides seen from a cell towards +x: an odd number of them means inside.
    flips = np.zeros((len(lines.xs), len(lines.ys) - 1), dtype=np.int64)
    for (x, y0), (_, y1) in zip(outline_mm, np.roll(outline_mm, -1, axis=0), strict=True):
        i, (j, m) = np.searchsorted(lines.xs, x), np.searchsorted(lines.ys, sorted((y0, y1)))
        flips[i, j:m] += 1
    return np.asarray(np.cumsum(flips, axis=0)[:-1] % 2 == 1)


def to_mm(metres: FloatArray) -> IntArray:
    """Metres to whole millimetres."""
    return np.asarray(np.round(np.asarray(metres) * MM_PER_M), dtype=np.int64)
