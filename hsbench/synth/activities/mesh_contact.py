"""How near bodies come to parts that are meshes: the distance to their triangles.

Only the surface counts, also of closed pieces: a body is of one piece, and none of it gets inside without crossing it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from hsbench.geometry.transforms import apply
from hsbench.geometry.triangle_rays import STACK, TriangleTree, nearest, triangle_tree
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.truth.obstacles import pack_obstacles
from hsbench.truth.sittable import BEDDING_M, SEAT_HEIGHT_M, SEAT_ROLES
from hsbench.truth.tops import Surface, surfaces
from hsbench.truth.walkable import STEP_M
from hsbench.typing import FloatArray

CUSHION_M = 0.15  # what lies so little below a seat of the same mesh gives way with it


@dataclass(frozen=True, eq=False)
class MeshObstacle:
    """The mesh parts of an object, moved along the floor by shift_xy (2,) from where the trees have them.

    hard, soft: triangles; the soft ones give way under who sits or lies on the object. Either is None if it is empty.
    """

    object_id: int
    hard: TriangleTree | None
    soft: TriangleTree | None
    shift_xy: FloatArray

    def depth(self, points: FloatArray, radii: FloatArray, is_used: bool) -> FloatArray:
        """(N, 3) points, (N,) radii -> (N,) metres by which balls about them reach through a surface, at least 0."""
        there = points - np.append(self.shift_xy, 0.0)
        depth = np.zeros(len(points))
        for tree in (self.hard, None if is_used else self.soft):
            if tree is not None:
                depth = np.maximum(depth, radii - _distances(tree, there, radii))
        return depth

    def cuts(self, origin: FloatArray, target: FloatArray) -> bool:
        """Whether a surface cuts the straight line between two points (3,)."""
        start = (origin - np.append(self.shift_xy, 0.0))[None]
        trees = [tree for tree in (self.hard, self.soft) if tree is not None]
        return any(np.isfinite(nearest(tree, start, (target - origin)[None], 0.0, end=1.0)[0]) for tree in trees)

    def moved(self, shift_xy: FloatArray) -> MeshObstacle:
        """The same, farther along the floor."""
        return replace(self, shift_xy=self.shift_xy + shift_xy)


def mesh_obstacle(scene: Scene, item: SceneObject) -> MeshObstacle | None:
    """The triangles of an object's meshes that one does not step on; None without any."""
    corners = [(part.role, _corners(item, part)) for part in item.parts if part.mesh is not None]
    if not corners:
        return None
    heights = [
        top.height_m for j, part in enumerate(item.parts) if part.role in SEAT_ROLES for top in tops(scene, item, j)
    ]
    hard, soft = [np.empty((0, 3, 3))], [np.empty((0, 3, 3))]
    for role, triangles in corners:
        top = triangles[:, :, 2].max(axis=1)
        yields = np.zeros(len(top), dtype=np.bool_)
        if heights and (role is None or role in SEAT_ROLES):
            yields = (top >= min(heights) - CUSHION_M) & (top <= max(heights) + BEDDING_M)
        soft.append(triangles[yields & (top > STEP_M)])
        hard.append(triangles[~yields & (top > STEP_M)])
    return MeshObstacle(item.object_id, _tree(np.concatenate(hard)), _tree(np.concatenate(soft)), np.zeros(2))


def tops(scene: Scene, item: SceneObject, part_index: int) -> list[Surface]:
    """The surfaces on top of a part that are as high as seats."""
    alone = pack_obstacles(replace(scene, objects=(item,)))
    found = surfaces(item, 0, part_index, alone)
    return [top for top in found if SEAT_HEIGHT_M[0] <= top.height_m <= SEAT_HEIGHT_M[1]]


def gap_m(item: SceneObject, part: Part, points: FloatArray, limit_m: float) -> FloatArray:
    """(N, 3) points -> (N,) distance from the surface of a part; of a mesh at most ``limit_m``."""
    if part.solid is not None:
        solid = part.solid.transformed(item.scene_T_object)
        return np.asarray(np.abs((points @ solid.planes[:, :3].T - solid.planes[:, 3]).max(axis=1)))
    tree = _tree(_corners(item, part))
    assert tree is not None
    return np.asarray(_distances(tree, np.ascontiguousarray(points), np.full(len(points), limit_m)))


def first_hit(item: SceneObject, part: Part, origin: FloatArray, direction: FloatArray) -> FloatArray | None:
    """(3,) where a ray from a point along a unit direction meets a part's triangles first, or None."""
    tree = _tree(_corners(item, part))
    assert tree is not None
    away = nearest(tree, origin[None], direction[None], 0.0)[0]
    return np.asarray(origin + away * direction) if np.isfinite(away) else None


def _corners(item: SceneObject, part: Part) -> FloatArray:
    """(T, 3, 3) triangles of a part in the scene."""
    return np.asarray(apply(item.scene_T_object, part.vertices)[part.triangles])


def _tree(corners: FloatArray) -> TriangleTree | None:
    if not len(corners):
        return None
    return triangle_tree(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))


@numba.njit(cache=True)
def _distances(tree: TriangleTree, points: FloatArray, limits: FloatArray) -> FloatArray:
    """(N,) distance from each point to the nearest triangle, at most its limit."""
    found = np.empty(len(points))
    stack = np.empty(STACK, np.int64)
    for n in range(len(points)):
        p, best = points[n], limits[n] ** 2
        stack[0], size = 0, 1
        while size:
            size -= 1
            node = stack[size]
            square = 0.0
            for axis in range(3):
                low, high = tree.bounds[node, 0, axis], tree.bounds[node, 1, axis]
                square += max(low - p[axis], 0.0, p[axis] - high) ** 2
            if square >= best:
                continue
            if tree.child[node] >= 0:
                stack[size], stack[size + 1] = tree.child[node], tree.child[node] + 1
                size += 2
                continue
            for t in range(tree.span[node, 0], tree.span[node, 1]):
                best = min(best, _square_to_triangle(tree.corners[t], p))
        found[n] = np.sqrt(best)
    return found


@numba.njit(cache=True)
def _square_to_triangle(corners: FloatArray, p: FloatArray) -> float:
    """Squared distance from a point to a triangle: to its plane if its foot lies inside, else to the nearest side."""
    ux, uy, uz = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    vx, vy, vz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    best, inside = np.inf, square > 0.0
    for k in range(3):
        a, b = corners[k], corners[(k + 1) % 3]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        px, py, pz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
        inside &= nx * (ey * pz - ez * py) + ny * (ez * px - ex * pz) + nz * (ex * py - ey * px) >= 0.0
        length = ex * ex + ey * ey + ez * ez
        share = 0.0 if length == 0.0 else min(max((ex * px + ey * py + ez * pz) / length, 0.0), 1.0)
        best = min(best, (px - share * ex) ** 2 + (py - share * ey) ** 2 + (pz - share * ez) ** 2)
    if inside:
        away = nx * (p[0] - corners[0, 0]) + ny * (p[1] - corners[0, 1]) + nz * (p[2] - corners[0, 2])
        return away * away / square
    return best
