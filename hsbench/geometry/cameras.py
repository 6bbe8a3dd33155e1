"""Camera models: pinhole with and without distortion, equirectangular, and from above; between points and pixels.

Camera frame: x right, y down, z forward; of a camera from above it is the z-up episode frame itself.
The centre of pixel (column 0, row 0) is at (0.5, 0.5). What a pixel shows at a depth is depth times its ray
(``rays``); a camera from above adds where the ray starts (``origins``). So depth of a pinhole image, distorted or not,
is the camera z coordinate, of an equirectangular image the range, and of one from above the height.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import ANGLE_DECIMALS, cos_sin, rigid, rotation_z
from hsbench.typing import AnyArray, BoolArray, FloatArray

PIXEL_DECIMALS = 9  # of a place on a sphere: the last bits of a machine's arc functions choose no pixel
NEWTON_STEPS = 8  # quadratic: the fifth is exact for lenses in use
FOLD_SAMPLES = 33  # across the picture and from its middle outwards, to see that a distortion does not fold
INVERTED = 1e-9  # what inverting a distortion may be off by, at unit depth


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

    def contains(self, pixels: FloatArray) -> BoolArray:
        """(..., 2) pixels -> (...) bool: inside the image (NaN is outside)."""
        return _inside(self, pixels)

    def rays_at(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) pixels -> (..., 3) directions, scaled so that z = 1 (not unit length)."""
        x, y = (pixels[..., 0] - self.cx_px) / self.fx_px, (pixels[..., 1] - self.cy_px) / self.fy_px
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def rays(self) -> FloatArray:
        """(height, width, 3) directions through pixel centres, scaled so that z = 1 (not unit length)."""
        return self.rays_at(pixel_centres(self.width_px, self.height_px))

    def unproject(self, depth_m: AnyArray) -> FloatArray:
        """(height, width) depth in metres -> (height, width, 3) points in the camera frame (depth 0 -> origin)."""
        return self.rays() * _depth_image(self, depth_m)[..., None]


