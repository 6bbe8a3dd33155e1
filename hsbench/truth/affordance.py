"""What the surfaces of a scene afford, from geometry alone: per part, per voxel and from above.

The rules of task affordance-topdown are in ``walkable``, ``sittable`` and ``reach``. Joined here, with our own:

- interactable: a reached point of a part with a functional role; of a top, a point of its upper side, at .4-1.4 m.
- reachable: a reached point of any part.
- supportable, openable: the points that ``supportable`` says; the reached points of the parts that ``openable`` says.
- sittable, lyable: the upper side of the whole part, where it is at t0.

Labels belong to small patches of surface (``surfaces``); a part has a label if one of its patches has it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.occupancy import AffordanceTruth, AffordanceVoxels, PartAffordances
from hsbench.schema.scene import Scene
from hsbench.schema.states import Affordance
from hsbench.truth.lying import lying_parts
from hsbench.truth.obstacles import Obstacles, pack_obstacles
from hsbench.truth.openable import openable_parts
from hsbench.truth.reach import REACH_M, Shoulders, face_normals, reached, shoulders
from hsbench.truth.sittable import SEAT_HEIGHT_M, SHOULDER_SEATED_M, SHOULDER_STANDING_M, seat_uses
from hsbench.truth.supportable import supports
from hsbench.truth.surfaces import SLACK_M, Patches, cut_patches, draw_plan, draw_voxels
from hsbench.truth.walkable import CELL_M, WalkMap, connected_to_doors, walk_map
from hsbench.typing import BoolArray, FloatArray, Int32Array, IntArray, UInt8Array

FUNCTIONAL_ROLES = ("shelf", "handle", "door", "drawer", "screen", "switch", "tap", "front", "board")
TOP_HEIGHT_M = (0.4, 1.4)  # task affordance-topdown
LOWEST_M = SEAT_HEIGHT_M[0] + SHOULDER_SEATED_M - REACH_M  # no label but the floor's lies outside these heights
HIGHEST_M = SHOULDER_STANDING_M + REACH_M
PLAN_CELLS = 256  # task affordance-topdown


@dataclass(frozen=True, eq=False)
class AffordanceScene:
    """A scene's surfaces in patches and what each affords, in the scene's frame.

    walk: cells that are free and connected to a door. labels: (P,) uint8 bit field of ``Affordance`` per patch.
    """

    scene: Scene
    walk: WalkMap
    obstacles: Obstacles
    shoulders: tuple[Shoulders, ...]
    patches: Patches
    labels: UInt8Array

    def reaches(self, points_m: FloatArray, object_id: IntArray, part_index: IntArray) -> BoolArray:
        """(N, 3) points on the surface of parts, (N,) object ids and part indices -> (N,) bool: a hand gets there.

        Raises SchemaError for an id that no object has.
        """
        objects = self.scene.objects
        index = {i: objects.index(self.scene.object(i)) for i in np.unique(object_id).tolist()}
        first = np.searchsorted(self.obstacles.object_index, [index[i] for i in object_id.tolist()])
        part = (first + part_index).astype(np.int32)
        return reached(points_m, face_normals(points_m, part, self.obstacles), part, self.obstacles, self.shoulders)


def afford(scene: Scene) -> AffordanceScene:
    """Label the surfaces of a scene. Raises SchemaError for an object with mesh parts."""
    walk = walk_map(scene)
    walk = WalkMap(walk.origin_xy, connected_to_doors(walk, scene), walk.cell_m)
    obstacles = pack_obstacles(scene)
    uses = seat_uses(scene, walk, obstacles)
    from_ = shoulders(walk, uses)
    patches = cut_patches(obstacles, LOWEST_M, HIGHEST_M)
    owner, up = patches.owner, patches.faces_up
    touched = reached(patches.point, patches.normal[patches.face], owner, obstacles, from_)
    labels = np.zeros(len(owner), dtype=np.uint8)
    for kind, held in {
        Affordance.SITTABLE: up & _chosen({(u.object_index, u.part_index) for u in uses}, obstacles)[owner],
        Affordance.INTERACTABLE: touched & _functional(scene, owner, up),
        Affordance.LYABLE: up & _chosen(set(lying_parts(scene, walk, obstacles)), obstacles)[owner],
        Affordance.REACHABLE: touched,
        Affordance.SUPPORTABLE: supports(patches, obstacles),
        Affordance.OPENABLE: touched & openable_parts(scene, patches, touched, obstacles)[owner],
    }.items():
        labels |= held * _bit(kind)
    return AffordanceScene(scene, walk, obstacles, from_, patches, labels)


def part_affordances(found: AffordanceScene) -> PartAffordances:
    """What each part affords, in the scene's order."""
    labels = np.zeros(len(found.obstacles), dtype=np.uint8)
    np.bitwise_or.at(labels, found.patches.owner, found.labels)
    objects = found.scene.objects
    return PartAffordances(
        np.array([objects[k].object_id for k in found.obstacles.object_index], dtype=np.int32),
        found.obstacles.part_index,
        tuple(part.name for item in objects for part in item.parts),
        labels,
    )


