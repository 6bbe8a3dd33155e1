"""The labelled frames of NYU v2 (N. Silberman et al., ECCV 2012): ``nyu_depth_v2_labeled.mat``, MATLAB 7.3, so HDF5.

As HDF5 has them, axes reversed: ``images`` (N, 3, 640, 480) uint8; ``depths``, filled, and ``rawDepths`` (N, 640, 480)
float32 metres, 0 = none; ``labels`` (N, 640, 480) uint16, 0 = none, else a number of ``names``, from 1; ``instances``
(N, 640, 480) uint8, counted within each class; ``names`` (1, C) references to text. One frame is read, not the file.

Beside it may lie ``classMapping40.mat`` (mapClass (1, 894): class of 40, from 1; className), by which classes without a
category of ours get one, and a text of rotations, three rows of three a frame, which turn (x, z, -y) of the camera
frame upright, as SUN RGB-D's ``Rtilt``. Pixels of the calibration are counted from 1.

*Unverified on real data*, but for the class map and the rotations: the layout is that of the data set's page.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.hdf5 import check_chunks
from hsbench.datasets.importers.mat5 import read_mat5
from hsbench.datasets.importers.room_boxes import NEUTRAL, category_of
from hsbench.datasets.importers.sunrgbd import FIRST_PIXEL, UPRIGHT_OF_DOWN
from hsbench.errors import DataError, MissingExtraError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.categories import category
from hsbench.schema.scene import PERSON_ID_OFFSET
from hsbench.typing import AnyArray, Float32Array, FloatArray, UInt8Array, UInt16Array

WIDTH_PX, HEIGHT_PX = 640, 480
CAMERA = PinholeCamera(
    WIDTH_PX, HEIGHT_PX, 518.8579, 519.4696, 325.5824 - FIRST_PIXEL, 253.7362 - FIRST_PIXEL
)  # fmt: skip
"""The colour camera by the data set's toolbox; depth was brought to its pixels."""

MAX_FRAMES = 100_000
MAX_NAMES = 5_000
MAX_NAME_LENGTH = 100
MAX_CHUNK_BYTES = 256 << 20
MAX_ROTATIONS_BYTES = 4 << 20
MAX_DEPTH_M = 16.0
CLASSES_40 = 40


@dataclass(frozen=True, eq=False)
class NyuFrame:
    """One labelled frame.

    rgb (480, 640, 3) uint8; depth_m and filled_m (480, 640) float32 metres, 0 = none; instance (480, 640) uint16, 1, 2
    ... in the order of class and number, 0 = none; semantic (480, 640) uint8, category of ours. names, categories: of
    the instances, the source's and ours.
    """

    rgb: UInt8Array
    depth_m: Float32Array
    filled_m: Float32Array
    instance: UInt16Array
    semantic: UInt8Array
    names: tuple[str, ...]
    categories: tuple[str, ...]


def read_nyu_labelled(path: str | Path, index: int, class_map: str | Path | None = None) -> NyuFrame:
    """Path of the data set and a frame's index from 0 -> the frame. class_map: path of classMapping40.mat.

    Raises DataError, naming the file and the array, for damage, other shapes and an index that is not there;
    MissingExtraError without the extra ``import``.
    """
    try:
        import h5py
    except ModuleNotFoundError as error:
        raise MissingExtraError("NYU v2", error.name or "h5py", "import") from error
    path = Path(path)
    try:
        with h5py.File(path, "r", locking=False) as file:
            depths = _plane(h5py, file, "rawDepths", index, "f"), _plane(h5py, file, "depths", index, "f")
            labels, instances = (_plane(h5py, file, name, index, "u") for name in ("labels", "instances"))
            rgb = _slice(h5py, file, "images", index, (3, WIDTH_PX, HEIGHT_PX), "u1").transpose(2, 1, 0)
            names = _names(h5py, file)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError) as error:  # HDF5 has no one error
        reason = ascii(" ".join(str(error).split()))[1:200]
        raise DataError(f"{path}: cannot be read: {reason}; expected MATLAB 7.3, HDF5 (an incomplete copy?)") from error
    if labels.max() > len(names):
        raise DataError(f"{path}: labels of frame {index} reach {labels.max()}; expected 0 to {len(names)}")
    instance, classes = _numbered(f"{path}: frame {index}", labels, instances)
    found = tuple(names[number - 1] for number in classes)
    coarse = {} if class_map is None else _coarse(Path(class_map))
    categories = tuple(_category(name, coarse.get(int(k))) for name, k in zip(found, classes, strict=True))
    table = np.array([0, *(category(name).category_id for name in categories)], dtype=np.uint8)
    raw, filled = (_metres(path, name, depth) for name, depth in zip(("rawDepths", "depths"), depths, strict=True))
    return NyuFrame(np.ascontiguousarray(rgb), raw, filled, instance, table[instance], found, categories)


