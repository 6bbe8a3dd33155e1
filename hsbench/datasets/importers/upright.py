"""From the camera of a capture to its episode frame: which way is up, where the floor is, numbers in text files.

A capture's *upright frame* is right-handed with z up, its origin in the camera. The episode frame is that frame moved
to the floor below the camera and turned about z, so that x is the camera's heading.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from hsbench.errors import DataError
from hsbench.geometry import transforms
from hsbench.geometry.footprints import hull
from hsbench.geometry.numerics import quantise_m
from hsbench.io.reading import read_limited
from hsbench.typing import BoolArray, FloatArray

ROTATION_TOLERANCE = 1e-3
"""What entries of a rotation printed with three to six digits may be off by."""

MIN_HORIZONTAL_HEADING = 0.05  # of a unit vector: less is within 3 degrees of straight up or down
LOWEST_PERCENT = 1.0
"""Share of depth points below the floor that are noise: VoteNet's floor is its 0.99 %."""
FLOOR_BAND_M = 0.05
MAX_TEXT_BYTES = 1 << 16
SHOWN = 40
"""Characters of a wrong value in a message."""


def rotation(matrix: FloatArray, where: str) -> FloatArray:
    """The (3, 3) rotation nearest to a printed one, to 12 decimals.

    Raises DataError, starting with ``where``, if the matrix is none.
    """
    if not transforms.is_rigid(transforms.rigid(matrix, (0.0, 0.0, 0.0)), ROTATION_TOLERANCE):
        raise DataError(f"{where} {np.round(matrix, 3).tolist()} is no rotation; expected one (scaled, or mirrored?)")
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(np.round(u @ vt, transforms.ANGLE_DECIMALS))


def to_episode_frame(upright_R_camera: FloatArray, floor_m: float) -> tuple[FloatArray, FloatArray]:
    """(3, 3) camera (x right, y down, z forward) to upright, and z of the floor in it, < 0
    -> (``episode_T_camera`` (4, 4), ``episode_T_upright`` (4, 4)).

    Raises DataError if the camera looks straight up or down, where no heading exists, or lies below the floor.
    """
    if not floor_m < 0:
        raise DataError(f"the floor is {floor_m:.2f} m above the camera; expected it below (upside down?)")
    upright_T_camera = transforms.rigid(upright_R_camera, (0.0, 0.0, 0.0))
    episode_T_upright = below_camera(upright_T_camera, floor_m)
    return episode_T_upright @ upright_T_camera, episode_T_upright


def below_camera(world_T_camera: FloatArray, floor_m: float) -> FloatArray:
    """(4, 4) pose of a camera in a world with z up, and z of its floor -> (4, 4) ``episode_T_world``.

    The episode frame has its origin on the floor below the camera, z up, x along the optical axis laid on the floor, y
    left. Raises DataError if the camera looks straight up or down, where no heading exists.
    """
    heading = world_T_camera[:2, 2]
    length = math.hypot(*heading)
    if length < MIN_HORIZONTAL_HEADING:
        raise DataError(f"the camera looks along {world_T_camera[:3, 2].round(3).tolist()}; expected a heading")
    c, s = heading / length
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return transforms.rigid(turn, -turn @ np.array([*world_T_camera[:2, 3], floor_m]))


def floor_level(heights_m: FloatArray) -> float:
    """(N,) heights of what a camera sees -> that of the floor: the median within 5 cm of the lowest percent's top.

    Right where the floor is seen, else the level of the lowest thing. Rounded to .1 mm. Raises DataError for none.
    """
    if not len(heights_m):
        raise DataError("the depth image has no reading at all; expected metres somewhere")
    low = np.percentile(heights_m, LOWEST_PERCENT)
    return float(quantise_m(np.median(heights_m[np.abs(heights_m - low) <= FLOOR_BAND_M])))


def near_floor(heights_m: FloatArray, floor_m: float) -> BoolArray:
    """(N,) bool: within 5 cm of the floor."""
    return np.asarray(np.abs(heights_m - floor_m) <= FLOOR_BAND_M)


def seen_outline(points_xy: FloatArray) -> FloatArray:
    """(N, 2) what is seen, around the camera at (0, 0) -> the (H, 2) convex hull of both, rounded to .1 mm."""
    return hull(quantise_m(np.concatenate([points_xy, np.zeros((1, 2))])))


def read_text(path: Path, limit: int = MAX_TEXT_BYTES) -> str:
    """A text file of at most ``limit`` bytes. Raises DataError naming it."""
    try:
        return read_limited(path, limit, "another file?").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: is no text at byte {error.start}; expected numbers") from error


def numbers(tokens: list[str], where: str) -> FloatArray:
    """(n,) finite float64 of printed numbers. Raises DataError, starting with ``where``, for the first that is none."""
    values = []
    for index, token in enumerate(tokens):
        try:
            value = math.nan if "_" in token else float(token)  # Python's own reader takes 1_000
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise DataError(f"{where}: value {index + 1} is {ascii(token)[:SHOWN]}; expected a finite number")
        values.append(value)
    return np.array(values, dtype=np.float64)
