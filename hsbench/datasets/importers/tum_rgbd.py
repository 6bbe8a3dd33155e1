"""TUM RGB-D sequences (J. Sturm et al., IROS 2012): folders of colour and depth pictures, and where the camera was.

    rgb.txt, depth.txt     a line a picture: seconds, file name; lines that start with # are comments
    groundtruth.txt        seconds tx ty tz qx qy qz qw: camera (x right, y down, z forward) to world, z up

Depth PNG: 5000 a metre, 0 = none, pixel by pixel on the colour picture. Colour and depth were taken at different times.
They are paired by the data set's own rule (its ``associate.py``): pairs at most 20 ms apart, the nearest first, each
picture once. A frame has the exact time of its colour picture, and the pose nearest to it within the same 20 ms.

Our sensors stand still, and most of these cameras do not. What is read is the first stretch of at least ``MIN_FRAMES``
pictures during which the camera stays within ``STILL_M`` and ``STILL_RAD`` of where it was at the stretch's beginning.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path, PurePosixPath

import numpy as np

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.bounded_images import read_colour, read_grey16
from hsbench.errors import DataError
from hsbench.geometry.cameras import BrownCamera, PinholeCamera
from hsbench.geometry.transforms import matrix_from_quaternion
from hsbench.schema.episode import NS_PER_S, Frame
from hsbench.typing import FloatArray, IntArray

UNITS_PER_M = np.float32(5000.0)
MAX_APART_NS = 20_000_000
"""``max_difference`` of associate.py."""

MIN_FRAMES = 30  # a second
STILL_M = 0.02
STILL_RAD = math.radians(1.0)
"""A hand-held sensor that is meant to stay, as in freiburg3_sitting_static, sways by about this much."""

UNIT_QUATERNION = 1e-2  # printed with four decimals
MAX_POSITION_M = 100.0
MAX_SECONDS = 10**10  # some hundred years
MAX_LIST_BYTES = 32 << 20
MAX_LINES = 500_000

_HALF = 0.5  # their first pixel has its centre at 0, ours at 0.5
CAMERAS: dict[str, PinholeCamera | BrownCamera] = {
    "freiburg1": BrownCamera(
        640, 480, 517.306408, 516.469215, 318.643040 + _HALF, 255.313989 + _HALF,
        0.262383, -0.953104, -0.005358, 0.002628, 1.163314,
    ),
    "freiburg2": BrownCamera(
        640, 480, 520.908620, 521.007327, 325.141442 + _HALF, 249.701764 + _HALF,
        0.231222, -0.784899, -0.003257, -0.000105, 0.917205,
    ),
    "freiburg3": PinholeCamera(640, 480, 535.4, 539.2, 320.1 + _HALF, 247.6 + _HALF),
    "ros-default": PinholeCamera(640, 480, 525.0, 525.0, 319.5 + _HALF, 239.5 + _HALF),
}  # fmt: skip
"""The colour cameras by the data set's own calibration; pictures of the third were undistorted before release."""

_SECONDS = re.compile(r"\d{1,11}(\.\d{0,12})?", re.ASCII)


@dataclass(frozen=True, eq=False)
class TumFrames:
    """Frames of a folder, decoded when indexed. timestamps_ns: (n,) int64 from the first; rgb, depth: file names."""

    folder: Path
    timestamps_ns: IntArray
    rgb: tuple[str, ...]
    depth: tuple[str, ...]
    size_px: tuple[int, int]

    def __len__(self) -> int:
        return len(self.timestamps_ns)

    def __getitem__(self, index: int) -> Frame:
        index = range(len(self))[index]
        rgb_path, depth_path = self.folder / self.rgb[index], self.folder / self.depth[index]
        rgb, depth = read_colour(rgb_path), read_grey16(depth_path)
        for path, shape in ((rgb_path, rgb.shape[:2]), (depth_path, depth.shape)):
            if shape[::-1] != self.size_px:
                raise DataError(f"{path}: {shape[1]} x {shape[0]} px; expected {self.size_px} (another camera?)")
        return Frame(int(self.timestamps_ns[index]), rgb, depth.astype(np.float32) / UNITS_PER_M)


