"""The surfaces on top of parts that bodies use, and the places on them for somebody who sits.

Of a convex part: the convex hull, seen from above, of the faces tilted by at most 15 degrees; exact. Of a mesh part:
its triangles that face up, on a lattice of ``CELL_M`` along the axes of its object, the highest where several lie above
each other within ``BAND_M``. What hangs together on the lattice without a jump of more than ``JUMP_M`` is one surface:
the cushions, the arms and the back of a sofa are several, though they are one mesh. Cushions are round at their rims:
triangles may be as steep as ``RIM_RAD``, if the plane through the middle of a patch is tilted by at most 15 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from scipy.ndimage import correlate1d, distance_transform_edt, maximum_filter
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.triangle_meshes import double_areas
from hsbench.schema.scene import SceneObject
from hsbench.truth.meshes import MeshBody
from hsbench.truth.obstacles import Obstacles
from hsbench.typing import BoolArray, FloatArray

MAX_TILT_RAD = np.radians(15.0)  # this and the next: task affordance-topdown
PATCH_M = 0.35
THIGH_M = 0.15  # from back to hollow of the knee .5 m (ISO/TR 7250-2, adults) less the patch
STEP_ALONG_M = 0.01
STEP_BACK_M = 0.05
CELL_M = 0.005
JUMP_M = 0.01  # between neighbouring cells; a slope of 45 degrees rises half of that
RIM_RAD = np.radians(45.0)
BAND_M = (0.05, 1.0)  # nobody sits or lies on meshes that are lower or higher
SLOPE_DECIMALS = 6  # so that the last bits of a sum decide nothing
INNER_CELLS = int(PATCH_M / 2 / np.sqrt(2.0) / CELL_M)  # half of the square in the disc of a patch
MIN_SIDE_M = 0.1  # smaller surfaces carry nobody
SLACK_M = 1e-6  # lengths that differ by less are equal, so that the last bits of a turn decide nothing


@dataclass(frozen=True, eq=False)
class Lattice:
    """Cells of a surface of a mesh part. held: (nx, ny) bool, z_m: (nx, ny) heights where held.

    low: (2,) minimum corner along ``axes`` (2, 2), whose rows are the horizontal unit axes of the object, in the scene.
    """

    held: BoolArray
    z_m: FloatArray
    low: FloatArray
    axes: FloatArray

    @cached_property
    def middle(self) -> BoolArray:
        """(nx, ny) bool: the cell can be the middle of a patch."""
        room = distance_transform_edt(np.pad(self.held, 1))[1:-1, 1:-1] * CELL_M
        steps = CELL_M * np.arange(-INNER_CELLS, INNER_CELLS + 1)
        z, even = np.where(self.held, self.z_m, 0.0), np.ones(len(steps))
        lines = [(steps, even), (even, steps)]
        slopes = [correlate1d(correlate1d(z, x, axis=0), y, axis=1) for x, y in lines]
        slopes = [found / ((steps**2).sum() * len(steps)) for found in slopes]
        slope = np.round(np.hypot(*slopes), SLOPE_DECIMALS)
        return np.asarray((room >= (PATCH_M - CELL_M) / 2) & (slope <= np.tan(MAX_TILT_RAD)))

    def holds(self, points: FloatArray, margin_m: float) -> BoolArray:
        """(N, 3) points -> (N,) bool: within a margin of the surface, in its cells or their neighbours."""
        z_m = maximum_filter(np.pad(np.where(self.held, self.z_m, -np.inf), 1, constant_values=-np.inf), size=3)
        index = np.floor((points[:, :2] @ self.axes.T - self.low) / CELL_M).astype(np.int64) + 1
        inside = ((index >= 0) & (index < z_m.shape)).all(axis=1)
        i, j = np.where(inside[:, None], index, 0).T
        return np.asarray(inside & (np.abs(z_m[i, j] - points[:, 2]) <= margin_m))


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of a part in the scene frame. height_m: of its highest point.

    outlines: convex outlines (H, 2), counter-clockwise, that cover it. lattice: None if the one outline is exact.
    """

    part_index: int
    outlines: tuple[FloatArray, ...]
    height_m: float
    lattice: Lattice | None = None


def surfaces(item: SceneObject, object_index: int, part_index: int, obstacles: Obstacles) -> list[Surface]:
    """The surfaces on top of a part."""
    solid = obstacles.solids[object_index][part_index]
    if solid is None:
        return _of_mesh(item, part_index, obstacles.bodies[object_index])
    found = upper_outline(solid)
    return [] if found is None else [Surface(part_index, (found[0],), found[1])]


