"""Skeleton files of NTU RGB+D (rose1.ntu.edu.sg/dataset/actionRecognition): several people before a Kinect v2.

Text. First line: the number of frames. A frame: the number of bodies; per body a line of ten values (identity, clipped
edges, confidence and state of the left and of the right hand, is restricted, lean x and y, tracking state), a line with
the number of joints, 25, and a line of twelve values for each joint in the order of the Kinect SDK: x y z in metres
in the kinect frame (see ``kinect_csv``), its pixel in the depth picture (512 x 424) and in the colour picture
(1920 x 1080), a quaternion w x y z, and the state: 0 not tracked, 1 inferred, 2 tracked. Frames without a body occur,
the order of bodies may change, pixels may be no number. There are no time stamps: frames come at 30 Hz. Identities
become tracks by first appearance. Lean, hands, clipping and orientations have no place in the schema and are not
returned.

The SDK's pictures are mirrored: u grows with x, to the sensor's own left. ``depth_camera`` is of the picture that is
not (``kinect_bodies.unmirrored``): to lay a picture of the data set under the joints, flip it left to right.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.datasets.importers.kinect_bodies import (
    MAX_BODIES,
    KinectBodies,
    checked_joints,
    track_numbers,
    unmirrored,
)
from hsbench.datasets.importers.kinect_csv import JOINT_COUNT, TRACKED
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.io.reading import read_limited
from hsbench.schema.episode import NS_PER_S
from hsbench.typing import FloatArray

RATE_HZ = 30
BODY_FIELDS, JOINT_FIELDS = 10, 12
MAX_FRAMES = 10_000  # five and a half minutes; the longest clip of NTU RGB+D lasts ten seconds
MAX_BYTES = 2**26
MAX_LINES = 1 + MAX_FRAMES * (1 + MAX_BODIES * (2 + JOINT_COUNT))
MAX_IDENTITY = 2**64 - 1
MAX_PIXEL = 10_000.0  # the SDK gives -inf for what is behind the sensor; a pixel this far away is none

MIN_DEPTH_M = 0.1  # the sensor sees from half a metre on
INTRINSICS_DECIMALS = 3  # of a pixel: the last bits of a machine's sums do not reach the episode
MIN_FITTED = 50  # two bodies' joints; with fewer, two unknowns an axis follow the noise
MAX_RESIDUAL_PX = 1.0
"""Median distance from a joint's pixel to where the fitted camera shows it: 0.01 to 0.1 px in NTU's own files."""


@dataclass(frozen=True, eq=False)
class NtuRecording:
    """``bodies``, and for each row the (R, 25, 2) float64 pixels of its joints in the SDK's mirrored pictures.

    Pixels that the file does not give are NaN.
    """

    bodies: KinectBodies
    depth_px: FloatArray
    colour_px: FloatArray


class _Lines:
    """The lines of a text, one after the other, each with its place for messages."""

    def __init__(self, path: Path, lines: list[str]) -> None:
        self.path, self.lines, self.next = path, lines, 0

    @property
    def where(self) -> str:
        """The line that was taken last."""
        return f"{self.path}: line {self.next}"

    def take(self, wanted: str) -> str:
        if self.next == len(self.lines):
            raise DataError(f"{self.path}: ends after line {self.next}; expected {wanted} (an incomplete copy?)")
        self.next += 1
        return self.lines[self.next - 1]

    def count(self, what: str, largest: int) -> int:
        text = self.take(f"the number of {what}").strip()
        if not (text.isdecimal() and len(text) < 10 and int(text) <= largest):
            raise DataError(f"{self.where}: {text[:20]!r} {what}; expected a whole number of 0 to {largest:,}")
        return int(text)

    def fields(self, what: str, count: int) -> list[str]:
        """The fields of a line with ``count`` of them."""
        fields = self.take(what).split(maxsplit=count)
        if len(fields) != count:
            found = f"{len(fields)} values" if len(fields) < count else f"more than {count} values"
            raise DataError(f"{self.where}: {found}; expected {count} of {what} (an incomplete copy?)")
        return fields


def read_ntu_skeleton(path: str | Path) -> NtuRecording:
    """Path of a ``.skeleton`` file -> its bodies and their pixels.

    Raises DataError, naming the line, for a file that ends early or late, counts that do not fit, values that are no
    numbers or no metres, unknown states, and an identity given twice in a frame; and for a file without any body.
    """
    lines = _Lines(Path(path), _read_lines(Path(path)))
    frames = lines.count("frames", MAX_FRAMES)
    times, identities = [], []
    values: list[FloatArray] = []
    for frame in range(frames):
        bodies = [_body(lines) for _ in range(lines.count("bodies", MAX_BODIES))]
        named = [identity for identity, _ in bodies]
        if len(set(named)) != len(named):
            raise DataError(f"{lines.where}: an identity occurs twice in frame {frame}; expected different bodies")
        times += [round(frame * NS_PER_S / RATE_HZ)] * len(bodies)
        identities += named
        values += [joints for _, joints in bodies]
    if lines.next < len(lines.lines):
        raise DataError(
            f"{path}: line {lines.next + 1}: more lines after the last of {frames} frames; expected the end"
        )
    if not values:
        raise DataError(f"{path}: {frames} frames without any body; expected somebody (a sample of missing skeletons?)")
    tracks = track_numbers(identities)
    order = np.lexsort((tracks, np.array(times)))
    joints = np.stack(values)[order]
    bodies_found = KinectBodies(
        timestamp_ns=np.array(times, dtype=np.int64)[order],
        track_id=tracks[order],
        joints_kinect_m=joints[..., :3],
        state=joints[..., 7].astype(np.uint8),
        end_ns=round((frames - 1) * NS_PER_S / RATE_HZ),
    )
    return NtuRecording(bodies_found, joints[..., 3:5], joints[..., 5:7])


def depth_camera(recording: NtuRecording) -> PinholeCamera | None:
    """The depth camera, unmirrored, from where it saw the tracked joints; None if too few have a pixel.

    Least squares: u = cx + fx x / z and v = cy - fy y / z, which is linear in the unknowns.
    Raises DataError if the pixels do not follow from any such camera.
    """
    x, y, z = np.moveaxis(recording.bodies.joints_kinect_m, -1, 0)
    u, v = recording.depth_px[..., 0], recording.depth_px[..., 1]
    used = (recording.bodies.state == TRACKED) & np.isfinite(u) & np.isfinite(v) & (z >= MIN_DEPTH_M)
    if used.sum() < MIN_FITTED:
        return None
    (fx, cx), residual_u = _fitted(x[used] / z[used], u[used])
    (fy, cy), residual_v = _fitted(-y[used] / z[used], v[used])
    if not (fx > 0 and fy > 0 and np.median(np.hypot(residual_u, residual_v)) <= MAX_RESIDUAL_PX):
        found = f"focal lengths {fx:.1f} and {fy:.1f} px leave {np.median(np.hypot(residual_u, residual_v)):.1f} px"
        raise DataError(
            f"joints and depth pixels do not fit: {found}; expected at most {MAX_RESIDUAL_PX:g} px (columns?)"
        )
    return unmirrored(*(round(value, INTRINSICS_DECIMALS) for value in (fx, fy, cx, cy)))


def _fitted(at: FloatArray, seen_px: FloatArray) -> tuple[tuple[float, float], FloatArray]:
    """Slope and offset of the straight line through points, and what it leaves of each."""
    slope = float(np.cov(at, seen_px)[0, 1] / max(np.var(at, ddof=1), np.finfo(np.float64).tiny))
    offset = float(np.mean(seen_px) - slope * np.mean(at))
    return (slope, offset), seen_px - slope * at - offset


def _body(lines: _Lines) -> tuple[int, FloatArray]:
    """A body -> (identity, (25, 8): x y z m, depth u v px, colour u v px, state)."""
    header = lines.fields("a body", BODY_FIELDS)
    identity = header[0]
    if not (identity.isdecimal() and len(identity) <= 20 and int(identity) <= MAX_IDENTITY):
        raise DataError(f"{lines.where}: identity is {identity[:30]!r}; expected a whole number (a line too many?)")
    _floats(lines.where, header[1:])
    joint_count = lines.count("joints", 2**15)
    if joint_count != JOINT_COUNT:
        raise DataError(f"{lines.where}: {joint_count} joints; expected {JOINT_COUNT} (another sensor's skeleton?)")
    rows = np.empty((JOINT_COUNT, JOINT_FIELDS))
    first = lines.next + 1
    for joint in range(JOINT_COUNT):
        rows[joint] = _floats(f"{lines.path}: line {lines.next + 1}", lines.fields("a joint", JOINT_FIELDS))
    xyz_m, state = checked_joints(f"{lines.path}: lines {first}-{lines.next}", rows[:, :3], rows[:, 11])
    pixels = np.where(np.abs(rows[:, 3:7]) <= MAX_PIXEL, rows[:, 3:7], np.nan)
    return int(identity), np.concatenate([xyz_m, pixels, state[:, None]], axis=1)


def _floats(where: str, fields: list[str]) -> FloatArray:
    try:
        return np.array(fields, dtype=np.float64)
    except ValueError as error:
        raise DataError(f"{where}: {str(error)[:80]}; expected numbers only") from error


def _read_lines(path: Path) -> list[str]:
    data = read_limited(path, MAX_BYTES, "a different file?")
    try:
        text = data.decode("ascii").rstrip()
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: byte {error.start} is not ASCII; expected text (a binary or UTF-16 file?)") from error
    if not text:
        raise DataError(f"{path}: is empty; expected the number of frames")
    # Counted before the lines are cut, so that memory stays within what the limit allows.
    line_count = text.count("\n") + 1
    if line_count > MAX_LINES:
        raise DataError(f"{path}: {line_count:,} lines; expected at most {MAX_LINES:,}")
    return text.split("\n")
