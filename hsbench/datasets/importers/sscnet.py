"""SSCNet / NYU frames: a depth PNG and a labelled volume ``.bin`` (github.com/shurans/sscnet, MIT).

Depth PNG: 640 x 480, 16-bit grey. A pixel is the depth in millimetres rotated left by three bits; 0 = none
(``matlab_code/utils/saveDepth.m``). The camera has a focal length of 518.8579 px and its principal point in
the image centre, (320, 240) px here. The source's two readers differ by a pixel, since one counts pixels from 0
and one from 1; the image centre lies half a pixel from both (3 mm at 3 m).

Volume, little endian (``writeRLEfile.m``): float32 x 3 origin; float32 x 16 pose of the camera, row major,
camera (x right, y down, z forward) to world (z up, floor at z = 0); then uint32 pairs (label, run). The runs
fill an array indexed [world x, world z, world y] of 240 x 144 x 240 voxels of 0.02 m, 8,294,400 in all.
The labels were sampled at origin + index * 0.02 m (``perpareNYUCADdata.m``), so the stored origin is the *centre*
of voxel 0; the floor's two layers of voxels then lie at z = -0.01 and 0.01 m, on either side of the floor. Here
arrays are [x, y, z] and ``origin_m`` is the minimum corner, 0.01 m below the stored one on every axis.
A volume of one value only is written one voxel short by the source; that single case is read as meant. It comes
from frames prepared without ground truth: no voxel is labelled, and nothing about the room is known.

Labels: 0 empty, 1-36 the classes of ``CLASSES_36``, 255 outside the room or unknown. Voxels outside the field of
view are 0 within the room. ``ELEVEN_OF_36`` maps to the eleven benchmark classes.

The evaluation down-samples the 36 classes by ``downsample_labels`` (``geometry.voxel_labels``, which states the rule),
factor 4, to 60 x 36 x 60 voxels of 0.08 m, then maps to eleven.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hsbench.datasets.importers.upright import below_camera
from hsbench.errors import DataError, SchemaError
from hsbench.geometry import transforms
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.voxel_labels import downsample_labels as downsample_labels
from hsbench.io.decoding import decode_image
from hsbench.io.reading import read_limited
from hsbench.typing import AnyArray, Float32Array, FloatArray, UInt8Array

CAMERA = PinholeCamera(640, 480, fx_px=518.8579, fy_px=518.8579, cx_px=320.0, cy_px=240.0)
VOXEL_M = 0.02
VOXEL_COUNT = 240 * 144 * 240
EMPTY, UNKNOWN = 0, 255

CLASSES_36 = (
    *("empty", "ceiling", "floor", "wall", "window", "door", "chair", "bed", "sofa", "table", "side_table"),
    *("bookshelf", "kitchen_cabinet", "closets", "lamp", "car", "computer", "desk", "music", "gym", "appliance"),
    *("kitchen_appliance", "pillow", "pets", "plants", "pool", "recreation", "night_stand", "bathtub", "shower"),
    *("table_and_chair", "toilet", "trash_can", "tvs", "sink", "mirror", "dont_care"),
)
CLASSES_11 = ("empty", "ceiling", "floor", "wall", "window", "chair", "bed", "sofa", "table", "tvs", "furn", "objs")
ELEVEN_OF_36 = (
    *(0, 1, 2, 3, 4, 11, 5, 6, 7, 8, 8, 10, 10, 10, 11, 11, 9, 8, 11),
    *(11, 11, 11, 11, 11, 11, 11, 11, 10, 10, 11, 8, 10, 11, 9, 11, 11, 11),
)

MAX_PNG_BYTES = 8 * 2**20
MAX_PNG_SIDE_PX = 4096
# Kinect-like sensors end at 10 m; plain millimetres, decoded as if rotated, pass 16 m in three pixels of four.
MAX_DEPTH_M = 16.0
MAX_FRACTION_BEYOND_DEPTH = 0.1
HEADER_BYTES = 4 * (3 + 16)
MAX_VOLUME_BYTES = HEADER_BYTES + 8 * VOXEL_COUNT
POSE_TOLERANCE = 1e-4
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True, eq=False)
class SscnetVolume:
    """A labelled volume in the file's world frame (z up, floor at z = 0).

    ``origin_m`` is the minimum corner, ``voxel_m`` the side, ``world_T_camera`` (4, 4) the pose of the camera,
    ``labels`` (240, 240, 144) uint8, indexed [x, y, z]: 0 empty, 1-36 classes, 255 unknown.
    """

    origin_m: tuple[float, float, float]
    voxel_m: float
    world_T_camera: FloatArray
    labels: UInt8Array

    @property
    def grid(self) -> VoxelGrid:
        """The grid of the labels, in the file's world frame."""
        nx, ny, nz = self.labels.shape
        return VoxelGrid(self.origin_m, (nx, ny, nz), self.voxel_m)


