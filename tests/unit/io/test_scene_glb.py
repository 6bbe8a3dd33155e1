"""The GLB of a scene, read by trimesh and taken apart by hand."""

from __future__ import annotations

import io
import json
import struct

import numpy as np
import pytest
import trimesh

from hsbench.errors import SchemaError
from hsbench.geometry.transforms import apply
from hsbench.io.scene_glb import glb_bytes
from hsbench.schema.scene import Scene
from tests.unit.episode_builders import scene


def document(data: bytes) -> dict:
    size, kind = struct.unpack_from("<II", data, 12)
    assert kind == 0x4E4F534A
    return json.loads(data[20 : 20 + size])


def test_another_reader_finds_every_part_where_it_belongs() -> None:
    ours = scene()
    theirs = trimesh.load(io.BytesIO(glb_bytes(ours)), file_type="glb", process=False)
    parts = [(item, part) for item in ours.objects for part in item.parts]
    assert len(theirs.graph.nodes_geometry) == len(parts)
    found = []
    for name in theirs.graph.nodes_geometry:
        pose, geometry = theirs.graph[name]
        found.append(apply(pose, np.asarray(theirs.geometry[geometry].triangles)))
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    for item, part in parts:
        corners = apply(item.scene_T_object, part.vertices)[part.triangles] @ turn.T
        assert any(f.shape == corners.shape and np.allclose(f, corners, atol=1e-6) for f in found)


def test_names_roles_and_rooms_are_in_the_file() -> None:
    ours = scene()
    content = document(glb_bytes(ours))
    names = [node["name"] for node in content["nodes"]]
    assert {"1_wall", "4_dining_table", "7_object"} <= set(names)
    table = next(node for node in content["nodes"] if node["name"] == "4_dining_table")
    assert table["extras"] == {"object_id": 4, "category": "dining_table", "movable": True}
    top, leg = (content["nodes"][k] for k in table["children"])
    assert (top["name"], top["extras"]["role"], top["extras"]["convex"]) == ("top", "top", True)
    assert leg["extras"]["role"] is None
    extras = content["scenes"][0]["extras"]
    assert extras["scene_id"] == ours.scene_id
    assert extras["rooms"][0]["outline_xy"] == ours.rooms[0].outline_xy.tolist()


def test_lengths_and_bounds_are_those_of_the_format() -> None:
    data = glb_bytes(scene())
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    content = document(data)
    size, kind = struct.unpack_from("<II", data, 20 + struct.unpack_from("<I", data, 12)[0])
    assert kind == 0x004E4942
    assert size == content["buffers"][0]["byteLength"]
    assert size % 4 == 0
    binary = data[-size:]
    for accessor in content["accessors"]:
        view = content["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        values = np.frombuffer(
            binary, "<f4" if accessor["componentType"] == 5126 else "<u4",
            accessor["count"] * (3 if accessor["type"] == "VEC3" else 1), view["byteOffset"],
        )  # fmt: skip
        assert values.nbytes == view["byteLength"]
        if accessor["type"] == "VEC3":
            assert values.reshape(-1, 3).min(axis=0).tolist() == accessor["min"]
            assert values.reshape(-1, 3).max(axis=0).tolist() == accessor["max"]


def test_the_same_scene_gives_the_same_bytes() -> None:
    assert glb_bytes(scene()) == glb_bytes(scene())


def test_a_scene_without_objects_is_refused() -> None:
    ours = scene()
    with pytest.raises(SchemaError, match="has no objects"):
        glb_bytes(Scene("s", ours.rooms, 2.5, ()))
