"""The sensor of an episode: what kind, its camera, and where the camera stands in the episode frame.

Episode frame: origin on the floor below the camera, z up, x along the camera's heading, y left. So height
and tilt say everything; the heading with respect to the walls is nowhere. A view from above is of that frame itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import (
    BrownCamera,
    Camera,
    EquirectangularCamera,
    PinholeCamera,
    TopDownCamera,
    world_T_camera,
)
from hsbench.typing import FloatArray

CAMERAS_OF_KIND: dict[str, tuple[type, ...]] = {
    "rgbd": (PinholeCamera, BrownCamera),
    "monocular": (PinholeCamera, BrownCamera),
    "equirectangular": (EquirectangularCamera,),
    "topdown": (TopDownCamera,),
}


@dataclass(frozen=True)
class Sensor:
    """A static sensor.

    kind: ``rgbd``, ``monocular``, ``equirectangular`` or ``topdown``.
    camera: the matching camera model.
    height_m: metres above the floor; None where it is not given (360 episodes: it is truth).
    tilt_rad: downward tilt in radians, in [-pi/2, pi/2].
    roll_rad: turn about the forward axis, in [-pi, pi]; 0 for generated sensors, real ones lean a little.
    Raises SchemaError if kind and camera do not fit, or a value is out of range.
    """

    kind: str
    camera: Camera
    height_m: float | None
    tilt_rad: float = 0.0
    roll_rad: float = 0.0

    def __post_init__(self) -> None:
        fitting = CAMERAS_OF_KIND.get(self.kind)
        if fitting is None:
            raise SchemaError(f"sensor.kind is {self.kind!r}; expected one of {', '.join(CAMERAS_OF_KIND)}")
        if not isinstance(self.camera, fitting):
            expected = " or ".join(kind.__name__ for kind in fitting)
            raise SchemaError(
                f"sensor.camera is a {type(self.camera).__name__}; expected {expected} for kind {self.kind!r}"
            )
        if self.height_m is not None and not (np.isfinite(self.height_m) and 0.0 < self.height_m < 100.0):
            raise SchemaError(f"sensor.height_m is {self.height_m}; expected 0..100 m (is it in millimetres?)")
        if not (np.isfinite(self.tilt_rad) and abs(self.tilt_rad) <= np.pi / 2):
            raise SchemaError(f"sensor.tilt_rad is {self.tilt_rad}; expected -pi/2..pi/2 (is it in degrees?)")
        if not (np.isfinite(self.roll_rad) and abs(self.roll_rad) <= np.pi):
            raise SchemaError(f"sensor.roll_rad is {self.roll_rad}; expected -pi..pi (is it in degrees?)")

    @property
    def world_T_camera(self) -> FloatArray:
        """(4, 4) camera to episode frame; from above they are the same.

        Raises SchemaError where the camera height is needed and not given.
        """
        if isinstance(self.camera, TopDownCamera):
            return np.eye(4)
        if self.height_m is None:
            raise SchemaError("sensor.height_m is not given, so metric episode coordinates of the camera are unknown")
        return world_T_camera(self.height_m, self.tilt_rad, self.roll_rad)
