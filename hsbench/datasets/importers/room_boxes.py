"""Annotated boxes of real rooms as objects of a scene: their names in our categories, their outlines as solids."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry import convex, transforms
from hsbench.geometry.footprints import hull
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import signed_area
from hsbench.schema.categories import CATEGORIES
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.typing import FloatArray

MIN_SIDE_M = 0.001
"""A box thinner than this holds nothing."""
MAX_COORDINATE_M = 100.0
BOX_COLOUR = (160, 160, 160)
NEUTRAL = "object"
SHOWN = 8
"""Names in one note."""

CATEGORY_OF_NAME = {
    **{category.name.replace("_", " "): category.name for category in CATEGORIES},
    **{"couch": "sofa", "loveseat": "sofa", "table": "dining_table"},
    **{"endtable": "side_table", "end table": "side_table", "nightstand": "night_stand"},
    **{"tv": "television", "refridgerator": "fridge", "refrigerator": "fridge"},
    **{"bookcase": "bookshelf", "shelves": "shelf", "rack": "shelf", "closet": "wardrobe", "armoire": "wardrobe"},
    **{"counter": "kitchen_counter", "kitchen cabinet": "kitchen_counter", "island": "kitchen_island"},
    **{"lamp": "table_lamp", "sink": "washbasin", "garbage bin": "waste_bin", "trash can": "waste_bin"},
    **{"recycle bin": "waste_bin", "bin": "waste_bin", "oven": "stove", "floor mat": "rug", "carpet": "rug"},
    **{"blinds": "curtain", "shower curtain": "curtain", "book": "books", "pillow": "cushion", "box": "storage_box"},
    **{"sofa chair": "armchair", "drawer": "dresser", "dresser mirror": "dresser", "potted plant": "plant"},
    **{"painting": "picture", "file cabinet": "filing_cabinet"},
}
"""Names in SUN RGB-D and NYU v2, in lower case with blanks, with a category of ours; every other one is ``object``."""


@dataclass(frozen=True, eq=False)
class RoomBox:
    """An upright prism with a name: outline (n, 2) from above, z of its bottom and its top, all in one frame.

    front_xy: (2,) direction in which its front looks; None where nobody said.
    """

    name: str
    outline_xy: FloatArray
    bottom_m: float
    top_m: float
    front_xy: FloatArray | None = None

    def moved(self, a_T_b: FloatArray) -> RoomBox:
        """The same box in frame a, given a turn about z and a shift."""
        outline = transforms.apply(a_T_b, np.pad(self.outline_xy, ((0, 0), (0, 1))))[:, :2]
        front = None if self.front_xy is None else a_T_b[:2, :2] @ self.front_xy
        rise = float(a_T_b[2, 3])
        return replace(self, outline_xy=outline, bottom_m=self.bottom_m + rise, top_m=self.top_m + rise, front_xy=front)


def plain_name(name: str) -> str:
    """``Night_stand:left`` -> ``night stand``: lower case, blanks, without what follows a colon."""
    return " ".join(name.partition(":")[0].replace("_", " ").lower().split())


def category_of(name: str) -> str:
    """The category of ours for a name, or the neutral one."""
    return CATEGORY_OF_NAME.get(plain_name(name), NEUTRAL)


def rectangle_from_axes(name: str, centre_m: FloatArray, half_size_m: FloatArray, along_xy: FloatArray) -> RoomBox:
    """A box from its centre (3,), half sizes (3,) along ``along_xy`` (2,), across it and up. Its front looks along."""
    along = along_xy / math.hypot(*along_xy)
    across = np.array([-along[1], along[0]])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    outline = centre_m[:2] + signs[:, :1] * half_size_m[0] * along + signs[:, 1:] * half_size_m[1] * across
    bottom, top = centre_m[2] - half_size_m[2], centre_m[2] + half_size_m[2]
    return RoomBox(name, outline, float(bottom), float(top), along)


def box_object(box: RoomBox, object_id: int) -> SceneObject | None:
    """A box standing on the middle of its footprint, its front towards -y; None if it is flat.

    Without a front, x lies along its first side.
    """
    if box.front_xy is not None:
        yaw = math.atan2(box.front_xy[0], -box.front_xy[1])
    else:
        x, y = box.outline_xy[1] - box.outline_xy[0]
        yaw = math.atan2(y, x)
    yaw = quantise_angle(yaw)
    turn = transforms.rotation_z(yaw)[:2, :2]
    local = box.outline_xy @ turn  # the inverse turn
    low, high = local.min(axis=0), local.max(axis=0)
    centre = (low + high) / 2
    outline = hull(quantise_m(local - centre))
    height = float(quantise_m(box.top_m - box.bottom_m))
    if height < MIN_SIDE_M or len(outline) < 3 or np.ptp(outline, axis=0).min() < MIN_SIDE_M:
        return None
    x, y, z = quantise_m(np.array([*(turn @ centre), box.bottom_m])).tolist()
    part = Part("box", BOX_COLOUR, solid=convex.frustum(outline, outline, 0.0, height))
    return SceneObject(object_id, category_of(box.name), transforms.planar(x, y, yaw, z), (part,))


def box_scene(
    scene_id: str, boxes: Sequence[RoomBox], room_type: str, outline_xy: FloatArray, height_m: float
) -> tuple[Scene, list[str]]:
    """(scene of boxes in its frame, notes on what was left out or has no category).

    outline_xy: (n, 2) of the room, either way round. Raises SchemaError where it encloses nothing.
    """
    objects: list[SceneObject] = []
    for box in boxes:
        item = box_object(box, len(objects) + 1)
        if item is not None:
            objects.append(item)
    outline = quantise_m(outline_xy)
    room = Room(room_type, outline if signed_area(outline) > 0 else outline[::-1].copy())
    notes = []
    if len(objects) < len(boxes):
        notes.append(f"left out {len(boxes) - len(objects)} boxes without a volume")
    scene = Scene(scene_id, (room,), float(quantise_m(height_m)), tuple(objects), "imported")
    return scene, notes + unknown_names([box.name for box in boxes])


def check_box(box: RoomBox, where: str) -> RoomBox:
    """The box itself. Raises DataError, starting with ``where``, unless its numbers are metres of a room."""
    values = np.array([*box.outline_xy.ravel(), box.bottom_m, box.top_m])
    if not (np.abs(values) <= MAX_COORDINATE_M).all():
        worst = values[np.argmax(~(np.abs(values) <= MAX_COORDINATE_M))]
        raise DataError(f"{where} reaches {worst:g} m; expected metres within {MAX_COORDINATE_M:g} (millimetres?)")
    return box


def unknown_names(names: Sequence[str]) -> list[str]:
    """A note on the names of objects that have no category of ours; none where all have."""
    found = Counter(plain_name(name) for name in names if category_of(name) == NEUTRAL)
    found.pop(NEUTRAL, None)
    if not found:
        return []
    shown = ", ".join(ascii(name)[1:-1][:40] for name in sorted(found)[:SHOWN])
    more = f" and {len(found) - SHOWN} more names" if len(found) > SHOWN else ""
    return [f"{found.total()} objects are of no category of ours and become {NEUTRAL!r}: {shown}{more}"]
