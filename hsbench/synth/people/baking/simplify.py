"""Edge collapse by quadric error onto existing vertices: the levels of detail are nested subsets of the vertices.

M. Garland, P. Heckbert, Surface simplification using quadric error metrics, SIGGRAPH 1997; half-edge collapses, so
that a coarse mesh of another shape is the same subset of its vertices. Lines between regions and borders stay lines.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hsbench.synth.people.baking.surgery import half_edges
from hsbench.typing import BoolArray, FloatArray, IntArray

BORDER, LINE = 30.0, 6.0  # how much more a border or a line between regions resists than the surface
SHORT = 1e-9  # a tie is broken by length
FOLD = 0.25  # the cosine by which a triangle's normal may turn at most


@dataclass(frozen=True, eq=False)
class Level:
    """triangles (T, 3) of the vertices in ``order`` of the simplification, and the (T,) region of each."""

    triangles: IntArray
    region: IntArray
    count: int


def simplify(
    points: FloatArray, triangles: IntArray, region: IntArray, weight: FloatArray,
    targets: Sequence[int],
) -> tuple[list[Level], IntArray]:  # fmt: skip
    """(V, 3) points, (T, 3) triangles, (T,) region, (V,) weight -> a level for each count, and the order.

    Level k has the first ``count`` vertices of the (V',) order, as near to targets[k] as can be had; targets fall.
    """
    state = _State.of(points, triangles, region, weight)
    left: list[tuple[IntArray, IntArray]] = []
    counts: list[int] = []
    gone: list[int] = []
    for target in targets:
        went = state.collapse_to(target)
        gone += went if left else []
        left.append(state.surface(region))
        counts.append(int(state.alive.sum()))
    order = np.array([*np.flatnonzero(state.alive), *gone[::-1]])
    place = np.full(len(points), -1)
    place[order] = np.arange(len(order))
    return [Level(place[faces], label, count) for (faces, label), count in zip(left, counts, strict=True)], order


@dataclass(eq=False)
class _State:
    points: FloatArray
    weight: FloatArray
    quadric: FloatArray
    faces: list[list[int]]
    on: list[bool]
    faces_of: list[set[int]]
    lines: list[set[int]]  # of each vertex: where lines and borders lead from it
    border: BoolArray
    alive: BoolArray
    version: IntArray
    heap: list[tuple[float, int, int, int, int]] = field(default_factory=list)

    @classmethod
    def of(cls, points: FloatArray, triangles: IntArray, region: IntArray, weight: FloatArray) -> _State:
        count = len(points)
        faces_of: list[set[int]] = [set() for _ in range(count)]
        for face, corners in enumerate(triangles.tolist()):
            for i in corners:
                faces_of[i].add(face)
        normal = np.cross(
            points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
        )
        area = np.sqrt(np.sum(normal**2, axis=1))
        normal = normal / np.where(area > 0, area, 1.0)[:, None]
        plane = np.column_stack([normal, -np.sum(normal * points[triangles[:, 0]], axis=1)])
        quadric = np.zeros((count, 4, 4))
        for corner in range(3):
            np.add.at(quadric, triangles[:, corner], area[:, None, None] * plane[:, :, None] * plane[:, None])
        lines, border = _add_lines(points, triangles, region, normal, quadric)
        state = cls(
            points, weight, quadric * weight[:, None, None], triangles.tolist(), [True] * len(triangles),
            faces_of, lines, border, np.array([bool(f) for f in faces_of]), np.zeros(count, dtype=np.int64),
        )  # fmt: skip
        for i in np.flatnonzero(state.alive):
            state.push(int(i))
        return state

    def collapse_to(self, target: int) -> list[int]:
        """Collapse the cheapest edges until so many vertices are left; the vertices that went, in order."""
        gone = []
        left = int(self.alive.sum())
        while left > target and self.heap:
            _, goes, stays, version_goes, version_stays = heapq.heappop(self.heap)
            current = self.alive[goes] and self.alive[stays]
            if not current or self.version[goes] != version_goes or self.version[stays] != version_stays:
                continue
            if self.allowed(goes, stays):
                self.collapse(goes, stays)
                gone.append(goes)
                left -= 1
        return gone

    def surface(self, region: IntArray) -> tuple[IntArray, IntArray]:
        """The triangles that are left, and of (T,) regions theirs."""
        on = np.array(self.on)
        return np.array(self.faces)[on], region[on]

    def neighbours(self, i: int) -> set[int]:
        return {j for face in self.faces_of[i] for j in self.faces[face]} - {i}

    def cost(self, goes: int, stays: int) -> float:
        place = np.append(self.points[stays], 1.0)
        way = self.points[goes] - self.points[stays]
        longer = SHORT * float(way @ way) * max(self.weight[goes], self.weight[stays])
        return float(place @ (self.quadric[goes] + self.quadric[stays]) @ place) + longer

    def push(self, i: int) -> None:
        """Queue the collapses of the edges at a vertex. Lines stay lines, and where several meet nothing moves."""
        for j in sorted(self.neighbours(i)):
            for goes, stays in ((i, j), (j, i)):
                on_line = len(self.lines[goes]) > 0
                if on_line and (stays not in self.lines[goes] or len(self.lines[goes]) != 2):
                    continue
                entry = (self.cost(goes, stays), goes, stays, int(self.version[goes]), int(self.version[stays]))
                heapq.heappush(self.heap, entry)

    def allowed(self, goes: int, stays: int) -> bool:
        """Whether the surface stays a surface (link condition), also mirrored at its border, and nothing folds over."""
        shared = self.faces_of[goes] & self.faces_of[stays]
        if not shared or len(self.neighbours(goes) & self.neighbours(stays)) != len(shared):
            return False
        if self.border[stays] and not self.border[goes]:
            chords = {j for j in self.neighbours(goes) if self.border[j]} - self.lines[stays] - {stays}
            if chords:
                return False
        for face in self.faces_of[goes] - shared:
            before = self.points[self.faces[face]]
            after = self.points[[stays if i == goes else i for i in self.faces[face]]]
            old, new = (np.cross(p[1] - p[0], p[2] - p[0]) for p in (before, after))
            if float(new @ old) < FOLD * float(np.sqrt((new @ new) * (old @ old))):
                return False
        return True

    def collapse(self, goes: int, stays: int) -> None:
        for face in sorted(self.faces_of[goes]):
            if stays in self.faces[face]:
                self.on[face] = False
                for i in self.faces[face]:
                    self.faces_of[i].discard(face)
            else:
                self.faces[face] = [stays if i == goes else i for i in self.faces[face]]
                self.faces_of[stays].add(face)
        self.faces_of[goes], self.alive[goes] = set(), False
        self.quadric[stays] += self.quadric[goes]
        for j in self.lines[goes]:
            self.lines[j].discard(goes)
            if j != stays:
                self.lines[j].add(stays)
                self.lines[stays].add(j)
        self.lines[goes] = set()
        around = sorted(self.neighbours(stays))
        self.version[[stays, *around]] += 1
        for i in (stays, *around):
            self.push(i)


def _add_lines(
    points: FloatArray, triangles: IntArray, region: IntArray, normal: FloatArray, quadric: FloatArray
) -> tuple[list[set[int]], BoolArray]:
    """Find borders and lines between regions and add planes across the surface there.

    Gives where they lead from each vertex, and the (V,) vertices that lie on a border.
    """
    face_of = half_edges(triangles)
    lines: list[set[int]] = [set() for _ in range(len(points))]
    border = np.zeros(len(points), dtype=bool)
    for (i, j), face in face_of.items():
        other = face_of.get((j, i))
        if other is not None and region[face] == region[other]:
            continue
        lines[i].add(j)
        lines[j].add(i)
        border[[i, j]] |= other is None
        along = points[j] - points[i]
        across = np.cross(along, normal[face])
        length = float(np.sqrt(across @ across))
        if length > 0:
            plane = np.append(across / length, -(across / length) @ points[i])
            added = (BORDER if other is None else LINE) * float(along @ along) * np.outer(plane, plane)
            quadric[i] += added
            quadric[j] += added
    return lines, border
