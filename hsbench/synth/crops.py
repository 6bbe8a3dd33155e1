"""Which pixels of a static camera's picture something can change, so that only these are drawn again."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numba
import numpy as np

from hsbench.geometry.cameras import Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Picture
from hsbench.schema.sensor import Sensor
from hsbench.synth.render import Window
from hsbench.synth.render.base import NEAR_M
from hsbench.synth.render.image_boxes import ray_table
from hsbench.typing import BoolArray, FloatArray, UInt8Array, UInt16Array

CROP_MARGIN_PX = 2


def window_of(sensor: Sensor, shapes: Sequence[tuple[FloatArray, FloatArray]]) -> Window | None:
    """The pixels that shapes can cover or shade, or None where they are out of view.

    A shape is the (V, 3) vertices of a mesh and the (C, 3) corners of a convex solid that holds all that it shades,
    world frame. In a 360 picture a shape across the seam has a window as wide as the picture.
    """
    camera, camera_T_world = sensor.camera, invert(sensor.world_T_camera)
    size = np.array([camera.width_px, camera.height_px])
    low, high = size.copy(), np.zeros(2, dtype=np.int64)
    for vertices, shaded in shapes:
        found = _extent(camera, apply(camera_T_world, vertices), apply(camera_T_world, shaded))
        if found is not None:
            low = np.minimum(low, np.floor(found[0]).astype(np.int64) - CROP_MARGIN_PX)
            high = np.maximum(high, np.ceil(found[1]).astype(np.int64) + CROP_MARGIN_PX)
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    if isinstance(camera, EquirectangularCamera) and (low[0] == 0 or high[0] == size[0]):
        low[0], high[0] = 0, size[0]  # the margin goes on beyond the seam
    if (high <= low).any():
        return None
    return Window(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def _extent(camera: Camera, vertices: FloatArray, shaded: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Least and greatest (2,) pixels of a shape in the camera frame; None where it is behind an image plane."""
    if isinstance(camera, EquirectangularCamera):
        return _extent_on_sphere(camera, np.concatenate([vertices, shaded]))
    if isinstance(camera, TopDownCamera):
        pixels, _ = camera.project(np.concatenate([vertices, shaded]))
        return pixels.min(axis=0), pixels.max(axis=0)
    if vertices[:, 2].max() <= NEAR_M:
        return None
    if vertices[:, 2].min() <= NEAR_M:  # it stands against the lens
        return np.zeros(2), np.array([camera.width_px, camera.height_px], dtype=np.float64)
    points = np.concatenate([vertices, _in_front(shaded)])
    if isinstance(camera, PinholeCamera):
        pixels, _ = camera.project(points)
        return pixels.min(axis=0), pixels.max(axis=0)
    # Straight lines are bent: ask the ray of every pixel.
    directions, rays = points[:, :2] / points[:, 2:], ray_table(camera)
    inside = ((rays[..., :2] >= directions.min(axis=0)) & (rays[..., :2] <= directions.max(axis=0))).all(axis=2)
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    if not len(rows):
        return None
    return np.array([columns[0], rows[0]], np.float64), np.array([columns[-1] + 1, rows[-1] + 1], np.float64)


def _extent_on_sphere(camera: EquirectangularCamera, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of the upright box around points: its rectangle seen from above gives the columns, with heights the rows."""
    (x0, y0, z0), (x1, y1, z1) = points.min(axis=0), points.max(axis=0)
    nearest = math.hypot(max(x0, -x1, 0.0), max(z0, -z1, 0.0))
    farthest = math.hypot(max(-x0, x1), max(-z0, z1))
    up = math.atan2(-y0, nearest if y0 < 0.0 else farthest)
    down = math.atan2(-y1, nearest if y1 > 0.0 else farthest)
    middle = math.atan2(x0 + x1, z0 + z1)
    turns = [math.remainder(math.atan2(x, z) - middle, math.tau) for x in (x0, x1) for z in (z0, z1)]
    left, right = middle + min(turns), middle + max(turns)
    if nearest == 0.0 or left <= -math.pi or right >= math.pi:
        left, right = -math.pi, math.pi
    across = np.array([left, right]) / math.tau + 0.5
    return (
        np.array([across[0] * camera.width_px, (0.5 - up / math.pi) * camera.height_px]),
        np.array([across[1] * camera.width_px, (0.5 - down / math.pi) * camera.height_px]),
    )


def _in_front(corners: FloatArray) -> FloatArray:
    """(N, 3) corners of the part of a convex solid with (C, 3) corners that lies before the lens, camera frame."""
    behind = corners[:, 2] <= NEAR_M
    a, b = corners[~behind][:, None], corners[behind][None]
    cut_at = a + (a[..., 2:] - NEAR_M) / (a[..., 2:] - b[..., 2:]) * (b - a)
    return np.concatenate([corners[~behind], cut_at.reshape(-1, 3)])


def corners_of(low_m: FloatArray, high_m: FloatArray) -> FloatArray:
    """(8, 3) corners of a box along the axes."""
    (x0, y0, z0), (x1, y1, z1) = low_m, high_m
    return np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)])


def joined(a: Window | None, b: Window | None) -> Window | None:
    """The smallest window that holds both; None is empty."""
    return a or b if a is None or b is None else hull(a, b)


def hull(a: Window, b: Window) -> Window:
    """The smallest window that holds both."""
    u0, v0 = min(a.u0, b.u0), min(a.v0, b.v0)
    right, bottom = max(a.u0 + a.width, b.u0 + b.width), max(a.v0 + a.height, b.v0 + b.height)
    return Window(u0, v0, right - u0, bottom - v0)


def overlap(a: Window, b: Window) -> bool:
    """Whether two windows share a pixel."""
    return a.u0 < b.u0 + b.width and b.u0 < a.u0 + a.width and a.v0 < b.v0 + b.height and b.v0 < a.v0 + a.height


def crop(window: Window) -> tuple[slice, slice]:
    """Rows and columns of a window."""
    return slice(window.v0, window.v0 + window.height), slice(window.u0, window.u0 + window.width)


def within(window: Window, outer: Window) -> Window:
    """A window's place in another one that holds it."""
    return Window(window.u0 - outer.u0, window.v0 - outer.v0, window.width, window.height)


def cut(picture: Picture, window: Window) -> Picture:
    """The pixels of a window, as views."""
    at = crop(window)
    return Picture(picture.rgb[at], picture.depth_mm[at], picture.instance[at])


def differs(a: Picture, b: Picture) -> BoolArray:
    """(h, w) bool: pixels in which two pictures of one size are not the same."""
    return _differs(a.rgb, a.depth_mm, a.instance, b.rgb, b.depth_mm, b.instance)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _differs(
    rgb: UInt8Array, depth: UInt16Array, ids: UInt16Array, rgb_b: UInt8Array, depth_b: UInt16Array, ids_b: UInt16Array
) -> BoolArray:
    unlike = np.empty(depth.shape, dtype=np.bool_)
    for i in range(depth.shape[0]):
        for j in range(depth.shape[1]):
            same = depth[i, j] == depth_b[i, j] and ids[i, j] == ids_b[i, j]
            for c in range(3):
                same &= rgb[i, j, c] == rgb_b[i, j, c]
            unlike[i, j] = not same
    return unlike
