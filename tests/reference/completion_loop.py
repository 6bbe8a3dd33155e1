"""Scene completion counted voxel by voxel, slow and plain on purpose.

By the author of the fast scorer: independent in method. ``completion_from_tasks`` is by somebody who had not read it.
"""

from __future__ import annotations

import math

FREE, SURFACE, OCCLUDED, OUTSIDE_FOV, OUTSIDE_ROOM, UNKNOWN = 1, 2, 3, 5, 6, 0
STRUCTURE_NAMES = ("floor", "ceiling", "wall", "door", "window", "passage")


def belongs(region, state, semantic, height_m, ignored, swept_s, structure_ids):
    """Whether one voxel counts in a region."""
    if ignored or state == OUTSIDE_ROOM:
        return False
    if region not in ("occluded-full-height", "everything") and not 0 < height_m <= 2.0:
        return False
    if region not in ("occluded-with-structure", "everything") and semantic in structure_ids:
        return False
    if region == "surface+occluded":
        return state in (SURFACE, OCCLUDED)
    if region in ("known", "everything"):
        return state != UNKNOWN
    if region == "outside-frustum":
        return state == OUTSIDE_FOV
    if region == "occluded-swept":
        return state == OCCLUDED and math.isfinite(swept_s)
    if region == "occluded-unswept":
        return state == OCCLUDED and not math.isfinite(swept_s)
    return state == OCCLUDED


def count(region, semantic, prediction, state, ignored, swept_s, z_min_m, voxel_m, structure_ids):
    """[tp, fp, fn, tn] of one region; all arrays (nx, ny, nz)."""
    tp = fp = fn = tn = 0
    nx, ny, nz = semantic.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                here = (i, j, k)
                height = z_min_m + (k + 0.5) * voxel_m
                if not belongs(
                    region, state[here], semantic[here], height, ignored[here], swept_s[here], structure_ids
                ):
                    continue
                if semantic[here] > 0 and prediction[here]:
                    tp += 1
                elif semantic[here] > 0:
                    fn += 1
                elif prediction[here]:
                    fp += 1
                else:
                    tn += 1
    return [tp, fp, fn, tn]
