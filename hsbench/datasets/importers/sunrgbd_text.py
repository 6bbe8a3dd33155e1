"""SUN RGB-D frames as VoteNet and mmdet3d have them (github.com/facebookresearch/votenet, open-mmlab/mmdetection3d).

    label/000001.txt  calib/000001.txt  image/000001.jpg  000001_bbox.npy  000001_pc.npz or points/000001.bin

Label: a line an object, ``class x y w h cx cy cz hw hl hh ox oy``: a rectangle of pixels (not read), the centre, the
half sizes across, along and up, and the heading (ox, oy), in the toolbox's upright frame (x right, y ahead, z up, its
origin in the camera). Calib: ``Rtilt`` and K, a line each, column by column. ``*_bbox.npy``: (K, 8) centre, half sizes
along, across and up, heading with the opposite sign, class of ``CLASSES``. Points: (N, 6) float32, upright x y z and
colour; those of depth pixels, so a depth image of the pixels that were kept follows from them.

mmdet3d's ``*_infos_*.pkl`` are pickles, which can run code when they are opened; they are refused.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.bounded_images import read_colour
from hsbench.datasets.importers.room_boxes import MAX_COORDINATE_M, RoomBox, check_box, rectangle_from_axes
from hsbench.datasets.importers.sunrgbd import UPRIGHT_OF_DOWN, pinhole
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.io.arrays import MAX_OPEN_BYTES, ArraySpec, read_npz
from hsbench.io.reading import read_limited
from hsbench.typing import Float32Array, FloatArray, UInt8Array

CLASSES = ("bed", "table", "sofa", "chair", "toilet", "desk", "dresser", "night_stand", "bookshelf", "bathtub")
"""Class ids of ``*_bbox.npy``."""

LABEL_FIELDS = 13
CALIB_FIELDS = 9
BOX_FIELDS = 8
POINT_FIELDS = 6
MAX_BOXES = 10_000
MAX_HEADER_BYTES = 4096
MIN_INSIDE = 0.9
"""Share of the points that must lie in the picture: all do, but for rounding at its border."""


@dataclass(frozen=True, eq=False)
class SunRgbdText:
    """One frame: rgb (h, w, 3) uint8, camera, ``upright_R_camera`` (3, 3), boxes in the upright frame.

    depth_m (h, w) float32: of the pixels whose points are known, 0 elsewhere; None without points.
    """

    camera: PinholeCamera
    rgb: UInt8Array
    depth_m: Float32Array | None
    upright_R_camera: FloatArray
    boxes: tuple[RoomBox, ...]


def read_sunrgbd_text(
    boxes: str | Path, calib: str | Path, image: str | Path, points: str | Path | None = None
) -> SunRgbdText:
    """Paths of a label (.txt) or box array (.npy), calibration, picture and perhaps points (.npz, .bin) -> the frame.

    Raises DataError, naming the file and the line or row, for damage, other counts, and points of another frame.
    """
    rgb = read_colour(Path(image))
    camera, upright_R_camera = _calib(Path(calib), rgb.shape[1], rgb.shape[0])
    depth = None if points is None else _depth(Path(points), camera, upright_R_camera)
    return SunRgbdText(camera, rgb, depth, upright_R_camera, _boxes(Path(boxes)))


def _calib(path: Path, width_px: int, height_px: int) -> tuple[PinholeCamera, FloatArray]:
    lines = [line for line in upright.read_text(path).splitlines() if line.strip()]
    if len(lines) != 2:
        raise DataError(f"{path}: {len(lines)} lines; expected Rtilt and K, a line each")
    matrices = []
    for number, line in enumerate(lines, start=1):
        tokens = line.split()
        if len(tokens) != CALIB_FIELDS:
            raise DataError(f"{path} line {number}: {len(tokens)} values; expected {CALIB_FIELDS}")
        matrices.append(upright.numbers(tokens, f"{path} line {number}").reshape(3, 3, order="F"))
    tilt = upright.rotation(matrices[0], f"{path} line 1:")
    return pinhole(f"{path} line 2", matrices[1], width_px, height_px), tilt @ UPRIGHT_OF_DOWN


def _boxes(path: Path) -> tuple[RoomBox, ...]:
    if path.suffix == ".txt":
        lines = upright.read_text(path).splitlines()
        return tuple(
            _of_line(f"{path} line {n}", line.split()) for n, line in enumerate(lines, start=1) if line.strip()
        )
    if path.suffix == ".npy":
        return tuple(_of_row(f"{path} row {n}", row) for n, row in enumerate(_rows(path)))
    if path.suffix in (".pkl", ".pickle"):
        raise DataError(
            f"{path}: is a pickle, which can run code when it is opened; expected the frame's label .txt or _bbox.npy"
        )
    raise DataError(f"{path}: ends in {path.suffix!r}; expected a label (.txt) or VoteNet's boxes (_bbox.npy)")


def _of_line(where: str, tokens: list[str]) -> RoomBox:
    if len(tokens) != LABEL_FIELDS:
        raise DataError(f"{where}: {len(tokens)} fields; expected {LABEL_FIELDS}, class to oy")
    values = upright.numbers(tokens[1:], f"{where} after the class")
    half_across, half_along, half_up = values[7:10]
    return _box(where, tokens[0], values[4:7], np.array([half_along, half_across, half_up]), values[10:12])


def _of_row(where: str, row: FloatArray) -> RoomBox:
    if row[7] not in range(len(CLASSES)):
        raise DataError(f"{where} is of class {row[7]:g}; expected 0 to {len(CLASSES) - 1}")
    heading = np.array([math.cos(row[6]), -math.sin(row[6])])
    return _box(where, CLASSES[int(row[7])], row[:3], row[3:6], heading)


def _box(where: str, name: str, centre: FloatArray, half_size: FloatArray, heading: FloatArray) -> RoomBox:
    if not name.isprintable():
        raise DataError(f"{where}: class {ascii(name)[:40]}; expected a name")
    if not (half_size >= 0).all():
        raise DataError(f"{where} has half sizes {half_size.tolist()}; expected metres >= 0")
    length = math.hypot(*heading)
    if not (math.isfinite(length) and length > 0):
        raise DataError(f"{where} has heading {heading.tolist()}; expected a direction")
    with np.errstate(over="ignore", invalid="ignore"):
        box = rectangle_from_axes(name, centre, half_size, heading / length)
    return check_box(box, where)


def _rows(path: Path) -> FloatArray:
    """(K, 8) float64 of an npy file; nothing is allocated before the header is believed."""
    data = read_limited(path, MAX_HEADER_BYTES + MAX_BOXES * BOX_FIELDS * 8, "another file?")
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran_order, dtype = read(file, max_header_size=MAX_HEADER_BYTES)
    except Exception as error:  # numpy lets through whatever tokenising and evaluating the text raises
        reason = ascii(" ".join(str(error).split()))[1:120] or type(error).__name__
        raise DataError(f"{path}: header cannot be read ({reason}); expected an npy array") from error
    if dtype.kind != "f":
        raise DataError(f"{path}: array of {dtype}; expected floating point numbers (objects would need pickle)")
    if len(shape) != 2 or shape[1] != BOX_FIELDS:
        raise DataError(f"{path}: shape {shape}; expected (boxes, {BOX_FIELDS})")
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if len(data) != expected:
        raise DataError(f"{path}: {len(data):,} bytes; expected {expected:,} as its header says (an incomplete copy?)")
    flat = np.frombuffer(data, dtype=dtype, offset=file.tell())
    if not np.isfinite(flat).all():
        row = int(np.argmin(np.isfinite(flat.reshape(shape, order="F" if fortran_order else "C")).all(axis=1)))
        raise DataError(f"{path} row {row} has a value that is not finite; expected metres (bytes swapped?)")
    return np.array(flat.reshape(shape, order="F" if fortran_order else "C"), dtype=np.float64, order="C")


def _depth(path: Path, camera: PinholeCamera, upright_R_camera: FloatArray) -> Float32Array:
    """(h, w) depth of the pixels on which points lie, 0 elsewhere; of several points on a pixel the nearest."""
    points = _points(path)
    pixels, depth = camera.project(points @ upright_R_camera)
    inside = camera.contains(pixels)
    if not len(points) or inside.mean() < MIN_INSIDE:
        share = inside.mean() if len(points) else 0.0
        raise DataError(
            f"{path}: {share:.0%} of {len(points):,} points lie in the picture; expected all (another frame?)"
        )
    image = np.full((camera.height_px, camera.width_px), np.inf)
    column, row = np.floor(pixels[inside]).astype(np.int64).T
    np.minimum.at(image, (row, column), depth[inside])
    return np.where(np.isfinite(image), image, 0.0).astype(np.float32)


def _points(path: Path) -> FloatArray:
    """(N, 3) float64 upright points of an .npz or .bin."""
    if path.suffix == ".npz":
        try:
            spec = ArraySpec((None, POINT_FIELDS), "float32")
            return np.asarray(read_npz(path, {"pc": spec}, MAX_OPEN_BYTES)["pc"][:, :3], dtype=np.float64)
        except DataError as error:
            raise DataError(str(error).splitlines()[0]) from error
    if path.suffix == ".bin":
        data = read_limited(path, MAX_OPEN_BYTES, "another file?")
        if len(data) % (4 * POINT_FIELDS):
            raise DataError(f"{path}: {len(data):,} bytes; expected {4 * POINT_FIELDS} a point (an incomplete copy?)")
        points = np.frombuffer(data, "<f4").reshape(-1, POINT_FIELDS)[:, :3]
        bad = ~(np.abs(points) <= MAX_COORDINATE_M).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise DataError(f"{path}: point {first} is {points[first].tolist()}; expected metres (bytes swapped?)")
        return points.astype(np.float64)
    raise DataError(f"{path}: ends in {path.suffix!r}; expected points (.npz of VoteNet or .bin of mmdet3d)")
