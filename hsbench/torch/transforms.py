"""Geometric augmentations that move pictures, poses, boxes, maps and voxels together. Numpy in, numpy out.

Each is exact: no pixel is interpolated, so that ids, depth and maps stay what they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.torch.samples import Sample
from hsbench.typing import AnyArray, FloatArray

PICTURES = ("rgb", "depth_m", "instance", "semantic")
PLANS = ("maps", "affordance", "affordance_ignored")  # row 0 is the largest x, column 0 the largest y
VOXELS = ("solid", "voxel_state", "solid_ignored")


@dataclass(frozen=True)
class Sometimes:
    """A transform for data sets: ``change``, such as ``mirrored``, of a share of the samples."""

    change: Callable[[Sample], Sample]
    probability: float = 0.5

    def __call__(self, sample: Sample, rng: np.random.Generator) -> Sample:
        """The sample, changed or as it is."""
        return self.change(sample) if rng.random() < self.probability else sample


def mirrored(sample: Sample) -> Sample:
    """Left and right exchanged: y becomes -y, column c becomes width - 1 - c, left joints become right ones.

    A box keeps its centre's x, its size, and gets minus its yaw: boxes have no handedness.
    """
    changes: dict[str, Any] = {"roll_rad": -sample.roll_rad}
    camera = sample.camera
    if isinstance(camera, PinholeCamera):
        changes["camera"] = replace(camera, cx_px=camera.width_px - camera.cx_px)
    elif not isinstance(camera, EquirectangularCamera | TopDownCamera):
        raise SchemaError(f"mirrored does not know {type(camera).__name__}; expected a camera without distortion")
    for name in PICTURES:
        changes[name] = _each(getattr(sample, name), lambda pictures: pictures[:, :, ::-1])
    for name in PLANS:
        changes[name] = _each(getattr(sample, name), lambda plan: plan[..., ::-1])
    if sample.skeleton is not None:
        order = list(sample.skeleton.mirror)
        changes["joint_state"] = _each(sample.joint_state, lambda state: state[:, order])
        changes["joints_m"] = _each(
            sample.joints_m, lambda joints: joints[:, order] * np.array([1, -1, 1], dtype=np.float32)
        )
        changes["joints_px"] = _each(
            sample.joints_px,
            lambda pixels: (
                np.array([camera.width_px, 0], dtype=np.float32)
                + pixels[:, order] * np.array([-1, 1], dtype=np.float32)
            ),
        )
    changes["boxes"] = _each(sample.boxes, lambda boxes: boxes * np.array([1.0, -1, 1, 1, 1, 1, -1]))
    for name in VOXELS:
        changes[name] = _each(getattr(sample, name), lambda voxels: voxels[:, ::-1])
    if sample.grid is not None:
        grid = sample.grid
        low = -(grid.origin_m[1] + grid.shape[1] * grid.voxel_m)
        changes["grid"] = VoxelGrid((grid.origin_m[0], low, grid.origin_m[2]), grid.shape, grid.voxel_m)
    return replace(sample, **_contiguous(changes))


def turned(sample: Sample, quarters: int) -> Sample:
    """A 360 camera turned left by so many quarter turns: what lay to its left now lies ahead.

    Raises SchemaError for another camera, one that leans, a width that four does not divide, or maps that are no
    squares.
    """
    camera, quarters = sample.camera, quarters % 4
    if not isinstance(camera, EquirectangularCamera) or sample.tilt_rad or sample.roll_rad:
        raise SchemaError(
            f"turned needs an upright 360 camera; found {type(camera).__name__} (use mirrored or cropped)"
        )
    if camera.width_px % 4:
        raise SchemaError(f"turned needs a width that four divides; found {camera.width_px} px")
    shift = quarters * camera.width_px // 4
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters]
    turn = np.array([[c, s], [-s, c]])  # new_R_old
    changes: dict[str, Any] = {}
    for name in PICTURES:
        changes[name] = _each(getattr(sample, name), lambda pictures: np.roll(pictures, shift, axis=2))
    for name in PLANS:
        plan = getattr(sample, name)
        if plan is not None and plan.shape[-1] != plan.shape[-2]:
            raise SchemaError(f"turned needs square {name}; found {plan.shape[-2]} x {plan.shape[-1]} cells")
        changes[name] = _each(plan, lambda plan: np.rot90(plan, -quarters, axes=(-2, -1)))
    changes["joints_m"] = _each(sample.joints_m, lambda joints: _turned_xy(joints, turn))
    if sample.joints_px is not None:
        pixels = sample.joints_px.copy()
        pixels[..., 0] = (pixels[..., 0] + shift) % camera.width_px
        changes["joints_px"] = pixels
    if sample.boxes is not None:
        boxes = _turned_xy(sample.boxes, turn)
        boxes[:, 6] = (boxes[:, 6] - quarters * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
        changes["boxes"] = boxes
    for name in VOXELS:
        changes[name] = _each(getattr(sample, name), lambda voxels: np.rot90(voxels, -quarters, axes=(0, 1)))
    if sample.grid is not None:
        changes["grid"] = _turned_grid(sample.grid, quarters, turn)
    return replace(sample, **_contiguous(changes))


def cropped(sample: Sample, row: int, column: int, height_px: int, width_px: int) -> Sample:
    """A window of a pinhole picture, and the camera that would have taken it; poses, boxes and maps stay.

    Raises SchemaError for another camera or a window that leaves the picture.
    """
    camera = sample.camera
    if not isinstance(camera, PinholeCamera):
        raise SchemaError(f"cropped needs a pinhole camera; found {type(camera).__name__}")
    if not (0 <= row < row + height_px <= camera.height_px and 0 <= column < column + width_px <= camera.width_px):
        raise SchemaError(
            f"window of {height_px} x {width_px} at ({row}, {column}) leaves the picture of "
            f"{camera.height_px} x {camera.width_px}"
        )
    window = np.s_[:, row : row + height_px, column : column + width_px]
    changes: dict[str, Any] = {
        "camera": replace(
            camera,
            width_px=width_px,
            height_px=height_px,
            cx_px=camera.cx_px - column,
            cy_px=camera.cy_px - row,
        )
    }
    for name in PICTURES:
        changes[name] = _each(getattr(sample, name), lambda pictures: pictures[window])
    changes["joints_px"] = _each(sample.joints_px, lambda pixels: pixels - np.array([column, row], dtype=np.float32))
    return replace(sample, **_contiguous(changes))


def _turned_xy(rows: AnyArray, turn: AnyArray) -> FloatArray:
    """A copy of (..., >= 2) rows with x and y turned."""
    result = rows.copy()
    result[..., :2] = rows[..., :2] @ turn.T.astype(rows.dtype)
    return result


def _turned_grid(grid: VoxelGrid, quarters: int, turn: AnyArray) -> VoxelGrid:
    low = np.array(grid.origin_m[:2])
    high = low + np.array(grid.shape[:2]) * grid.voxel_m
    corners = np.stack([low, high]) @ turn.T
    x, y = corners.min(axis=0).tolist()
    nx, ny, nz = grid.shape
    return VoxelGrid((x, y, grid.origin_m[2]), (ny, nx, nz) if quarters % 2 else grid.shape, grid.voxel_m)


def _each(array: AnyArray | None, change: Callable[[AnyArray], AnyArray]) -> AnyArray | None:
    return None if array is None else change(array)


def _contiguous(changes: dict[str, Any]) -> dict[str, Any]:
    """Arrays in memory order: tensors cannot have negative strides."""
    return {k: np.ascontiguousarray(v) if isinstance(v, np.ndarray) else v for k, v in changes.items()}
