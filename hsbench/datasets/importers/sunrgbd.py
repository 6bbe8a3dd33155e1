"""SUN RGB-D frame folders (S. Song, S. Lichtenberg, J. Xiao, CVPR 2015): colour, depth, annotated boxes, room layout.

    image/*.jpg  depth/*.png  depth_bfx/*.png (filled)  intrinsics.txt  extrinsics/*.txt  scene.txt
    annotation3Dfinal/index.json  annotation3Dlayout/index.json

Depth PNG: millimetres rotated left by three bits, 0 = none, as SSCNet's. ``intrinsics.txt`` is a 3 x 3 matrix of pixels
counted from 1, ``extrinsics`` a 3 x 4 one; of several files the last by name counts, as in the toolbox. Its rotation R
turns the camera frame (x right, y down, z forward) to one without tilt and roll, y still down. The upright frame is
that frame as (x, z, -y): x right, y ahead, z up, origin in the camera; so it is the toolbox's ``Rtilt``.

Boxes and the room are polygons X, Z of the frame of R, between Ymin and Ymax, of which y is down. The front of a box
is its side between the first two corners. Names are ``class:label``; entries that are null or have an empty polygon are
things that were deleted. The room of ``annotation3Dlayout`` is the first entry that has an outline.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import pose_json, upright
from hsbench.datasets.importers.bounded_images import read_colour
from hsbench.datasets.importers.room_boxes import MAX_COORDINATE_M, RoomBox, check_box
from hsbench.datasets.importers.sscnet import read_depth_png
from hsbench.errors import DataError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.typing import Float32Array, FloatArray, UInt8Array

UPRIGHT_OF_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""(x, y down, z ahead) -> (x, y ahead, z up)."""

FIRST_PIXEL = 0.5
"""The toolbox counts pixels from 1, and its first has its centre there; ours has it at 0.5."""

MAX_JSON_BYTES = 4 << 20
MAX_OBJECTS = 10_000
MAX_CORNERS = 1_000
MAX_ROOM_NAME = 40


@dataclass(frozen=True, eq=False)
class SunRgbdFrame:
    """One frame: rgb (h, w, 3) uint8, depth_m (h, w) float32 (0 = none), camera, ``upright_R_camera`` (3, 3).

    boxes and layout (the room; None where nobody drew it) are in the upright frame. deleted: entries without one.
    """

    camera: PinholeCamera
    rgb: UInt8Array
    depth_m: Float32Array
    upright_R_camera: FloatArray
    room_type: str
    boxes: tuple[RoomBox, ...]
    layout: RoomBox | None
    deleted: int


def read_sunrgbd(folder: str | Path, *, filled: bool = False) -> SunRgbdFrame:
    """A frame folder -> the frame. filled: depth with its holes filled (``depth_bfx``), as detectors take it.

    Raises DataError, naming the file and the object, for what is missing, damaged or no numbers of a room.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DataError(f"{folder}: is no folder; expected one frame of SUN RGB-D, with image/ and depth/ in it")
    depth_path = _last(folder / ("depth_bfx" if filled else "depth"), ".png")
    image_path = _last(folder / "image", ".jpg")
    depth_m, rgb = read_depth_png(depth_path), read_colour(image_path)
    if rgb.shape[:2] != depth_m.shape:
        raise DataError(
            f"{image_path}: {rgb.shape[1]} x {rgb.shape[0]} px; expected {depth_m.shape[::-1]} as the depth"
        )
    boxes, deleted = _boxes(folder / "annotation3Dfinal" / "index.json")
    return SunRgbdFrame(
        camera=_camera(folder / "intrinsics.txt", rgb.shape[1], rgb.shape[0]),
        rgb=rgb,
        depth_m=depth_m,
        upright_R_camera=_extrinsics(_last(folder / "extrinsics", ".txt")),
        room_type=_room_type(folder / "scene.txt"),
        boxes=boxes,
        layout=_layout(folder / "annotation3Dlayout" / "index.json"),
        deleted=deleted,
    )


def _last(folder: Path, ending: str) -> Path:
    """The last file by name in a folder."""
    found = sorted(path for path in folder.glob(f"*{ending}") if path.is_file()) if folder.is_dir() else []
    if not found:
        raise DataError(f"{folder}: has no file *{ending}; expected one (an incomplete copy?)")
    return found[-1]


def pinhole(where: str, matrix: FloatArray, width_px: int, height_px: int) -> PinholeCamera:
    """The camera of a (3, 3) intrinsic matrix in the toolbox's pixels. Raises DataError, starting with ``where``."""
    fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    shape = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    if not (np.array_equal(matrix, shape) and fx > 0 and fy > 0 and 0 < cx < width_px and 0 < cy < height_px):
        hint = "the other order?" if matrix[2, 0] or matrix[2, 1] else "of another size of picture?"
        raise DataError(
            f"{where}: {matrix.tolist()} is no intrinsic matrix of {width_px} x {height_px} px;"
            f" expected fx 0 cx, 0 fy cy, 0 0 1 ({hint})"
        )
    return PinholeCamera(width_px, height_px, fx, fy, cx - FIRST_PIXEL, cy - FIRST_PIXEL)


