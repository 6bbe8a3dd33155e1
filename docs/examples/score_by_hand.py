"""The worked example of docs/tasks/scene-completion.md: two tiny rooms, scored by hand and by hsbench."""

import numpy as np

from hsbench.metrics.completion import Counts, score
from hsbench.schema import VoxelState, category


def room(voxels: int, solid: int, hit: int, false: int) -> Counts:
    """A row of occluded voxels: some solid, of which ``hit`` predicted, and ``false`` others."""
    truth = np.zeros((voxels, 1, 1), dtype=np.uint8)
    truth[:solid] = category("sofa").category_id
    prediction = np.zeros(truth.shape, dtype=bool)
    prediction[:hit] = prediction[solid : solid + false] = True
    state = np.full(truth.shape, VoxelState.OCCLUDED, dtype=np.uint8)
    return score(truth, prediction, state, "hsbench-occluded").counts


a = room(voxels=10, solid=4, hit=3, false=2)
b = room(voxels=20, solid=8, hit=2, false=0)
print(a, a.iou)
print(b, b.iou)
print("pooled", (a + b).iou, "mean over episodes", (a.iou + b.iou) / 2)
everything = room(10, 4, 4, 6) + room(20, 8, 8, 12)
print("all solid", everything.iou, "=", 12 / 30, "the solid share of the mask")
nothing = room(10, 4, 0, 0)
print("empty", nothing.iou, nothing.precision)
