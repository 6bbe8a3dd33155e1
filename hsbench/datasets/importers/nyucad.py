"""Room models of NYU v2 frames (R. Guo, C. Zou, D. Hoiem, arXiv 1504.02437), the "3D CAD" data that SSCNet trains on.

A MATLAB file a frame, of version 5 or 7.3 (HDF5), with one variable, ``model``:

    objects{k}.model.label                                   a class name of NYU v2
    objects{k}.model.surfaces{i}.polygon.pts{j}.x .y .z      outlines; those of the object "floor" are the room's
    objects{k}.mesh.comp{i}.vertices (V, 3), .faces (F, 3)   triangles, counted from 1; may be missing
    camera.R                                                 (3, 3)

Points are metres with the camera at the origin and y up, z against the view. Ours are (x, -z, y): z up. The camera (x
right, y down, z forward) is turned into that frame by P R' diag(1, -1, -1), P that change of axes, as in SSCNet's
``perpareNYUCADdata.m``. The floor's height is that of its first corner. *Unverified on real data*: the layout is
that script's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers import upright
from hsbench.datasets.importers.mat5 import MAT73_STARTS, read_mat5
from hsbench.datasets.importers.mat73 import read_mat73
from hsbench.errors import DataError
from hsbench.typing import FloatArray, Int32Array

TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""(x, y up, z back) -> (x, y ahead, z up)."""

MAX_OBJECTS = 10_000
MAX_CORNERS = 10_000
MAX_ROWS = 1_000_000
MAX_COORDINATE_M = 100.0


@dataclass(frozen=True, eq=False)
class ModelObject:
    """A class name of NYU v2 and meshes, each (vertices (V, 3), triangles (F, 3)), in the upright frame."""

    label: str
    meshes: tuple[tuple[FloatArray, Int32Array], ...]


@dataclass(frozen=True, eq=False)
class RoomModel:
    """A room in the upright frame (z up, the camera at the origin): objects, outlines (n, 2) and z of the floor."""

    objects: tuple[ModelObject, ...]
    outlines_xy: tuple[FloatArray, ...]
    floor_m: float
    upright_R_camera: FloatArray
    without_mesh: int


def read_nyucad(path: str | Path) -> RoomModel:
    """Path of a model -> the room.

    Raises DataError, naming the file and the object, for damage or another layout; MissingExtraError for HDF5 without
    the extra ``import``.
    """
    path = Path(path)
    model = read_mat73(path, "model") if _is_mat73(path) else _field(read_mat5(path), "model", f"{path}")
    entries = _cell(_field(model, "objects", f"{path}: model"), f"{path}: model.objects", MAX_OBJECTS)
    camera = _field(model, "camera", f"{path}: model")
    rotation = _numbers(_field(camera, "R", f"{path}: model.camera"), f"{path}: model.camera.R", (3, 3))
    objects: list[ModelObject] = []
    outlines: list[FloatArray] = []
    without = 0
    for number, entry in enumerate(entries, start=1):
        where = f"{path}: model.objects{{{number}}}"
        inner = _field(entry, "model", where)
        label = _field(inner, "label", f"{where}.model")
        if not isinstance(label, str) or not label.isprintable() or not label.strip():
            raise DataError(f"{where}.model.label is {ascii(label)[:40]}; expected a class name")
        if label == "floor" and not outlines:
            outlines = _outlines(_field(inner, "surfaces", f"{where}.model"), f"{where}.model.surfaces")
        meshes = _meshes(entry.get("mesh"), f"{where}.mesh")
        objects.append(ModelObject(label.strip(), meshes))
        without += not meshes
    if not outlines:
        raise DataError(f"{path}: no object is labelled floor; expected one, with the outline of the room")
    return RoomModel(
        objects=tuple(item for item in objects if item.meshes),
        outlines_xy=tuple(outline[:, :2] for outline in outlines),
        floor_m=float(outlines[0][0, 2]),
        upright_R_camera=TO_Z_UP @ upright.rotation(rotation, f"{path}: model.camera.R").T @ np.diag([1.0, -1.0, -1.0]),
        without_mesh=without,
    )