def read_rotation(path: str | Path, index: int) -> FloatArray:
    """Path of the rotations and a frame's index from 0 -> ``upright_R_camera`` (3, 3). Raises DataError."""
    rows = [line for line in upright.read_text(Path(path), MAX_ROTATIONS_BYTES).splitlines() if line.strip()]
    if not 0 <= index < len(rows) // 3:
        raise DataError(f"{path}: {len(rows)} rows; expected three for frame {index} (counted from 0)")
    tokens = [row.split() for row in rows[3 * index : 3 * index + 3]]
    if any(len(row) != 3 for row in tokens):
        raise DataError(f"{path}: rotation {index} has rows of {[len(row) for row in tokens]} values; expected 3 each")
    matrix = upright.numbers([token for row in tokens for token in row], f"{path}: rotation {index}").reshape(3, 3)
    return upright.rotation(matrix, f"{path}: rotation {index}") @ UPRIGHT_OF_DOWN


def _category(name: str, coarse: str | None) -> str:
    found = category_of(name)
    return found if found != NEUTRAL or coarse is None else category_of(coarse)


def _coarse(path: Path) -> dict[int, str]:
    """Class number -> name of one of the 40 classes."""
    variables = read_mat5(path)
    mapping, names = variables.get("mapClass"), variables.get("className")
    named = isinstance(names, list) and len(names) == CLASSES_40 and all(isinstance(name, str) for name in names)
    mapped = isinstance(mapping, np.ndarray) and mapping.ndim == 2 and len(mapping) == 1
    if mapping is None or names is None or not named or not mapped or not np.isin(mapping, range(1, 41)).all():
        raise DataError(f"{path}: has no mapClass (1, classes) of 1 to 40 and 40 names in className; expected both")
    return {number: names[int(k) - 1] for number, k in enumerate(mapping[0], start=1)}


def _numbered(where: str, labels: AnyArray, instances: AnyArray) -> tuple[UInt16Array, AnyArray]:
    """((h, w) instances 1, 2 ... over all classes, 0 = none; (n,) their class numbers)."""
    pairs = labels.astype(np.int64) << 8 | instances
    pairs[(labels == 0) | (instances == 0)] = 0
    unique, found = np.unique(np.append(pairs.ravel(), 0), return_inverse=True)
    if len(unique) > PERSON_ID_OFFSET:
        raise DataError(f"{where} has {len(unique) - 1:,} things; expected fewer than {PERSON_ID_OFFSET:,}")
    return found[:-1].reshape(labels.shape).astype(np.uint16), unique[1:] >> 8


def _metres(path: Path, name: str, depth: AnyArray) -> Float32Array:
    if not ((depth >= 0) & (depth <= MAX_DEPTH_M)).all():
        raise DataError(f"{path}: {name} hold {float(depth.max()):g}; expected 0 to {MAX_DEPTH_M:g} m (bytes swapped?)")
    return depth.astype(np.float32)


def _plane(h5py: Any, file: Any, name: str, index: int, kind: str) -> AnyArray:
    """(480, 640) of one frame."""
    return np.ascontiguousarray(_slice(h5py, file, name, index, (WIDTH_PX, HEIGHT_PX), kind).T)


def _slice(h5py: Any, file: Any, name: str, index: int, shape: tuple[int, ...], kind: str) -> AnyArray:
    """One frame of an array, whose shape and kind are checked before anything is read."""
    item = _member(h5py, file, name)
    if item.shape is None or item.shape[1:] != shape or not item.dtype.str[1:].startswith(kind):
        raise DataError(f"{name} is {item.dtype} of shape {item.shape}; expected {kind}* (frames, {shape})")
    if name in ("labels", "instances") and item.dtype.itemsize > 2:
        raise DataError(f"{name} is {item.dtype}; expected uint8 or uint16")
    if not 0 <= index < min(len(item), MAX_FRAMES):
        raise DataError(f"{name} has {len(item):,} frames; frame {index} is none of them (counted from 0)")
    length = item.chunks[0] if item.chunks else 1
    check_chunks(item, name, MAX_CHUNK_BYTES, lambda start: start[0] <= index < start[0] + length)
    return np.asarray(item[index]).astype(item.dtype.newbyteorder("="))


def _names(h5py: Any, file: Any) -> list[str]:
    """Class names, by the text that each reference leads to."""
    item = _member(h5py, file, "names")
    if item.dtype != h5py.ref_dtype or len(item.shape) != 2 or not 1 <= item.size <= MAX_NAMES:
        raise DataError(f"names is {item.dtype} of shape {item.shape}; expected (1, classes) references")
    check_chunks(item, "names", MAX_CHUNK_BYTES)
    found = []
    for number, reference in enumerate(item[()].ravel(), start=1):
        text = file[reference] if reference else None
        if not isinstance(text, h5py.Dataset) or text.dtype.kind != "u" or not 1 <= text.size <= MAX_NAME_LENGTH:
            raise DataError(f"names {number} leads to no text of 1 to {MAX_NAME_LENGTH} letters; expected a class name")
        check_chunks(text, f"names {number}", MAX_CHUNK_BYTES)
        name = "".join(chr(int(code)) for code in text[()].ravel() & 0xFFFF)
        if not name.isprintable():
            raise DataError(f"names {number} is {name!a}; expected a class name")
        found.append(name)
    return found


def _member(h5py: Any, file: Any, name: str) -> Any:
    """An array in the file itself."""
    link = file.get(name, getlink=True)
    if link is None:
        raise DataError(f"has no {name!r}; expected it (another data set?)")
    item = file[name] if isinstance(link, h5py.HardLink) else None
    if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
        raise DataError(f"{name} is no array in the file itself; expected one")
    return item