@dataclass(frozen=True, eq=False)
class SscnetFrame:
    """One frame: camera, ``depth_m`` (480, 640) float32 (0 = none), and the labelled volume."""

    camera: PinholeCamera
    depth_m: Float32Array
    volume: SscnetVolume

    @property
    def world_T_camera(self) -> FloatArray:
        """(4, 4) pose of the camera in the file's world frame."""
        return self.volume.world_T_camera


def read_depth_png(path: str | Path) -> Float32Array:
    """Path of a depth PNG -> (height, width) float32 metres, 0 = none.

    Raises DataError for anything but a one-channel 16-bit PNG of rotated millimetres.
    """
    data = read_limited(Path(path), MAX_PNG_BYTES, "a different file?")
    if not data.startswith(_PNG_SIGNATURE) or data[12:16] != b"IHDR" or len(data) < 33:
        raise DataError(f"{path}: is not a PNG; expected a 16-bit depth PNG (is this the volume .bin?)")
    # The header is read first, so that a small file cannot claim a huge image.
    width, height, bits, colour = struct.unpack(">IIBB", data[16:26])
    if not (0 < width <= MAX_PNG_SIDE_PX and 0 < height <= MAX_PNG_SIDE_PX):
        raise DataError(f"{path}: PNG of {width} x {height} px; expected at most {MAX_PNG_SIDE_PX} px a side")
    if (bits, colour) != (16, 0):
        kind = f"{bits}-bit {'grey' if colour == 0 else 'colour or alpha'}"
        raise DataError(f"{path}: {kind} PNG; expected 16-bit grey (a colour image, or depth scaled for viewing?)")
    pixels, complaint = decode_image(data, cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.shape != (height, width) or pixels.dtype != np.uint16:
        raise DataError(
            f"{path}: damaged PNG{complaint}; expected {height} x {width} 16-bit pixels (an incomplete copy?)"
        )
    depth_m: Float32Array = ((pixels >> 3) | (pixels << 13)).astype(np.float32) / np.float32(1000.0)
    beyond, measured = int((depth_m > MAX_DEPTH_M).sum()), int((depth_m > 0).sum())
    if beyond > MAX_FRACTION_BEYOND_DEPTH * measured:
        found = f"{beyond} of {measured} depths exceed {MAX_DEPTH_M:g} m"
        raise DataError(f"{path}: {found}; expected millimetres rotated left by 3 bits (are these plain millimetres?)")
    return depth_m


def read_volume(path: str | Path) -> SscnetVolume:
    """Path of a ``.bin`` volume -> its labels and pose in the file's world frame.

    Raises DataError for a truncated file, runs that do not fill the volume, unknown labels or a pose that is not rigid.
    """
    data = read_limited(Path(path), MAX_VOLUME_BYTES, "a different file?")
    if data.startswith(_PNG_SIGNATURE):
        raise DataError(f"{path}: is a PNG; expected a volume .bin (depth and volume in the wrong order?)")
    if len(data) < HEADER_BYTES + 8 or (len(data) - HEADER_BYTES) % 8:
        raise DataError(f"{path}: {len(data)} bytes; expected {HEADER_BYTES} + 8 per run (an incomplete copy?)")
    header = np.frombuffer(data, "<f4", count=19).astype(np.float64)
    if not np.isfinite(header[:3]).all():
        raise DataError(f"{path}: origin is {header[:3].tolist()}; expected three finite metres")
    pairs = np.frombuffer(data, "<u4", offset=HEADER_BYTES).reshape(-1, 2)
    values, runs = pairs[:, 0], pairs[:, 1].astype(np.int64)
    bad = ((values >= len(CLASSES_36)) & (values != UNKNOWN)).nonzero()[0]
    if len(bad):
        raise DataError(f"{path}: run {bad[0]} has label {values[bad[0]]}; expected 0-36 or 255 (a damaged file?)")
    if not runs.all():
        raise DataError(f"{path}: run {int(np.argmin(runs))} has length 0; expected positive lengths")
    if runs.tolist() == [VOXEL_COUNT - 1]:
        runs = runs + 1
    if int(runs.sum()) != VOXEL_COUNT:
        found = f"runs sum to {int(runs.sum()):,}"
        raise DataError(f"{path}: {found}; expected {VOXEL_COUNT:,} (an incomplete copy, or another resolution?)")
    labels_xzy = np.repeat(values.astype(np.uint8), runs).reshape(240, 144, 240)
    labels = np.ascontiguousarray(labels_xzy.transpose(0, 2, 1))
    x, y, z = (header[:3] - VOXEL_M / 2).tolist()
    return SscnetVolume((x, y, z), VOXEL_M, _rigid_pose(path, header[3:].reshape(4, 4)), labels)


def read_frame(depth_png: str | Path, volume_bin: str | Path) -> SscnetFrame:
    """Paths of a depth PNG and of its volume -> the frame. Raises DataError as the two readers do."""
    depth_m = read_depth_png(depth_png)
    height, width = depth_m.shape
    if (width, height) != (CAMERA.width_px, CAMERA.height_px):
        raise DataError(f"{depth_png}: {width} x {height} px; expected 640 x 480 (another sensor?)")
    return SscnetFrame(CAMERA, depth_m, read_volume(volume_bin))


def eleven_classes(labels: AnyArray) -> UInt8Array:
    """(...) labels 0-36, 255 -> (...) uint8 labels 0-11 of ``CLASSES_11``, 255. Raises SchemaError for others."""
    table = np.full(256, UNKNOWN, dtype=np.uint8)
    table[: len(ELEVEN_OF_36)] = ELEVEN_OF_36
    if ((labels >= len(ELEVEN_OF_36)) & (labels != UNKNOWN)).any():
        raise SchemaError(f"labels reach {int(labels[labels != UNKNOWN].max())}; expected 0-36 or {UNKNOWN}")
    return table[labels]


def to_episode_frame(frame: SscnetFrame) -> tuple[FloatArray, FloatArray]:
    """A frame -> (``episode_T_camera`` (4, 4), ``episode_T_ssc`` (4, 4)); ssc is the file's world frame.

    The pose keeps the roll of a hand-held camera, which a height and a tilt alone would lose.
    Raises DataError if the camera looks straight up or down, where no heading exists.
    """
    episode_T_ssc = below_camera(frame.world_T_camera, 0.0)
    return episode_T_ssc @ frame.world_T_camera, episode_T_ssc


def resample_labels(volume: SscnetVolume, episode_T_ssc: FloatArray, grid: VoxelGrid) -> UInt8Array:
    """(``grid.shape``) uint8 labels on a grid of the episode frame: that of the nearest voxel centre, 255 outside."""
    points_ssc = transforms.apply(transforms.invert(episode_T_ssc), grid.centres().reshape(-1, 3))
    index, inside = volume.grid.index(points_ssc)
    labels = np.full(len(index), UNKNOWN, dtype=np.uint8)
    labels[inside] = volume.labels[tuple(index[inside].T)]
    return labels.reshape(grid.shape)


def _rigid_pose(path: str | Path, matrix: FloatArray) -> FloatArray:
    """The rigid pose nearest to a stored one, whose float32 entries are rotations to about 1e-6 only."""
    if not (np.isfinite(matrix).all() and transforms.is_rigid(matrix, POSE_TOLERANCE)):
        hint = "stored column major?" if transforms.is_rigid(matrix.T, POSE_TOLERANCE) else "a different format?"
        raise DataError(f"{path}: pose {matrix.round(3).tolist()} is not rigid; expected camera to world ({hint})")
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    return transforms.rigid(u @ vt, matrix[:3, 3])
