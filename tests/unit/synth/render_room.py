"""A furnished test room for the renderers: closed walls, more than thirty objects, sloped and round ones, a person."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import PinholeCamera, world_T_camera
from hsbench.geometry.transforms import apply, planar
from hsbench.synth.render import DirectionalLight, Lighting, Mesh, PointLight
from hsbench.typing import FloatArray

CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
POSE = planar(0.35, 0.4, 0.72) @ world_T_camera(1.9, 0.36)
LIGHTS = Lighting(
    0.42,
    (PointLight((2.5, 2.0, 4.6), 4.4, (1.0, 0.97, 0.91)),),
    (DirectionalLight((-0.85, -0.20, -0.50), 0.3, (0.92, 0.96, 1.0)), DirectionalLight((-0.10, 0.95, -0.30), 0.16)),
)
PERSON_ID = 60001  # needs both bytes of the id colour

Colour = tuple[int, int, int]
Size = tuple[float, float, float]


def mesh(mesh_id: int, vertices: FloatArray, triangles: FloatArray, colour: Colour, smooth: bool = False) -> Mesh:
    """A mesh of one colour."""
    return Mesh(mesh_id, vertices, triangles, np.tile(np.array(colour, np.uint8), (len(triangles), 1)), smooth)


def fan_prism(mesh_id: int, bottom: FloatArray, top: FloatArray, colour: Colour, smooth: bool = False) -> Mesh:
    """Solid between two convex (n, 3) polygons, counter-clockwise seen from above."""
    n = len(bottom)
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    cap = np.arange(1, n - 1)
    triangles = np.concatenate(
        [
            np.stack([i, j, j + n], 1),
            np.stack([i, j + n, i + n], 1),
            np.stack([np.zeros_like(cap), cap + 1, cap], 1),
            np.stack([np.full_like(cap, n), cap + n, cap + 1 + n], 1),
        ]
    )
    return mesh(mesh_id, np.concatenate([bottom, top]), triangles, colour, smooth)


def box(mesh_id: int, low: Size, size: Size, colour: Colour, yaw: float = 0.0, slope: float = 0.0) -> Mesh:
    """Box on its lowest corner, turned about its middle; ``slope`` lowers the top's front edge: a sloped face."""
    (dx, dy, dz), middle = size, np.add(low, np.divide(size, 2))
    corners = np.array([[-dx, -dy], [dx, -dy], [dx, dy], [-dx, dy]]) / 2
    bottom = np.column_stack([corners, np.full(4, -dz / 2)])
    top = np.column_stack([corners, dz / 2 - slope * (corners[:, 1] < 0)])
    pose = planar(middle[0], middle[1], yaw, middle[2])
    return fan_prism(mesh_id, apply(pose, bottom), apply(pose, top), colour)


def cylinder(mesh_id: int, base: Size, radius: float, height: float, colour: Colour, top: float = 1.0) -> Mesh:
    """Upright cylinder, or cone where ``top`` (ratio of the upper radius) is not 1."""
    angle = np.arange(24) * (2 * np.pi / 24)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)]) * radius
    return fan_prism(mesh_id, ring + base, ring * top + base + np.array([0, 0, height]), colour)


