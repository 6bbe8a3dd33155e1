"""glTF 2.0 files, ``.glb`` or ``.gltf`` with its buffers: nodes with transforms, triangles, colours and extras.

Read by ourselves, not by a library: names of nodes must stay what they are (labels hang on them), every length is
checked before it is believed, and reading needs no extra package. Khronos glTF 2.0 specification: +Y up, metres,
little endian. Draco and quantised meshes, sparse accessors and other required extensions are refused; skins and
morph targets are read in their rest shape; points and lines are left out.
"""

from __future__ import annotations

import base64
import binascii
import struct
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.datasets.importers.scene_source import (
    GREY,
    MAX_FILE_BYTES,
    MAX_NODES,
    MAX_TEXTURE_BYTES,
    TOO_LARGE,
    Rgb,
    SourceMesh,
    SourceNode,
    SourceScene,
    check_triangles,
    checked_mesh,
    mean_colour,
    referenced,
    rgb,
)
from hsbench.errors import DataError
from hsbench.geometry.transforms import matrix_from_quaternion
from hsbench.io.reading import read_limited
from hsbench.io.strict_json import parse_json
from hsbench.typing import AnyArray, FloatArray, Int32Array

GLB_HEADER_BYTES = 12
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
FLOAT = 5126
INDEX_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4"}
TRIANGLES, STRIP, FAN = 4, 5, 6
UNIT = 0.01  # what the squared length of a quaternion may be off by: files round
LARGEST = 1e9  # entries of a transform beyond this place nothing
HARMLESS_EXTENSIONS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_")
"""Beginnings of the names of extensions that leave the shape as it is."""


def read_gltf(path: Path, root: Path) -> SourceScene:
    """The default scene of a file; what it refers to must lie in ``root``. Raises DataError, naming the item."""
    data = read_limited(path, MAX_FILE_BYTES, TOO_LARGE)
    if not data:
        raise DataError(f"{path}: is empty; expected a glTF 2.0 file (an incomplete copy?)")
    try:
        document, binary = _split(path, data) if data[:4] == b"glTF" else (parse_json(data), None)
        return _Reader(path, root, document, binary).scene()
    except DataError as error:
        raise DataError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from error
    except (
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
        IndexError,
        OverflowError,
        RecursionError,
        struct.error,
    ) as error:
        found = str(error).partition("\n")[0]
        raise DataError(f"{path}: {type(error).__name__} on {found}; expected a glTF 2.0 file") from error


def _split(path: Path, data: bytes) -> tuple[Any, bytes | None]:
    """JSON and binary chunk of a GLB file."""
    _, version, length = struct.unpack_from("<4sII", data.ljust(GLB_HEADER_BYTES, b"\0"))
    if len(data) < GLB_HEADER_BYTES or length != len(data):
        raise DataError(f"{path}: {len(data):,} bytes; expected {length:,}, as its header says (an incomplete copy?)")
    if version != 2:
        raise DataError(f"{path}: GLB of version {version}; expected version 2")
    document, binary, at = None, None, 12
    while at + 8 <= len(data):
        size, kind = struct.unpack_from("<II", data, at)
        chunk = data[at + 8 : at + 8 + size]
        if len(chunk) != size:
            raise DataError(f"{path}: a chunk of {size:,} bytes runs past the end (an incomplete copy?)")
        if kind == JSON_CHUNK and document is None:
            document = parse_json(chunk)
        elif kind == BINARY_CHUNK and binary is None:
            binary = chunk
        at += 8 + size
    if document is None:
        raise DataError(f"{path}: holds no JSON chunk; expected a GLB file")
    return document, binary


