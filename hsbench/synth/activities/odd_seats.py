"""Where people sit that is not meant for it: edges of tops, arms of sofas, and the floor with the back to something.

Life is not a label: a few sits in a hundred are of this kind, and no method may trust a single one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.synth.activities.contact import Obstacles
from hsbench.synth.activities.seats import Surface, surfaces_on
from hsbench.synth.people import body as anatomy
from hsbench.synth.people.body import Body
from hsbench.synth.people.lounging import legs_ahead
from hsbench.synth.people.motion import SeatPose
from hsbench.truth.sittable import SIDES
from hsbench.truth.walkable import WalkMap
from hsbench.typing import FloatArray

LEDGE_HEIGHT_M = (0.25, 0.80)  # from a coffee table to a dining table
ARM = "armrest"  # what the generator calls it; imported sofas have none that is known
ARMED = ("sofa", "armchair")
FLOOR = "floor"
STRIDE_CELLS = 4  # of the floor, every so many cells are sat on
LEANT_ON_M = 0.45  # above the floor, what is behind a back is looked for
BEHIND_M = 0.5  # and so far behind
BACKS_M = (0.05, 0.10, 0.15)  # pelvis behind the last free cell


def odd_surfaces(scene: Scene) -> list[Surface]:
    """All surfaces not meant for sitting that one may sit on all the same, whether there is room for it or not."""
    return [surface for item in scene.objects for part in item.parts for surface in _odd_ways(scene, item, part)]


def _odd_ways(scene: Scene, item: SceneObject, part: Part) -> list[Surface]:
    if item.category_name == FLOOR:
        return [Surface(item, part, np.array(front), 0.0) for front in SIDES]
    if part.role == "top":
        return surfaces_on(scene, item, part, SIDES, LEDGE_HEIGHT_M)
    if item.category_name in ARMED and part.role is None and part.name.startswith(ARM):
        outwards = 1.0 if part.vertices[:, 0].mean() > 0 else -1.0
        return surfaces_on(scene, item, part, ((outwards, 0.0),), LEDGE_HEIGHT_M)
    return []


def floor_places(surface: Surface, body: Body, floor: WalkMap, obstacles: Obstacles) -> Iterator[SeatPose]:
    """Poses of who sits on a floor, facing the surface's front, with the back near something upright.

    Only cells count behind which the floor is not free: there the wall, cupboard or bed begins.
    """
    corners = apply(surface.item.scene_T_object, surface.part.vertices)[:, :2]
    facing = surface.item.scene_T_object[:2, :2] @ surface.front
    behind, inside = floor.index(floor.centres() - floor.cell_m * facing)
    border = floor.free.copy()
    border[inside] &= ~floor.free[tuple(behind[inside].T)]
    cells = floor.centres()[border]
    cells = cells[((cells > corners.min(axis=0)) & (cells < corners.max(axis=0))).all(axis=1)]
    for cell in cells[::STRIDE_CELLS]:
        back = np.append(cell, LEANT_ON_M)
        if obstacles.block(back, back - BEHIND_M * np.append(facing, 0.0)):
            for back_m in BACKS_M:
                yield _on_floor(cell - back_m * facing, facing, body)


def _on_floor(pelvis_xy: FloatArray, facing: FloatArray, body: Body) -> SeatPose:
    """Seated on the floor with the feet ahead."""
    x, y, z = quantise_m(np.append(pelvis_xy, body.radius(anatomy.RADIUS_BELLY[0]))).tolist()
    yaw = quantise_angle(float(np.arctan2(facing[1], facing[0])))
    left, right = legs_ahead(body, pelvis_xy, yaw, 0.0).tolist()
    return SeatPose((x, y, z), yaw, ((left[0], left[1], left[2]), (right[0], right[1], right[2])))
