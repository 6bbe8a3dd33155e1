"""Whether a body fits where it is to be: its axis points against the solids of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from hsbench.geometry.rays import PackedSolids, pack_solids, segments_blocked
from hsbench.schema.scene import Scene
from hsbench.synth.people.body import Body, capsules
from hsbench.truth.walkable import STEP_M
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

AXIS_SHARES = (0.0, 0.5, 1.0)  # points of a capsule's axis that are tested


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Solids of a scene that a body can run into, packed; object_id: (S,) int32 whose they are; bounds: (S, 2, 3)."""

    packed: PackedSolids
    object_id: Int32Array
    bounds: FloatArray

    @classmethod
    def of(cls, scene: Scene) -> Obstacles:
        """The solids of every object but those flat enough to be stepped on: the floor, rugs."""
        solids = [(item.object_id, solid) for item in scene.objects for solid in item.solids]
        owned = [(owner, solid) for owner, solid in solids if solid.bounds[1, 2] > STEP_M]
        bounds = np.array([solid.bounds for _, solid in owned]).reshape(-1, 2, 3)
        return cls(pack_solids([s for _, s in owned]), np.array([i for i, _ in owned], dtype=np.int32), bounds)

    def hold(self, points: FloatArray, margin_m: float = 0.0, ignored_id: int = -1) -> BoolArray:
        """(..., 3) points -> (...) bool: inside a solid grown by ``margin_m``, those of one object left out."""
        flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        planes, start = self.packed.planes, self.packed.plane_start
        inside = _inside(flat, planes, start, self.bounds, self.object_id, margin_m, ignored_id)
        return np.asarray(inside.reshape(points.shape[:-1]))

    def block(self, origin: FloatArray, target: FloatArray) -> bool:
        """Whether a solid cuts the straight line between two points (3,)."""
        return bool(segments_blocked(origin, np.asarray(target)[None], self.packed)[0])


def axis_points(body: Body, joints: FloatArray) -> FloatArray:
    """(T, 25, 3) joints -> (T, C, P, 3) points on the axes of the body's capsules."""
    ends, _ = capsules(body, joints)
    shares = np.array(AXIS_SHARES)[:, None]
    return np.asarray(ends[:, :, None, 0] * (1 - shares) + ends[:, :, None, 1] * shares)


@numba.njit(cache=True)
def _inside(
    points: FloatArray, planes: FloatArray, start: IntArray, bounds: FloatArray, owner: Int32Array,
    margin: float, ignored: int,
) -> BoolArray:  # fmt: skip
    inside = np.zeros(len(points), dtype=np.bool_)
    for t in range(len(points)):
        x, y, z = points[t, 0], points[t, 1], points[t, 2]
        for s in range(len(start) - 1):
            if owner[s] == ignored:
                continue
            if x < bounds[s, 0, 0] - margin or x > bounds[s, 1, 0] + margin:
                continue
            if y < bounds[s, 0, 1] - margin or y > bounds[s, 1, 1] + margin:
                continue
            if z < bounds[s, 0, 2] - margin or z > bounds[s, 1, 2] + margin:
                continue
            within = True
            for p in range(start[s], start[s + 1]):
                if planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z > planes[p, 3] + margin:
                    within = False
                    break
            if within:
                inside[t] = True
                break
    return inside
