"""Truth of space: solid voxels, what the sensor knew of them, what activity swept, and truth per object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.grids import VoxelGrid
from hsbench.schema.poses import require
from hsbench.schema.states import Affordance, Evidence, Visibility, VoxelState
from hsbench.typing import BoolArray, Float32Array, Int32Array, IntArray, UInt8Array, UInt16Array


@dataclass(frozen=True, eq=False)
class OccupancyTruth:
    """Voxel truth on one grid in the episode frame; all arrays have the grid's shape.

    semantic: uint8 category id of the solid that fills most of the voxel's sub-samples, 0 = free: a voxel is
    solid where semantic > 0, interiors of closed things included.
    instance: uint16 object id of that solid, 0 = free.
    state: uint8 of ``VoxelState`` in the noise-free, person-free frame at t0.
    ignored: bool, truth differs from t0 for more than half of the episode.
    swept_s: float32 seconds after t0 at which a body first entered the voxel, +inf = never.
    seen_s: float32 seconds after t0 at which the sensor first saw the voxel, free or surface: 0, or later when a thing
    that hid it moved away, +inf = never; None where that is not known.
    """

    grid: VoxelGrid
    semantic: UInt8Array
    instance: UInt16Array
    state: UInt8Array
    ignored: BoolArray
    swept_s: Float32Array
    seen_s: Float32Array | None = None

    def __post_init__(self) -> None:
        shape = self.grid.shape
        for name, dtype in (
            ("semantic", np.uint8),
            ("instance", np.uint16),
            ("state", np.uint8),
            ("ignored", np.bool_),
            ("swept_s", np.float32),
        ):
            require(getattr(self, name), f"occupancy.{name}", shape, dtype)
        if self.state.max() > max(VoxelState):
            raise SchemaError(f"occupancy.state holds {self.state.max()}; expected 0..{max(VoxelState)}")
        if ((self.semantic > 0) != (self.instance > 0)).any():
            raise SchemaError("occupancy.semantic and occupancy.instance disagree on which voxels are solid")
        if self.seen_s is not None:
            require(self.seen_s, "occupancy.seen_s", shape, np.float32)
        for name, seconds in (("swept_s", self.swept_s), ("seen_s", self.seen_s)):
            if seconds is not None and not (seconds >= 0).all():
                raise SchemaError(f"occupancy.{name} holds NaN or negative seconds; expected >= 0 or +inf")

    @property
    def solid(self) -> BoolArray:
        """Whether a voxel is solid."""
        return np.asarray(self.semantic > 0)


@dataclass(frozen=True, eq=False)
class ObjectTruth:
    """Truth per object, in the order of the scene's objects.

    object_id: (N,) int32. visible_px, amodal_px: (N,) int64 pixels at t0, without people, inside the image.
    evidence: (N,) uint8 of ``Evidence``. skirted_share: (N,) float32 swept share of the free border, 0..1.
    """

    object_id: Int32Array
    visible_px: IntArray
    amodal_px: IntArray
    evidence: UInt8Array
    skirted_share: Float32Array

    VISIBLE_SHARE = 0.60  # task object-detection-3d
    PARTIAL_SHARE = 0.02

    def __post_init__(self) -> None:
        n = len(self.object_id)
        require(self.object_id, "objects.object_id", (n,), np.int32)
        require(self.visible_px, "objects.visible_px", (n,), np.int64)
        require(self.amodal_px, "objects.amodal_px", (n,), np.int64)
        require(self.evidence, "objects.evidence", (n,), np.uint8)
        require(self.skirted_share, "objects.skirted_share", (n,), np.float32)
        if (self.visible_px > self.amodal_px).any() or (self.visible_px < 0).any():
            raise SchemaError("objects.visible_px exceeds amodal_px or is negative")
        if not ((self.skirted_share >= 0) & (self.skirted_share <= 1)).all():
            raise SchemaError("objects.skirted_share leaves 0..1 or holds NaN")
        if n and self.evidence.max() > max(Evidence):
            raise SchemaError(f"objects.evidence holds {self.evidence.max()}; expected 0..{max(Evidence)}")

    @property
    def visibility(self) -> UInt8Array:
        """(N,) uint8 of ``Visibility``, from the pixel counts."""
        share = self.visible_px / np.maximum(self.amodal_px, 1)
        classes = np.where(
            share < self.PARTIAL_SHARE,
            Visibility.FULLY_OCCLUDED,
            np.where(share < self.VISIBLE_SHARE, Visibility.PARTIAL, Visibility.VISIBLE),
        )
        return np.where(self.amodal_px == 0, Visibility.OUTSIDE, classes).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class PartAffordances:
    """What each part of a scene affords, one entry a part, in the scene's order.

    object_id, part_index: (P,) int32, the index counts within the object. part: names. labels: (P,) uint8 bit field of
    ``Affordance``: a bit is set if it is for any point of the part's surface.
    """

    object_id: Int32Array
    part_index: Int32Array
    part: tuple[str, ...]
    labels: UInt8Array

    def __post_init__(self) -> None:
        n = len(self.part)
        require(self.object_id, "part affordances.object_id", (n,), np.int32)
        require(self.part_index, "part affordances.part_index", (n,), np.int32)
        require(self.labels, "part affordances.labels", (n,), np.uint8)
        _check_bits(self.labels, "part affordances.labels")
        if len(np.unique(np.column_stack([self.object_id, self.part_index]), axis=0)) != n:
            raise SchemaError("part affordances name a part twice; expected one entry a part")


@dataclass(frozen=True, eq=False)
class AffordanceVoxels:
    """Labelled surfaces in voxels: bit field of ``Affordance``, uint8 of the grid's shape, in the episode frame.

    A voxel has the labels of the surfaces that pass through it; the floor lies in the layer that begins at z = 0.
    """

    grid: VoxelGrid
    labels: UInt8Array

    def __post_init__(self) -> None:
        require(self.labels, "affordance voxels.labels", self.grid.shape, np.uint8)
        _check_bits(self.labels, "affordance voxels.labels")


@dataclass(frozen=True, eq=False)
class AffordanceTruth:
    """Affordance of a scene at t0, from above, and where known per part and per voxel of its surfaces.

    labels: (h, w) uint8 bit field of ``Affordance`` per cell. ignored: (h, w) bool. Row 0 is the largest x (forward),
    column 0 the largest y (left), centred on the camera, ``cell_m`` a side.
    """

    labels: UInt8Array
    ignored: BoolArray
    cell_m: float = 0.05
    parts: PartAffordances | None = None
    voxels: AffordanceVoxels | None = None

    def __post_init__(self) -> None:
        require(self.labels, "affordance.labels", (None, None), np.uint8)
        require(self.ignored, "affordance.ignored", self.labels.shape, np.bool_)
        _check_bits(self.labels, "affordance.labels")
        if not self.cell_m > 0:
            raise SchemaError(f"affordance.cell_m is {self.cell_m}; expected metres > 0")


VIEW_UNSCORED = 1 << 7
"""Bit of a pixel of a view that no score counts, beside the bits of ``Affordance``."""


def check_view(labels: UInt8Array) -> None:
    """Raise SchemaError unless labels are those of a view: (h, w) uint8, bits of ``Affordance`` and VIEW_UNSCORED."""
    require(labels, "view_affordance", (None, None), np.uint8)


def _check_bits(labels: UInt8Array, name: str) -> None:
    last = max(Affordance)
    if labels.size and labels.max() >= 2 << last:
        raise SchemaError(f"{name} holds {labels.max()}; expected bits 0..{last} of Affordance")
