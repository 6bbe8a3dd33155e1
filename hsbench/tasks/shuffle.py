"""The control "shuffled activity" of every task that uses activity: poses of another episode, turned and clipped.

It keeps what any room's activity has in common (people are in the middle, not in the walls) and removes what this
room's activity says. Of evenly spaced turns from a random start the one that keeps most poses inside the boundary is
taken, so that the control is not weak for want of poses. The boundary is the one that the method estimates for itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.polygons import contains
from hsbench.geometry.transforms import cos_sin
from hsbench.schema.poses import PoseTable
from hsbench.typing import BoolArray, FloatArray

TURNS = 36
CAMERA_XY = (0.0, 0.0)  # of the episode frame


def turn_inside(
    points_xy: FloatArray,
    boundary_xy: FloatArray,
    rng: np.random.Generator,
    about_xy: FloatArray | tuple[float, float] = CAMERA_XY,
    onto_xy: FloatArray | tuple[float, float] = CAMERA_XY,
) -> tuple[float, BoolArray]:
    """(N, 2) places of another episode, the polygon (n, 2) of this one -> (turn in radians, (N,) bool: kept).

    Places are turned about ``about_xy``, which is moved onto ``onto_xy``: both the camera, unless said otherwise. Those
    that are not finite are not kept. ``turned`` applies the move.
    """
    start = rng.uniform(0.0, 2 * np.pi)
    known = np.asarray(np.isfinite(points_xy).all(axis=-1))
    best: tuple[float, BoolArray] | None = None
    for k in range(TURNS):
        angle = start + 2 * np.pi * k / TURNS
        kept = known.copy()
        kept[known] = contains(boundary_xy, turned(points_xy[known], angle, about_xy, onto_xy))
        if best is None or kept.sum() > best[1].sum():
            best = angle, kept
    assert best is not None
    return best


def turned(
    points: FloatArray,
    angle_rad: float,
    about_xy: FloatArray | tuple[float, float] = CAMERA_XY,
    onto_xy: FloatArray | tuple[float, float] = CAMERA_XY,
) -> FloatArray:
    """(..., 2 or 3) points turned counter-clockwise about a vertical line, which is then moved; heights stay."""
    c, s = cos_sin(angle_rad)
    result = np.array(points, dtype=np.float64)
    result[..., :2] = (result[..., :2] - about_xy) @ np.array([[c, s], [-s, c]]) + onto_xy
    return result


def shuffled_poses(other: PoseTable, boundary_xy: FloatArray, rng: np.random.Generator) -> PoseTable:
    """Poses of another episode turned about the camera, those whose middle lies in the polygon (n, 2) of this one.

    The middle is the mean of the known joints. Raises SchemaError for poses in pixels only: they have no place.
    """
    if other.joints_m is None:
        raise SchemaError("poses to shuffle have no joints in metres; expected 3D poses (estimate their depth first)")
    joints = other.joints_m.astype(np.float64)
    known = np.isfinite(joints[..., :2]).all(axis=-1, keepdims=True)
    count = known.sum(axis=1)
    total = np.where(known, joints[..., :2], 0.0).sum(axis=1)
    middle = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    angle, kept = turn_inside(middle, boundary_xy, rng)
    table = replace(other, joints_m=turned(joints, angle).astype(np.float32), joints_px=None)
    return table.select(kept)
