"""Truth per object: how much of it the camera sees at t0, and what activity says of it.

Task object-detection-3d: *used* = touched; *skirted* = at least half of its free border swept by bodies.
The border is ours to define: floor columns within BORDER_M of the object's columns that are free up to
BORDER_HEIGHT_M (a rug is stepped on) and in the room; a column is swept if any of its voxels is.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from hsbench.geometry.rays import RayImage
from hsbench.schema.categories import category
from hsbench.schema.events import EventTable
from hsbench.schema.occupancy import ObjectTruth, OccupancyTruth
from hsbench.schema.scene import Scene
from hsbench.schema.states import Evidence, VoxelState
from hsbench.typing import BoolArray

BORDER_M = 0.30  # a body's radius of .25 m, rounded up to whole voxels
BORDER_HEIGHT_M = 1.75  # standing bodies free space up to 1.75 m
SKIRTED_SHARE = 0.5  # task object-detection-3d


def object_truth(scene: Scene, image: RayImage, occupancy: OccupancyTruth, events: EventTable) -> ObjectTruth:
    """Truth of every object of a scene, in its order; ``image`` as ``truth.sight.ray_image`` makes it."""
    n = len(scene.objects)
    visible = np.bincount(image.owner[image.owner >= 0], minlength=n).astype(np.int64)
    touched = {int(i) for i, contact in zip(events.object_id, events.contact, strict=True) if contact}
    share = np.zeros(n, dtype=np.float32)
    evidence = np.zeros(n, dtype=np.uint8)
    top = round(BORDER_HEIGHT_M / occupancy.grid.voxel_m)
    blocking = occupancy.solid & (occupancy.semantic != category("rug").category_id)
    free = ~blocking[:, :, :top].any(axis=2) & (occupancy.state[:, :, 0] != VoxelState.OUTSIDE_ROOM)
    swept = np.isfinite(occupancy.swept_s).any(axis=2)
    disc = _disc(round(BORDER_M / occupancy.grid.voxel_m))
    for k, item in enumerate(scene.objects):
        columns = (occupancy.instance == item.object_id).any(axis=2)
        if columns.any() and item.category.group != "structure":
            border = binary_dilation(columns, disc) & free
            share[k] = (border & swept).sum() / border.sum() if border.any() else 0.0
        if item.object_id in touched:
            evidence[k] = Evidence.USED
        elif share[k] >= SKIRTED_SHARE:
            evidence[k] = Evidence.SKIRTED
    ids = np.array([item.object_id for item in scene.objects], dtype=np.int32)
    return ObjectTruth(ids, visible, image.amodal_px, evidence, share)


def _disc(radius: int) -> BoolArray:
    x, y = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    return np.asarray(x * x + y * y <= radius * radius)
