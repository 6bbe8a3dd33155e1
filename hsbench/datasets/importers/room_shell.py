"""The objects around an empty room, from its outline and what opens its walls: floor, ceiling, walls, doors, windows.

Walls are slabs behind the outline, cut out where they open. A door and a window fill their openings; a passage is an
opening with nothing but a threshold under the level of the floor. Frames of objects are those of generated rooms
(docs/conventions.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry import convex
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, SceneObject
from hsbench.typing import FloatArray, Int32Array

WALL_M = 0.1  # inner walls have 0.07 to 0.15 m
THRESHOLD_M = 0.01
MIN_M = 0.001  # thinner pieces of wall, and narrower openings, are rounding
MAX_CORNERS = 200
MAX_FROM_WALL_M = 0.3  # an opening farther from every wall belongs to another room
COLOURS = {"wall": (226, 222, 214), "floor": (168, 140, 108), "ceiling": (242, 241, 238), "door": (196, 178, 152),
           "window": (196, 216, 226), "passage": (168, 140, 108)}  # fmt: skip
ROLE_OF = {"door": "door"}


@dataclass(frozen=True, eq=False)
class Opening:
    """A ``door``, ``window`` or ``passage`` from left to right (2,) in the plane, metres, between two heights."""

    kind: str
    left_xy: FloatArray
    right_xy: FloatArray
    low_m: float
    high_m: float


@dataclass(frozen=True, eq=False)
class _Hole:
    """An opening in a wall: along it from its start, and in height."""

    kind: str
    start_m: float
    end_m: float
    low_m: float
    high_m: float


def room_objects(outline_xy: FloatArray, height_m: float, openings: Sequence[Opening]) -> tuple[SceneObject, ...]:
    """Floor, ceiling, a wall for each edge of the (n, 2) counter-clockwise outline, openings; ids from 1.

    Raises DataError for an outline that crosses itself, and for openings that lie in no wall.
    """
    triangles = triangulated(outline_xy)
    middle = quantise_m((outline_xy.min(axis=0) + outline_xy.max(axis=0)) / 2)
    flat = np.column_stack([outline_xy - middle, np.zeros(len(outline_xy))])
    pose = planar(float(middle[0]), float(middle[1]), 0.0)
    under = planar(float(middle[0]), float(middle[1]), 0.0, height_m)
    found = [
        ("floor", pose, [Part("floor", COLOURS["floor"], mesh=(flat, triangles))]),
        (
            "ceiling",
            under,
            [Part("ceiling", COLOURS["ceiling"], mesh=(flat, np.ascontiguousarray(triangles[:, ::-1])))],
        ),
    ]
    fillings = []
    holes = _holes(outline_xy, height_m, openings)
    for k, (start, end) in enumerate(zip(outline_xy, np.roll(outline_xy, -1, axis=0), strict=True)):
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        yaw = float(np.arctan2(-along[1], -along[0]))  # x against the edge, so that y points out of the room
        parts = [
            _block("wall", length / 2 - e, length / 2 - s, WALL_M, low, high)
            for s, e, low, high in _bricks(length, height_m, holes[k])
        ]
        if parts:
            x, y = ((start + end) / 2).tolist()
            found.append(("wall", planar(x, y, yaw), parts))
        for hole in holes[k]:
            x, y = (start + along * (hole.start_m + hole.end_m) / 2).tolist()
            half = (hole.end_m - hole.start_m) / 2
            low, high = (-THRESHOLD_M, 0.0) if hole.kind == "passage" else (hole.low_m, hole.high_m)
            fillings.append((hole.kind, planar(x, y, yaw), [_block(hole.kind, -half, half, WALL_M, low, high)]))
    numbered = enumerate([*found, *fillings], start=1)
    return tuple(SceneObject(number, kind, pose, tuple(parts)) for number, (kind, pose, parts) in numbered)


def triangulated(outline_xy: FloatArray) -> Int32Array:
    """(n, 2) simple counter-clockwise polygon -> (n - 2, 3) int32 triangles of its corners, by clipping ears.

    Raises DataError for a polygon that crosses or touches itself, and for more than 200 corners.
    """
    if len(outline_xy) > MAX_CORNERS:
        raise DataError(f"outline has {len(outline_xy):,} corners; expected at most {MAX_CORNERS}")
    left = list(range(len(outline_xy)))
    triangles = []
    if _crosses_itself(outline_xy):
        raise DataError(f"outline of {len(outline_xy)} corners crosses itself; expected a simple polygon")
    while len(left) > 3:
        ears = ((left[i - 1], left[i], left[(i + 1) % len(left)]) for i in range(len(left)))
        ear = next((ear for ear in ears if _is_ear(outline_xy, ear, left)), None)
        if ear is None:
            raise DataError(
                f"outline of {len(outline_xy)} corners crosses or touches itself; expected a simple polygon"
            )
        triangles.append(ear)
        left.remove(ear[1])
    return np.array([*triangles, tuple(left)], dtype=np.int32)


def _crosses_itself(outline_xy: FloatArray) -> bool:
    """Whether two edges have a point in common that is an end of neither."""
    start, end = outline_xy[:, None], np.roll(outline_xy, -1, axis=0)[:, None]
    sides = [_side(start, end, points[:, 0]) for points in (start, end)]  # of edge j's ends, for each edge i
    apart = sides[0] * sides[1] < 0
    return bool((apart & apart.T).any())


def _is_ear(points: FloatArray, ear: tuple[int, int, int], left: list[int]) -> bool:
    """Whether a corner lies straight between its neighbours, or is convex and holds no other corner with them."""
    a, b, c = points[list(ear)]
    area = _side(a, b, c)
    if area == 0:
        return bool((b - a) @ (c - b) > 0)
    others = points[[i for i in left if i not in ear]]
    held = (_side(a, b, others) >= 0) & (_side(b, c, others) >= 0) & (_side(c, a, others) >= 0)
    return bool(area > 0 and not held.any())


def _side(start: FloatArray, end: FloatArray, points: FloatArray) -> FloatArray:
    """(..., 2) points -> (...) positive to the left of the line from start to end."""
    along, away = end - start, points - start
    return np.asarray(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])


def _holes(outline_xy: FloatArray, height_m: float, openings: Sequence[Opening]) -> list[list[_Hole]]:
    """The openings of each edge: of the nearest one, cut off at its ends, the floor and the ceiling."""
    start = outline_xy
    edge = np.roll(outline_xy, -1, axis=0) - start
    length = np.linalg.norm(edge, axis=1)
    along = edge / length[:, None]
    holes: list[list[_Hole]] = [[] for _ in outline_xy]
    for number, opening in enumerate(openings, start=1):
        middle = (opening.left_xy + opening.right_xy) / 2
        place = np.clip(np.einsum("ij,ij->i", middle - start, along), 0, length)
        away = np.linalg.norm(middle - start - place[:, None] * along, axis=1)
        k = int(np.argmin(away))
        if away[k] > MAX_FROM_WALL_M:
            raise DataError(f"{opening.kind} {number} lies {away[k]:.2f} m from the nearest wall; expected in one")
        ends = np.sort([(end - start[k]) @ along[k] for end in (opening.left_xy, opening.right_xy)])
        s, e = np.clip(quantise_m(ends), 0, length[k]).tolist()
        low, high = np.clip([opening.low_m, opening.high_m], 0, height_m).tolist()
        if e - s < MIN_M or high - low < MIN_M:
            raise DataError(f"{opening.kind} {number} is {e - s:.3f} m wide, {high - low:.3f} m high in its wall")
        holes[k].append(_Hole(opening.kind, s, e, low, high))
    return holes


def _bricks(length_m: float, height_m: float, holes: Sequence[_Hole]) -> list[tuple[float, float, float, float]]:
    """(start, end, low, high) of rectangles that make up a wall without its holes."""
    cuts = sorted({0.0, length_m, *(x for hole in holes for x in (hole.start_m, hole.end_m))})
    bricks = []
    for start, end in pairwise(cuts):
        at = 0.0
        across = sorted((h.low_m, h.high_m) for h in holes if h.start_m < (start + end) / 2 < h.end_m)
        for low, high in [*across, (height_m, height_m)]:
            if low - at > MIN_M and end - start > MIN_M:
                bricks.append((start, end, at, low))
            at = max(at, high)
    return bricks


def _block(name: str, x0: float, x1: float, depth: float, z0: float, z1: float) -> Part:
    solid = convex.span((x0, 0.0, z0), (x1, depth, z1))
    return Part(name, COLOURS[name], ROLE_OF.get(name), solid=solid)
