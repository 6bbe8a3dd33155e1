"""Whether a body fits where it is to be: its capsules against the solids and meshes of a scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from hsbench.geometry.rays import PackedSolids, pack_solids, segments_blocked
from hsbench.schema.scene import Scene, SceneObject
from hsbench.synth.activities.mesh_contact import MeshObstacle, mesh_obstacle
from hsbench.synth.people.body import Body, capsules
from hsbench.truth.walkable import STEP_M
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

AXIS_SHARES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # points of a capsule's axis that are tested
BEDDING_M = 0.12  # pillows and duvets on a mattress are as thick, at most (as in ``truth.sittable``)
YIELDING = frozenset(("cushion", "curtain"))  # what gives way wherever it lies


@dataclass(frozen=True, eq=False)
class Obstacles:
    """S solids of a scene that a body can run into, packed. object_id: (S,) int32 whose they are; bounds: (S, 2, 3).

    soft: (S,) bool, seats and mattresses with their bedding: they give way under who uses them. meshes: of the objects
    with mesh parts.
    """

    packed: PackedSolids
    object_id: Int32Array
    bounds: FloatArray
    soft: BoolArray
    meshes: tuple[MeshObstacle, ...] = ()

    @classmethod
    def of(cls, scene: Scene) -> Obstacles:
        """The parts of every object but cushions and those flat enough to be stepped on: the floor, rugs."""
        items = [item for item in scene.objects if item.category_name not in YIELDING]
        owned = [
            (item.object_id, solid, soft)
            for item in items
            for solid, soft in zip(item.solids, _soft(item), strict=True)
            if solid.bounds[1, 2] > STEP_M
        ]
        bounds = np.array([solid.bounds for _, solid, _ in owned]).reshape(-1, 2, 3)
        meshes = [mesh_obstacle(scene, item) for item in items]
        return cls(
            pack_solids([solid for _, solid, _ in owned]),
            np.array([i for i, _, _ in owned], dtype=np.int32),
            bounds,
            np.array([soft for _, _, soft in owned], dtype=np.bool_),
            tuple(mesh for mesh in meshes if mesh is not None),
        )

    def depth(self, points: FloatArray, radii: FloatArray, used_id: int = -1) -> FloatArray:
        """(N, 3) points and (N,) radii -> (N,) metres by which balls about them reach into parts, 0 where they do not.

        used_id: the object one sits or lies on; its soft parts are left out. Near an edge of a solid this is an upper
        bound: the distance is that to the farthest of its planes.
        """
        reach = radii.max(initial=0.0)
        low, high = points.min(axis=0, initial=np.inf) - reach, points.max(axis=0, initial=-np.inf) + reach
        near = ((self.bounds[:, 0] <= high) & (self.bounds[:, 1] >= low)).all(axis=1)
        near &= ~(self.soft & (self.object_id == used_id))
        which = np.flatnonzero(near)
        depth = np.asarray(_depth(points, radii, self.packed.planes, self.packed.plane_start, self.bounds, which))
        for mesh in self.meshes:
            depth = np.maximum(depth, mesh.depth(points, radii, mesh.object_id == used_id))
        return depth

    def block(self, origin: FloatArray, target: FloatArray) -> bool:
        """Whether anything cuts the straight line between two points (3,)."""
        if segments_blocked(origin, np.asarray(target)[None], self.packed)[0]:
            return True
        return any(mesh.cuts(origin, target) for mesh in self.meshes)

    def without(self, object_id: int) -> Obstacles:
        """The same without one object."""
        gone = self.object_id == object_id
        bounds = np.where(gone[:, None, None], np.array([[np.inf], [-np.inf]]), self.bounds)
        return replace(self, bounds=bounds, meshes=tuple(m for m in self.meshes if m.object_id != object_id))

    def with_moved(self, object_id: int, shift_xy: FloatArray) -> Obstacles:
        """The same with one object moved along the floor."""
        planes, bounds = self.packed.planes.copy(), self.bounds.copy()
        for row in np.flatnonzero(self.object_id == object_id):
            own = slice(self.packed.plane_start[row], self.packed.plane_start[row + 1])
            planes[own, 3] += planes[own, :2] @ shift_xy
            bounds[row, :, :2] += shift_xy
        meshes = tuple(m.moved(shift_xy) if m.object_id == object_id else m for m in self.meshes)
        return replace(self, packed=replace(self.packed, planes=planes), bounds=bounds, meshes=meshes)


def body_depth(obstacles: Obstacles, body: Body, joints: FloatArray, used_id: int = -1) -> FloatArray:
    """(T, 25, 3) joints -> (T, C) metres by which each of the body's capsules reaches into solids."""
    ends, radii = capsules(body, joints)
    shares = AXIS_SHARES[:, None]
    points = ends[:, :, None, 0] * (1 - shares) + ends[:, :, None, 1] * shares
    balls = radii[:, :1] * (1 - AXIS_SHARES) + radii[:, 1:] * AXIS_SHARES
    each = np.ascontiguousarray(np.broadcast_to(balls, points.shape[:-1])).reshape(-1)
    depth = obstacles.depth(np.ascontiguousarray(points).reshape(-1, 3), each, used_id)
    return np.asarray(depth.reshape(points.shape[:-1]).max(axis=-1))


def _soft(item: SceneObject) -> list[bool]:
    """For each solid of an object, whether it gives way under who uses it."""
    parts = [part for part in item.parts if part.solid is not None]
    tops = [float(part.vertices[:, 2].max()) for part in parts if part.role in ("seat", "mattress")]
    if not tops:
        return [False] * len(parts)
    low, high = min(tops) - BEDDING_M, max(tops) + BEDDING_M
    return [
        part.role in ("seat", "mattress")
        or (part.role is None and part.vertices[:, 2].min() >= low and part.vertices[:, 2].max() <= high)
        for part in parts
    ]


@numba.njit(cache=True)
def _depth(
    points: FloatArray, radii: FloatArray, planes: FloatArray, start: IntArray, bounds: FloatArray, which: IntArray
) -> FloatArray:
    depth = np.zeros(len(points))
    for t in range(len(points)):
        limit = radii[t]
        for s in which:
            beyond = False
            for axis in range(3):
                at = points[t, axis]
                beyond |= at < bounds[s, 0, axis] - limit or at > bounds[s, 1, axis] + limit
            if beyond:
                continue
            farthest = -np.inf
            for p in range(start[s], start[s + 1]):
                away = planes[p, 0] * points[t, 0] + planes[p, 1] * points[t, 1] + planes[p, 2] * points[t, 2]
                farthest = max(farthest, away - planes[p, 3])
                if farthest > limit:
                    break
            depth[t] = max(depth[t], limit - farthest)
    return depth
