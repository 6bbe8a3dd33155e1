"""Which pixels a triangle can cover: a box of columns and rows for each, tight for small triangles, never too small.

Boxes are half open: (u0, v0, u1, v1) with pixel centres u + .5, v + .5 inside. Only the parts of triangles at camera z
of NEAR_M or more count for cameras with an image plane. Columns of an equirectangular image may reach beyond it on
either side by less than its width: it goes on there.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numba
import numpy as np

from hsbench.geometry.cameras import Camera, EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.synth.render.base import NEAR_M
from hsbench.typing import FloatArray, Int32Array

SLACK_PX = 1e-6  # rounding
BIN_PX = 2  # about so many pixels lie across a bin of a distorted image


@lru_cache(maxsize=2)
def ray_table(camera: Camera) -> FloatArray:
    """(height, width, 3) read-only rays of a camera, kept; (x, y, 1) of the vertical lines of one from above."""
    rays = camera.origins() + camera.rays() if isinstance(camera, TopDownCamera) else camera.rays()
    rays = np.ascontiguousarray(rays)
    rays.flags.writeable = False
    return rays


def image_boxes(camera: Camera, corners: FloatArray) -> Int32Array:
    """(T, 4) boxes of (T, 3, 3) triangles in the camera frame; an empty one where nothing is in view."""
    if isinstance(camera, EquirectangularCamera):
        return _sphere_boxes(corners, camera.width_px, camera.height_px)
    if isinstance(camera, TopDownCamera):
        pixels, _ = camera.project(corners)
        return _pixel_boxes(camera, pixels.min(axis=1), pixels.max(axis=1))
    plane = _plane_boxes(corners)
    if isinstance(camera, PinholeCamera):
        focal, middle = np.array([camera.fx_px, camera.fy_px]), np.array([camera.cx_px, camera.cy_px])
        return _pixel_boxes(camera, plane[:, :2] * focal + middle, plane[:, 2:] * focal + middle)
    return _binned_boxes(plane, *_bins(camera))


def _pixel_boxes(camera: Camera, low_px: FloatArray, high_px: FloatArray) -> Int32Array:
    size = camera.width_px, camera.height_px
    # Pixel u has its centre at u + .5.
    first = np.clip(np.ceil(low_px - 0.5 - SLACK_PX), 0, size)
    end = np.clip(np.floor(high_px - 0.5 + SLACK_PX) + 1, 0, size)
    return np.concatenate([first, end], axis=1).astype(np.int32)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _plane_boxes(corners: FloatArray) -> FloatArray:
    """(T, 4) least and greatest x / z and y / z of triangles, cut at z = NEAR_M: (x0, y0, x1, y1)."""
    boxes = np.empty((len(corners), 4))
    for t in range(len(corners)):
        low_x, low_y, high_x, high_y = math.inf, math.inf, -math.inf, -math.inf
        for k in range(3):
            a, b = corners[t, k], corners[t, (k + 1) % 3]
            for end in range(2):  # a corner, and where the edge that begins there passes NEAR_M
                x, y, z = a[0], a[1], a[2]
                if end == 1:
                    if (a[2] < NEAR_M) == (b[2] < NEAR_M):
                        continue
                    way = (NEAR_M - a[2]) / (b[2] - a[2])
                    x, y, z = x + way * (b[0] - x), y + way * (b[1] - y), NEAR_M
                if z >= NEAR_M:
                    low_x, high_x = min(low_x, x / z), max(high_x, x / z)
                    low_y, high_y = min(low_y, y / z), max(high_y, y / z)
        boxes[t, 0], boxes[t, 1], boxes[t, 2], boxes[t, 3] = low_x, low_y, high_x, high_y
    return boxes


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _sphere_boxes(corners: FloatArray, width: int, height: int) -> Int32Array:
    boxes = np.empty((len(corners), 4), dtype=np.int32)
    for t in range(len(corners)):
        start = math.atan2(corners[t, 0, 0], corners[t, 0, 2])
        azimuth, low, high = start, start, start
        down, up = math.pi / 2, -math.pi / 2  # elevations
        pole = False
        for k in range(3):
            a, b = corners[t, k], corners[t, (k + 1) % 3]
            elevation = math.atan2(-a[1], math.hypot(a[0], a[2]))
            down, up = min(down, elevation), max(up, elevation)
            turn = math.atan2(a[2] * b[0] - a[0] * b[2], a[0] * b[0] + a[2] * b[2])
            pole |= abs(turn) > math.pi - SLACK_PX or math.hypot(a[0], a[2]) == 0.0
            azimuth += turn
            low, high = min(low, azimuth), max(high, azimuth)
            # An edge is an arc of a great circle: its highest or lowest point may lie between its ends.
            n = np.cross(a, b)
            level = math.hypot(n[0], n[2])
            steepest = math.atan2(level, abs(n[1]))
            x, y, z = n[1] * n[0], -level * level, n[1] * n[2]  # towards that point, above
            along = (n[1] * a[2] - n[2] * a[1]) * x + (n[2] * a[0] - n[0] * a[2]) * y + (n[0] * a[1] - n[1] * a[0]) * z
            beyond = (n[1] * b[2] - n[2] * b[1]) * x + (n[2] * b[0] - n[0] * b[2]) * y + (n[0] * b[1] - n[1] * b[0]) * z
            if along > 0.0 > beyond:
                up = max(up, steepest)
            if along < 0.0 < beyond:
                down = min(down, -steepest)
        if pole or abs(azimuth - start) > math.pi:  # it lies above or below the camera
            low, high = -math.pi, math.pi
            n = np.cross(corners[t, 1] - corners[t, 0], corners[t, 2] - corners[t, 0])
            above = -n[1] * (n[0] * corners[t, 0, 0] + n[1] * corners[t, 0, 1] + n[2] * corners[t, 0, 2])
            if above >= 0.0:
                up = math.pi / 2
            if above <= 0.0:
                down = -math.pi / 2
        boxes[t, 0] = math.ceil((low / (2 * math.pi) + 0.5) * width - 0.5 - SLACK_PX)
        boxes[t, 1] = max(math.ceil((0.5 - up / math.pi) * height - 0.5 - SLACK_PX), 0)
        boxes[t, 2] = math.floor((high / (2 * math.pi) + 0.5) * width - 0.5 + SLACK_PX) + 1
        boxes[t, 3] = min(math.floor((0.5 - down / math.pi) * height - 0.5 + SLACK_PX) + 1, height)
    return boxes


@lru_cache(maxsize=2)
def _bins(camera: Camera) -> tuple[FloatArray, FloatArray, Int32Array]:
    """Least x / z and y / z of a camera's rays, bins for each 1 of them, and (rows, columns, 4) the box of each bin."""
    rays = ray_table(camera)
    xy = rays[..., :2] / rays[..., 2:]
    low = xy.min(axis=(0, 1))
    count = np.array([camera.width_px, camera.height_px]) // BIN_PX
    per_unit = count / (xy.max(axis=(0, 1)) - low)
    return low, per_unit, _bin_boxes(((xy - low) * per_unit).astype(np.int32), *(count + 1))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _bin_boxes(bins: Int32Array, columns: int, rows: int) -> Int32Array:
    """(rows, columns, 4) box of the pixels in each bin; bins: (h, w, 2) column and row of each pixel's."""
    boxes = np.zeros((rows, columns, 4), dtype=np.int32)
    boxes[..., :2] = np.iinfo(np.int32).max
    for v in range(bins.shape[0]):
        for u in range(bins.shape[1]):
            box = boxes[bins[v, u, 1], bins[v, u, 0]]
            box[0], box[1] = min(box[0], u), min(box[1], v)
            box[2], box[3] = max(box[2], u + 1), max(box[3], v + 1)
    return boxes


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _binned_boxes(plane: FloatArray, low: FloatArray, per_unit: FloatArray, boxes: Int32Array) -> Int32Array:
    """(T, 4) boxes of all pixels in the bins that (T, 4) boxes of x / z and y / z meet."""
    found = np.zeros((len(plane), 4), dtype=np.int32)
    rows, columns = boxes.shape[:2]
    for t in range(len(plane)):
        x0, x1 = (plane[t, 0] - low[0]) * per_unit[0] - SLACK_PX, (plane[t, 2] - low[0]) * per_unit[0] + SLACK_PX
        y0, y1 = (plane[t, 1] - low[1]) * per_unit[1] - SLACK_PX, (plane[t, 3] - low[1]) * per_unit[1] + SLACK_PX
        if not (x0 < columns and x1 >= 0.0 and y0 < rows and y1 >= 0.0):
            continue
        found[t, :2] = np.iinfo(np.int32).max
        for i in range(int(max(y0, 0.0)), int(min(y1, rows - 1.0)) + 1):
            for j in range(int(max(x0, 0.0)), int(min(x1, columns - 1.0)) + 1):
                for k in range(2):
                    found[t, k] = min(found[t, k], boxes[i, j, k])
                    found[t, k + 2] = max(found[t, k + 2], boxes[i, j, k + 2])
    return found