def ellipsoid(mesh_id: int, centre: Size, radii: Size, colour: Colour, n: int = 24) -> Mesh:
    """Smooth ellipsoid of n x 2 n quads."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, n + 1)[:, None]
    longitude = np.arange(2 * n)[None, :] * (np.pi / n)
    unit = np.stack(
        np.broadcast_arrays(
            np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)
        ),
        axis=-1,
    ).reshape(-1, 3)
    row, column = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    a, b = row * 2 * n + column, row * 2 * n + (column + 1) % (2 * n)
    c, d = a + 2 * n, b + 2 * n
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    return mesh(mesh_id, unit * radii + np.asarray(centre), triangles, colour, smooth=True)


def shell() -> list[Mesh]:
    """Floor, ceiling and four walls, 10 cm thick, around 5 x 4 x 2.6 m."""
    wall, t = (226, 221, 205), 0.1
    return [
        box(1, (-t, -t, -t), (5 + 2 * t, 4 + 2 * t, t), (189, 160, 128)),
        box(2, (-t, -t, 2.6), (5 + 2 * t, 4 + 2 * t, t), (243, 242, 238)),
        box(3, (-t, 0, 0), (t, 4, 2.6), wall),
        box(4, (5, 0, 0), (t, 4, 2.6), (200, 216, 208)),
        box(5, (-t, -t, 0), (5 + 2 * t, t, 2.6), wall),
        box(6, (-t, 4, 0), (5 + 2 * t, t, 2.6), (229, 209, 196)),
    ]


def furniture() -> list[Mesh]:
    """More than thirty pieces."""
    wood, cloth, white = (150, 108, 72), (104, 132, 158), (236, 236, 232)
    pieces = [
        box(10, (2.6, 3.1, 0), (2.0, 0.85, 0.42), cloth),
        box(11, (2.6, 3.75, 0.42), (2.0, 0.2, 0.45), cloth),
        box(12, (2.75, 3.2, 0.42), (0.5, 0.45, 0.14), (214, 158, 92), 0.2, slope=0.06),
        box(13, (4.4, 0.4, 0), (0.55, 1.3, 2.0), white),
        box(14, (4.36, 0.6, 1.0), (0.04, 0.03, 0.2), (90, 90, 95)),
        box(15, (2.9, 1.7, 0.38), (1.1, 0.65, 0.05), wood, 0.25),
        cylinder(20, (3.2, 2.0, 0.43), 0.06, 0.22, (180, 70, 66), top=0.6),
        cylinder(21, (3.7, 2.1, 0.43), 0.12, 0.05, white, top=1.4),
        cylinder(22, (4.6, 3.6, 0), 0.16, 0.04, (70, 70, 74)),
        cylinder(23, (4.6, 3.6, 0.04), 0.02, 1.4, (70, 70, 74)),
        cylinder(24, (4.6, 3.6, 1.4), 0.24, 0.3, (238, 224, 186), top=0.6),
        cylinder(25, (0.9, 3.5, 0), 0.2, 0.4, (176, 112, 84), top=1.25),
        ellipsoid(26, (0.9, 3.5, 0.85), (0.35, 0.35, 0.5), (92, 140, 84)),
        box(27, (1.5, 0.9, 0.0), (3.2, 2.3, 0.012), (196, 176, 182), 0.05),
        box(28, (4.98, 2.0, 1.0), (0.02, 1.2, 1.1), (214, 232, 244)),
        box(29, (2.9, 3.97, 1.3), (0.9, 0.03, 0.6), (120, 150, 140)),
        box(30, (1.6, 2.6, 0.0), (0.5, 0.5, 0.45), (160, 90, 100), 0.6, slope=0.1),
        box(31, (1.35, 3.55, 0.9), (1.1, 0.4, 0.04), wood),
    ]
    for k, (x, y) in enumerate(((2.95, 1.72), (3.85, 1.95), (2.85, 2.1), (3.7, 2.3))):
        pieces.append(cylinder(40 + k, (x + 0.1, y, 0), 0.03, 0.38, wood, top=1.2))
    for k in range(10):
        shade = (90 + 15 * k, 200 - 12 * k, 120 + (37 * k) % 100)
        pieces.append(box(50 + k, (1.4 + 0.09 * k, 3.6, 0.94), (0.06, 0.2, 0.2 + 0.02 * (k % 4)), shade))
    for k in range(3):
        pieces.append(box(70 + k, (4.38, 0.45, 0.4 + 0.5 * k), (0.02, 1.2, 0.42), (222, 220, 214)))
    return pieces


def person(x: float, y: float, lean: float = 0.0) -> Mesh:
    """One smooth mesh of body and head standing at (x, y); ``lean`` shifts the head: other vertices, same topology."""
    parts = [
        ellipsoid(PERSON_ID, (x, y, 0.45), (0.14, 0.14, 0.48), (70, 80, 110)),
        ellipsoid(PERSON_ID, (x + lean / 2, y, 1.15), (0.2, 0.24, 0.38), (176, 84, 72)),
        ellipsoid(PERSON_ID, (x + lean, y, 1.62), (0.11, 0.1, 0.14), (222, 180, 150), n=12),
    ]
    offsets = np.cumsum([0, *(len(p.vertices) for p in parts)])
    return Mesh(
        PERSON_ID,
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.triangles + offset for p, offset in zip(parts, offsets, strict=False)]),
        np.concatenate([p.colours for p in parts]),
        smooth=True,
    )


def room() -> list[Mesh]:
    """Shell, furniture and a person."""
    return [*shell(), *furniture(), person(2.2, 2.0)]