@dataclass(frozen=True)
class BrownCamera:
    """A pinhole camera with Brown's radial and tangential distortion, in the convention of OpenCV's ``calib3d``.

    A direction (x, y, 1), r^2 = x^2 + y^2, appears where a pinhole has
    x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and for y with p1 and p2 exchanged.
    Points farther from the axis than the picture reaches are continued straight outwards and have pixels outside it.
    Raises SchemaError for values as of a pinhole, and for a distortion that folds inside the image.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def __post_init__(self) -> None:
        _ = self.pinhole
        if not np.isfinite(self.distortion).all():
            raise SchemaError(f"camera distortion k1 k2 p1 p2 k3 is {self.distortion}; expected finite numbers")
        across = [np.linspace(0.0, size, FOLD_SAMPLES) for size in (self.width_px, self.height_px)]
        pixels = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
        asked = self.pinhole.rays_at(pixels)[:, :2]
        with np.errstate(all="ignore"):
            x, y = undistorted(asked[:, 0], asked[:, 1], *self.distortion)
            gap = np.hypot(*(distorted(x, y, *self.distortion) - asked.T))
            outwards = np.linspace(0.0, 1.0, FOLD_SAMPLES)[:, None]
            turning = _determinant(outwards * x, outwards * y, *self.distortion)
        if not ((gap <= INVERTED).all() and (turning > 0.0).all()):
            raise SchemaError(
                f"camera distortion k1 k2 p1 p2 k3 {self.distortion} folds inside the image of "
                f"{self.width_px} x {self.height_px} px; expected one pixel for each direction "
                "(is the focal length that of another size?)"
            )

    @property
    def distortion(self) -> tuple[float, float, float, float, float]:
        """k1, k2, p1, p2, k3: OpenCV's order."""
        return self.k1, self.k2, self.p1, self.p2, self.k3

    @cached_property
    def pinhole(self) -> PinholeCamera:
        """The camera without its distortion."""
        return PinholeCamera(self.width_px, self.height_px, self.fx_px, self.fy_px, self.cx_px, self.cy_px)

    @cached_property
    def reach(self) -> float:
        """Distance from the axis, at unit depth, within which everything lies that the picture shows."""
        u, v = (np.linspace(0.0, size, 2 * size + 1) for size in (self.width_px, self.height_px))
        edges = [np.stack([u, np.full_like(u, at)], axis=-1) for at in (0.0, self.height_px)]
        edges += [np.stack([np.full_like(v, at), v], axis=-1) for at in (0.0, self.width_px)]
        rays = self.rays_at(np.concatenate(edges))
        return float(np.hypot(rays[:, 0], rays[:, 1]).max())

    def scaled(self, factor: float) -> BrownCamera:
        """The same view in ``factor`` times the pixels along each side, whole ones rounded down."""
        part = self.pinhole.scaled(factor)
        return BrownCamera(
            part.width_px, part.height_px, part.fx_px, part.fy_px, part.cx_px, part.cy_px, *self.distortion
        )  # fmt: skip

    def project(self, points_camera: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(..., 3) points in the camera frame -> ((..., 2) pixels u v, (...) depth_m).

        Pixels of points at or behind the camera plane are NaN.
        """
        points_camera = np.asarray(points_camera, dtype=np.float64)
        depth_m = points_camera[..., 2]
        safe = np.where(depth_m > 0, depth_m, np.nan)
        x, y = points_camera[..., 0] / safe, points_camera[..., 1] / safe
        beyond = np.maximum(np.hypot(x, y) / self.reach, 1.0)
        seen = beyond * distorted(x / beyond, y / beyond, *self.distortion)
        return np.stack([self.fx_px * seen[0] + self.cx_px, self.fy_px * seen[1] + self.cy_px], axis=-1), depth_m

    def contains(self, pixels: FloatArray) -> BoolArray:
        """(..., 2) pixels -> (...) bool: inside the image (NaN is outside)."""
        return _inside(self, pixels)

    def rays_at(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) pixels of the image -> (..., 3) directions, scaled so that z = 1 (not unit length)."""
        straight = self.pinhole.rays_at(pixels)
        x, y = undistorted(straight[..., 0], straight[..., 1], *self.distortion)
        return np.asarray(np.round(np.stack([x, y, straight[..., 2]], axis=-1), ANGLE_DECIMALS))

    def rays(self) -> FloatArray:
        """(height, width, 3) directions through pixel centres, scaled so that z = 1 (not unit length)."""
        return self.rays_at(pixel_centres(self.width_px, self.height_px))

    def unproject(self, depth_m: AnyArray) -> FloatArray:
        """(height, width) depth in metres -> (height, width, 3) points in the camera frame (depth 0 -> origin)."""
        return self.rays() * _depth_image(self, depth_m)[..., None]


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

    def scaled(self, factor: float) -> EquirectangularCamera:
        """The same view in ``factor`` times the pixels along each side, whole ones rounded down."""
        height_px = int(self.height_px * factor)
        return EquirectangularCamera(2 * height_px, height_px)

    def project(self, points_camera: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(..., 3) points in the camera frame -> ((..., 2) pixels u v, (...) range_m). The origin gives NaN pixels."""
        points_camera = np.asarray(points_camera, dtype=np.float64)
        range_m = np.linalg.norm(points_camera, axis=-1)
        safe = np.where(range_m > 0, range_m, np.nan)
        azimuth = np.where(range_m > 0, np.arctan2(points_camera[..., 0], points_camera[..., 2]), np.nan)
        elevation = np.arcsin(np.clip(-points_camera[..., 1] / safe, -1.0, 1.0))
        u = np.round((azimuth / (2 * np.pi) + 0.5) * self.width_px, PIXEL_DECIMALS)
        v = np.round((0.5 - elevation / np.pi) * self.height_px, PIXEL_DECIMALS)
        return np.stack([u % self.width_px, np.minimum(v, np.nextafter(self.height_px, 0))], axis=-1), range_m

    def contains(self, pixels: FloatArray) -> BoolArray:
        """(..., 2) pixels -> (...) bool: inside the image (NaN is outside)."""
        return _inside(self, pixels)

    def rays_at(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) pixels -> (..., 3) directions of unit length, but for rounding to 12 decimals."""
        azimuth = 2 * np.pi * (pixels[..., 0] / self.width_px - 0.5)
        elevation = np.pi * (0.5 - pixels[..., 1] / self.height_px)
        level = np.cos(elevation)
        rays = np.stack([np.sin(azimuth) * level, -np.sin(elevation), np.cos(azimuth) * level], axis=-1)
        return np.asarray(np.round(rays, ANGLE_DECIMALS))

    def rays(self) -> FloatArray:
        """(height, width, 3) unit directions through pixel centres, in the camera frame."""
        return self.rays_at(pixel_centres(self.width_px, self.height_px))

    def unproject(self, depth_m: AnyArray) -> FloatArray:
        """(height, width) range in metres -> (height, width, 3) points in the camera frame."""
        return self.rays() * _depth_image(self, depth_m)[..., None]


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

    def scaled(self, factor: float) -> TopDownCamera:
        """The same view in ``factor`` times the pixels along each side, whole ones rounded down."""
        return TopDownCamera(int(self.width_px * factor), int(self.height_px * factor), self.cell_m / factor)

    def contains(self, pixels: FloatArray) -> BoolArray:
        """(..., 2) pixels -> (...) bool: inside the image (NaN is outside)."""
        return _inside(self, pixels)

    def rays_at(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) pixels -> (..., 3) up, along which depth, the height, is counted."""
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), (*pixels.shape[:-1], 3))

    def origins_at(self, pixels: FloatArray) -> FloatArray:
        """(..., 2) pixels -> (..., 3) where their rays start, on the floor (height 0)."""
        x = (self.height_px / 2 - pixels[..., 1]) * self.cell_m
        y = (self.width_px / 2 - pixels[..., 0]) * self.cell_m
        return np.stack([x, y, np.zeros_like(x)], axis=-1)

    def rays(self) -> FloatArray:
        """(height, width, 3) up for every pixel."""
        return self.rays_at(pixel_centres(self.width_px, self.height_px))

    def origins(self) -> FloatArray:
        """(height, width, 3) where the rays of pixel centres start, on the floor."""
        return self.origins_at(pixel_centres(self.width_px, self.height_px))

    def unproject(self, height_m: AnyArray) -> FloatArray:
        """(height, width) heights in metres -> (height, width, 3) points in the z-up frame."""
        return self.origins() + self.rays() * _depth_image(self, height_m)[..., None]


CentralCamera = PinholeCamera | BrownCamera | EquirectangularCamera
"""Cameras all of whose rays start at one point."""

Camera = CentralCamera | TopDownCamera


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


def pixel_centres(width_px: int, height_px: int) -> FloatArray:
    """(height, width, 2) u and v of the centres of an image's pixels."""
    return np.stack(np.meshgrid(np.arange(width_px) + 0.5, np.arange(height_px) + 0.5), axis=-1)


def distorted(x: AnyArray, y: AnyArray, k1: float, k2: float, p1: float, p2: float, k3: float) -> FloatArray:
    """Directions (x, y, 1), x and y (...) each -> (2, ...) where a lens with Brown's distortion shows them."""
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    )


def undistorted(
    x_seen: FloatArray, y_seen: FloatArray, k1: float, k2: float, p1: float, p2: float, k3: float
) -> tuple[FloatArray, FloatArray]:
    """The inverse of ``distorted``, by Newton's method; numbers or arrays.

    Calls nothing, so that numba can compile it for callers that need single rays.
    """
    x, y = x_seen, y_seen
    for _ in range(NEWTON_STEPS):
        square = x * x + y * y
        radial = 1.0 + square * (k1 + square * (k2 + square * k3))
        slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3))
        gap_x = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x) - x_seen
        gap_y = y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y - y_seen
        xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
        yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
        xy = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
        determinant = xx * yy - xy * xy
        x, y = x - (yy * gap_x - xy * gap_y) / determinant, y - (xx * gap_y - xy * gap_x) / determinant
    return x, y


def _determinant(x: FloatArray, y: FloatArray, k1: float, k2: float, p1: float, p2: float, k3: float) -> FloatArray:
    """How much ``distorted`` stretches the area about (x, y); negative where it is turned over."""
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3))
    xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    yy = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    xy = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    return np.asarray(np.where(radial > 0.0, xx * yy - xy * xy, -1.0))


def _inside(camera: Camera, pixels: FloatArray) -> BoolArray:
    u, v = pixels[..., 0], pixels[..., 1]
    return np.asarray((u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px))


def _depth_image(camera: Camera, depth_m: AnyArray) -> FloatArray:
    """A depth image as float64. Raises SchemaError unless it has the camera's size."""
    if depth_m.shape != (camera.height_px, camera.width_px):
        raise SchemaError(
            f"depth_m has shape {depth_m.shape}; expected ({camera.height_px}, {camera.width_px}) as the camera says"
        )
    return np.asarray(depth_m, dtype=np.float64)


def _check_size(width_px: int, height_px: int) -> None:
    if not (width_px > 0 and height_px > 0):
        raise SchemaError(f"camera image is {width_px} x {height_px} px; expected a positive size")
