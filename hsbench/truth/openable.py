"""What can be opened: doors, drawers, fronts and handles with free space in front, as far as a hand reaches them.

Our default: .3 m free of other objects in front of all of the part. The front of a door or a window is each side on
which it is reached (of a leaf: its two broad sides, however far it stands open); that of furniture is the object's.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.transforms import apply
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.truth.obstacles import Box, Obstacles, Shapes, box_hits, is_within
from hsbench.truth.surfaces import SLACK_M, Patches
from hsbench.typing import BoolArray, FloatArray

OPENING_ROLES = ("door", "drawer", "front", "handle")
SWING_M = 0.3
UPRIGHT = float(np.sin(np.radians(15.0)))  # a face whose normal has a smaller |z| is upright
FACING = float(np.cos(np.radians(45.0)))  # a face whose normal is nearer to a direction than this faces it


def openable_parts(scene: Scene, patches: Patches, touched: BoolArray, obstacles: Obstacles) -> BoolArray:
    """(N,) bool over all parts: opens, and has free space in front. touched: (P,) bool, patches reached."""
    free = np.zeros(obstacles.part_count, dtype=np.bool_)
    touched_face = np.zeros(len(patches.shape), dtype=np.bool_)
    touched_face[patches.face[touched]] = True
    part_of_face = obstacles.part[patches.shape]
    shapes = obstacles.picked(np.arange(len(obstacles)))
    parts = [(k, item, j, part) for k, item in enumerate(scene.objects) for j, part in enumerate(item.parts)]
    for n, (k, item, j, part) in enumerate(parts):
        if part.role not in OPENING_ROLES:
            continue
        faces = np.flatnonzero((part_of_face == n) & obstacles.face)
        normals = patches.normal[faces]
        upright = np.abs(normals[:, 2]) < UPRIGHT
        if obstacles.solids[k][j] is None:
            ways = _ways_of_mesh(item, part, normals[upright & touched_face[faces]])
        elif item.category.group == "structure":
            thin = patches.thickness_m[faces]
            broad = upright & (thin <= thin[upright].min(initial=np.inf) + SLACK_M)
            ways = normals[broad & touched_face[faces]]
        else:
            towards = np.where(upright, normals @ -item.scene_T_object[:3, 1], -1.0)
            ways = normals[towards >= max(FACING, towards.max() - SLACK_M)]
        corners = apply(item.scene_T_object, part.vertices)
        free[n] = any(_has_swing(shapes, obstacles, k, corners, way[:2]) for way in ways)
    return free


def _ways_of_mesh(item: SceneObject, part: Part, touched: FloatArray) -> FloatArray:
    """(W, 3) directions in which a mesh part may open, of its ``touched`` upright faces' normals (T, 3).

    The front of furniture; of a door or window both sides across the smaller side of the box of the leaf, or of it all.
    """
    if item.category.group != "structure":
        ways = -item.scene_T_object[None, :3, 1]
    else:
        leaf = (part,) if part.role == "door" else item.parts
        size = np.ptp(np.concatenate([one.vertices[:, :2] for one in leaf]), axis=0)
        across = item.scene_T_object[:3, int(np.argmin(size))]
        ways = np.stack([across, -across])
    return np.asarray(ways[(touched @ ways.T >= FACING).any(axis=0)])


def _has_swing(shapes: Shapes, obstacles: Obstacles, object_index: int, corners: FloatArray, way: FloatArray) -> bool:
    """Whether nothing of other objects is within ``SWING_M`` in front of a part, all over its width and height."""
    x, y = (way / np.linalg.norm(way)).tolist()
    ahead, left = corners[:, 0] * x + corners[:, 1] * y, corners[:, 1] * x - corners[:, 0] * y
    low, high = corners.min(axis=0), corners.max(axis=0)
    near = obstacles.near(low - SWING_M, high + SWING_M)
    near = near[obstacles.object_index[near] != object_index]
    walls = np.flatnonzero(obstacles.wall & (obstacles.object_index != object_index))
    box = Box(x, y, (ahead.max(), ahead.max() + SWING_M), (left.min(), left.max()), (low[2], high[2]))
    return not box_hits(shapes, near, box) and not is_within(shapes, walls, box)