def _is_mat73(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(max(map(len, MAT73_STARTS))).startswith(MAT73_STARTS)
    except OSError:
        return False  # the reader of the other version says why


def _outlines(surfaces: Any, where: str) -> list[FloatArray]:
    """(n, 3) corners of every surface."""
    found = []
    for i, surface in enumerate(_cell(surfaces, where, MAX_OBJECTS), start=1):
        at = f"{where}{{{i}}}.polygon"
        polygon = _field(surface, "polygon", f"{where}{{{i}}}")
        corners = _cell(_field(polygon, "pts", at), f"{at}.pts", MAX_CORNERS)
        if len(corners) < 3:
            raise DataError(f"{at}.pts has {len(corners)} corners; expected at least 3")
        rows = [
            [_numbers(_field(corner, axis, f"{at}.pts{{{j}}}"), f"{at}.pts{{{j}}}.{axis}", (1, 1)) for axis in "xyz"]
            for j, corner in enumerate(corners, start=1)
        ]
        found.append(np.array(rows, dtype=np.float64).reshape(-1, 3) @ TO_Z_UP.T)
    if not found:
        raise DataError(f"{where} is empty; expected the outline of the floor")
    return found


def _meshes(mesh: Any, where: str) -> tuple[tuple[FloatArray, Int32Array], ...]:
    """Meshes that have triangles."""
    if mesh is None or (isinstance(mesh, np.ndarray) and not mesh.size):
        return ()
    found = []
    for i, part in enumerate(_cell(_field(mesh, "comp", where), f"{where}.comp", MAX_OBJECTS), start=1):
        at = f"{where}.comp{{{i}}}"
        faces = _field(part, "faces", at)
        if isinstance(faces, np.ndarray) and not faces.size:
            continue
        vertices = _numbers(_field(part, "vertices", at), f"{at}.vertices", (None, 3))
        found.append((vertices @ TO_Z_UP.T, _triangles(faces, f"{at}.faces", len(vertices))))
    return tuple(found)


def _triangles(faces: Any, where: str, count: int) -> Int32Array:
    """(F, 3) indices from 0."""
    if not isinstance(faces, np.ndarray) or faces.ndim != 2 or faces.shape[1] != 3:
        raise DataError(f"{where} is {_kind(faces)}; expected (F, 3) numbers of vertices")
    if len(faces) > MAX_ROWS:
        raise DataError(f"{where} has {len(faces):,} rows; expected at most {MAX_ROWS:,}")
    bad = ~((faces >= 1) & (faces <= count) & (faces == np.floor(faces)))
    if bad.any():
        value = faces[bad][0]
        raise DataError(
            f"{where} row {int(np.argmax(bad.any(axis=1))) + 1} has {value:g}; expected vertices 1 to {count}"
        )
    return (faces - 1).astype(np.int32)


def _field(mapping: Any, key: str, where: str) -> Any:
    if not isinstance(mapping, dict) or key not in mapping:
        raise DataError(f"{where} is {_kind(mapping)} without {key!r}; expected a struct with it (another data set?)")
    return mapping[key]


def _cell(value: Any, where: str, most: int) -> list[Any]:
    """The items of a cell array or of an array of structs; a lone struct is one of itself."""
    items = [value] if isinstance(value, dict) else value
    if isinstance(items, np.ndarray) and not items.size:
        items = []
    if not isinstance(items, list):
        raise DataError(f"{where} is {_kind(value)}; expected a cell array")
    if len(items) > most:
        raise DataError(f"{where} has {len(items):,} items; expected at most {most:,}")
    return items


def _numbers(value: Any, where: str, shape: tuple[int | None, int]) -> FloatArray:
    fits = isinstance(value, np.ndarray) and value.ndim == 2
    if not fits or any(w not in (None, s) for w, s in zip(shape, value.shape, strict=True)):
        wanted = ", ".join("any" if side is None else str(side) for side in shape)
        raise DataError(f"{where} is {_kind(value)}; expected numbers of shape ({wanted})")
    if len(value) > MAX_ROWS:
        raise DataError(f"{where} has {len(value):,} rows; expected at most {MAX_ROWS:,}")
    if not ((value >= -MAX_COORDINATE_M) & (value <= MAX_COORDINATE_M)).all():
        raise DataError(f"{where} has a value that is NaN or beyond {MAX_COORDINATE_M:g} m; expected metres of a room")
    return np.asarray(value, dtype=np.float64)


def _kind(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if isinstance(value, dict | list):
        return "a struct" if isinstance(value, dict) else "a cell array"
    return "a text" if isinstance(value, str) else "of an unknown class"
