"""Which pixels of a static camera's picture something can change, so that only these are drawn again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.transforms import apply, invert
from hsbench.io.frame_store import Picture
from hsbench.schema.sensor import Sensor
from hsbench.synth.render import Window
from hsbench.typing import BoolArray, FloatArray

CROP_MARGIN_PX = 2
NEAR_M = 0.05  # in front of it a vertex has a pixel


def window_of(sensor: Sensor, shapes: Sequence[tuple[FloatArray, FloatArray]]) -> Window | None:
    """The pixels that shapes can cover or shade, or None where they are out of view.

    A shape is the (V, 3) vertices of a mesh and the (C, 3) corners of a convex solid that holds all that it shades,
    world frame.
    """
    camera = sensor.camera
    assert isinstance(camera, PinholeCamera)
    camera_T_world = invert(sensor.world_T_camera)
    size = np.array([camera.width_px, camera.height_px])
    low, high = size.copy(), np.zeros(2, dtype=np.int64)
    for vertices, shaded in shapes:
        points = apply(camera_T_world, vertices)
        if points[:, 2].max() <= NEAR_M:
            continue
        if points[:, 2].min() <= NEAR_M:  # it stands against the lens
            low, high = np.zeros(2, dtype=np.int64), size
            break
        pixels, _ = camera.project(np.concatenate([points, _in_front(apply(camera_T_world, shaded))]))
        low = np.minimum(low, np.floor(pixels.min(axis=0)).astype(np.int64) - CROP_MARGIN_PX)
        high = np.maximum(high, np.ceil(pixels.max(axis=0)).astype(np.int64) + CROP_MARGIN_PX)
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    if (high <= low).any():
        return None
    return Window(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


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
    unlike = (a.depth_mm != b.depth_mm) | (a.instance != b.instance)
    for channel in range(3):
        unlike |= a.rgb[..., channel] != b.rgb[..., channel]
    return np.asarray(unlike)
