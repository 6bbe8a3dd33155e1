"""A scene as JSON for people and other programs: rooms, and every object with its box and its parts by size and role.

All in metres and radians, in the frame of the scene (z up, floor at 0). Triangles are left out: they are in the GLB.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsbench import __version__
from hsbench.geometry.numerics import quantise_m
from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.typing import FloatArray

YAW_DECIMALS = 6


def scene_description(scene: Scene) -> dict[str, Any]:
    """The scene as JSON values; docs/formats/scenes.md lists them."""
    return {
        "made_by": f"hsbench {__version__}",
        "frame": "metres, z up, floor at z = 0; yaw in radians about z",
        "scene_id": scene.scene_id,
        "style": scene.style,
        "height_m": scene.height_m,
        "rooms": [
            {
                "room_type": room.room_type,
                "area_m2": round(room.area_m2, 4),
                "outline_xy": room.outline_xy.tolist(),
            }
            for room in scene.rooms
        ],
        "objects": [_object(scene, item) for item in scene.objects],
    }


def _object(scene: Scene, item: SceneObject) -> dict[str, Any]:
    box = item.box
    return {
        "object_id": item.object_id,
        "category": item.category_name,
        "group": item.category.group,
        "movable": item.movable,
        "room": next((k for k, room in enumerate(scene.rooms) if room is scene.room_at(box[:2])), None),
        "box": {
            "centre": _metres(box[:3]),
            "size": _metres(box[3:6]),
            "yaw_rad": round(float(box[6]), YAW_DECIMALS),
        },
        "parts": [_part(item, part) for part in item.parts],
    }


def _part(item: SceneObject, part: Part) -> dict[str, Any]:
    vertices = apply(item.scene_T_object, part.vertices)
    return {
        "name": part.name,
        "role": part.role,
        "colour": list(part.colour),
        "texture": part.texture,
        "convex": part.solid is not None,
        "low": _metres(vertices.min(axis=0)),
        "high": _metres(vertices.max(axis=0)),
    }


def _metres(values: FloatArray) -> list[float]:
    return [float(value) for value in np.atleast_1d(quantise_m(values))]
