"""What recordings of several people by a Kinect v2 have in common: bodies in the kinect frame, and their episode.

The kinect frame (metres, x to the sensor's own left, y up, z ahead) and how height and tilt of a sensor are estimated
from standing people are those of ``kinect_csv``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsbench.datasets.importers import kinect_csv
from hsbench.errors import DataError
from hsbench.geometry import transforms
from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.skeletons import KINECT_V2
from hsbench.typing import FloatArray, Int32Array, IntArray, UInt8Array

MAX_BODIES = 6
"""People that a Kinect v2 tracks at a time (BODY_COUNT of the SDK)."""

KINECT_T_CAMERA = transforms.rigid(np.diag([-1.0, -1.0, 1.0]), (0.0, 0.0, 0.0))
"""Our camera frame (x right, y down, z forward) in the kinect frame: half a turn about z, and its own inverse."""

DEPTH_WIDTH_PX, DEPTH_HEIGHT_PX = 512, 424


@dataclass(frozen=True, eq=False)
class KinectBodies:
    """R bodies, ordered by time, then track; and when the recording ends, with or without a body.

    ``timestamp_ns`` (R,) int64; ``track_id`` (R,) int32 from 1; ``joints_kinect_m`` (R, 25, 3) float64, NaN where not
    tracked; ``state`` (R, 25) uint8 of ``JointState``; ``end_ns`` int, the time of the last frame.
    """

    timestamp_ns: IntArray
    track_id: Int32Array
    joints_kinect_m: FloatArray
    state: UInt8Array
    end_ns: int

    def poses(self, episode_T_kinect: FloatArray) -> PoseTable:
        """The bodies in the episode frame, (4, 4) ``episode_T_kinect`` away. Raises SchemaError as ``PoseTable``."""
        joints_m = transforms.apply(episode_T_kinect, self.joints_kinect_m).astype(np.float32)
        return PoseTable(KINECT_V2.name, self.timestamp_ns, self.track_id, self.state, joints_m)


def unmirrored(fx_px: float, fy_px: float, cx_px: float, cy_px: float) -> PinholeCamera:
    """The depth camera of a picture that is not mirrored, from the constants of the SDK's, which is.

    There u grows with x, to the sensor's own left, and whole numbers are centres of pixels: what it shows at (u, v)
    lies at (512 - u - 1/2, v + 1/2) here.
    """
    return PinholeCamera(DEPTH_WIDTH_PX, DEPTH_HEIGHT_PX, fx_px, fy_px, DEPTH_WIDTH_PX - cx_px - 0.5, cy_px + 0.5)


def checked_joints(where: str, xyz_m: FloatArray, state: FloatArray) -> tuple[FloatArray, UInt8Array]:
    """(25, 3) coordinates and (25,) states as a file gives them -> the same with NaN where not tracked, and uint8.

    Raises DataError, starting with ``where``, for other states than 0, 1, 2 and for coordinates no Kinect gives.
    """
    known = (state == 0) | (state == 1) | (state == 2)
    if not known.all():
        joint = int(np.argmin(known))
        raise DataError(f"{where}: joint {joint} has state {state[joint]:g}; expected 0, 1 or 2 (shifted columns?)")
    missing = state == JointState.MISSING
    possible = missing | (np.abs(xyz_m) <= kinect_csv.MAX_COORDINATE_M).all(axis=-1)
    if not possible.all():
        joint = int(np.argmin(possible))
        raise DataError(
            f"{where}: joint {joint} lies at {xyz_m[joint].tolist()}; expected metres, at most"
            f" {kinect_csv.MAX_COORDINATE_M:g} away (millimetres?)"
        )
    return np.where(missing[:, None], np.nan, xyz_m), state.astype(np.uint8)


def estimate_camera(bodies: KinectBodies) -> tuple[float, float]:
    """(``height_m``, ``tilt_rad``) of the sensor, from whoever stands: the method of ``kinect_csv``.

    Raises DataError if too few rows show a standing person with tracked feet.
    """
    rows = kinect_csv.KinectRecording(bodies.timestamp_ns, bodies.joints_kinect_m, bodies.state)
    return kinect_csv.estimate_camera(rows)


def track_numbers(identities: list[int]) -> Int32Array:
    """(R,) a recorder's identities -> (R,) int32 tracks 1, 2, ... in the order of first appearance."""
    numbers = {identity: number for number, identity in enumerate(dict.fromkeys(identities), start=1)}
    return np.array([numbers[identity] for identity in identities], dtype=np.int32)
