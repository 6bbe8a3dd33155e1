"""Affordance from above about a camera: a scene's labelled surfaces, turned, drawn; and what of it cannot be asked.

Labels belong to small patches of surface and turn with them, so that one scene is labelled once for all its cameras.
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import pack_solids, segments_blocked
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.schema.scene import Scene
from hsbench.schema.states import Affordance
from hsbench.synth.activity_maps.config import MapConfig
from hsbench.truth.affordance import AffordanceScene
from hsbench.truth.obstacles import Obstacles
from hsbench.truth.surfaces import Patches, draw_plan
from hsbench.truth.walkable import WalkMap
from hsbench.typing import BoolArray, FloatArray

TASK_BITS = np.uint8(1 << Affordance.SITTABLE | 1 << Affordance.INTERACTABLE)  # of surfaces; walkable is of cells
SIGHT_M = 1.5  # above furniture, below lintels: only walls and the leaves of doors end a line of sight


def of_task(found: AffordanceScene) -> AffordanceScene:
    """The scene with none but the surfaces and labels that the task asks for: a tenth of all."""
    kept, patches = (found.labels & TASK_BITS) > 0, found.patches
    few = patches._replace(point=patches.point[kept], middle=patches.middle[kept], face=patches.face[kept])
    return replace(found, patches=few, labels=found.labels[kept] & TASK_BITS)


def plan_truth(found: AffordanceScene, scene_T_episode: FloatArray, config: MapConfig) -> AffordanceTruth:
    """Walkable, sittable and interactable of a scene ``of_task`` about a camera, in the episode frame.

    Cells of rooms other than the camera's are ignored where walls or shut doors are in the line of sight. Walkable
    cells are those of the scene's own grid, looked up at the middles of the plan's.
    """
    side, corner = config.side_cells, np.full(2, config.low_m)
    patches, obstacles = _moved(found, invert(scene_T_episode))
    plan = draw_plan(patches, found.labels, obstacles, corner, (side, side), config.cell_m)
    walk, hidden = found.walk, hidden_rooms(found.scene, found.walk, scene_T_episode[:2, 3])
    walkable, ignored = (
        _looked_up(cells, walk.origin_xy, walk.cell_m, scene_T_episode, config.low_m, side, config.cell_m)
        for cells in (walk.free, hidden)
    )
    plan |= walkable * np.uint8(1 << Affordance.WALKABLE)
    return AffordanceTruth(
        np.ascontiguousarray(plan[::-1, ::-1]), np.ascontiguousarray(ignored[::-1, ::-1]), config.cell_m
    )


def hidden_rooms(scene: Scene, grid: WalkMap, camera_xy: FloatArray) -> BoolArray:
    """(nx, ny) bool on the cells of ``grid``: in another room than the camera's (2,), or a doorway, out of its sight.

    A line ends at walls, doors and windows ``SIGHT_M`` above the floor.
    """
    if len(scene.rooms) == 1:
        return np.zeros(grid.free.shape, dtype=np.bool_)
    own, centres = scene.room_at(camera_xy), grid.centres()
    hidden = grid.free & ~contains(own.outline_xy, centres)
    for room in scene.rooms:
        if room is not own:
            hidden |= contains(room.outline_xy, centres)
    targets = centres[hidden]
    structure = [s for item in scene.objects if item.category.group == "structure" for s in item.solids]
    across = [s for s in structure if s.bounds[0, 2] < SIGHT_M < s.bounds[1, 2]]
    origin = np.array([*camera_xy, SIGHT_M])
    ends = np.column_stack([targets, np.full(len(targets), SIGHT_M)])
    hidden[hidden] = segments_blocked(origin, ends, pack_solids(across))
    return hidden


def _moved(found: AffordanceScene, a_T_scene: FloatArray) -> tuple[Patches, Obstacles]:
    """The patches of a scene and the planes of its parts in frame a, as far as drawing needs them."""
    turn, patches, shapes = a_T_scene[:3, :3].T, found.patches, found.obstacles.shapes
    normals = shapes.planes[:, :3] @ turn
    planes = np.column_stack([normals, shapes.planes[:, 3] + normals @ a_T_scene[:3, 3]])
    moved = patches._replace(
        middle=apply(a_T_scene, patches.middle),
        normal=np.ascontiguousarray(patches.normal @ turn),
        half=np.ascontiguousarray(patches.half @ turn),
    )
    return moved, replace(found.obstacles, shapes=replace(shapes, planes=planes))


@numba.njit(cache=True)
def _looked_up(
    cells: BoolArray, origin: FloatArray, cell_m: float, scene_T_plan: FloatArray, low_m: float, side: int,
    step_m: float,
) -> BoolArray:  # fmt: skip
    """(side, side) bool: the value of ``cells`` (nx, ny) at the middle of each cell of a plan; False outside them."""
    found = np.zeros((side, side), dtype=np.bool_)
    for i in range(side):
        for j in range(side):
            x, y = low_m + (i + 0.5) * step_m, low_m + (j + 0.5) * step_m
            u = scene_T_plan[0, 0] * x + scene_T_plan[0, 1] * y + scene_T_plan[0, 3]
            v = scene_T_plan[1, 0] * x + scene_T_plan[1, 1] * y + scene_T_plan[1, 3]
            k, m = int(np.floor((u - origin[0]) / cell_m)), int(np.floor((v - origin[1]) / cell_m))
            if 0 <= k < cells.shape[0] and 0 <= m < cells.shape[1]:
                found[i, j] = cells[k, m]
    return found