def upper_outline(solid: ConvexSolid) -> tuple[FloatArray, float] | None:
    """((H, 2) counter-clockwise outline, height in m) of a solid's surface on top; None if it has none.

    The surface is the convex hull, seen from above, of the faces tilted by at most 15 degrees; its height the largest.
    """
    faces = solid.planes[solid.planes[:, 2] >= np.cos(MAX_TILT_RAD) - SLACK_M]
    on_top = (np.abs(solid.vertices @ faces[:, :3].T - faces[:, 3]) < SLACK_M).any(axis=1)
    corners = solid.vertices[on_top]
    if not len(corners):
        return None
    outline = corners[ConvexHull(corners[:, :2]).vertices, :2]
    return np.ascontiguousarray(outline), float(quantise_m(corners[:, 2].max()))


def places(surface: Surface, front_xy: FloatArray) -> FloatArray:
    """(K, 3) middles of the patches that a surface holds for somebody who faces ``front_xy``: along it, to its left,
    and where the surface ends in front of the patch, along it. From right to left, from the front backwards.
    """
    if surface.lattice is None:
        outline = surface.outlines[0]
        ahead, left = outline @ front_xy, outline[:, 1] * front_xy[0] - outline[:, 0] * front_xy[1]
        return np.asarray(_places_in(ahead, left))
    return _places_on(surface.lattice, front_xy)


@numba.njit(cache=True)
def _places_in(ahead: FloatArray, left: FloatArray) -> FloatArray:
    """(K, 3) places in a counter-clockwise outline, along its front edge."""
    half = PATCH_M / 2
    edge, low, high = ahead.max(), left.min() + half, left.max() - half
    found = np.empty((0, 3))
    if high < low - SLACK_M:
        return found
    steps = 2 * max(1, int(np.ceil((high - low - SLACK_M) / (2 * STEP_ALONG_M))))  # even: the middle is one of them
    found = np.empty(((steps + 1) * (int(THIGH_M / STEP_BACK_M) + 2), 3))
    count = 0
    for k in range(steps + 1):
        across = low + (high - low) * k / steps
        rear, fore = _chord(ahead, left, across, half - SLACK_M)
        while fore >= rear and edge - fore - half <= THIGH_M + SLACK_M:
            found[count] = fore, across, edge
            count += 1
            fore -= STEP_BACK_M
    return found[:count].copy()


@numba.njit(cache=True)
def _chord(ahead: FloatArray, left: FloatArray, across: float, inset: float) -> tuple[float, float]:
    """Extent along ``ahead``, at one value of ``left``, of what lies ``inset`` inside a counter-clockwise outline."""
    rear, fore = -np.inf, np.inf
    for k in range(len(ahead)):
        n = (k + 1) % len(ahead)
        x, y = left[n] - left[k], ahead[k] - ahead[n]  # outward normal
        length = np.sqrt(x * x + y * y)
        rest = x * ahead[k] + y * left[k] - inset * length - y * across
        if x > SLACK_M * length:
            fore = min(fore, rest / x)
        elif x < -SLACK_M * length:
            rear = max(rear, rest / x)
        elif rest < 0.0:
            fore = -np.inf
    return rear, fore


def _places_on(lattice: Lattice, front_xy: FloatArray) -> FloatArray:
    """(K, 3) places on a lattice, one of whose axes ``front_xy`` runs along, either way."""
    forward = lattice.axes @ front_xy
    leftward = lattice.axes @ np.array([-front_xy[1], front_xy[0]])
    held, middle, low = lattice.held, lattice.middle, lattice.low
    high = low + CELL_M * np.array(held.shape)
    along, across = int(np.argmax(np.abs(forward))), int(np.argmax(np.abs(leftward)))
    if along == 1:
        held, middle = held.T, middle.T
    ahead_from, left_from = low[along], low[across]
    if forward[along] < 0:
        held, middle, ahead_from = held[::-1], middle[::-1], -high[along]
    if leftward[across] < 0:
        held, middle, left_from = held[:, ::-1], middle[:, ::-1], -high[across]
    rows = _cells_on(np.ascontiguousarray(held), np.ascontiguousarray(middle))
    return np.column_stack(
        [
            ahead_from + (rows[:, 0] + 0.5) * CELL_M,
            left_from + (rows[:, 1] + 0.5) * CELL_M,
            ahead_from + rows[:, 2] * CELL_M,
        ]
    )


@numba.njit(cache=True)
def _cells_on(held: BoolArray, middle: BoolArray) -> FloatArray:
    """(K, 3) cells, [ahead, left], that can be the middle of a patch near enough to the surface's edge ahead of them,
    and where that is.
    """
    found = np.empty((middle.sum(), 3))
    back, count = round(STEP_BACK_M / CELL_M), 0
    for j in range(0, held.shape[1], round(STEP_ALONG_M / CELL_M)):
        i = held.shape[0] - 1
        while i >= 0:
            if not held[i, j]:
                i -= 1
                continue
            edge = i + 1
            next_ = i
            while i >= 0 and held[i, j]:
                if middle[i, j] and i <= next_ and (edge - i - 0.5) * CELL_M - PATCH_M / 2 <= THIGH_M + SLACK_M:
                    found[count] = i, j, edge
                    count += 1
                    next_ = i - back
                i -= 1
    return found[:count].copy()


