"""What can be opened: doors, drawers, fronts and handles with free space in front, as far as a hand reaches them.

Our default: .3 m free of other objects in front of all of the part. The front of a door or a window is each side on
which it is reached (of a leaf: its two broad sides, however far it stands open); that of furniture is the object's.
"""

from __future__ import annotations

import numpy as np

from hsbench.schema.scene import Scene
from hsbench.truth.obstacles import Box, Obstacles, Shapes, box_hits
from hsbench.truth.surfaces import SLACK_M, Patches
from hsbench.typing import BoolArray, FloatArray

OPENING_ROLES = ("door", "drawer", "front", "handle")
SWING_M = 0.3
UPRIGHT = float(np.sin(np.radians(15.0)))  # a face whose normal has a smaller |z| is upright
FACING = float(np.cos(np.radians(45.0)))  # a face whose normal is nearer to a direction than this faces it


def openable_parts(scene: Scene, patches: Patches, touched: BoolArray, obstacles: Obstacles) -> BoolArray:
    """(N,) bool over the packed parts: opens, and has free space in front. touched: (P,) bool, patches reached."""
    free = np.zeros(len(obstacles), dtype=np.bool_)
    touched_face = np.zeros(len(patches.part), dtype=np.bool_)
    touched_face[patches.face[touched]] = True
    shapes = obstacles.picked(np.arange(len(obstacles)))
    for n in range(len(obstacles)):
        item = scene.objects[obstacles.object_index[n]]
        if item.parts[obstacles.part_index[n]].role not in OPENING_ROLES:
            continue
        faces = np.arange(shapes.start[n, 0], shapes.start[n + 1, 0])
        normals = patches.normal[faces]
        upright = np.abs(normals[:, 2]) < UPRIGHT
        if item.category.group == "structure":
            thin = patches.thickness_m[faces]
            broad = upright & (thin <= thin[upright].min(initial=np.inf) + SLACK_M)
            ways = normals[broad & touched_face[faces]]
        else:
            towards = np.where(upright, normals @ -item.scene_T_object[:3, 1], -1.0)
            ways = normals[towards >= max(FACING, towards.max() - SLACK_M)]
        free[n] = any(_has_swing(shapes, obstacles, n, way[:2]) for way in ways)
    return free


def _has_swing(shapes: Shapes, obstacles: Obstacles, part: int, way: FloatArray) -> bool:
    """Whether nothing of other objects is within ``SWING_M`` in front of a part, all over its width and height."""
    x, y = (way / np.linalg.norm(way)).tolist()
    corners = shapes.corners[shapes.start[part, 1] : shapes.start[part + 1, 1]]
    ahead, left = corners[:, 0] * x + corners[:, 1] * y, corners[:, 1] * x - corners[:, 0] * y
    low, high = obstacles.shapes.bounds[part]
    near = obstacles.near(low - SWING_M, high + SWING_M)
    near = near[obstacles.object_index[near] != obstacles.object_index[part]]
    front, across = (ahead.max(), ahead.max() + SWING_M), (left.min(), left.max())
    return not box_hits(shapes, near, Box(x, y, front, across, (low[2], high[2])))
