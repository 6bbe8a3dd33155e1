"""Places in a picture as a lens without distortion would have shown them: homographies join those alone."""

from __future__ import annotations

import numpy as np

from hsbench.geometry.cameras import BrownCamera, Camera
from hsbench.typing import FloatArray


def straight(camera: Camera, pixels: FloatArray) -> FloatArray:
    """(..., 2) places in the camera's picture -> those in the picture of a pinhole with the same focal lengths."""
    if not isinstance(camera, BrownCamera):
        return pixels
    return np.asarray(camera.rays_at(pixels)[..., :2] * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px))


def bent(camera: Camera, pixels: FloatArray) -> FloatArray:
    """The inverse of ``straight``; NaN stays NaN."""
    if not isinstance(camera, BrownCamera):
        return pixels
    return camera.project(camera.pinhole.rays_at(pixels))[0]
