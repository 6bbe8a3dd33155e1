"""3D files written from scratch for tests: glTF with all its data inside, GLB, OBJ; and a small furnished room."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from hsbench.geometry.convex import ConvexSolid, span
from tests.unit.geometry.meshes import Mesh, flipped, joined, of

Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Rows: a point with z up as one with y up."""


def y_up(mesh: Mesh) -> Mesh:
    return mesh[0] @ Y_UP.T, mesh[1]


def node(
    name: str, *meshes: Mesh, materials: tuple[str, ...] = (), children: tuple = (), **more: Any
) -> dict[str, Any]:
    """A node for ``gltf``: more may hold translation, rotation, scale, matrix, extras."""
    return {"name": name, "meshes": meshes, "materials": materials, "children": children, **more}


def gltf(*nodes: dict[str, Any], colours: dict[str, tuple] | None = None) -> dict[str, Any]:
    """A glTF document: every mesh of a node is a primitive; buffers are data URIs, one an array."""
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "accessors": [],
        "bufferViews": [], "buffers": [], "materials": [],
    }  # fmt: skip

    def accessor(values: np.ndarray, kind: str, component: int) -> int:
        data = values.tobytes()
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        document["buffers"].append({"byteLength": len(data), "uri": uri})
        document["bufferViews"].append({"buffer": len(document["buffers"]) - 1, "byteLength": len(data)})
        view = len(document["bufferViews"]) - 1
        document["accessors"].append(
            {"bufferView": view, "componentType": component, "count": len(values), "type": kind}
        )
        return len(document["accessors"]) - 1

    def material(name: str) -> int:
        names = [m["name"] for m in document["materials"]]
        if name not in names:
            entry: dict[str, Any] = {"name": name}
            if colours and name in colours:
                entry["pbrMetallicRoughness"] = {"baseColorFactor": [*colours[name], 1.0]}
            document["materials"].append(entry)
            return len(names)
        return names.index(name)

    def add(item: dict[str, Any]) -> int:
        entry = {k: v for k, v in item.items() if k not in ("meshes", "materials", "children")}
        index = len(document["nodes"])
        document["nodes"].append(entry)
        primitives = []
        for k, (vertices, triangles) in enumerate(item["meshes"]):
            position = accessor(vertices.astype("<f4"), "VEC3", 5126)
            indices = accessor(triangles.astype("<u2").reshape(-1, 1), "SCALAR", 5123)
            primitive = {"attributes": {"POSITION": position}, "indices": indices}
            if item["materials"]:
                primitive["material"] = material(item["materials"][k])
            primitives.append(primitive)
        if primitives:
            document["meshes"].append({"name": "never a label", "primitives": primitives})
            entry["mesh"] = len(document["meshes"]) - 1
        if item["children"]:
            entry["children"] = [add(child) for child in item["children"]]
        return index

    document["scenes"][0]["nodes"] = [add(item) for item in nodes]
    return {key: value for key, value in document.items() if value != []}


def write_gltf(path: Path, document: dict[str, Any]) -> Path:
    path.write_text(json.dumps(document))
    return path


def glb(document: dict[str, Any], binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def obj(named: dict[str, Mesh], word: str = "o") -> str:
    """An OBJ file; corners counted over all objects, from 1."""
    lines, count = ["# made by a test"], 1
    for name, (vertices, triangles) in named.items():
        lines.append(f"{word} {name}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
        lines += [f"f {a + count}/1 {b + count}//2 {c + count}" for a, b, c in triangles]
        count += len(vertices)
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------- a room, z up

WIDTH, DEPTH, HEIGHT = 4.0, 3.0, 2.5


def sheet(*corners: tuple[float, float, float]) -> Mesh:
    return np.array(corners, dtype=np.float64), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


FLOOR = sheet((0, 0, 0), (WIDTH, 0, 0), (WIDTH, DEPTH, 0), (0, DEPTH, 0))
CEILING = sheet((0, 0, HEIGHT), (0, DEPTH, HEIGHT), (WIDTH, DEPTH, HEIGHT), (WIDTH, 0, HEIGHT))
WALLS = joined(
    *(
        sheet((*a, 0), (*a, HEIGHT), (*b, HEIGHT), (*b, 0))
        for a, b in zip(
            ((0, 0), (WIDTH, 0), (WIDTH, DEPTH), (0, DEPTH)),
            ((WIDTH, 0), (WIDTH, DEPTH), (0, DEPTH), (0, 0)),
            strict=True,
        )
    )
)
SHELL = flipped(of(span((0, 0, 0), (WIDTH, DEPTH, HEIGHT))))
TABLE_TOP = span((-0.6, -0.4, 0.7), (0.6, 0.4, 0.74))
TABLE_LEGS = tuple(span((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.7)) for x in (-0.5, 0.5) for y in (-0.3, 0.3))
SOFA = (span((-0.9, -0.4, 0), (0.9, 0.4, 0.4)), span((-0.9, 0.2, 0.4), (0.9, 0.4, 0.8)))
WARDROBE = span((-0.5, -0.3, 0), (0.5, 0.3, 2.0))


def solids(*parts: ConvexSolid) -> Mesh:
    return joined(*(of(part) for part in parts))


ROOM_LABELS = """node,part,category,object,role,movable
room,floor_mat,floor,,,
room,ceiling_mat,ceiling,,,
room,,wall,,,
Table,,dining_table,,,
Table_top,,,,top,
Sofa,,sofa,,seat,true
Wardrobe,,wardrobe,,,
"""


def room_nodes(yaw: float = 0.4) -> tuple[dict[str, Any], ...]:
    """Y up: sheets for the shell in one node of three materials; a turned table of two nodes; sofas; a wardrobe."""
    half = yaw / 2
    table = node(
        "Table",
        children=(
            node("Table_top", y_up(of(TABLE_TOP))),
            node("Table_legs", y_up(solids(*TABLE_LEGS))),
        ),
        translation=[1.2, 0.0, -1.0], rotation=[0.0, float(np.sin(half)), 0.0, float(np.cos(half))],
    )  # fmt: skip
    shell = node("room", y_up(FLOOR), y_up(CEILING), y_up(WALLS), materials=("floor_mat", "ceiling_mat", "paint"))
    sofas = [
        node(name, y_up(solids(*SOFA)), translation=[x, 0.0, -2.4]) for name, x in (("Sofa", 1.0), ("Sofa.001", 3.0))
    ]
    wardrobe = node("Wardrobe", y_up(of(WARDROBE)), translation=[3.4, 0.0, -0.4])
    return (shell, table, *sofas, wardrobe)


# ---------------------------------------------------------------- a scene of several files


def habitat(folder: Path, instances: list[dict[str, Any]], **more: Any) -> Path:
    """A stage with z up whose floor lies in its xy plane, a chair and a configuration of it, and a scene of them."""
    write_gltf(folder / "stage.gltf", gltf(node("Floor", FLOOR), node("Walls", WALLS)))
    (folder / "stage.stage_config.json").write_text(
        json.dumps({"render_asset": "stage.gltf", "up": [0, 0, 1], "front": [0, 1, 0]})
    )
    write_gltf(folder / "chair.gltf", gltf(node("Cube", y_up(of(span((0, 0, 0), (0.4, 0.5, 0.9)))))))
    (folder / "big.object_config.json").write_text(
        json.dumps({"render_asset": "chair.gltf", "scale": [2, 2, 2], **more})
    )
    path = folder / "flat.scene_instance.json"
    path.write_text(json.dumps({"stage_instance": {"template_name": "stages/stage"}, "object_instances": instances}))
    return path
