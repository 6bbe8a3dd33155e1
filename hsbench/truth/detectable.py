"""Which objects a detector is asked for: furniture with its middle in the grid, not too small to matter.

Task object-detection-3d. The group ``furniture`` of the category table is what stands on the floor or hangs on a wall;
rugs, curtains, fixtures and clutter are of other groups.
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_m
from hsbench.schema.scene import Scene
from hsbench.typing import BoolArray

LONGEST_SIDE_M = 0.3  # task object-detection-3d


def detectable(scene: Scene, grid: VoxelGrid) -> BoolArray:
    """(N,) bool of the scene's objects, in its order; scene and grid are in one frame. Lengths compare to .1 mm."""
    boxes = np.array([item.box for item in scene.objects]).reshape(-1, 7)
    furniture = np.array([item.category.group == "furniture" for item in scene.objects], dtype=np.bool_)
    _, inside = grid.index(quantise_m(boxes[:, :3]))
    return np.asarray(furniture & inside & (quantise_m(boxes[:, 3:6]).max(axis=1, initial=0.0) >= LONGEST_SIDE_M))
