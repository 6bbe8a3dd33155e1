"""What the surfaces of a scene afford, from geometry alone: per part, per voxel and from above.

The rules of task affordance-topdown are in ``walkable``, ``sittable`` and ``reach``. Joined here, with our own:

- interactable: a reached point of a part with a functional role; of a top, a point of its upper side, at .4-1.4 m.
- reachable: a reached point of any part.
- supportable, openable: the points that ``supportable`` says; the reached points of the parts that ``openable`` says.
- sittable, lyable: the upper side of the whole part, where it is at t0.

Labels belong to small patches of surface (``surfaces``); a part has a label if one of its patches has it. A mesh part
may be a whole sofa: of its upper sides only the surfaces that are sat or lain upon have these labels (``tops``). Of a
mesh part that is a top the height counts patch by patch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.occupancy import AffordanceTruth, AffordanceVoxels, PartAffordances
from hsbench.schema.scene import Scene
from hsbench.schema.states import Affordance
from hsbench.truth.lying import lying_surfaces
from hsbench.truth.obstacles import Obstacles, pack_obstacles
from hsbench.truth.openable import openable_parts
from hsbench.truth.reach import REACH_M, Shoulders, nearest_faces, reached, shoulders
from hsbench.truth.sittable import SEAT_HEIGHT_M, SHOULDER_SEATED_M, SHOULDER_STANDING_M, seat_uses
from hsbench.truth.supportable import supports
from hsbench.truth.surfaces import SLACK_M, Patches, cut_patches, draw_plan, draw_voxels
from hsbench.truth.tops import JUMP_M, Surface
from hsbench.truth.walkable import CELL_M, WalkMap, connected_to_doors, walk_map
from hsbench.typing import BoolArray, FloatArray, IntArray, UInt8Array

FUNCTIONAL_ROLES = ("shelf", "handle", "door", "drawer", "screen", "switch", "tap", "front", "board")
TOP_HEIGHT_M = (0.4, 1.4)  # task affordance-topdown
LOWEST_M = SEAT_HEIGHT_M[0] + SHOULDER_SEATED_M - REACH_M  # no label but the floor's lies outside these heights
HIGHEST_M = SHOULDER_STANDING_M + REACH_M
PLAN_CELLS = 256  # task affordance-topdown


@dataclass(frozen=True, eq=False)
class AffordanceScene:
    """A scene's surfaces in patches and what each affords, in the scene's frame.

    walk: cells that one can get to. labels: (P,) uint8 bit field of ``Affordance`` per patch.
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
        first = {i: self.obstacles.part_number(k, 0) for i, k in index.items()}
        part = np.array([first[i] for i in object_id.tolist()], dtype=np.int64) + part_index
        shape, normals = nearest_faces(points_m, part, self.obstacles)
        return reached(points_m, normals, shape, self.obstacles, self.shoulders)


def afford(scene: Scene, walk: WalkMap | None = None) -> AffordanceScene:
    """Label the surfaces of a scene. walk: the cells one can get to; by default those connected to a door."""
    if walk is None:
        walk = walk_map(scene)
        walk = WalkMap(walk.origin_xy, connected_to_doors(walk, scene), walk.cell_m)
    obstacles = pack_obstacles(scene)
    uses = seat_uses(scene, walk, obstacles)
    from_ = shoulders(walk, uses)
    patches = cut_patches(obstacles, LOWEST_M, HIGHEST_M)
    owner = patches.owner
    touched = reached(patches.point, patches.normal[patches.face], owner, obstacles, from_)
    labels = np.zeros(len(owner), dtype=np.uint8)
    for kind, held in {
        Affordance.SITTABLE: _on_surfaces(patches, [(use.object_index, use.surface) for use in uses], obstacles),
        Affordance.INTERACTABLE: touched & _functional(scene, patches, obstacles),
        Affordance.LYABLE: _on_surfaces(patches, lying_surfaces(scene, walk, obstacles), obstacles),
        Affordance.REACHABLE: touched,
        Affordance.SUPPORTABLE: supports(scene, patches, obstacles),
        Affordance.OPENABLE: touched & openable_parts(scene, patches, touched, obstacles)[obstacles.part[owner]],
    }.items():
        labels |= held * _bit(kind)
    return AffordanceScene(scene, walk, obstacles, from_, patches, labels)


def part_affordances(found: AffordanceScene) -> PartAffordances:
    """What each part affords, in the scene's order."""
    obstacles, parts = found.obstacles, [(item, j) for item in found.scene.objects for j in range(len(item.parts))]
    labels = np.zeros(len(parts), dtype=np.uint8)
    np.bitwise_or.at(labels, obstacles.part[found.patches.owner], found.labels)
    return PartAffordances(
        np.array([item.object_id for item, _ in parts], dtype=np.int32),
        np.array([j for _, j in parts], dtype=np.int32),
        tuple(item.parts[j].name for item, j in parts),
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
    scene: Scene,
    grid: VoxelGrid | None = None,
    side_cells: int = PLAN_CELLS,
    cell_m: float = CELL_M,
    walk: WalkMap | None = None,
) -> AffordanceTruth:
    """Affordance of a scene at t0 in its frame: from above, centred on the origin, per part, and in a grid if given.

    Nothing is ignored. walk: as in ``afford``.
    """
    found = afford(scene, walk)
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


def _on_surfaces(patches: Patches, chosen: Sequence[tuple[int, Surface]], obstacles: Obstacles) -> BoolArray:
    """(P,) bool: the patch faces up and lies on one of the surfaces, each with the index of its object."""
    part = obstacles.part[patches.owner]
    whole = {obstacles.part_number(k, surface.part_index) for k, surface in chosen if surface.lattice is None}
    found = patches.faces_up & np.isin(np.arange(obstacles.part_count), sorted(whole))[part]
    for k, surface in chosen:
        if surface.lattice is not None:
            own = np.flatnonzero(part == obstacles.part_number(k, surface.part_index))
            own = own[patches.normal[patches.face[own], 2] > 0]
            found[own[surface.lattice.holds(patches.point[own], JUMP_M)]] = True
    return found


def _functional(scene: Scene, patches: Patches, obstacles: Obstacles) -> BoolArray:
    """(P,) bool: the patch is for hands."""
    parts = [part for item in scene.objects for part in item.parts]
    solids = [solid for own in obstacles.solids for solid in own]
    sides = np.array([part.role in FUNCTIONAL_ROLES for part in parts], dtype=np.bool_)
    tops = np.array([part.role == "top" for part in parts], dtype=np.bool_)
    heights = np.array([np.nan if solid is None else solid.bounds[1, 2] for solid in solids])
    part_of = obstacles.part[patches.owner]
    height = quantise_m(np.where(np.isnan(heights)[part_of], patches.point[:, 2], heights[part_of]))
    upper = patches.faces_up & (height >= TOP_HEIGHT_M[0]) & (height <= TOP_HEIGHT_M[1])
    return np.asarray(sides[part_of] | (tops[part_of] & upper))