def _camera(path: Path, width_px: int, height_px: int) -> PinholeCamera:
    return pinhole(str(path), _matrix(path, 3, 3), width_px, height_px)


def _extrinsics(path: Path) -> FloatArray:
    """(3, 3) camera to upright."""
    matrix = _matrix(path, 3, 4)
    return UPRIGHT_OF_DOWN @ upright.rotation(matrix[:, :3], f"{path}: the left of")


def _matrix(path: Path, rows: int, columns: int) -> FloatArray:
    tokens = upright.read_text(path).split()
    if len(tokens) != rows * columns:
        raise DataError(f"{path}: {len(tokens):,} values; expected {rows} x {columns} (an incomplete copy?)")
    return upright.numbers(tokens, str(path)).reshape(rows, columns)


def _room_type(path: Path) -> str:
    """The word in scene.txt; ``room`` where there is no such file."""
    if not path.exists():
        return "room"
    word = upright.read_text(path).strip()
    if not (word.isprintable() and 0 < len(word) <= MAX_ROOM_NAME):
        raise DataError(f"{path}: {ascii(word)[:MAX_ROOM_NAME]}; expected one word, such as office")
    return word


def _boxes(path: Path) -> tuple[tuple[RoomBox, ...], int]:
    """(boxes, number of entries without an outline); nothing where there is no annotation."""
    if not path.exists():
        return (), 0
    found = [_box(f"{path}: objects[{i}]", entry) for i, entry in enumerate(_entries(path))]
    boxes = tuple(box for box in found if box is not None)
    return boxes, len(found) - len(boxes)


def _layout(path: Path) -> RoomBox | None:
    """The first entry with an outline, as in the toolbox."""
    if not path.exists():
        return None
    found = (_box(f"{path}: objects[{i}]", entry) for i, entry in enumerate(_entries(path)))
    return next((box for box in found if box is not None), None)


def _entries(path: Path) -> list[Any]:
    root = pose_json.load(path, MAX_JSON_BYTES)
    return pose_json.items(pose_json.field(root, "objects", f"{path}: the whole"), f"{path}: objects", MAX_OBJECTS)


def _box(where: str, entry: Any) -> RoomBox | None:
    """None for an entry that was deleted, or never got an outline."""
    if entry is None:
        return None
    name = pose_json.text(pose_json.field(entry, "name", where), f"{where}.name")
    polygons = pose_json.items(pose_json.field(entry, "polygon", where), f"{where}.polygon", MAX_OBJECTS)
    if not polygons:
        return None
    where = f"{where}.polygon[0]"
    sides = [
        pose_json.items(pose_json.field(polygons[0], axis, where), f"{where}.{axis}", MAX_CORNERS) for axis in "XZ"
    ]
    if len(sides[0]) < 3 or len(sides[0]) != len(sides[1]):
        raise DataError(
            f"{where} has {len(sides[0])} X and {len(sides[1])} Z; expected 3 or more corners, as many of each"
        )
    x, z = (
        pose_json.numbers(s, f"{where}.{a}", len(sides[0]), MAX_COORDINATE_M) for a, s in zip("XZ", sides, strict=True)
    )
    down = pose_json.numbers(
        [pose_json.field(polygons[0], key, where) for key in ("Ymin", "Ymax")],
        f"{where} Ymin and Ymax",
        2,
        MAX_COORDINATE_M,
    )
    outline = np.stack([x, z], axis=1)
    front = (outline[0] + outline[1]) / 2 - (outline[0] + outline[2]) / 2 if len(x) == 4 else None
    if front is not None and not front.any():
        front = None
    return check_box(RoomBox(name, outline, float(-down.max()), float(-down.min()), front), where)
