"""Whether a scene could stand in a house: nothing interpenetrates, nothing floats, every door lets a body through.

Judged from the finished geometry alone, by other means than those that placed it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.geometry.convex import ConvexSolid
from hsbench.geometry.separation import penetrating_pairs
from hsbench.geometry.triangle_rays import nearest
from hsbench.schema.scene import Scene, SceneObject
from hsbench.truth.doorways import doorways
from hsbench.truth.meshes import has_mesh, mesh_body
from hsbench.truth.walkable import WalkMap, connected, walk_map
from hsbench.typing import BoolArray, FloatArray

PENETRATION_M = 0.01
GAP_M = 0.01
ROUNDING_M = 2e-4  # positions are quantised to .1 mm: a touch may be off by two roundings
BODY_WIDTH_M = 0.6
STEP_IN_M = 0.45  # a body is past a doorway when its middle is so far inside a room
MOUNTED_ABOVE_M = 0.08  # what hangs on a wall begins higher than this; a curtain hangs, too, and nearly reaches it
DOWN, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Faults:
    """One line a fault, naming the objects."""

    penetrating: tuple[str, ...]
    floating: tuple[str, ...]
    blocked_doors: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.penetrating) + len(self.floating) + len(self.blocked_doors)


def faults(scene: Scene) -> Faults:
    """What is wrong with a scene. How deep meshes penetrate is not judged: an open one has no inside. All else is."""
    return Faults(penetrating(scene), floating(scene), blocked_doors(scene))


def penetrating(scene: Scene) -> tuple[str, ...]:
    """Pairs of objects with convex parts deeper than ``PENETRATION_M`` inside each other."""
    solids = [s for item in scene.objects for s in item.solids]
    owner = np.array([k for k, item in enumerate(scene.objects) for _ in item.solids], dtype=np.int64)
    pairs, depth = penetrating_pairs(solids, owner, PENETRATION_M)
    worst: dict[tuple[int, int], float] = {}
    for (i, j), d in zip(owner[pairs].tolist(), depth.tolist(), strict=True):
        worst[i, j] = max(d, worst.get((i, j), 0.0))
    return tuple(
        f"{_name(scene.objects[i])} and {_name(scene.objects[j])} penetrate by {d:.3f} m"
        for (i, j), d in sorted(worst.items())
    )


def floating(scene: Scene) -> tuple[str, ...]:
    """Objects farther than ``GAP_M`` above what should carry them, and not mounted on a wall or under a ceiling."""
    return tuple(
        f"{_name(item)} floats at z = {item.vertices[:, 2].min():.3f} m"
        for item in scene.objects
        if item.category.group != "structure" and not _held(scene, item)
    )


def blocked_doors(scene: Scene) -> tuple[str, ...]:
    """Doors and passages that a body ``BODY_WIDTH_M`` wide cannot walk through; an entrance must be reached inside."""
    walk = walk_map(scene, radius_m=BODY_WIDTH_M / 2)
    lines = []
    for way in doorways(scene):
        past = [_near(walk, foot + STEP_IN_M * inward) for foot, inward in zip(way.feet, way.inward, strict=True)]
        reached = connected(walk, (way.feet[0] + STEP_IN_M * way.inward[0]))
        if not all((reached & near).any() for near in past):
            lines.append(f"{_name(scene.object(way.object_id))} is not passable for a body of {BODY_WIDTH_M} m")
    return tuple(lines)


def _near(walk: WalkMap, point_xy: FloatArray) -> BoolArray:
    """(nx, ny) bool: the cells that lie at most ``STEP_IN_M`` from a point (2,)."""
    return np.asarray(np.linalg.norm(walk.centres() - point_xy, axis=-1) <= STEP_IN_M)


def _held(scene: Scene, item: SceneObject) -> bool:
    """Whether a lowest corner rests on something, a rearmost is at a wall, or a highest one at the ceiling."""
    points = item.vertices
    low, high = points[:, 2].min(), points[:, 2].max()
    others = [o for o in scene.objects if o is not item]
    if _meets(points[points[:, 2] < low + GAP_M], DOWN, others):
        return True
    structure = [o for o in others if o.category.group == "structure"]
    if low > MOUNTED_ABOVE_M or item.category_name == "curtain":
        back = item.scene_T_object[:3, 1]
        depth = points @ back
        if _meets(points[depth > depth.max() - GAP_M], back, structure):
            return True
    return _meets(points[points[:, 2] > high - GAP_M], UP, structure)


def _meets(points: FloatArray, direction: FloatArray, others: list[SceneObject]) -> bool:
    """Whether a ray of ``GAP_M`` from any of the points (N, 3) along a unit direction meets another object."""
    ends = np.stack([points, points + (GAP_M + ROUNDING_M) * direction])
    low, high = ends.min(axis=(0, 1)) - ROUNDING_M, ends.max(axis=(0, 1)) + ROUNDING_M
    start, ways = points - ROUNDING_M * direction, np.tile(direction, (len(points), 1))
    return any(
        np.isfinite(nearest(mesh_body(other).tree, start, ways, 0.0, end=GAP_M + 2 * ROUNDING_M)).any()
        for other in others
        if has_mesh(other) and (other.vertices.min(axis=0) <= high).all() and (other.vertices.max(axis=0) >= low).all()
    ) or any(
        _cut(solid, points, direction).any()
        for other in others
        for solid in other.solids
        if (solid.bounds[0] <= high).all() and (solid.bounds[1] >= low).all()
    )


def _cut(solid: ConvexSolid, points: FloatArray, direction: FloatArray) -> BoolArray:
    """(N,) bool: the segment of length ``GAP_M`` from a point along a direction meets a solid (slab method)."""
    along = solid.planes[:, :3] @ direction
    gap = solid.planes[:, 3] + ROUNDING_M - points @ solid.planes[:, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = gap / along
    leave = np.where(along > 0, t, np.where((along == 0) & (gap < 0), -np.inf, np.inf)).min(axis=1)
    enter = np.where(along < 0, t, -np.inf).max(axis=1)
    return np.asarray(np.maximum(enter, 0.0) <= np.minimum(leave, GAP_M))


def _name(item: SceneObject) -> str:
    return f"{item.category_name} {item.object_id}"
