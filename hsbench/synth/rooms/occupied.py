"""Compiled tests of a layout: upright prisms against each other, floods of free cells, points near reached cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from hsbench.typing import BoolArray, FloatArray, IntArray

TOUCH_M = 1e-6  # heights that share no more than this do not meet
LAST_BITS_M = 1e-9


KEEP_OUT, BODY, ZONE = 0, 1, 2
"""What a prism stands for: nothing at all may be there; a body; floor that nothing stands on."""


@dataclass(frozen=True, eq=False)
class Prisms:
    """Upright prisms over counter-clockwise rectangles: corners (n, 4, 2), heights (n, 2) from and to, metres."""

    corners: FloatArray
    z: FloatArray

    @classmethod
    def of(cls, prisms: Sequence[tuple[FloatArray, float, float]]) -> Prisms:
        """Prisms from (corners (4, 2), low, high)."""
        corners = np.array([p[0] for p in prisms], dtype=np.float64).reshape(-1, 4, 2)
        return cls(corners, np.array([p[1:3] for p in prisms], dtype=np.float64).reshape(-1, 2))

    def meet(self, corners: FloatArray, low: float, high: float) -> bool:
        """Whether any of them overlaps a prism over (4, 2) corners."""
        return bool(_meet_any(self.corners, self.z, corners, low, high))


@dataclass(frozen=True, eq=False)
class Taken:
    """All that a new item keeps clear of: prisms, what each stands for (n,), and how far bodies are apart, metres."""

    prisms: Prisms
    kind: IntArray
    apart_m: float

    @classmethod
    def of(cls, prisms: Sequence[tuple[FloatArray, float, float, int]], apart_m: float) -> Taken:
        """From (corners (4, 2), low, high, kind)."""
        kind = np.array([p[3] for p in prisms], dtype=np.int64)
        return cls(Prisms.of([p[:3] for p in prisms]), kind, apart_m)

    def meet(self, corners: FloatArray, low: float, high: float, head: float, stands: bool) -> bool:
        """Whether an item over (4, 2) corners is in the way: its body, up to ``head`` with who sits on it."""
        p = self.prisms
        return bool(_meet_taken(p.corners, p.z, self.kind, corners, low, high, head, stands, self.apart_m))


@dataclass(frozen=True, eq=False)
class Inside:
    """A rectilinear room: the size of the box around it and the rectangles (k, 4, 2) in it that are not the room."""

    size_m: tuple[float, float]
    outside: FloatArray

    def holds(self, corners: FloatArray, margin_m: float) -> bool:
        """Whether a rectangle (4, 2) keeps ``margin_m`` from all walls."""
        return bool(_holds(self.outside, self.size_m[0], self.size_m[1], corners, margin_m))


@numba.njit(cache=True)
def meet(a: FloatArray, a_low: float, a_high: float, b: FloatArray, b_low: float, b_high: float, apart: float) -> bool:
    """Whether two upright prisms over counter-clockwise convex quads come nearer than ``apart`` (separating axes)."""
    if min(a_high, b_high) - max(a_low, b_low) <= TOUCH_M:
        return False
    for turn in range(2):
        first, second = (a, b) if turn == 0 else (b, a)
        for e in range(4):
            dx, dy = first[(e + 1) % 4, 0] - first[e, 0], first[(e + 1) % 4, 1] - first[e, 1]
            length = np.sqrt(dx * dx + dy * dy)
            nearest = np.inf
            for v in range(4):
                beyond = ((second[v, 0] - first[e, 0]) * dy - (second[v, 1] - first[e, 1]) * dx) / length
                nearest = min(nearest, beyond)
            if nearest >= apart - LAST_BITS_M:
                return False
    return True


@numba.njit(cache=True)
def _holds(outside: FloatArray, width: float, depth: float, corners: FloatArray, margin: float) -> bool:
    for k in range(4):
        x, y = corners[k, 0], corners[k, 1]
        if x < margin or y < margin or x > width - margin or y > depth - margin:
            return False
    crosses = False
    for k in range(len(outside)):
        crosses = crosses or meet(outside[k], 0.0, 1.0, corners, 0.0, 1.0, margin)
    return not crosses


@numba.njit(cache=True)
def _meet_taken(
    prisms: FloatArray, z: FloatArray, kind: IntArray, b: FloatArray, low: float, high: float, head: float,
    stands: bool, apart: float,
) -> bool:  # fmt: skip
    for k in range(len(prisms)):
        if kind[k] == BODY:
            if meet(prisms[k], z[k, 0], z[k, 1], b, low, head, apart):
                return True
        elif (kind[k] == KEEP_OUT or stands) and meet(prisms[k], z[k, 0], z[k, 1], b, low, high, 0.0):
            return True
    return False


@numba.njit(cache=True)
def _meet_any(prisms: FloatArray, z: FloatArray, b: FloatArray, low: float, high: float) -> bool:
    found = False
    for k in range(len(prisms)):
        found = found or meet(prisms[k], z[k, 0], z[k, 1], b, low, high, 0.0)
    return found


@numba.njit(cache=True)
def flood(free: BoolArray, starts: IntArray) -> BoolArray:
    """(nx, ny) bool: the free cells that steps to the four neighbours lead to from the first of ``starts`` (n, 2)."""
    nx, ny = free.shape
    reached = np.zeros((nx, ny), dtype=np.bool_)
    if len(starts) == 0 or not free[starts[0, 0], starts[0, 1]]:
        return reached
    stack = np.empty((nx * ny, 2), dtype=np.int64)
    stack[0] = starts[0]
    reached[starts[0, 0], starts[0, 1]] = True
    count = 1
    while count > 0:
        count -= 1
        i, j = stack[count, 0], stack[count, 1]
        for step in range(4):
            k, m = i + (step == 0) - (step == 1), j + (step == 2) - (step == 3)
            if 0 <= k < nx and 0 <= m < ny and free[k, m] and not reached[k, m]:
                reached[k, m] = True
                stack[count, 0], stack[count, 1] = k, m
                count += 1
    return reached


@numba.njit(cache=True)
def any_near(reached: BoolArray, origin: FloatArray, cell: float, points: FloatArray, limit: float) -> bool:
    """Whether the centre of a reached cell is within ``limit`` of any of the points (n, 2)."""
    nx, ny = reached.shape
    for p in range(len(points)):
        x, y = (points[p, 0] - origin[0]) / cell - 0.5, (points[p, 1] - origin[1]) / cell - 0.5  # in cell numbers
        far = limit / cell
        for i in range(max(0, int(np.ceil(x - far))), min(nx - 1, int(np.floor(x + far))) + 1):
            for j in range(max(0, int(np.ceil(y - far))), min(ny - 1, int(np.floor(y + far))) + 1):
                if reached[i, j] and (i - x) ** 2 + (j - y) ** 2 <= far * far + LAST_BITS_M:
                    return True
    return False
