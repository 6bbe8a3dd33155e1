"""What the readers of 3D files hand to the importer: a tree of named nodes with triangles; limits; safe references.

Every check that keeps a hostile or a mistaken file from doing harm is made before anything of its size is allocated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import cv2
import numpy as np

from hsbench.errors import DataError
from hsbench.io.decoding import decode_image
from hsbench.typing import AnyArray, FloatArray, Int32Array

MAX_FILE_BYTES = 512 << 20
TOO_LARGE = "split it, or simplify its meshes"
MAX_TRIANGLES = 4_000_000
"""Over all nodes: a furnished flat has tens to hundreds of thousands."""
MAX_NODES = 50_000
MAX_TEXTURE_BYTES = 32 << 20
MAX_TEXTURE_SIDE_PX = 8192
GREY = (150, 150, 150)
"""The colour of what has none, or whose texture is missing."""

Rgb = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class SourceMesh:
    """The triangles of one material of a node: (V, 3) vertices in the node's frame, (T, 3) int32, sRGB colour.

    exact: the vertices are those of one of our own files, in float64.
    """

    material: str
    vertices: AnyArray
    triangles: Int32Array
    colour: Rgb = GREY
    exact: bool = False


@dataclass(frozen=True, eq=False)
class SourceNode:
    """A node: its name, the index of its parent in the list (-1: none, always before it), its (4, 4) affine transform
    to the parent, its meshes, and the extras its author put on it.
    """

    name: str
    parent: int = -1
    parent_T_node: FloatArray = field(default_factory=lambda: np.eye(4))
    meshes: tuple[SourceMesh, ...] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SourceScene:
    """A file as it was read: nodes, parents first; ``up`` (``y`` or ``z``) as the format says, None where it does not;
    what the user should hear; textures that are missing; the files that were read; the extras of the whole scene.
    """

    nodes: tuple[SourceNode, ...]
    up: str | None
    notes: tuple[str, ...] = ()
    missing_textures: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)


def referenced(uri: object, folder: Path, root: Path, by: Path) -> Path:
    """The file that a reference in ``by``, a file of ``folder``, names. Raises DataError outside ``root``."""
    if not isinstance(uri, str) or not uri:
        raise DataError(f"{by}: reference {uri!r}; expected the relative path of a file")
    text = unquote(uri)
    path = folder / text
    if ":" in text or "\0" in text or not path.resolve().is_relative_to(root.resolve()):
        raise DataError(f"{by}: reference {uri[:120]!r} leads out of {root}; expected a file in it (copy it there)")
    return path


def check_triangles(count: int, at: Path) -> None:
    """Raise DataError for more triangles than ``MAX_TRIANGLES``."""
    if count > MAX_TRIANGLES:
        raise DataError(f"{at}: {count:,} triangles; expected at most {MAX_TRIANGLES:,} (simplify its meshes)")


def checked_mesh(mesh: SourceMesh, at: str) -> SourceMesh:
    """The mesh with the vertices that it uses, as float64; an exact one that uses all stays as it is.

    Raises DataError, naming the place, for indices out of range and vertices that are not finite.
    """
    if mesh.triangles.size and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise DataError(f"{at}: triangle index outside 0..{len(mesh.vertices) - 1} (an incomplete copy?)")
    used, compact = np.unique(mesh.triangles, return_inverse=True)
    odd = used[~np.isfinite(mesh.vertices[used]).all(axis=1)]
    if len(odd):
        raise DataError(f"{at}: vertex {odd[0]} is {mesh.vertices[odd[0]].tolist()}; expected finite coordinates")
    if mesh.exact and len(used) == len(mesh.vertices):
        return mesh
    vertices, triangles = mesh.vertices[used].astype(np.float64), compact.reshape(-1, 3).astype(np.int32)
    return replace(mesh, vertices=vertices, triangles=triangles, exact=False)


def mean_colour(data: bytes) -> FloatArray | None:
    """(3,) mean sRGB, 0..1, of a PNG or JPEG texture; None if it is neither, damaged, or too large."""
    if len(data) > MAX_TEXTURE_BYTES or not data.startswith((b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")):
        return None
    sides = (int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"))
    if data[0] == 0x89 and max(sides) > MAX_TEXTURE_SIDE_PX:  # a JPEG is shrunk while it is read, a PNG is not
        return None
    picture, _ = decode_image(data, cv2.IMREAD_REDUCED_COLOR_8)
    return None if picture is None else np.asarray(picture.reshape(-1, 3).mean(axis=0)[::-1] / 255.0)


def rgb(colour: FloatArray) -> Rgb:
    """(3,) sRGB 0..1 as three integers 0..255."""
    r, g, b = (round(255 * min(max(float(c), 0.0), 1.0)) for c in colour)
    return r, g, b
