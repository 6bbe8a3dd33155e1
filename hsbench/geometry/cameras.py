"""Camera models: pinhole and equirectangular, between points in the camera frame and pixels.

Camera frame: x right, y down, z forward. The centre of pixel (column 0, row 0) is at (0.5, 0.5).
``depth`` of a pinhole image is the camera z coordinate; of an equirectangular image it is the range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import cos_sin, rigid, rotation_z
from hsbench.typing import AnyArray, FloatArray


@dataclass(frozen=True)
class PinholeCamera:
    """An ideal pinhole camera. Focal lengths and principal point are in pixels.

    Raises SchemaError for sizes or focal lengths that are not positive and finite.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float

    def __post_init__(self) -> None:
        _check_size(self.width_px, self.height_px)
        for name in ("fx_px", "fy_px"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise SchemaError(f"camera.{name} is {value}; expected a positive finite number of pixels")
        if not np.isfinite([self.cx_px, self.cy_px]).all():
            raise SchemaError(f"camera principal point is ({self.cx_px}, {self.cy_px}); expected finite pixels")

    def scaled(self, factor: float) -> PinholeCamera:
        """The same view in ``factor`` times the pixels along each side, whole ones rounded down."""
        return PinholeCamera(
            int(self.width_px * factor), int(self.height_px * factor),
            self.fx_px * factor, self.fy_px * factor, self.cx_px * factor, self.cy_px * factor,
        )  # fmt: skip

    def project(self, points_camera: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(..., 3) points in the camera frame -> ((..., 2) pixels u v, (...) depth_m).

        Pixels of points at or behind the camera plane are NaN.
        """
        points_camera = np.asarray(points_camera, dtype=np.float64)
        depth_m = points_camera[..., 2]
        safe = np.where(depth_m > 0, depth_m, np.nan)
        u = self.fx_px * points_camera[..., 0] / safe + self.cx_px
        v = self.fy_px * points_camera[..., 1] / safe + self.cy_px
        return np.stack([u, v], axis=-1), depth_m

    def contains(self, pixels: FloatArray) -> AnyArray:
        """(..., 2) pixels -> (...) bool: inside the image (NaN is outside)."""
        u, v = pixels[..., 0], pixels[..., 1]
        return np.asarray((u >= 0) & (u < self.width_px) & (v >= 0) & (v < self.height_px))

    def rays(self) -> FloatArray:
        """(height, width, 3) directions through pixel centres, scaled so that z = 1 (not unit length)."""
        u = (np.arange(self.width_px) + 0.5 - self.cx_px) / self.fx_px
        v = (np.arange(self.height_px) + 0.5 - self.cy_px) / self.fy_px
        rays = np.ones((self.height_px, self.width_px, 3))
        rays[..., 0] = u[None, :]
        rays[..., 1] = v[:, None]
        return rays

    def unproject(self, depth_m: AnyArray) -> FloatArray:
        """(height, width) depth in metres -> (height, width, 3) points in the camera frame (depth 0 -> origin)."""
        return _along_rays(self, depth_m)


@dataclass(frozen=True)
class EquirectangularCamera:
    """A full-sphere camera: azimuth 0 in the middle column, growing right; elevation +90 degrees at the top."""

    width_px: int
    height_px: int

    def __post_init__(self) -> None:
        _check_size(self.width_px, self.height_px)
        if self.width_px != 2 * self.height_px:
            raise SchemaError(
                f"equirectangular camera is {self.width_px} x {self.height_px} px; expected width = 2 height"
            )

    def project(self, points_camera: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(..., 3) points in the camera frame -> ((..., 2) pixels u v, (...) range_m). The origin gives NaN pixels."""
        points_camera = np.asarray(points_camera, dtype=np.float64)
        range_m = np.linalg.norm(points_camera, axis=-1)
        safe = np.where(range_m > 0, range_m, np.nan)
        azimuth = np.where(range_m > 0, np.arctan2(points_camera[..., 0], points_camera[..., 2]), np.nan)
        elevation = np.arcsin(np.clip(-points_camera[..., 1] / safe, -1.0, 1.0))
        u = (azimuth / (2 * np.pi) + 0.5) * self.width_px
        v = (0.5 - elevation / np.pi) * self.height_px
        return np.stack([u % self.width_px, np.minimum(v, np.nextafter(self.height_px, 0))], axis=-1), range_m

    def rays(self) -> FloatArray:
        """(height, width, 3) unit directions through pixel centres, in the camera frame."""
        azimuth = 2 * np.pi * (np.arange(self.width_px) + 0.5) / self.width_px - np.pi
        elevation = np.pi / 2 - np.pi * (np.arange(self.height_px) + 0.5) / self.height_px
        cos_e = np.cos(elevation)[:, None]
        x = np.sin(azimuth)[None, :] * cos_e
        y = np.broadcast_to(-np.sin(elevation)[:, None], x.shape)
        z = np.cos(azimuth)[None, :] * cos_e
        return np.stack([x, y, z], axis=-1)

    def unproject(self, depth_m: AnyArray) -> FloatArray:
        """(height, width) range in metres -> (height, width, 3) points in the camera frame."""
        return _along_rays(self, depth_m)


@dataclass(frozen=True)
class TopDownCamera:
    """An orthographic view from above: row 0 is the largest x (forward), column 0 the largest y (left).

    ``cell_m`` is the side of a square pixel in metres; the image is centred on the frame's origin.
    """

    width_px: int
    height_px: int
    cell_m: float

    def __post_init__(self) -> None:
        _check_size(self.width_px, self.height_px)
        if not (np.isfinite(self.cell_m) and self.cell_m > 0):
            raise SchemaError(f"camera.cell_m is {self.cell_m}; expected a positive finite number of metres")

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(..., 3) points in the z-up episode frame -> ((..., 2) pixels u v, (...) height z in metres)."""
        points = np.asarray(points, dtype=np.float64)
        u = self.width_px / 2 - points[..., 1] / self.cell_m
        v = self.height_px / 2 - points[..., 0] / self.cell_m
        return np.stack([u, v], axis=-1), points[..., 2]


Camera = PinholeCamera | EquirectangularCamera | TopDownCamera


def world_T_camera(height_m: float, tilt_rad: float, roll_rad: float = 0.0) -> FloatArray:
    """(4, 4) pose of a camera in its episode frame: above the origin, heading +x, tilted down by ``tilt_rad``,
    then turned by ``roll_rad`` about its forward axis (right-handed: the right side of the camera goes down).

    The episode frame has its origin on the floor below the camera, z up, x along the heading, y left.
    """
    c, s = cos_sin(tilt_rad)
    right = [0.0, -1.0, 0.0]
    down = [-s, 0.0, -c]
    forward = [c, 0.0, -s]
    return rigid(np.array([right, down, forward]).T @ rotation_z(roll_rad), (0.0, 0.0, height_m))


def _along_rays(camera: PinholeCamera | EquirectangularCamera, depth_m: AnyArray) -> FloatArray:
    """(h, w, 3) the camera's rays times a depth image of its size. Raises SchemaError for another size."""
    if depth_m.shape != (camera.height_px, camera.width_px):
        raise SchemaError(
            f"depth_m has shape {depth_m.shape}; expected ({camera.height_px}, {camera.width_px}) as the camera says"
        )
    return camera.rays() * np.asarray(depth_m, dtype=np.float64)[..., None]


def _check_size(width_px: int, height_px: int) -> None:
    if not (width_px > 0 and height_px > 0):
        raise SchemaError(f"camera image is {width_px} x {height_px} px; expected a positive size")
