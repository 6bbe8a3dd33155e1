"""Affordance as labelled space: truth of task scene-reconstruction-360, from what is stored with an episode.

Each walkable, sittable or interactable surface is extruded to the floor; floor and walls are one voxel thick. Where
volumes meet, sittable goes before interactable before wall before walkable. Of walls, with their doors, windows and
the frames of passages, only voxels that face a room count: beside one of another category with its centre in a room.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.categories import category
from hsbench.schema.occupancy import AffordanceTruth, OccupancyTruth
from hsbench.schema.scene import Scene
from hsbench.schema.states import Affordance
from hsbench.typing import BoolArray, UInt8Array

WALLS = tuple(category(name).category_id for name in ("wall", "door", "window", "passage"))


class Volume(IntEnum):
    """Label of a voxel."""

    NONE = 0
    WALKABLE = 1
    SITTABLE = 2
    INTERACTABLE = 3
    WALL = 4


@dataclass(frozen=True, eq=False)
class VolumeTruth:
    """Truth on one grid in the episode frame; all arrays have its shape.

    labels: uint8 of ``Volume``. solid: bool, the solids inside the rooms and the walls that face them. ignored: bool.
    """

    grid: VoxelGrid
    labels: UInt8Array
    solid: BoolArray
    ignored: BoolArray


def volume_truth(scene: Scene, occupancy: OccupancyTruth, affordance: AffordanceTruth) -> VolumeTruth:
    """Affordance volumes and true solids of an episode.

    Ignored are the columns that the map from above ignores, and the voxels that occupancy does. Raises SchemaError
    where labelled surfaces are missing or on another grid, or the map does not lie over the grid.
    """
    grid, surfaces = occupancy.grid, affordance.voxels
    if surfaces is None or surfaces.grid != grid:
        raise SchemaError(f"labelled surfaces are on {None if surfaces is None else surfaces.grid}; expected {grid}")
    size = tuple(round(side * affordance.cell_m / grid.voxel_m) for side in affordance.labels.shape)
    if affordance.cell_m != grid.voxel_m or size != grid.shape[:2]:
        raise SchemaError(f"the map from above has {affordance.labels.shape} cells; expected those of {grid}")
    inside = scene.contains(grid.centres()[:, :, 0, :2])[:, :, None]
    walls = np.isin(occupancy.semantic, WALLS)
    facing = walls & _beside(inside & ~walls)
    labels = np.zeros(grid.shape, dtype=np.uint8)
    floor = int(np.floor(0.5 - grid.origin_m[2] / grid.voxel_m))
    labels[:, :, floor][_held(surfaces.labels, Affordance.WALKABLE)[:, :, floor]] = Volume.WALKABLE
    labels[facing] = Volume.WALL
    labels[_down_to(floor, _held(surfaces.labels, Affordance.INTERACTABLE))] = Volume.INTERACTABLE
    labels[_down_to(floor, _held(surfaces.labels, Affordance.SITTABLE))] = Volume.SITTABLE
    solid = facing | (occupancy.solid & ~walls & inside)
    return VolumeTruth(grid, labels, solid, occupancy.ignored | affordance.ignored[::-1, ::-1, None])


def _held(bits: UInt8Array, label: Affordance) -> BoolArray:
    return np.asarray((bits & np.uint8(1 << label)) > 0)


def _beside(mask: BoolArray) -> BoolArray:
    """(nx, ny, nz) bool: one of the four neighbours at the same height is in the mask."""
    found = np.zeros_like(mask)
    found[1:] |= mask[:-1]
    found[:-1] |= mask[1:]
    found[:, 1:] |= mask[:, :-1]
    found[:, :-1] |= mask[:, 1:]
    return found


def _down_to(floor: int, surface: BoolArray) -> BoolArray:
    """Every voxel of the mask and those below it, from the layer ``floor`` up."""
    filled = np.logical_or.accumulate(surface[:, :, ::-1], axis=2)[:, :, ::-1]
    filled[:, :, :floor] = False
    return np.asarray(filled)
