"""What the network sees of an episode, and what it is to answer, as small arrays: 4 MB an episode.

The frame at t0 gives a flipped signed distance (Song et al., "Semantic scene completion from a single depth image",
CVPR 2017: the steep change lies at the surface, not at the end of the truncation) and the distance behind the surface
along the ray; the observed poses give the maps and seats of carving. All constants are hsbench defaults.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from hsbench.baselines.method import depth_at_t0
from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.carve import activity_maps, fill_holes, seats, voxel_states
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.height_prior import behind_surface
from hsbench.metrics.completion import primary_mask
from hsbench.schema.episode import Episode
from hsbench.schema.states import VoxelState
from hsbench.tasks.scene_completion import GRID
from hsbench.typing import AnyArray, BoolArray, Float32Array, UInt8Array

TRUNCATION_M = 0.3
BEHIND_M = 2.0
FULL = 127
"""Of int8 that stands for 1."""


@dataclass(frozen=True, eq=False)
class Depth:
    """The frame at t0 on the task's grid.

    states: (nx, ny, nz) uint8 of ``VoxelState``. distance: (nx, ny, nz) int8, 127 (1 - d / ``TRUNCATION_M``) at d
    metres from the nearest surface voxel, 0 beyond, negative where occluded, 0 outside the view. behind: (nx, ny, nz)
    int8, 127 = ``BEHIND_M`` metres behind the surface along the camera's axis, negative before it, clipped.
    """

    states: UInt8Array
    distance: AnyArray
    behind: AnyArray


@dataclass(frozen=True, eq=False)
class Evidence:
    """Activity on the plan, all (nx, ny) float32: stand and sit maps in 0..1, and the height of a seat in metres."""

    stand: Float32Array
    sit: Float32Array
    seat_m: Float32Array


@dataclass(frozen=True, eq=False)
class Target:
    """mask: (nx, ny, nz) bool, the voxels that the primary score counts. solid: (nx, ny, nz) bool."""

    mask: BoolArray
    solid: BoolArray


def depth_features(episode: Episode) -> Depth:
    """Of the frame at t0, holes filled. Raises DataError where there is none."""
    depth_m = depth_at_t0(episode)
    states = voxel_states(episode.sensor, GRID, depth_m)
    known = (states == VoxelState.FREE) | (states == VoxelState.OCCLUDED) | (states == VoxelState.SURFACE)
    surface = states == VoxelState.SURFACE
    if surface.any():
        away_m = distance_transform_edt(~surface, sampling=GRID.voxel_m)
        near = np.clip(1 - away_m / TRUNCATION_M, 0, 1) * known
    else:
        near = np.zeros(GRID.shape)
    sign = np.where(states == VoxelState.OCCLUDED, -1, 1)
    behind = np.clip(behind_surface(episode.sensor, GRID, fill_holes(depth_m)) / BEHIND_M, -1, 1)
    return Depth(
        states,
        np.rint(FULL * sign * near).astype(np.int8),
        np.rint(FULL * np.nan_to_num(behind)).astype(np.int8),
    )


def evidence(activity: Activity, config: CarveConfig) -> Evidence:
    """What the poses of an episode say of the floor plan."""
    maps = activity_maps(activity, GRID, config)
    seat_m = np.full(GRID.shape[:2], config.seat_height_m, dtype=np.float32)
    for seat in seats(maps.sit, activity, GRID, config):
        seat_m[seat.mask] = seat.height_m
    return Evidence(maps.stand, maps.sit, seat_m)


def target(episode: Episode) -> Target:
    """Truth of an episode that was loaded with it."""
    assert episode.truth is not None
    assert episode.truth.occupancy is not None
    truth = episode.truth.occupancy
    return Target(primary_mask(truth), truth.solid)