@dataclass(frozen=True, eq=False)
class TumSequence:
    """The first stretch of a sequence without motion.

    upright_R_camera: (3, 3) at its beginning. first: number of its first pair; pairs: of the sequence. sway_m: how far
    the camera strays in the stretch. unposed: pairs without a pose, which are left out.
    """

    camera: PinholeCamera | BrownCamera
    frames: TumFrames
    upright_R_camera: FloatArray
    first: int
    pairs: int
    unposed: int
    sway_m: float


def read_tum_rgbd(folder: str | Path, camera: str | None = None) -> TumSequence:
    """A sequence folder -> its first stretch without motion. camera: a name of ``CAMERAS``; default: by the folder's.

    Raises DataError, naming the file and the line, for damage, for no pairs, and for a camera that never stands still.
    """
    folder = Path(folder)
    model = CAMERAS[camera_name(folder) if camera is None else camera]
    rgb_ns, rgb = _pictures(folder / "rgb.txt")
    depth_ns, depth = _pictures(folder / "depth.txt")
    pose_ns, poses = _poses(folder / "groundtruth.txt")
    try:
        pairs = associate(rgb_ns, depth_ns)
    except DataError as error:
        raise DataError(f"{folder}: {error}") from error
    if not len(pairs):
        raise DataError(f"{folder}: no colour and depth picture within 20 ms; expected pairs (of one sequence?)")
    pose = nearest(rgb_ns[pairs[:, 0]], pose_ns)
    posed = pose >= 0
    kept, pose = pairs[posed], pose[posed]
    start, end = _still(folder, poses[pose])
    kept, pose = kept[start:end], pose[start:end]
    stamps = rgb_ns[kept[:, 0]]
    sway = np.linalg.norm(poses[pose, :3] - poses[pose[0], :3], axis=1).max()
    return TumSequence(
        camera=model,
        frames=TumFrames(
            folder,
            stamps - stamps[0],
            tuple(rgb[i] for i in kept[:, 0]),
            tuple(depth[i] for i in kept[:, 1]),
            (model.width_px, model.height_px),
        ),
        upright_R_camera=np.round(matrix_from_quaternion(poses[pose[0], [6, 3, 4, 5]]), 12),
        first=int(np.flatnonzero(posed)[start]),
        pairs=len(pairs),
        unposed=int((~posed).sum()),
        sway_m=float(sway),
    )


def camera_name(folder: Path) -> str:
    """The camera that a folder's name tells, as in rgbd_dataset_freiburg3_sitting_static. Raises DataError if none."""
    name = folder.resolve().name
    found = [key for key in CAMERAS if key in name]
    if len(found) != 1:
        raise DataError(f"{folder}: its name tells no camera; expected freiburg1, 2 or 3 in it (name a camera)")
    return found[0]


def associate(a_ns: IntArray, b_ns: IntArray) -> IntArray:
    """(A,), (B,) ascending times -> (P, 2) pairs of indices at most 20 ms apart, nearest first, each index once.

    Ordered by time. Of pairs as near as each other, the earlier comes first. Raises DataError where more than
    ``MAX_LINES`` pairs are that near, as no camera takes.
    """
    low = np.searchsorted(b_ns, a_ns - MAX_APART_NS, side="left")
    high = np.searchsorted(b_ns, a_ns + MAX_APART_NS, side="right")
    if int((high - low).sum()) > MAX_LINES:
        raise DataError(f"{int((high - low).sum()):,} pairs of pictures within 20 ms; expected at most {MAX_LINES:,}")
    near = [(abs(int(a_ns[i] - b_ns[j])), i, j) for i in range(len(a_ns)) for j in range(low[i], high[i])]
    used_a, used_b, pairs = set(), set(), []
    for _, i, j in sorted(near):
        if i not in used_a and j not in used_b:
            used_a.add(i)
            used_b.add(j)
            pairs.append((i, j))
    return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)


