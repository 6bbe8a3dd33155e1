"""The rays of a picture's samples for compiled code: of any camera, of any part of it, and of its mirror image."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from hsbench.geometry.cameras import BrownCamera, Camera, EquirectangularCamera, TopDownCamera, undistorted
from hsbench.synth.render.base import Window
from hsbench.typing import FloatArray, IntArray

PLANE, LENS, SPHERE = 0, 1, 2  # models: pinhole, pinhole with Brown's distortion, equirectangular
# A camera from above is a pinhole so high that its rays lean by less than a fifth of a millimetre over 20 m and a room.
HIGH_M = 1e6

_undistorted = numba.njit(cache=True, error_model="numpy")(undistorted)


class Rays(NamedTuple):
    """Sample (i, j) looks from ``eye`` through the point (first[0] + j, first[1] + i) of the picture."""

    eye: FloatArray
    """(3,) metres, world frame."""
    axes: FloatArray
    """(3, 3) the camera's right, down and forward in rows, world frame; those of a mirror image are left-handed."""
    first: FloatArray
    """(2,) u and v of sample (0, 0), pixels."""
    model: int
    lens: FloatArray
    """(9,) fx, fy, cx, cy, k1, k2, p1, p2, k3; of a sphere fx and fy are pixels a radian."""

    def part(self, row: int, column: int) -> Rays:
        """The rays of the samples from (row, column) on."""
        return self._replace(first=self.first + (column, row))

    def mirrored(self, point: FloatArray, normal: FloatArray) -> Rays:
        """The rays of the eye's image in the plane of a point and a unit normal (3,)."""
        flip = np.eye(3) - 2.0 * np.outer(normal, normal)
        return self._replace(eye=point + flip @ (self.eye - point), axes=self.axes @ flip)

    def goes_round(self, columns: int) -> bool:
        """Whether the first of so many columns follows the last."""
        return self.model == SPHERE and columns == round(2.0 * math.pi * self.lens[0])


def rays_of(camera: Camera, world_T_camera: FloatArray, window: Window) -> Rays:
    """The rays of the pixels of a window."""
    axes, eye = np.ascontiguousarray(world_T_camera[:3, :3].T), np.ascontiguousarray(world_T_camera[:3, 3])
    first, lens = np.array([window.u0 + 0.5, window.v0 + 0.5]), np.zeros(9)
    if isinstance(camera, EquirectangularCamera):
        around = camera.width_px / (2.0 * math.pi)
        lens[:4] = around, around, camera.width_px / 2, camera.height_px / 2
        return Rays(eye, axes, first, SPHERE, lens)
    if isinstance(camera, TopDownCamera):
        ahead, left, up = axes
        lens[:4] = HIGH_M / camera.cell_m, HIGH_M / camera.cell_m, camera.width_px / 2, camera.height_px / 2
        return Rays(eye + HIGH_M * up, -np.stack([left, ahead, up]), first, PLANE, lens)
    lens[:4] = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    if isinstance(camera, BrownCamera):
        lens[4:] = camera.distortion
        return Rays(eye, axes, first, LENS, lens)
    return Rays(eye, axes, first, PLANE, lens)


@numba.njit(cache=True, error_model="numpy")
def aim(rays: Rays, i: float, j: float, ray: FloatArray) -> None:
    """Set ray (3,) to the direction of sample (i, j), between samples where these are not whole."""
    lens = rays.lens
    x, y, z = (rays.first[0] + j - lens[2]) / lens[0], (rays.first[1] + i - lens[3]) / lens[1], 1.0
    if rays.model == SPHERE:
        level, z = math.cos(y), math.cos(x) * math.cos(y)
        x, y = math.sin(x) * level, math.sin(y)
    elif rays.model == LENS:
        x, y = _undistorted(x, y, lens[4], lens[5], lens[6], lens[7], lens[8])
    for c in range(3):
        ray[c] = x * rays.axes[0, c] + y * rays.axes[1, c] + z * rays.axes[2, c]


@numba.njit(cache=True, error_model="numpy")
def directions(rays: Rays, i: IntArray, j: IntArray) -> FloatArray:
    """(N, 3) directions of samples (i, j), (N,) each."""
    found = np.empty((len(i), 3))
    for k in range(len(i)):
        aim(rays, float(i[k]), float(j[k]), found[k])
    return found