class _Reader:
    """One document, its buffers read once."""

    def __init__(self, path: Path, root: Path, document: Any, binary: bytes | None) -> None:
        self.path, self.root, self.document, self.binary = path, root, document, binary
        self.buffers: dict[int, bytes] = {}
        self.read: dict[int, tuple[SourceMesh, ...]] = {}
        self.colours: dict[int, Rgb] = {}
        self.notes: list[str] = []
        self.missing: list[str] = []
        self.files: list[Path] = [path]
        self.triangles = 0
        if not isinstance(document, dict) or str(document.get("asset", {}).get("version", "")).split(".")[0] != "2":
            raise DataError("asset.version is not 2; expected glTF 2.0")
        for name in document.get("extensionsRequired", ()):
            if not str(name).startswith(HARMLESS_EXTENSIONS):
                raise DataError(f"needs extension {name}; expected plain meshes (export it without compression)")

    def scene(self) -> SourceScene:
        """All nodes of the default scene, parents first."""
        nodes: list[SourceNode] = []
        scene = self.item("scenes", self.document.get("scene", 0))
        seen: set[int] = set()
        waiting = [(index, -1) for index in reversed(scene.get("nodes", []))]
        while waiting:
            index, parent = waiting.pop()
            entry = self.item("nodes", index)
            if index in seen or len(nodes) >= MAX_NODES:
                why = "is reached twice" if index in seen else f"is one of more than {MAX_NODES:,}"
                raise DataError(f"node {index} {why}; expected a tree of at most {MAX_NODES:,} nodes")
            seen.add(index)
            name = str(entry.get("name") or f"node {index}")
            meshes = self.meshes(entry["mesh"]) if "mesh" in entry else ()
            self.triangles += sum(len(mesh.triangles) for mesh in meshes)
            check_triangles(self.triangles, self.path)
            nodes.append(SourceNode(name, parent, _transform(entry, name), meshes, _extras(entry)))
            waiting += [(child, len(nodes) - 1) for child in reversed(entry.get("children", []))]
        lists = tuple(self.notes), tuple(self.missing), tuple(self.files)
        return SourceScene(tuple(nodes), "y", *lists, _extras(scene))

    def item(self, kind: str, index: Any) -> Any:
        """Entry ``index`` of a list of the document."""
        entries = self.document.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise DataError(f"refers to {kind}[{index}]; expected 0..{len(entries) - 1}")
        return entries[index]

    def meshes(self, index: int) -> tuple[SourceMesh, ...]:
        """The triangles of a mesh, one entry a primitive, named by its material; read once."""
        if index not in self.read:
            primitives = self.item("meshes", index)["primitives"]
            found = (self.mesh(f"meshes[{index}]", k, primitive) for k, primitive in enumerate(primitives))
            self.read[index] = tuple(mesh for mesh in found if mesh is not None)
        return self.read[index]

    def mesh(self, at: str, k: int, primitive: Any) -> SourceMesh | None:
        """Primitive ``k`` of a mesh, None with a note if it has no triangles."""
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            self.notes.append(f"{at}: its points or lines are left out")
            return None
        if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
            raise DataError(f"{at} is Draco-compressed; expected plain meshes (export it without compression)")
        points = self.accessor(primitive["attributes"]["POSITION"], "VEC3", {FLOAT: "<f4"})
        flat = np.arange(len(points))
        if "indices" in primitive:
            flat = self.accessor(primitive["indices"], "SCALAR", INDEX_TYPES)[:, 0].astype(np.int64)
        if mode == TRIANGLES and len(flat) % 3:
            raise DataError(f"{at} has {len(flat)} indices; expected three for each triangle")
        material = primitive.get("material")
        name = "" if material is None else str(self.item("materials", material).get("name") or f"material {material}")
        exact = self.exact_points(_extras(primitive).get("float64"), points)
        vertices = points if exact is None else exact
        colour = self.colour(material)
        return checked_mesh(
            SourceMesh(name or f"primitive {k}", vertices, _triangles(flat, mode), colour, exact is not None), at
        )

    def exact_points(self, view: Any, points: AnyArray) -> FloatArray | None:
        """The vertices in float64 that files of ours carry (``io.scene_glb``), None unless they are the accessor's."""
        if not isinstance(view, int) or not 0 <= view < len(self.document["bufferViews"]):
            return None
        data = self.view(view)
        if len(data) != points.size * 8:
            return None
        exact = np.frombuffer(data, "<f8").reshape(points.shape)
        return exact if np.array_equal(exact.astype("<f4"), points) else None

    def accessor(self, index: int, kind: str, types: dict[int, str]) -> AnyArray:
        """(count, n) values of an accessor, n = 3 for VEC3, 1 for SCALAR."""
        entry = self.item("accessors", index)
        count = entry["count"]
        if "sparse" in entry or "bufferView" not in entry or entry.get("normalized") or entry["type"] != kind:
            raise DataError(f"accessors[{index}] is sparse, empty, normalised or no {kind}; expected plain values")
        if entry["componentType"] not in types:
            raise DataError(f"accessors[{index}] has componentType {entry['componentType']}; expected {list(types)}")
        dtype, width = np.dtype(types[entry["componentType"]]), 3 if kind == "VEC3" else 1
        view = self.view(entry["bufferView"])
        stride = self.item("bufferViews", entry["bufferView"]).get("byteStride", dtype.itemsize * width)
        start = entry.get("byteOffset", 0)
        need = start + stride * (count - 1) + dtype.itemsize * width
        if count == 0:
            return np.empty((0, width), dtype)
        if not (count > 0 and start >= 0 and stride >= dtype.itemsize * width and need <= len(view)):
            raise DataError(f"accessors[{index}] needs {need:,} bytes of a view of {len(view):,} (an incomplete copy?)")
        return np.array(np.ndarray((count, width), dtype, view, start, (stride, dtype.itemsize)))

    def view(self, index: int) -> bytes:
        """The bytes of a buffer view."""
        entry = self.item("bufferViews", index)
        buffer = self.buffer(entry["buffer"])
        start, length = entry.get("byteOffset", 0), entry["byteLength"]
        if not 0 <= start <= start + length <= len(buffer):
            raise DataError(
                f"bufferViews[{index}] ends at {start + length:,} of {len(buffer):,} bytes (an incomplete copy?)"
            )
        return buffer[start : start + length]

    def buffer(self, index: int) -> bytes:
        """The bytes of a buffer: the binary chunk, a data URI, or a file beside this one."""
        if index not in self.buffers:
            entry = self.item("buffers", index)
            if "uri" not in entry:
                if index or self.binary is None:
                    raise DataError(f"buffers[{index}] has no uri; expected one, or the binary chunk of a GLB file")
                self.buffers[index] = self.binary
            else:
                self.buffers[index] = self.resource(entry["uri"])
            if len(self.buffers[index]) < entry["byteLength"]:
                raise DataError(
                    f"buffers[{index}] has {len(self.buffers[index]):,} bytes; expected {entry['byteLength']:,}"
                    " (an incomplete copy?)"
                )
        return self.buffers[index]

    def resource(self, uri: Any) -> bytes:
        """The bytes behind a URI."""
        if isinstance(uri, str) and uri.startswith("data:"):
            header, _, body = uri.partition(",")
            if not header.endswith(";base64"):
                raise DataError(f"data URI {header[:60]!r}; expected base64")
            try:
                return base64.b64decode(body, validate=True)
            except binascii.Error as error:
                raise DataError(f"data URI is no base64 ({error})") from error
        path = referenced(uri, self.path.parent, self.root, self.path)
        self.files.append(path)
        return read_limited(path, MAX_FILE_BYTES, TOO_LARGE)

    def colour(self, material: int | None) -> Rgb:
        """SRGB colour of a material: its factor times the mean of its texture; grey where that is missing."""
        if material is None:
            return GREY
        if material not in self.colours:
            surface = self.item("materials", material).get("pbrMetallicRoughness", {})
            factor = np.array(surface.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])[:3], dtype=np.float64)
            colour = np.where(factor <= 0.0031308, 12.92 * factor, 1.055 * np.maximum(factor, 0) ** (1 / 2.4) - 0.055)
            texture: FloatArray | None = np.ones(3)
            if "baseColorTexture" in surface:
                texture = self.texture(surface["baseColorTexture"]["index"])
            self.colours[material] = GREY if texture is None else rgb(colour * texture)
        return self.colours[material]

    def texture(self, index: int) -> FloatArray | None:
        """(3,) mean sRGB of a texture, None where it cannot be read: then it counts as missing."""
        image = self.item("images", self.item("textures", index).get("source"))
        name = str(image.get("uri", f"image {index}"))[:80]
        if "uri" not in image:
            mean = mean_colour(self.view(image["bufferView"]))
        elif str(image["uri"]).startswith("data:"):
            mean = mean_colour(self.resource(image["uri"]))
        else:
            path = referenced(image["uri"], self.path.parent, self.root, self.path)
            mean = mean_colour(read_limited(path, MAX_TEXTURE_BYTES)) if path.is_file() else None
        if mean is None:
            self.missing.append(name)
        return mean


