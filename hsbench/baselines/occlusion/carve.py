"""Carving: bodies cannot intersect structure, so where people stood or sat, occluded space is free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.sight import pinhole_states
from hsbench.geometry.activity_map import rasterise
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Action, VoxelState
from hsbench.typing import AnyArray, BoolArray, Float32Array, FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class ActionMaps:
    """Activity maps on a grid's floor plan, (nx, ny) float32 in 0..1."""

    stand: Float32Array
    sit: Float32Array


@dataclass(frozen=True, eq=False)
class Seat:
    """A place where somebody sat: mask (nx, ny) bool of the floor plan, height of the seat in metres."""

    mask: BoolArray
    height_m: float


def fill_holes(depth_m: AnyArray) -> FloatArray:
    """(h, w) depth with every missing pixel (0) set to the nearest valid one; all missing stays all missing.

    Without it the voxels behind a lost pixel have no state, and every method loses the same ones.
    """
    depth = np.asarray(depth_m, dtype=np.float64)
    missing = depth == 0
    if missing.all() or not missing.any():
        return depth
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    return np.asarray(depth[tuple(nearest)])


def voxel_states(sensor: Sensor, grid: VoxelGrid, depth_m: AnyArray) -> UInt8Array:
    """States of the grid's voxels as the depth frame (h, w) shows them, holes filled."""
    assert isinstance(sensor.camera, PinholeCamera)
    return pinhole_states(grid, sensor.camera, sensor.world_T_camera, fill_holes(depth_m))


def activity_maps(activity: Activity, grid: VoxelGrid, config: CarveConfig) -> ActionMaps:
    """Stand and sit maps: every pose adds ``delta`` to a body disc, up to 1."""

    def map_of(action: Action) -> Float32Array:
        return rasterise(
            activity.of(action).position,
            (grid.origin_m[0], grid.origin_m[1]),
            (grid.shape[0], grid.shape[1]),
            grid.voxel_m,
            config.body_radius_m,
            config.delta,
        )

    return ActionMaps(map_of(Action.STAND), map_of(Action.SIT))


def carve(
    states: UInt8Array, stand: Float32Array, found: tuple[Seat, ...], grid: VoxelGrid, config: CarveConfig
) -> BoolArray:
    """(nx, ny, nz) bool: what is occupied once the stand map (nx, ny) and seats have carved the occluded space.

    Visible surface stays; occluded voxels stay unless a body was there; below a seat is support.
    """
    z = grid.axis_centres(2)
    free = (stand > config.threshold)[:, :, None] & (z <= config.stand_top_m)
    support = np.zeros(grid.shape, dtype=bool)
    for seat in found:
        free |= seat.mask[:, :, None] & ((z > seat.height_m) & (z <= seat.height_m + config.sit_clear_m))
        support |= seat.mask[:, :, None] & (z <= seat.height_m)
    occluded = states == VoxelState.OCCLUDED
    # A seat's support wins over somebody standing beside it: both discs are wider than the body part they stand for.
    return np.asarray((states == VoxelState.SURFACE) | (occluded & (~free | support)))


def seats(sit: Float32Array, activity: Activity, grid: VoxelGrid, config: CarveConfig) -> tuple[Seat, ...]:
    """A seat for every connected blob of the sit map (nx, ny) above the threshold, as high as people's pelvises say."""
    labels, count = label(sit > config.threshold)
    sitting = activity.of(Action.SIT)
    cell = np.floor((sitting.position - np.asarray(grid.origin_m[:2])) / grid.voxel_m).astype(np.int64)
    inside = ((cell >= 0) & (cell < np.asarray(grid.shape[:2]))).all(axis=1)
    blob_of = np.zeros(len(cell), dtype=np.int64)
    blob_of[inside] = labels[cell[inside, 0], cell[inside, 1]]
    found = []
    for k in range(1, count + 1):
        pelvis = sitting.pelvis_m[blob_of == k]
        pelvis = pelvis[np.isfinite(pelvis)]
        seat_m = float(np.median(pelvis)) - config.pelvis_over_seat_m if len(pelvis) else config.seat_height_m
        found.append(Seat(labels == k, seat_m))
    return tuple(found)
