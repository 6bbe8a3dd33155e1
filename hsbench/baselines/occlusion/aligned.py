"""The room on a grid along its walls: what one depth frame and activity say of every voxel that may be furniture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.baselines.occlusion.action import Activity
from hsbench.baselines.occlusion.boundary import Boundary
from hsbench.baselines.occlusion.carve import Seat, activity_maps, carve, fill_holes, seats
from hsbench.baselines.occlusion.config import CarveConfig, CuboidConfig
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import VoxelState
from hsbench.truth.sight import depth_states
from hsbench.typing import AnyArray, BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class AlignedRoom:
    """Voxels (nx, ny, nz) bool of a room, in a frame along its walls with z = 0 on the floor.

    surface: seen, and no wall. hidden: occluded, inside the boundary and not carved. support: hidden, below a seat.
    free: seen to be free, or carved. No voxel is two of surface, hidden and free.
    """

    grid: VoxelGrid
    episode_T_room: FloatArray
    surface: BoolArray
    hidden: BoolArray
    support: BoolArray
    free: BoolArray
    seats: tuple[Seat, ...]


def aligned_room(
    sensor: Sensor,
    depth_m: AnyArray,
    boundary: Boundary,
    activity: Activity,
    carving: CarveConfig,
    config: CuboidConfig,
) -> AlignedRoom:
    """The room within a boundary from one depth frame (h, w), 0 = none, and activity in the episode frame."""
    assert isinstance(sensor.camera, PinholeCamera)
    episode_T_room = planar(0.0, 0.0, boundary.yaw_rad)
    room_T_episode = invert(episode_T_room)
    shape = np.ceil((boundary.high - boundary.low) / config.voxel_m).astype(int)
    levels = round(config.height_m / config.voxel_m)
    grid = VoxelGrid((float(boundary.low[0]), float(boundary.low[1]), 0.0), (*shape.tolist(), levels), config.voxel_m)
    position = apply(room_T_episode, np.c_[activity.position, np.zeros(len(activity.position))])[:, :2]
    here = Activity(position, activity.action, activity.pelvis_m)
    states = depth_states(grid, sensor.camera, room_T_episode @ sensor.world_T_camera, fill_holes(depth_m))
    maps = activity_maps(here, grid, carving)
    found = seats(maps.sit, here, grid, carving)
    solid = carve(states, maps.stand, found, grid, carving)
    z = grid.axis_centres(2)
    support = np.zeros(grid.shape, dtype=np.bool_)
    for seat in found:
        support |= seat.mask[:, :, None] & (z <= seat.height_m)
    occluded = states == VoxelState.OCCLUDED
    shell = walls(states == VoxelState.SURFACE, grid, config)[:, :, None] | (z < config.floor_m)
    hidden = occluded & solid & ~shell
    return AlignedRoom(
        grid,
        episode_T_room,
        (states == VoxelState.SURFACE) & ~shell,
        hidden,
        hidden & support,
        (states == VoxelState.FREE) | (occluded & ~solid),
        found,
    )


def walls(surface: BoolArray, grid: VoxelGrid, config: CuboidConfig) -> BoolArray:
    """(nx, ny) columns of the plan that hold no furniture: at the boundary, or with surface higher than furniture."""
    margin = round(config.wall_m / grid.voxel_m)
    found = np.ones(grid.shape[:2], dtype=np.bool_)
    inner = slice(margin, -margin or None)
    found[inner, inner] = surface[inner, inner, grid.axis_centres(2) > config.furniture_top_m].any(axis=2)
    return found
