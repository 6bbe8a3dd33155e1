"""Space that the people of a capture held: their observed bones as capsules.

Only tracked joints count: an inferred one is a guess. Radii are those of a slight adult, so that what is called swept
was: limb girths of NASA-STD-3000 vol. I sec. 3, as shares of a stature of 1.55 m (docs/data/people.md).
"""

from __future__ import annotations

import numpy as np

from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.episode import NS_PER_S
from hsbench.schema.poses import JointState, PoseTable
from hsbench.truth.evidence import first_swept
from hsbench.typing import Float32Array

RADIUS_M = {
    "spine_mid": 0.09, "spine_shoulder": 0.087, "neck": 0.05, "head": 0.05, "shoulder": 0.048, "elbow": 0.037,
    "wrist": 0.028, "hip": 0.053, "hip_mid": 0.09, "knee": 0.053, "ankle": 0.037, "foot": 0.025,
}  # fmt: skip
"""Of the bone that ends in a joint, by the joint's name without its side."""

LEAST_M = 0.017
"""Of every other bone: a hand's."""


def swept_by_joints(poses: PoseTable | None, t0_ns: int, grid: VoxelGrid) -> Float32Array:
    """(nx, ny, nz) seconds after t0 at which an observed bone first held a voxel's centre, +inf = never.

    Nothing is swept where there are no poses in 3D.
    """
    swept = np.full(grid.shape, np.inf, dtype=np.float32)
    if poses is None or poses.joints_m is None:
        return swept
    names = poses.layout.names
    tracked = poses.joint_state == JointState.TRACKED
    for parent, child in poses.layout.bones:
        name = names[child].removesuffix("_left").removesuffix("_right")
        radii = np.full((1, 2), RADIUS_M.get(name, LEAST_M))
        both = tracked[:, parent] & tracked[:, child]
        for track in np.unique(poses.track_id[both]).tolist():
            rows = both & (poses.track_id == track)
            ends = poses.joints_m[rows][:, None, (parent, child)].astype(np.float64)
            seconds = (poses.timestamp_ns[rows] - t0_ns) / NS_PER_S
            np.minimum(swept, first_swept(ends, radii, seconds, grid), out=swept)
    return swept