def _of_mesh(item: SceneObject, part_index: int, body: MeshBody) -> list[Surface]:
    """The surfaces of a mesh part, large enough to carry somebody."""
    own = np.flatnonzero(body.part == part_index)
    corners = body.vertices[body.triangles[own]]
    normals = double_areas(body.vertices, body.triangles[own])
    lift = np.where(body.solid[own], normals[:, 2], np.abs(normals[:, 2]))  # a sheet has two upper sides
    flat = lift >= np.cos(RIM_RAD) * np.linalg.norm(normals, axis=1)
    flat &= (corners[:, :, 2].max(axis=1) >= BAND_M[0]) & (corners[:, :, 2].min(axis=1) <= BAND_M[1]) & (lift > 0)
    if not flat.any():
        return []
    axes = item.scene_T_object[:2, :2].T
    axes = axes / np.linalg.norm(axes, axis=1)[:, None]
    local = corners[flat].copy()
    local[:, :, :2] = local[:, :, :2] @ axes.T
    low = quantise_m(local[:, :, :2].min(axis=(0, 1)))
    shape = np.ceil((local[:, :, :2].max(axis=(0, 1)) - low) / CELL_M).astype(np.int64) + 1
    z = _highest(np.ascontiguousarray(local), low, np.full((int(shape[0]), int(shape[1])), -np.inf))
    found = []
    for held in _hanging_together(z):
        sides = [np.flatnonzero(held.any(axis=1 - axis)) for axis in range(2)]
        if min(side[-1] - side[0] + 1 for side in sides) * CELL_M < MIN_SIDE_M:
            continue
        window = tuple(slice(side[0], side[-1] + 1) for side in sides)
        corner = low + CELL_M * np.array([side[0] for side in sides])
        lattice = Lattice(held[window], z[window], corner, axes)
        height_m = float(quantise_m(z[held].max()))
        found.append(Surface(part_index, _strips(lattice), height_m, lattice))
    return found


@numba.njit(cache=True)
def _highest(triangles: FloatArray, low: FloatArray, z: FloatArray) -> FloatArray:
    """``z`` (nx, ny) raised to the triangles (T, 3, 3) over the middles of the cells, where they lie in the band."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        margin = SLACK_M * np.sqrt(abs(area)) / abs(area)
        first, last = np.empty(2, dtype=np.int64), np.empty(2, dtype=np.int64)
        for axis in range(2):
            first[axis] = int((min(a[axis], b[axis], c[axis]) - low[axis]) / CELL_M - 0.5)
            last[axis] = min(z.shape[axis] - 1, int((max(a[axis], b[axis], c[axis]) - low[axis]) / CELL_M + 0.5))
        for i in range(max(0, first[0]), last[0] + 1):
            x = low[0] + (i + 0.5) * CELL_M
            for j in range(max(0, first[1]), last[1] + 1):
                y = low[1] + (j + 0.5) * CELL_M
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1.0 - u - v
                if min(u, v, w) < -margin:
                    continue
                height = u * a[2] + v * b[2] + w * c[2]
                if BAND_M[0] <= height <= BAND_M[1]:
                    z[i, j] = max(z[i, j], height)
    return z


def _hanging_together(z: FloatArray) -> list[BoolArray]:
    """(nx, ny) bool for each set of cells that hang together without a jump."""
    number = np.arange(z.size).reshape(z.shape)
    pairs = []
    for a, b in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        with np.errstate(invalid="ignore"):
            level = np.abs(z[a] - z[b]) <= JUMP_M
        pairs.append(np.stack([number[a][level], number[b][level]]))
    rows, columns = np.concatenate(pairs, axis=1)
    graph = coo_matrix((np.ones(len(rows), dtype=np.bool_), (rows, columns)), shape=(z.size, z.size))
    _, piece = connected_components(graph, directed=False)
    sizes = np.bincount(piece[np.isfinite(z).ravel()])
    wanted = np.flatnonzero(sizes * CELL_M**2 >= MIN_SIDE_M**2)
    return [(piece == k).reshape(z.shape) for k in wanted]


def _strips(lattice: Lattice) -> tuple[FloatArray, ...]:
    """The cells of each row along y that follow each other, as rectangles (4, 2) in the scene, with half a cell around:
    so that what is just long enough stays so.
    """
    edges = np.diff(np.pad(lattice.held, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(edges > 0)
    _, stop = np.nonzero(edges < 0)
    x, y = (np.stack([low - 0.5, high + 0.5], axis=1) for low, high in ((row, row + 1), (first, stop)))
    corners = np.stack([x[:, [0, 1, 1, 0]], y[:, [0, 0, 1, 1]]], axis=-1) * CELL_M + lattice.low
    return tuple(np.ascontiguousarray(outline) for outline in corners @ lattice.axes)