def _extras(entry: Any) -> dict[str, Any]:
    """What the author of a file put on an entry."""
    extras = entry.get("extras")
    return extras if isinstance(extras, dict) else {}


def _transform(entry: Any, name: str) -> FloatArray:
    """(4, 4) transform of a node: its matrix (stored by columns), or translation times rotation times scale."""
    rotation = np.array(entry.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    if rotation.shape != (4,) or not abs(np.clip(rotation, -2, 2) @ np.clip(rotation, -2, 2) - 1) < UNIT:
        raise DataError(f"node {name!r}: rotation {rotation.tolist()}; expected a unit quaternion x y z w")
    if "matrix" in entry:
        matrix = np.array(entry["matrix"], dtype=np.float64).reshape(4, 4).T
    else:
        matrix = np.eye(4)
        matrix[:3, :3] = matrix_from_quaternion(np.roll(rotation, 1)) * np.array(entry.get("scale", (1.0, 1.0, 1.0)))
        matrix[:3, 3] = entry.get("translation", (0.0, 0.0, 0.0))
    if not (np.abs(matrix) <= LARGEST).all() or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise DataError(f"node {name!r}: transform {matrix.tolist()}; expected a finite affine matrix")
    return matrix


def _triangles(flat: AnyArray, mode: int) -> Int32Array:
    """(T, 3) triangles of a list, a strip (every other one turned) or a fan of indices."""
    if mode == TRIANGLES:
        return np.ascontiguousarray(flat.reshape(-1, 3), dtype=np.int32)
    k = np.arange(max(len(flat) - 2, 0))
    if mode == STRIP:
        corners = np.column_stack([k, k + 1 + k % 2, k + 2 - k % 2])
    else:
        corners = np.column_stack([k + 1, k + 2, np.zeros_like(k)])
    return flat[corners].astype(np.int32).reshape(-1, 3)
