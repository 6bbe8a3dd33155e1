"""PLY triangle meshes: ASCII and binary, vertices with any scalar properties, faces of three corners.

Read by ourselves, since what matters here, labels and errors that name the place, is what common readers drop.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hsbench.datasets.importers.scene_source import MAX_FILE_BYTES, MAX_TRIANGLES, TOO_LARGE
from hsbench.errors import DataError
from hsbench.io.reading import read_limited
from hsbench.typing import AnyArray, FloatArray, Int32Array

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float32": "f4", "float64": "f8"},
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
END = b"end_header"
MAX_HEADER_BYTES = 1 << 14
MAX_PROPERTIES = 64
LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, eq=False)
class PlyMesh:
    """points: (V, 3) float64; triangles: (T, 3) int32; values: every property of the vertices, a record each."""

    points: FloatArray
    triangles: Int32Array
    values: AnyArray


def read_ply(path: Path) -> PlyMesh:
    """A mesh. Raises DataError, naming the file and what is wrong: header, size, faces, or coordinates."""
    data = read_limited(path, MAX_FILE_BYTES, TOO_LARGE)
    order, elements, start = _header(data, path)
    names = [name for name, _, _ in elements]
    if names != ["vertex", "face"]:
        raise DataError(f"{path}: elements {', '.join(names)[:80] or 'missing'}; expected vertex, then face")
    (_, vertex_count, vertex_type), (_, face_count, face_type) = elements
    if vertex_type.names is None or not {"x", "y", "z"} <= set(vertex_type.names):
        raise DataError(f"{path}: vertices have {', '.join(vertex_type.names or ())[:80]}; expected x, y, z")
    if not 0 < face_count <= MAX_TRIANGLES or not 0 < vertex_count <= 3 * MAX_TRIANGLES:
        raise DataError(
            f"{path}: {vertex_count:,} vertices, {face_count:,} faces; expected 1 to {MAX_TRIANGLES:,} faces"
        )
    read = _text if order == "" else _binary
    vertices, faces = read(data[start:], vertex_type, vertex_count, face_type, face_count, path)
    if (faces["count"] != 3).any():
        at = int(np.argmax(faces["count"] != 3))
        raise DataError(f"{path}: face {at} has {faces['count'][at]} corners; expected triangles")
    corners = faces["corners"].astype(np.int64)
    points = np.column_stack([vertices[axis].astype(np.float64) for axis in "xyz"])
    if not np.isfinite(points).all():
        at = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise DataError(f"{path}: vertex {at} is {points[at].tolist()}; expected finite coordinates")
    if not 0 <= corners.min() <= corners.max() < vertex_count:
        at = int(np.argmax(((corners < 0) | (corners >= vertex_count)).any(axis=1)))
        raise DataError(f"{path}: face {at} has corners {corners[at].tolist()}; expected 0 to {vertex_count - 1}")
    return PlyMesh(points, corners.astype(np.int32), vertices)


def _header(data: bytes, path: Path) -> tuple[str, list[tuple[str, int, np.dtype[np.void]]], int]:
    """(byte order, elements with their counts and types, where they start)."""
    end = data[:MAX_HEADER_BYTES].find(END)
    if not data.startswith(b"ply") or end < 0:
        raise DataError(f"{path}: has no header of PLY; expected a mesh (an incomplete copy?)")
    line_end = data.find(b"\n", end)
    lines = [line.split() for line in data[:end].decode("latin-1").splitlines()[1:]]
    order: str | None = None
    found: list[tuple[str, int, list[tuple[str, str] | tuple[str, str, tuple[int, ...]]]]] = []
    for number, words in enumerate(lines, start=2):
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = ORDERS[words[1]]
            elif words[0] == "element":
                found.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"] and words[4] in LISTS:
                how_many, corner = TYPES[words[2]], TYPES[words[3]]
                if "f" in how_many + corner:
                    raise ValueError
                found[-1][2].extend([("count", how_many), ("corners", corner, (3,))])
            elif words[0] == "property" and words[1] != "list":
                found[-1][2].append((words[2], TYPES[words[1]]))
            else:
                raise ValueError
        except (KeyError, IndexError, ValueError) as error:
            shown = ascii(" ".join(words))[:60]
            raise DataError(f"{path} line {number}: {shown}; expected a line of a mesh's header") from error
    if order is None or line_end < 0:
        raise DataError(f"{path}: the header names no format; expected {', '.join(ORDERS)}")
    elements = []
    for name, count, fields in found:
        typed = [(field[0], order + field[1], *field[2:]) for field in fields]
        try:
            if len(typed) > MAX_PROPERTIES:
                raise ValueError(f"{len(typed)} properties")
            elements.append((name, count, np.dtype(typed)))
        except (ValueError, TypeError) as error:
            raise DataError(f"{path}: element {name[:40]!r} has properties of no use ({error})") from error
    if [name for name, _, _ in elements] == ["vertex", "face"] and "corners" not in (elements[1][2].names or ()):
        raise DataError(f"{path}: faces have no list vertex_indices; expected triangles")
    return order, elements, line_end + 1


def _binary(
    data: bytes, vertex: np.dtype[np.void], vertex_count: int, face: np.dtype[np.void], face_count: int, path: Path
) -> tuple[AnyArray, AnyArray]:
    """Records of vertices and faces. A face of other than three corners shifts what follows, and is found out."""
    needed = vertex.itemsize * vertex_count + face.itemsize * face_count
    vertices_end = vertex.itemsize * vertex_count
    if len(data) < needed:
        whole = data[vertices_end:]
        faces = np.frombuffer(whole, face, len(whole) // face.itemsize)
        odd = f"; face {int(np.argmax(faces['count'] != 3))} is no triangle" if (faces["count"] != 3).any() else ""
        raise DataError(
            f"{path}: {len(data):,} bytes follow the header; expected {needed:,} (an incomplete copy?){odd}"
        )
    return np.frombuffer(data, vertex, vertex_count), np.frombuffer(data, face, face_count, vertices_end)


def _text(
    data: bytes, vertex: np.dtype[np.void], vertex_count: int, face: np.dtype[np.void], face_count: int, path: Path
) -> tuple[AnyArray, AnyArray]:
    lines = data.decode("latin-1").splitlines()
    if len(lines) < vertex_count + face_count:
        raise DataError(
            f"{path}: {len(lines):,} lines follow the header; expected {vertex_count + face_count:,}"
            " (an incomplete copy?)"
        )
    tables = []
    for start, count, kind in ((0, vertex_count, vertex), (vertex_count, face_count, face)):
        rows = np.zeros(count, dtype=kind)
        width = sum(int(np.prod(kind[name].shape)) for name in kind.names or ())
        for index in range(count):
            words = lines[start + index].split()
            try:
                if len(words) != width:
                    raise ValueError
                rows[index] = _record([float(word) for word in words], kind)
            except (ValueError, OverflowError) as error:
                shown = ascii(lines[start + index])[:60]
                raise DataError(f"{path}: row {start + index} is {shown}; expected {width} numbers") from error
        tables.append(rows)
    return tables[0], tables[1]


def _record(values: list[float], kind: np.dtype[np.void]) -> tuple[object, ...]:
    """The values of a line as numpy wants them for a record; whole numbers must be whole and fit."""
    found: list[object] = []
    at = 0
    for name in kind.names or ():
        shape, base = kind[name].shape, kind[name].base
        size = int(np.prod(shape))
        taken = values[at : at + size]
        at += size
        if base.kind in "iu":
            limits = np.iinfo(base)
            if not all(v == int(v) and limits.min <= v <= limits.max for v in taken):
                raise ValueError
            taken = [int(v) for v in taken]
        found.append(tuple(taken) if shape else taken[0])
    return tuple(found)
