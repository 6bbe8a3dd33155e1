"""What stands between a camera and people: the parts of a scene, those that move at their places of the time.

Parts that cannot be in the way of any joint of a body are left out by the cones that hold the body and the part as the
camera sees them; that decides only what is looked at, never the answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.rays import PARALLEL, pack_solids
from hsbench.geometry.transforms import ANGLE_DECIMALS, apply, invert
from hsbench.geometry.triangle_rays import TriangleTree, nearest, triangle_tree
from hsbench.schema.motions import ObjectMotions, Thing, check_things
from hsbench.schema.scene import Part, Scene
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray

CONE_SLACK = 1e-9  # of a cosine: more than rounding


class Solids(NamedTuple):
    """N convex solids: planes (P, 4), first row of each (N + 1,), spheres about them: centres (N, 3), radii (N,)."""

    planes: FloatArray
    start: IntArray
    centre: FloatArray
    radius: FloatArray


class Things(NamedTuple):
    """Parts that stay together, in one frame: the convex ones, and the triangles of the others."""

    solids: Solids
    triangles: TriangleTree | None


class Mover(NamedTuple):
    """A thing that moves: its parts in the object frame, that frame (4, 4) at t0, what moves it, outermost first."""

    parts: Things
    episode_T_object: FloatArray
    moved_by: tuple[Thing, ...]


@dataclass(frozen=True, eq=False)
class Occluders:
    """A scene for lines of sight: what never moves, in the episode frame, what does, and how."""

    still: Things
    movers: tuple[Mover, ...]
    motions: ObjectMotions

    @classmethod
    def of(cls, scene: Scene, motions: ObjectMotions) -> Occluders:
        """A scene in the episode frame. Raises SchemaError for motions of what it does not have."""
        check_things(scene, motions.tracks)
        still: list[tuple[FloatArray, Part]] = []
        movers: list[Mover] = []
        for item in scene.objects:
            frame, names = item.scene_T_object, sorted({p.name for p in item.parts})
            whole = tuple(thing for thing in ((item.object_id, ""),) if thing in motions.tracks)
            alone = [name for name in names if (item.object_id, name) in motions.tracks and name]
            rest = [p for p in item.parts if p.name not in alone]
            if whole:
                movers.append(Mover(_things([(np.eye(4), p) for p in rest]), frame, whole))
            else:
                still += [(frame, p) for p in rest]
            for name in alone:
                parts = [(np.eye(4), p) for p in item.parts if p.name == name]
                movers.append(Mover(_things(parts), frame, (*whole, (item.object_id, name))))
        return cls(_things(still), tuple(movers), motions)

    def hide(self, camera: FloatArray, timestamp_ns: IntArray, joints: FloatArray, asked: BoolArray) -> BoolArray:
        """(3,) camera, (N,) times, (N, J, 3) joints, (N, J) joints asked for -> (N, J) whether the scene hides them.

        A joint inside a solid is hidden, one that touches it from outside is not.
        """
        joints = np.ascontiguousarray(joints, dtype=np.float64)
        origins = np.tile(camera, (len(joints), 1))
        hidden = _cut_by(self.still, origins, joints, asked)
        times, when = np.unique(timestamp_ns, return_inverse=True)
        moves = _moves_over(self.motions, times)
        for mover in self.movers:
            points = apply(invert(mover.episode_T_object), np.concatenate([origins[:, None], joints], axis=1))
            for thing in mover.moved_by:
                points = _brought_back(points, moves[thing][when])
            hidden |= _cut_by(mover.parts, points[:, 0].copy(), points[:, 1:].copy(), asked & ~hidden)
        return hidden


def _things(parts: list[tuple[FloatArray, Part]]) -> Things:
    """Parts and the frames in which they are given."""
    solids = [p.solid.transformed(frame) for frame, p in parts if p.solid is not None]
    packed = pack_solids(solids)
    bounds = np.array([s.bounds for s in solids]).reshape(-1, 2, 3)
    spread = bounds[:, 1] - bounds[:, 0]
    radius = np.sqrt((spread * spread).sum(axis=1)) / 2
    meshes = [(apply(frame, p.vertices), p.triangles) for frame, p in parts if p.mesh is not None]
    return Things(Solids(packed.planes, packed.plane_start, bounds.mean(axis=1), radius), _tree(meshes))


def _tree(meshes: list[tuple[FloatArray, Int32Array]]) -> TriangleTree | None:
    if not meshes:
        return None
    start = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    triangles = np.concatenate([t + first for (_, t), first in zip(meshes, start[:-1], strict=True)])
    return triangle_tree(np.concatenate([vertices for vertices, _ in meshes]), triangles.astype(np.int32))


def _moves_over(motions: ObjectMotions, times_ns: IntArray) -> dict[Thing, FloatArray]:
    """The move (T, 3) of each thing at ascending times (T,)."""
    found = {thing: np.zeros((len(times_ns), 3)) for thing in motions.tracks}
    keys = np.unique(motions.timestamp_ns)
    at_key = [motions.moves_at(int(key)) for key in keys]
    for k, passed in enumerate(np.searchsorted(keys, times_ns, side="right").tolist()):
        if passed == 0:
            continue
        rests = passed == len(keys) or at_key[passed - 1] == at_key[passed]
        moves = at_key[passed - 1] if rests else motions.moves_at(int(times_ns[k]))
        for thing, move in moves.items():
            found[thing][k] = move
    return found


def _brought_back(points: FloatArray, move: FloatArray) -> FloatArray:
    """(N, K, 3) points and (N, 3) planar moves -> (N, K, 3) where the points are for one who goes along."""
    c, s = np.round(np.cos(move[:, 2:]), ANGLE_DECIMALS), np.round(np.sin(move[:, 2:]), ANGLE_DECIMALS)
    x, y = points[..., 0] - move[:, :1], points[..., 1] - move[:, 1:2]
    return np.stack([c * x + s * y, c * y - s * x, points[..., 2]], axis=-1)


def _cut_by(things: Things, origins: FloatArray, joints: FloatArray, asked: BoolArray) -> BoolArray:
    hidden = np.asarray(_blocked(origins, joints, asked, *things.solids))
    if things.triangles is not None:
        row, joint = np.nonzero(asked & ~hidden)
        hidden[row, joint] = nearest(things.triangles, origins[row], joints[row, joint] - origins[row], 0.0) < 1.0
    return hidden


@numba.njit(cache=True)
def _blocked(
    origins: FloatArray, joints: FloatArray, asked: BoolArray, planes: FloatArray, start: IntArray, centre: FloatArray,
    radius: FloatArray,
) -> BoolArray:  # fmt: skip
    """(N, 3) origins, (N, J, 3) joints -> (N, J) whether a solid cuts the open segment between them (slab method)."""
    hidden = np.zeros(asked.shape, dtype=np.bool_)
    near = np.empty(len(radius), dtype=np.int64)
    for row in range(asked.shape[0]):
        origin = origins[row]
        count = _near(origin, joints[row], asked[row], centre, radius, near)
        for j in range(asked.shape[1]):
            if not asked[row, j]:
                continue
            joint = joints[row, j]
            for k in range(count):
                if _cut(origin, joint, planes, start[near[k]], start[near[k] + 1]):
                    hidden[row, j] = True
                    break
    return hidden


@numba.njit(cache=True)
def _cut(origin: FloatArray, target: FloatArray, planes: FloatArray, first: int, stop: int) -> bool:
    dx, dy, dz = target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]
    enter, leave = 0.0, 1.0
    for p in range(first, stop):
        nx, ny, nz = planes[p, 0], planes[p, 1], planes[p, 2]
        gap = planes[p, 3] - nx * origin[0] - ny * origin[1] - nz * origin[2]
        along = nx * dx + ny * dy + nz * dz
        if abs(along) < PARALLEL:
            if gap <= 0.0:
                return False
        elif along > 0.0:
            leave = min(leave, gap / along)
        else:
            enter = max(enter, gap / along)
        if leave <= enter:
            return False
    return True


@numba.njit(cache=True)
def _near(
    origin: FloatArray, joints: FloatArray, asked: BoolArray, centre: FloatArray, radius: FloatArray, near: IntArray
) -> int:
    """Write to ``near`` the solids whose sphere meets the cone from the origin about the joints; how many there are."""
    ax, ay, az, far = 0.0, 0.0, 0.0, 0.0
    for j in range(len(asked)):
        if asked[j]:
            x, y, z = joints[j, 0] - origin[0], joints[j, 1] - origin[1], joints[j, 2] - origin[2]
            length = np.sqrt(x * x + y * y + z * z)
            far = max(far, length)
            if length > 0.0:
                ax, ay, az = ax + x / length, ay + y / length, az + z / length
    size = np.sqrt(ax * ax + ay * ay + az * az)
    cosine = 1.0
    for j in range(len(asked)):
        if asked[j] and size > 0.0:
            x, y, z = joints[j, 0] - origin[0], joints[j, 1] - origin[1], joints[j, 2] - origin[2]
            length = np.sqrt(x * x + y * y + z * z)
            if length > 0.0:
                cosine = min(cosine, (x * ax + y * ay + z * az) / (length * size))
    sine = np.sqrt(max(0.0, 1.0 - cosine * cosine))
    count = 0
    for s in range(len(radius)):
        x, y, z = centre[s, 0] - origin[0], centre[s, 1] - origin[1], centre[s, 2] - origin[2]
        distance = np.sqrt(x * x + y * y + z * z)
        if distance - radius[s] > far:
            continue
        if distance > radius[s] and size > 0.0 and cosine > 0.0:
            sine_s = radius[s] / distance
            both = cosine * np.sqrt(1.0 - sine_s * sine_s) - sine * sine_s
            if (x * ax + y * ay + z * az) / (distance * size) < both - CONE_SLACK:
                continue
        near[count] = s
        count += 1
    return count