def nearest(a_ns: IntArray, b_ns: IntArray) -> IntArray:
    """(A,) times, (B,) ascending times -> (A,) index of the nearest b, the earlier of two, or -1 beyond 20 ms."""
    after = np.clip(np.searchsorted(b_ns, a_ns), 1, max(len(b_ns) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(b_ns) - 1)
    index = np.where(np.abs(b_ns[after] - a_ns) < np.abs(b_ns[before] - a_ns), after, before)
    return np.where(np.abs(b_ns[index] - a_ns) <= MAX_APART_NS, index, -1)


def _still(folder: Path, poses: FloatArray) -> tuple[int, int]:
    """[start, end) of the first stretch of (N, 7) poses without motion. Raises DataError if there is none."""
    start, longest = 0, 0
    while start < len(poses):
        count = _still_count(poses[start : start + MIN_FRAMES])
        if count == MIN_FRAMES:
            return start, start + _still_count(poses[start:])
        longest = max(longest, count)
        start += count
    raise DataError(
        f"{folder}: the camera moves: it stays within {STILL_M * 100:g} cm and {math.degrees(STILL_RAD):g} degree for"
        f" {longest} frames at most; expected {MIN_FRAMES} or more (only cameras that stand still can be imported)"
    )


def _still_count(poses: FloatArray) -> int:
    """How many of (N, 7) poses pass before the first that is away from where the camera began."""
    apart = np.linalg.norm(poses[:, :3] - poses[0, :3], axis=1)
    cosine = np.abs(poses[:, 3:] @ poses[0, 3:])
    moved = (apart > STILL_M) | (2 * np.arccos(np.clip(cosine, -1.0, 1.0)) > STILL_RAD)
    return int(np.argmax(moved)) if moved.any() else len(moved)


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """(line number, words) of what is no comment."""
    lines = upright.read_text(path, MAX_LIST_BYTES).split("\n")
    if len(lines) > MAX_LINES:
        raise DataError(f"{path}: {len(lines):,} lines; expected at most {MAX_LINES:,}")
    found = [(n, line.split()) for n, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not found:
        raise DataError(
            f"{path}: nothing but comments; expected a time and a file or pose a line (an incomplete copy?)"
        )
    return found


def _stamp(path: Path, number: int, token: str) -> int:
    """Exact nanoseconds of printed seconds, rounded where there are more than nine decimals."""
    if not _SECONDS.fullmatch(token) or Fraction(token.rstrip(".")) > MAX_SECONDS:
        raise DataError(f"{path} line {number}: time {ascii(token)[:40]}; expected seconds, such as 1311868164.363181")
    return round(Fraction(token.rstrip(".")) * NS_PER_S)


def _ascending(path: Path, numbers: list[int], stamps: list[int]) -> IntArray:
    times = np.array(stamps, dtype=np.int64)
    back = np.diff(times) <= 0
    if back.any():
        raise DataError(f"{path} line {numbers[int(np.argmax(back)) + 1]}: time does not ascend; expected it to")
    return times


def _pictures(path: Path) -> tuple[IntArray, tuple[str, ...]]:
    """((N,) int64 ns, names) of a list of pictures, all within the folder."""
    numbers, stamps, names = [], [], []
    for number, words in _lines(path):
        if len(words) != 2:
            raise DataError(f"{path} line {number}: {len(words)} words; expected a time and a file name")
        name = PurePosixPath(words[1])
        if name.is_absolute() or ".." in name.parts or not words[1].isprintable():
            raise DataError(f"{path} line {number}: file {ascii(words[1])[:80]}; expected one within the folder")
        numbers.append(number)
        stamps.append(_stamp(path, number, words[0]))
        names.append(words[1])
    return _ascending(path, numbers, stamps), tuple(names)


def _poses(path: Path) -> tuple[IntArray, FloatArray]:
    """((N,) int64 ns, (N, 7) tx ty tz qx qy qz qw with unit quaternions)."""
    numbers, stamps, rows = [], [], []
    for number, words in _lines(path):
        if len(words) != 8:
            raise DataError(f"{path} line {number}: {len(words)} words; expected time tx ty tz qx qy qz qw")
        row = upright.numbers(words[1:], f"{path} line {number} after the time")
        if not (np.abs(row[:3]) <= MAX_POSITION_M).all():
            raise DataError(f"{path} line {number}: position {row[:3].tolist()}; expected metres (millimetres?)")
        length = math.hypot(*row[3:])
        if not abs(length - 1.0) <= UNIT_QUATERNION:
            raise DataError(f"{path} line {number}: quaternion of length {length:.3g}; expected 1")
        numbers.append(number)
        stamps.append(_stamp(path, number, words[0]))
        rows.append(row / np.array([1.0, 1.0, 1.0, *(4 * [length])]))
    return _ascending(path, numbers, stamps), np.stack(rows)
