"""Hand-made rooms with something to sit on and something to touch, independent of the room generator."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.scene import Part, Room, Scene, SceneObject

GREY = (120, 120, 120)
Corner = tuple[float, float, float]


def part(name: str, low: Corner, high: Corner, role: str | None = None) -> Part:
    return Part(name, GREY, role, span(low, high))


def legs(x: float, y: float, top: float, half: float = 0.02) -> list[Part]:
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    return [part(f"leg{i}", (a - half, b - half, 0), (a + half, b + half, top)) for i, (a, b) in enumerate(corners)]


def table(number: int, x: float, y: float, yaw: float) -> SceneObject:
    top = part("top", (-0.7, -0.4, 0.71), (0.7, 0.4, 0.74), "top")
    return SceneObject(number, "dining_table", planar(x, y, yaw), (top, *legs(0.65, 0.35, 0.71)))


def chair(number: int, x: float, y: float, yaw: float) -> SceneObject:
    seat = part("seat", (-0.22, -0.22, 0.41), (0.22, 0.22, 0.45), "seat")
    back = part("back", (-0.22, 0.19, 0.45), (0.22, 0.22, 0.9))
    return SceneObject(number, "chair", planar(x, y, yaw), (seat, back, *legs(0.19, 0.19, 0.41)), movable=True)


def sofa(number: int, x: float, y: float, yaw: float) -> SceneObject:
    parts = (
        part("base", (-1.0, -0.45, 0), (1.0, 0.45, 0.3)),
        part("seat0", (-0.8, -0.45, 0.3), (0.0, 0.25, 0.43), "seat"),
        part("seat1", (0.0, -0.45, 0.3), (0.8, 0.25, 0.43), "seat"),
        part("back", (-1.0, 0.25, 0.3), (1.0, 0.45, 0.8)),
        part("arm0", (-1.0, -0.45, 0.3), (-0.8, 0.25, 0.6)),
        part("arm1", (0.8, -0.45, 0.3), (1.0, 0.25, 0.6)),
    )
    return SceneObject(number, "sofa", planar(x, y, yaw), parts)


def bed(number: int, x: float, y: float, yaw: float) -> SceneObject:
    frame = part("frame", (-0.8, -1.0, 0.1), (0.8, 1.0, 0.3))
    mattress = part("mattress", (-0.78, -0.98, 0.3), (0.78, 0.95, 0.5), "mattress")
    return SceneObject(number, "bed", planar(x, y, yaw), (frame, mattress))


def wardrobe(number: int, x: float, y: float, yaw: float) -> SceneObject:
    body = part("body", (-0.5, -0.28, 0), (0.5, 0.3, 2.0))
    door = part("door", (-0.5, -0.3, 0.05), (0.5, -0.28, 1.95), "door")
    handle = part("handle", (-0.04, -0.33, 1.0), (-0.02, -0.3, 1.15), "handle")
    return SceneObject(number, "wardrobe", planar(x, y, yaw), (body, door, handle))


def shell(width: float, depth: float, door: bool = True) -> list[SceneObject]:
    here, height = planar(0, 0, 0), 2.5
    walls = (
        part("south", (-0.1, -0.1, 0), (width + 0.1, 0, height)),
        part("east", (width, 0, 0), (width + 0.1, depth, height)),
        part("north", (-0.1, depth, 0), (width + 0.1, depth + 0.1, height)),
        part("west", (-0.1, 0, 0), (0, depth, height)),
    )
    window = part("pane", (-0.02, -0.5, 0.9), (0.0, 0.5, 2.0))
    objects = [
        SceneObject(1, "floor", here, (part("floor", (0, 0, -0.1), (width, depth, 0)),)),
        SceneObject(2, "ceiling", here, (part("ceiling", (0, 0, height), (width, depth, height + 0.1)),)),
        SceneObject(3, "wall", here, walls),
        SceneObject(5, "window", planar(width, depth / 2, 0), (window,)),
    ]
    if door:
        leaf = part("leaf", (-0.4, -0.05, 0), (0.4, 0.0, 2.0))
        objects.insert(3, SceneObject(4, "door", planar(0.8, 0, 0), (leaf,)))
    return objects


def room(width: float, depth: float, *things: SceneObject, door: bool = True) -> Scene:
    outline = np.array([[0, 0], [width, 0], [width, depth], [0, depth]], dtype=np.float64)
    return Scene("room", (Room("living", outline),), 2.5, (*shell(width, depth, door), *things))


def living_room(seed: int) -> Scene:
    """A furnished room that differs with the seed in size and arrangement."""
    rng = np.random.default_rng(seed)
    width, depth = (float(v) for v in rng.uniform(4.2, 5.6, 2).round(2))
    things = [
        sofa(10, width - 0.5, depth / 2 + float(rng.uniform(-0.3, 0.3)), -np.pi / 2),
        wardrobe(11, 1.0 + float(rng.uniform(0, 0.5)), depth - 0.32, 0.0),
        table(13, width / 2 - 0.3, depth / 2, 0.0 if rng.random() < 0.5 else 0.3),
        chair(14, width / 2 - 0.3, depth / 2 - 0.75, np.pi),
        chair(15, width / 2 - 0.3, depth / 2 + 0.6, 0.0),
    ]
    if depth > 4.6:
        things.append(bed(16, width - 1.3, 1.1, np.pi))
    return room(width, depth, *things)
