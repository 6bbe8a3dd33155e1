"""A hand-made day-lit room with a window, a doorway to a second room, and things that stand before others."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject
from hsbench.typing import FloatArray

CAMERA = PinholeCamera(160, 120, 110.0, 110.0, 80.0, 60.0)
POSE = planar(0.3, 0.4, 0.5) @ world_T_camera(1.7, 0.35)  # from a corner along the window, towards the doorway
WALL, WOOD = (226, 222, 214), (150, 108, 72)
HEIGHT_M, THICK_M = 2.5, 0.1
HERE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.6], [0.0, 3.6]])
THERE = np.array([[4.1, 0.0], [7.0, 0.0], [7.0, 3.6], [4.1, 3.6]])
Corner = tuple[float, float, float]


def part(name: str, low: Corner, high: Corner, colour: tuple[int, int, int] = WOOD, texture: str = "") -> Part:
    return Part(name, colour, None, span(low, high), texture=texture)


def thing(object_id: int, kind: str, *parts: Part, at: FloatArray | None = None) -> SceneObject:
    return SceneObject(object_id, kind, np.eye(4) if at is None else at, parts)


def shell() -> list[SceneObject]:
    """Ceiling and walls of two rooms with a doorway between them; a window in the first one's north wall (y = 3.6)."""
    t, h = THICK_M, HEIGHT_M
    north = (
        part("wall", (-t, 3.6, 0), (1.2, 3.6 + t, h), WALL),
        part("wall", (2.8, 3.6, 0), (7 + t, 3.6 + t, h), WALL),
        part("wall", (1.2, 3.6, 0), (2.8, 3.6 + t, 0.9), WALL),
        part("wall", (1.2, 3.6, 2.1), (2.8, 3.6 + t, h), WALL),
    )
    middle = (
        part("wall", (4, 0, 0), (4.1, 1.2, h), WALL),
        part("wall", (4, 2.2, 0), (4.1, 3.6, h), WALL),
        part("wall", (4, 1.2, 2.1), (4.1, 2.2, h), WALL),
    )
    around = (
        part("wall", (-t, -t, 0), (7 + t, 0, h), WALL),
        part("wall", (-t, 0, 0), (0, 3.6, h), WALL),
        part("wall", (7, 0, 0), (7 + t, 3.6, h), WALL),
    )
    return [
        thing(2, "ceiling", part("slab", (-t, -t, h), (7 + t, 3.6 + t, h + t), (242, 241, 238))),
        thing(3, "wall", *north),
        thing(4, "wall", *middle),
        thing(5, "wall", *around),
        thing(6, "window", part("pane", (-0.8, 0.05, 0.9), (0.8, 0.07, 2.1)), at=planar(2.0, 3.6, 0.0)),
    ]


def wardrobe(object_id: int = 10) -> SceneObject:
    return thing(object_id, "wardrobe", part("body", (2.6, 0.5, 0), (3.2, 1.1, 2.0), (120, 90, 70), "wood"))


def table(object_id: int = 11) -> SceneObject:
    legs = [part("leg", (x, y, 0), (x + 0.05, y + 0.05, 0.7)) for x in (-0.5, 0.45) for y in (-0.3, 0.25)]
    top = part("top", (-0.5, -0.3, 0.7), (0.5, 0.3, 0.74), texture="wood")
    return thing(object_id, "dining_table", top, *legs, at=planar(1.9, 2.2, 0.3))


def scene(*things: SceneObject, floor_texture: str = "planks") -> Scene:
    """Both rooms with the things, ids ascending."""
    t = THICK_M
    floor = thing(1, "floor", part("slab", (-t, -t, -t), (7 + t, 3.6 + t, 0), (170, 140, 110), floor_texture))
    rooms = (Room("living", HERE), Room("bedroom", THERE))
    return Scene("lit", rooms, HEIGHT_M, (floor, *shell(), *things))
