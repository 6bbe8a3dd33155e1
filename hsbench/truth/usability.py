"""Whether what a scene offers can be used: seats sat on, handles and shelves reached by somebody who lives there.

Sitting, lying and reach are those of ``affordance``. Reach there is of people who stand or sit upright. People at home
also squat and bend before a low drawer, and lean over a desk to open a window, so here arms also begin there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.truth.affordance import TOP_HEIGHT_M, AffordanceScene, afford, part_affordances
from hsbench.truth.reach import Shoulders, reached
from hsbench.truth.walkable import walk_map
from hsbench.typing import BoolArray

BENT_SHOULDERS_M = (0.6, 1.0)  # height over a walkable cell of who squats and who bends; our default
LEAN_M, LEANING_SHOULDER_M = 0.25, 1.3  # a torso of .5 m leant forward by 30 degrees; our default
CHEST_M, CHEST_HEIGHTS_M = 0.1, (1.1, 1.45)  # half depth and heights of what must find room above the furniture


@dataclass(frozen=True)
class Uses:
    """(good, all) parts of a scene by what is asked of them.

    functional: usable parts with a functional role. seats: usable ones of role ``seat``. upright: parts for hands that
    are reached upright, as task affordance-topdown has it. unusable: the names of those that are of no use.
    """

    functional: tuple[int, int]
    seats: tuple[int, int]
    upright: tuple[int, int]
    unusable: tuple[str, ...]


def uses(scene: Scene) -> Uses:
    """Count what can be used. Tops beyond the heights of task affordance-topdown are left out, and of the handles on
    the two faces of a door or window one must be reached.
    """
    found = afford(scene)
    labels = part_affordances(found).labels
    sit, lie, touch = (
        (labels >> kind & 1).astype(bool) for kind in (Affordance.SITTABLE, Affordance.LYABLE, Affordance.INTERACTABLE)
    )
    parts = [(item, part) for item in scene.objects for part in item.parts]
    roles = np.array([_role(item, part) for item, part in parts])
    seat, mattress, functional = roles == "seat", roles == "mattress", roles != ""
    usable = np.select([seat, mattress], [sit, sit | lie], touch | _stretched_reach(found))
    usable |= _twins(parts, roles, usable)
    hand = functional & ~seat & ~mattress
    unusable = tuple(
        f"{part.name} of {item.category_name} {item.object_id}"
        for (item, part), lost in zip(parts, functional & ~usable, strict=True)
        if lost
    )
    return Uses(_counted(usable, functional), _counted(usable, seat), _counted(touch, hand), unusable)


def _role(item: SceneObject, part: Part) -> str:
    """The functional role of a part, "" for none."""
    if part.role == "top":
        height_m = apply(item.scene_T_object, part.vertices)[:, 2].max()
        return "top" if TOP_HEIGHT_M[0] <= height_m <= TOP_HEIGHT_M[1] else ""
    return part.role or ""


def _stretched_reach(found: AffordanceScene) -> BoolArray:
    """(P,) bool: the parts that somebody who squats, bends or leans forward on a walkable cell reaches."""
    walk = found.walk
    low_m, high_m = CHEST_HEIGHTS_M
    room_above = walk_map(found.scene, radius_m=CHEST_M, step_m=low_m, head_room_m=high_m).free
    near = ndimage.distance_transform_edt(~walk.free) * walk.cell_m <= LEAN_M
    places = [*((walk.free, z) for z in BENT_SHOULDERS_M), (near & room_above, LEANING_SHOULDER_M)]
    centres = walk.centres()
    shoulders = tuple(Shoulders(np.column_stack([centres[at], np.full(at.sum(), z)])) for at, z in places)
    patches = found.patches
    normals = patches.normal[patches.face]
    touched = reached(patches.point, normals, patches.owner, found.obstacles, shoulders)
    part = found.obstacles.part[patches.owner]
    return np.asarray(np.bincount(part, touched, minlength=found.obstacles.part_count) > 0)


def _twins(parts: list[tuple[SceneObject, Part]], roles: BoolArray, usable: BoolArray) -> BoolArray:
    """(P,) bool: handles of a door or window of which another handle is usable."""
    owner = np.array([item.object_id if item.category.group == "structure" else -1 for item, _ in parts])
    handles = (roles == "handle") & (owner >= 0)
    return np.asarray(handles & np.isin(owner, owner[handles & usable]))


def _counted(good: BoolArray, of: BoolArray) -> tuple[int, int]:
    return int((good & of).sum()), int(of.sum())
