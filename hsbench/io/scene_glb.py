"""A scene as one GLB file (binary glTF 2.0), for viewers, Blender and game engines.

Tree: one root node that turns z up into glTF's y up; under it a node ``<id>_<category>`` for each object, with its pose
as matrix; under that a node for each part. Extras carry what glTF has no place for: of an object ``object_id``,
``category`` and ``movable``; of a part its ``role``, ``texture`` and whether it is ``convex``; of the scene its id,
style, rooms and height. Positions are float32 in the object frame, as glTF wants them; beside them lie the same in
float64, in a buffer view that the primitive's extras name (``float64``). Colours are materials, sRGB turned to linear.
``hsbench import scene`` reads such a file without a label table, and without loss.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from hsbench import __version__
from hsbench.errors import SchemaError
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.typing import AnyArray

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
FLOAT, UNSIGNED_INT = 5126, 5125
VERTEX_BUFFER, INDEX_BUFFER = 34962, 34963
Y_UP_T_Z_UP = ((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1))
"""Turn from z up to y up about x, as rows: our -y, the front of objects, becomes glTF's +z."""

Rgb = tuple[int, int, int]


def glb_bytes(scene: Scene) -> bytes:
    """The file of a scene; the same scene gives the same bytes. Raises SchemaError for a scene without objects."""
    if not scene.objects:
        raise SchemaError(f"scene {scene.scene_id} has no objects; glTF has no way to say nothing")
    document = _Document()
    children = [document.add_object(item) for item in scene.objects]
    root = document.add(
        "nodes", {"name": scene.scene_id, "matrix": _columns(np.array(Y_UP_T_Z_UP)), "children": children}
    )
    extras = {
        "scene_id": scene.scene_id,
        "style": scene.style,
        "height_m": scene.height_m,
        "rooms": [{"room_type": r.room_type, "outline_xy": r.outline_xy.tolist()} for r in scene.rooms],
    }
    header = {
        "asset": {"version": "2.0", "generator": f"hsbench {__version__}"},
        "scene": 0,
        "scenes": [{"name": scene.scene_id, "nodes": [root], "extras": extras}],
        "buffers": [{"byteLength": len(document.data)}],
    }
    text = json.dumps({**header, **document.lists}, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(document.data)
    return b"".join(
        (
            struct.pack("<4sII", b"glTF", 2, length),
            struct.pack("<II", len(text), JSON_CHUNK), text,
            struct.pack("<II", len(document.data), BINARY_CHUNK), bytes(document.data),
        )
    )  # fmt: skip


class _Document:
    """The lists of a glTF document and its one buffer, grown entry by entry."""

    def __init__(self) -> None:
        self.lists: dict[str, list[Any]] = {}
        self.data = bytearray()
        self.materials: dict[Rgb, int] = {}

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Append an entry to a list of the document; its index."""
        entries = self.lists.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def add_object(self, item: SceneObject) -> int:
        """The node of an object, its parts under it."""
        parts = [self.add_part(part) for part in item.parts]
        node = {
            "name": f"{item.object_id}_{item.category_name}",
            "matrix": _columns(item.scene_T_object),
            "children": parts,
            "extras": {"object_id": item.object_id, "category": item.category_name, "movable": item.movable},
        }
        return self.add("nodes", node)

    def add_part(self, part: Part) -> int:
        """The node of a part, with its mesh."""
        vertices = part.vertices.astype("<f4")
        low, high = vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()
        position = self.add(
            "accessors",
            {
                "bufferView": self.add_view(vertices, VERTEX_BUFFER), "componentType": FLOAT, "count": len(vertices),
                "type": "VEC3", "min": low, "max": high,
            },
        )  # fmt: skip
        indices = part.triangles.astype("<u4").ravel()
        index = self.add(
            "accessors",
            {
                "bufferView": self.add_view(indices, INDEX_BUFFER), "componentType": UNSIGNED_INT,
                "count": len(indices), "type": "SCALAR",
            },
        )  # fmt: skip
        primitive = {
            "attributes": {"POSITION": position}, "indices": index, "material": self.material(part.colour),
            "extras": {"float64": self.add_view(part.vertices.astype("<f8"))},
        }  # fmt: skip
        mesh = self.add("meshes", {"name": part.name, "primitives": [primitive]})
        extras = {"role": part.role, "texture": part.texture, "convex": part.solid is not None}
        return self.add("nodes", {"name": part.name, "mesh": mesh, "extras": extras})

    def add_view(self, values: AnyArray, target: int | None = None) -> int:
        """A buffer view of an array, on a border of four bytes as all here are."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        self.data += values.tobytes()
        return self.add("bufferViews", view if target is None else {**view, "target": target})

    def material(self, colour: Rgb) -> int:
        """The material of an sRGB colour."""
        if colour not in self.materials:
            srgb = np.array(colour) / 255
            linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
            factor = [*(round(float(c), 6) for c in linear), 1.0]
            surface = {"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": 0.9}
            name = "#{:02x}{:02x}{:02x}".format(*colour)
            self.materials[colour] = self.add(
                "materials", {"name": name, "pbrMetallicRoughness": surface, "doubleSided": True}
            )
        return self.materials[colour]


def _columns(matrix: AnyArray) -> list[float]:
    """The 16 numbers of a (4, 4) matrix, column by column, as glTF stores them."""
    return [float(value) for value in matrix.T.ravel()]
