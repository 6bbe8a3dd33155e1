"""The truth of an imported scene that needs no camera: what is solid, where one can walk, what the surfaces afford."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hsbench.errors import DataError
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.polygons import contains
from hsbench.schema.occupancy import AffordanceTruth, OccupancyTruth
from hsbench.schema.scene import Scene
from hsbench.schema.states import VoxelState
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.walkable import WalkMap, connected_to_doors, walk_map

VOXEL_M = 0.05
MARGIN_VOXELS = 2  # walls beside the rooms
MAX_VOXELS = 200_000_000
FULL_SHARE = 0.9
"""A room of which more than this is solid is no room: its shell was taken for a closed thing."""


@dataclass(frozen=True, eq=False)
class SceneTruth:
    """occupancy: voxels in the scene's frame; state ``UNKNOWN`` in the rooms, as nobody looked, else ``OUTSIDE_ROOM``.
    walk: where a person can stand. affordance: of the surfaces, its plan around the origin and the rooms. notes: what
    the user should hear.
    """

    occupancy: OccupancyTruth
    walk: WalkMap
    affordance: AffordanceTruth
    notes: tuple[str, ...] = ()


def scene_grid(scene: Scene, voxel_m: float = VOXEL_M) -> VoxelGrid:
    """A grid around the rooms, its voxels at multiples of ``voxel_m``, from floor to ceiling."""
    corners = np.concatenate([room.outline_xy for room in scene.rooms])
    low = np.floor(corners.min(axis=0) / voxel_m).astype(int) - MARGIN_VOXELS
    high = np.ceil(corners.max(axis=0) / voxel_m).astype(int) + MARGIN_VOXELS
    shape = (int(high[0] - low[0]), int(high[1] - low[1]), int(np.ceil(scene.height_m / voxel_m)))
    if int(np.prod(shape)) > MAX_VOXELS:
        raise DataError(f"scene {scene.scene_id} takes {shape} voxels; expected at most {MAX_VOXELS:,} (wrong units?)")
    return VoxelGrid((float(low[0]) * voxel_m, float(low[1]) * voxel_m, 0.0), shape, voxel_m)


def scene_truth(scene: Scene, voxel_m: float = VOXEL_M) -> SceneTruth:
    """Occupancy, walkable floor, affordance. Raises DataError for a room that is solid throughout."""
    grid = scene_grid(scene, voxel_m)
    semantic, instance = solid_occupancy(scene, grid)
    centres = grid.centres()[:, :, 0, :2]
    for room in scene.rooms:
        inside = contains(room.outline_xy, centres)
        solid = semantic[inside] > 0
        if solid.size and solid.mean() > FULL_SHARE:
            filler = scene.object(int(np.bincount(instance[inside][solid]).argmax()))
            raise DataError(
                f"{room.room_type} of {room.area_m2:.1f} m2 is {solid.mean():.0%} solid, mainly by {filler.object_id}"
                f" ({filler.category_name}); expected free space (is it a closed shell around the room?)"
            )
    state = np.full(grid.shape, VoxelState.OUTSIDE_ROOM, dtype=np.uint8)
    state[scene.contains(centres)] = VoxelState.UNKNOWN
    never = np.full(grid.shape, np.inf, dtype=np.float32)
    occupancy = OccupancyTruth(grid, semantic, instance, state, np.zeros(grid.shape, dtype=bool), never)
    walk = walk_map(scene)
    within_reach, notes = _within_reach(walk, scene)
    corners = np.concatenate([room.outline_xy for room in scene.rooms])
    side = 2 * (int(np.ceil(np.abs(corners).max() / voxel_m)) + MARGIN_VOXELS)
    affordance = affordance_truth(scene, grid, side, voxel_m, within_reach)
    return SceneTruth(occupancy, walk, affordance, notes)


def _within_reach(walk: WalkMap, scene: Scene) -> tuple[WalkMap, tuple[str, ...]]:
    """The cells people get to: from the doors, or, in a scene without any, the largest piece of free floor; notes."""
    free, notes = connected_to_doors(walk, scene), []
    if not any(item.category_name == "door" for item in scene.objects):
        piece, count = ndimage.label(walk.free)
        if count:
            free = piece == 1 + int(np.argmax(np.bincount(piece.ravel())[1:]))
        notes.append("no node is a door: people are taken to be on the largest piece of free floor")
    if not free.any():
        notes.append("nobody gets in (no free floor at a door): nothing is walkable, sittable or in reach")
    return WalkMap(walk.origin_xy, free, walk.cell_m), tuple(notes)