def voxel_affordances(found: AffordanceScene, grid: VoxelGrid) -> AffordanceVoxels:
    """Labelled surfaces in a grid in the scene's frame; the floor of walkable cells is in the layer from z = 0 on."""
    labels = draw_voxels(found.patches, found.labels, found.obstacles, grid)
    layer = int(np.floor((SLACK_M - grid.origin_m[2]) / grid.voxel_m))
    if 0 <= layer < grid.shape[2]:
        labels[:, :, layer] |= _walkable(found.walk, np.array(grid.origin_m[:2]), grid.shape[:2], grid.voxel_m)
    return AffordanceVoxels(grid, labels)


def top_down(
    found: AffordanceScene, origin_xy: FloatArray, shape: tuple[int, int], cell_m: float = CELL_M
) -> UInt8Array:
    """(nx, ny) uint8 bit field of ``Affordance``, [x, y], of cells with minimum corner (2,) in the scene's frame.

    All labels of a column are kept, whatever lies above or below what.
    """
    plan = draw_plan(found.patches, found.labels, found.obstacles, origin_xy, shape, cell_m)
    return np.asarray(plan | _walkable(found.walk, np.asarray(origin_xy), shape, cell_m))


def affordance_truth(
    scene: Scene, grid: VoxelGrid | None = None, side_cells: int = PLAN_CELLS, cell_m: float = CELL_M
) -> AffordanceTruth:
    """Affordance of a scene at t0 in its frame: from above, centred on the origin, per part, and in a grid if given.

    Nothing is ignored. Raises SchemaError for an object with mesh parts.
    """
    found = afford(scene)
    corner = np.full(2, -side_cells * cell_m / 2)
    plan = np.ascontiguousarray(top_down(found, corner, (side_cells, side_cells), cell_m)[::-1, ::-1])
    voxels = None if grid is None else voxel_affordances(found, grid)
    return AffordanceTruth(plan, np.zeros(plan.shape, dtype=np.bool_), cell_m, part_affordances(found), voxels)


def _bit(kind: Affordance) -> np.uint8:
    return np.uint8(1 << kind)


def _walkable(walk: WalkMap, origin_xy: FloatArray, shape: tuple[int, ...], cell_m: float) -> UInt8Array:
    """(nx, ny) uint8: the walkable bit of the cells whose centre lies in a walkable cell of the map."""
    centres = WalkMap(origin_xy, np.zeros((shape[0], shape[1]), dtype=np.bool_), cell_m).centres()
    index, inside = walk.index(centres.reshape(-1, 2))
    free = inside & walk.free[tuple(np.where(inside[:, None], index, 0).T)]
    return np.asarray(free.reshape(shape[0], shape[1]) * _bit(Affordance.WALKABLE))


def _chosen(parts: set[tuple[int, int]], obstacles: Obstacles) -> BoolArray:
    """(N,) bool over the packed parts: among (object index, part index)."""
    pairs = zip(obstacles.object_index.tolist(), obstacles.part_index.tolist(), strict=True)
    return np.array([pair in parts for pair in pairs], dtype=np.bool_)


def _functional(scene: Scene, owner: Int32Array, up: BoolArray) -> BoolArray:
    """(P,) bool: the patch is for hands. owner: (P,) parts in the scene's order. up: (P,) bool, on an upper side."""
    sides, upper = [], []
    for item in scene.objects:
        for part, solid in zip(item.parts, item.solids, strict=True):
            height = float(quantise_m(solid.bounds[1, 2]))
            sides.append(part.role in FUNCTIONAL_ROLES)
            upper.append(part.role == "top" and TOP_HEIGHT_M[0] <= height <= TOP_HEIGHT_M[1])
    return np.array(sides, dtype=np.bool_)[owner] | (np.array(upper, dtype=np.bool_)[owner] & up)
