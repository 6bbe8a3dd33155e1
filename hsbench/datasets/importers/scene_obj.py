"""Wavefront OBJ files: every ``o`` (in files without one, every ``g``) is a node, every material a mesh of it.

Read by ourselves: labels hang on the names, and common libraries rename or join objects of one kind. Faces of more than
three corners become fans. Colours come from ``Kd`` of the material file, if it is there. The format states neither
units nor which axis is up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hsbench.datasets.importers.scene_source import (
    GREY,
    MAX_FILE_BYTES,
    MAX_NODES,
    TOO_LARGE,
    Rgb,
    SourceMesh,
    SourceNode,
    SourceScene,
    check_triangles,
    checked_mesh,
    referenced,
    rgb,
)
from hsbench.errors import DataError
from hsbench.io.reading import read_limited

SHOWN = 12  # names in one message


def read_obj(path: Path, root: Path) -> SourceScene:
    """The nodes of a file; its material files must lie in ``root``. Raises DataError, naming the line."""
    lines = read_limited(path, MAX_FILE_BYTES, TOO_LARGE).decode("utf-8", "replace").splitlines()
    opens = "o" if any(line.startswith("o ") for line in lines) else "g"
    vertices: list[list[str]] = []
    named: list[str] = []
    nodes: dict[str, dict[str, list[tuple[int, int, int]]]] = {}
    colours: dict[str, Rgb] = {}
    missing: list[str] = []
    files = [path]
    name, material, count = path.stem, "", 0
    for number, line in enumerate(lines, start=1):
        word, _, rest = line.strip().partition(" ")
        if word == "v":
            vertices.append(rest.split()[:3])
        elif word == "f":
            corners = [_corner(text, len(vertices), f"{path} line {number}") for text in rest.split()]
            if len(corners) < 3:
                raise DataError(f"{path} line {number}: a face of {len(corners)} corners; expected three or more")
            faces = nodes.setdefault(name, {}).setdefault(material, [])
            faces += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
            count += len(corners) - 2
            check_triangles(count, path)
        elif word == opens:
            name = rest.strip() or path.stem
            named.append(name)
            if len(nodes) > MAX_NODES:
                raise DataError(f"{path}: more than {MAX_NODES:,} objects; expected at most that")
        elif word == "usemtl":
            material = rest.strip()
        elif word == "mtllib":
            library = referenced(rest.strip(), path.parent, root, path)
            if library.is_file():
                files.append(library)
                colours |= _colours(library)
            else:
                missing.append(rest.strip())
    if not nodes:
        raise DataError(f"{path}: no face; expected objects of lines v and f (another format?)")
    try:
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise DataError(f"{path}: a vertex line is not three numbers ({str(error)[:80]})") from error
    found = []
    for node, materials in nodes.items():
        meshes = []
        for k, (used, faces) in enumerate(materials.items()):
            name = used or f"material {k}"
            mesh = SourceMesh(name, points, np.array(faces, dtype=np.int32), colours.get(used, GREY))
            meshes.append(checked_mesh(mesh, f"{path}: object {node!r}"))
        found.append(SourceNode(node, meshes=tuple(meshes)))
    empty = [name for name in named if name not in nodes]
    notes = (f"{len(empty)} objects without faces are left out: {', '.join(empty[:SHOWN])}",) if empty else ()
    return SourceScene(tuple(found), None, notes, tuple(missing), tuple(files))


def _corner(text: str, count: int, at: str) -> int:
    """Index of a corner ``v/vt/vn``; counted from 1, or from the last vertex backwards if negative."""
    try:
        index = int(text.partition("/")[0])
    except ValueError:
        index = 0
    if not (1 <= index <= count or -count <= index <= -1):
        raise DataError(f"{at}: corner {text[:40]!r}; expected a vertex of 1..{count}")
    return index - 1 if index > 0 else count + index


def _colours(path: Path) -> dict[str, Rgb]:
    """Material -> diffuse colour."""
    colours: dict[str, Rgb] = {}
    name = ""
    for line in read_limited(path, MAX_FILE_BYTES, TOO_LARGE).decode("utf-8", "replace").splitlines():
        word, _, rest = line.strip().partition(" ")
        if word == "newmtl":
            name = rest.strip()
        elif word == "Kd":
            try:
                r, g, b = (float(value) for value in rest.split()[:3])
            except ValueError as error:
                raise DataError(f"{path}: Kd {rest!r}; expected three numbers 0..1") from error
            colours[name] = rgb(np.nan_to_num(np.array([r, g, b])))
    return colours
