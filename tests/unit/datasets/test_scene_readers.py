"""glTF, OBJ and label tables as files: what is read, and what is refused."""

from __future__ import annotations

import base64
import contextlib
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.datasets.importers import scene_obj, scene_source
from hsbench.datasets.importers.scene_gltf import read_gltf
from hsbench.datasets.importers.scene_labels import nearest_names, read_labels
from hsbench.datasets.importers.scene_obj import read_obj
from hsbench.datasets.importers.scene_placement import read_source, world_transforms
from hsbench.datasets.importers.scene_source import GREY, SourceScene
from hsbench.errors import DataError
from hsbench.geometry.convex import box
from hsbench.geometry.transforms import apply
from tests.unit.datasets.scene_files import glb, gltf, node, obj, room_nodes, write_gltf
from tests.unit.geometry.meshes import of, torus

BOX = of(box((0.4, 0.6, 0.8)))


def world_meshes(scene: SourceScene) -> dict[str, list[np.ndarray]]:
    """(T, 3, 3) world corners of each mesh of each node."""
    found: dict[str, list[np.ndarray]] = {}
    for transform, entry in zip(world_transforms(scene.nodes), scene.nodes, strict=True):
        for mesh in entry.meshes:
            found.setdefault(entry.name, []).append(apply(transform, mesh.vertices)[mesh.triangles])
    return found


# ---------------------------------------------------------------- glTF


def test_what_trimesh_writes_is_read_with_its_names_and_transforms(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    scene = trimesh.Scene()
    expected = {}
    for k, name in enumerate(("Sofa", "Sofa.001", "door knob", "Tür")):
        mesh = trimesh.creation.box(rng.uniform(0.1, 1, 3)) if k % 2 else trimesh.creation.icosphere(subdivisions=1)
        pose = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
        pose[:3, 3] = rng.uniform(-2, 2, 3)
        scene.add_geometry(mesh, node_name=name, geom_name=f"mesh{k}", transform=pose)
        expected[name] = mesh.copy().apply_transform(pose).triangles
    path = tmp_path / "scene.glb"
    path.write_bytes(scene.export(file_type="glb"))
    found = world_meshes(read_gltf(path, tmp_path))
    assert set(found) == set(expected)
    for name, triangles in expected.items():
        assert np.allclose(found[name][0], triangles, atol=1e-6)


def test_the_chain_of_nodes_is_multiplied_out(tmp_path: Path) -> None:
    matrix = [0.0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1]  # by columns: twice as large, a quarter turn, a shift
    child = node("child", BOX, rotation=[0, 0, 0.7071067811865476, 0.7071067811865476], scale=[1, 2, 3])
    path = write_gltf(tmp_path / "a.gltf", gltf(node("top", matrix=matrix, children=(child,))))
    ((corners,),) = world_meshes(read_gltf(path, tmp_path)).values()
    points = BOX[0] * [1, 2, 3]
    points = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])  # the child's quarter turn
    points = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]]) * 2 + [5, 6, 7]
    assert np.allclose(corners, points[BOX[1]], atol=1e-6)


def test_names_are_those_of_nodes_and_materials_never_of_meshes(tmp_path: Path) -> None:
    path = write_gltf(
        tmp_path / "a.gltf",
        gltf(node("Chair.001", BOX, BOX, materials=("wood", "cloth"), extras={"category": "chair"}),
             colours={"wood": (1.0, 0.2158605, 0.0)}),
    )  # fmt: skip
    scene = read_gltf(path, tmp_path)
    (chair,) = scene.nodes
    assert chair.name == "Chair.001"
    assert chair.extras == {"category": "chair"}
    assert [(m.material, m.colour) for m in chair.meshes] == [("wood", (255, 128, 0)), ("cloth", (255, 255, 255))]
    assert scene.up == "y"


@pytest.mark.parametrize("mode", [5, 6])
def test_strips_and_fans_become_triangles(tmp_path: Path, mode: int) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]])
    if mode == 6:
        angles = np.linspace(0, 3, 4)
        points = np.concatenate([[[0, 0, 0]], np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])])
    document = gltf(node("strip", (points, np.zeros((1, 3), np.int32))))
    document["meshes"][0]["primitives"][0] |= {"mode": mode}
    document["meshes"][0]["primitives"][0].pop("indices")
    mesh = read_gltf(write_gltf(tmp_path / "a.gltf", document), tmp_path).nodes[0].meshes[0]
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert len(mesh.triangles) == 3
    assert (np.cross(b - a, c - a)[:, 2] > 0.1).all()  # all face the same way


def test_a_glb_keeps_its_buffer_inside(tmp_path: Path) -> None:
    document = gltf(node("box", BOX))
    binary, start = b"", 0
    for buffer, view in zip(document["buffers"], document["bufferViews"], strict=True):
        data = base64.b64decode(buffer["uri"].partition(",")[2])
        view |= {"buffer": 0, "byteOffset": start}
        binary, start = binary + data, start + len(data)
    document["buffers"] = [{"byteLength": len(binary)}]
    path = tmp_path / "a.glb"
    path.write_bytes(glb(document, binary))
    ((corners,),) = world_meshes(read_gltf(path, tmp_path)).values()
    assert np.allclose(corners, BOX[0][BOX[1]], atol=1e-6)


def textured(uri: str) -> dict[str, Any]:
    document = gltf(node("box", BOX, materials=("painted",)))
    document["materials"][0]["pbrMetallicRoughness"] = {"baseColorTexture": {"index": 0}}
    return document | {"textures": [{"source": 0}], "images": [{"uri": uri}]}


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_texture_gives_its_mean_colour(tmp_path: Path, suffix: str) -> None:
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:, :32] = (40, 100, 200)  # bgr
    picture[:, 32:] = (20, 60, 100)
    cv2.imwrite(str(tmp_path / f"wood 1.{suffix}"), picture)
    scene = read_gltf(write_gltf(tmp_path / "a.gltf", textured(f"wood%201.{suffix}")), tmp_path)
    assert np.allclose(scene.nodes[0].meshes[0].colour, (150, 80, 30), atol=3)
    assert scene.missing_textures == ()


@pytest.mark.parametrize("content", [None, b"no picture", b"\x89PNG\r\n\x1a\n" + b"\0" * 40])
def test_a_missing_or_broken_texture_is_grey_and_named(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "wood.png").write_bytes(content)
    scene = read_gltf(write_gltf(tmp_path / "a.gltf", textured("wood.png")), tmp_path)
    assert scene.nodes[0].meshes[0].colour == GREY
    assert scene.missing_textures == ("wood.png",)


def test_a_png_that_claims_to_be_huge_is_not_opened(tmp_path: Path) -> None:
    _, data = cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))
    lie = bytearray(data.tobytes())
    lie[16:24] = (60000).to_bytes(4, "big") * 2
    (tmp_path / "wood.png").write_bytes(bytes(lie))
    assert read_gltf(write_gltf(tmp_path / "a.gltf", textured("wood.png")), tmp_path).missing_textures == ("wood.png",)


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "http://x/y.bin", "%2e%2e/secret.bin", "link.bin"]
)
def test_references_that_lead_out_of_the_folder_are_refused(tmp_path: Path, uri: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.bin").write_bytes(b"\0" * 4096)
    (inside / "link.bin").symlink_to(tmp_path / "secret.bin")
    document = gltf(node("box", BOX))
    document["buffers"][0]["uri"] = uri
    with pytest.raises(DataError, match="leads out of"):
        read_gltf(write_gltf(inside / "a.gltf", document), inside)
    with pytest.raises(DataError, match="leads out of"):
        read_gltf(write_gltf(inside / "a.gltf", textured(uri)), inside)


def broken(document: dict[str, Any], *path: Any, value: Any) -> dict[str, Any]:
    """The document with one entry changed."""
    copy = json.loads(json.dumps(document))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copy


PLAIN = gltf(node("box", BOX, materials=("paint",)))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({}, "asset.version is not 2"),
        (broken(PLAIN, "asset", "version", value="1.0"), "asset.version is not 2"),
        (broken(PLAIN, "nodes", 0, "mesh", value=7), r"refers to meshes\[7\]; expected 0..0"),
        (broken(PLAIN, "nodes", 0, "mesh", value=-1), r"refers to meshes\[-1\]"),
        (broken(PLAIN, "scenes", 0, "nodes", value=[0, 0]), "node 0 is reached twice"),
        (broken(PLAIN, "nodes", 0, "children", value=[0]), "node 0 is reached twice"),
        (broken(PLAIN, "accessors", 0, "count", value=10**6), r"accessors\[0\] needs .* \(an incomplete copy"),
        (broken(PLAIN, "accessors", 0, "count", value=-3), r"accessors\[0\] needs"),
        (broken(PLAIN, "accessors", 0, "sparse", value={}), "sparse"),
        (broken(PLAIN, "accessors", 0, "componentType", value=5123), "componentType 5123"),
        (broken(PLAIN, "accessors", 1, "type", value="VEC3"), "no SCALAR"),
        (broken(PLAIN, "bufferViews", 0, "byteLength", value=10**6), r"bufferViews\[0\] ends at"),
        (broken(PLAIN, "buffers", 0, "byteLength", value=10**6), r"buffers\[0\] has 96 bytes; expected 1,000,000"),
        (broken(PLAIN, "buffers", 0, "uri", value="data:;base64,####"), "no base64"),
        (broken(PLAIN, "buffers", 0, "uri", value="gone.bin"), "gone.bin: cannot be read"),
        (broken(PLAIN, "extensionsRequired", value=["KHR_draco_mesh_compression"]), "without compression"),
        (broken(PLAIN, "nodes", 0, "scale", value=[1, float("inf"), 1]), "no JSON number|no valid JSON"),
        (broken(PLAIN, "nodes", 0, "matrix", value=[1] * 16), "expected a finite affine matrix"),
        (broken(PLAIN, "nodes", 0, "rotation", value=[0, 0, 0, 0]), "expected a unit quaternion x y z w"),
        (broken(PLAIN, "nodes", 0, "rotation", value=[0, 90, 0, 0]), "expected a unit quaternion x y z w"),
        (broken(PLAIN, "nodes", 0, "translation", value=[0, 1e300, 0]), "expected a finite affine matrix"),
        (broken(PLAIN, "nodes", value="box"), "expected a glTF 2.0 file"),
        (broken(PLAIN, "meshes", 0, "primitives", value=[{}]), "KeyError on 'attributes'"),
    ],
)  # fmt: skip
def test_a_broken_file_is_one_line_that_names_the_item(tmp_path: Path, document: dict, message: str) -> None:
    path = write_gltf(tmp_path / "a.gltf", document)
    with pytest.raises(DataError, match=message) as error:
        read_gltf(path, tmp_path)
    assert str(error.value).startswith(str(path)) or "gone.bin" in str(error.value)
    assert "\n" not in str(error.value)


def entries(value: Any, path: tuple = ()) -> list[tuple]:
    """The paths of everything in a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [p for key, child in items for p in ((*path, key), *entries(child, (*path, key)))]


WHOLE = gltf(*room_nodes()) | {"textures": [{"source": 0}], "images": [{"uri": "x.png"}]}
ODD = (None, -1, 0, 2**40, 1e300, -0.5, "x", [], {}, True, [1], [None] * 3, "data:;base64,AAAA")


@settings(max_examples=500, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(entries(WHOLE)), st.sampled_from(ODD))
def test_any_entry_may_be_anything(tmp_path: Path, path: tuple, value: Any) -> None:
    with contextlib.suppress(DataError):
        read_gltf(write_gltf(tmp_path / "a.gltf", broken(WHOLE, *path, value=value)), tmp_path)


def test_vertices_that_are_not_finite_and_indices_out_of_range(tmp_path: Path) -> None:
    bad = BOX[0].copy()
    bad[3, 1] = np.nan
    with pytest.raises(DataError, match=r"vertex 3 is .*nan.*; expected finite"):
        read_gltf(write_gltf(tmp_path / "a.gltf", gltf(node("box", (bad, BOX[1])))), tmp_path)
    with pytest.raises(DataError, match=r"triangle index outside 0..7"):
        read_gltf(write_gltf(tmp_path / "a.gltf", gltf(node("box", (BOX[0], BOX[1] + 1)))), tmp_path)


@pytest.mark.parametrize("cut", [4, 13, 60, 400, -4])
def test_a_cut_glb_is_refused(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(glb(PLAIN)[:cut])
    with pytest.raises(DataError, match=r"a\.glb"):
        read_gltf(path, tmp_path)


def test_limits_are_stated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_gltf(tmp_path / "a.gltf", PLAIN)
    monkeypatch.setattr(scene_source, "MAX_TRIANGLES", 11)
    with pytest.raises(DataError, match="12 triangles; expected at most 11"):
        read_gltf(path, tmp_path)
    other = tmp_path / "a.obj"
    other.write_text(obj({"box": BOX}))
    with pytest.raises(DataError, match="12 triangles; expected at most 11"):
        read_obj(other, tmp_path)
    monkeypatch.setattr(scene_obj, "MAX_FILE_BYTES", 100)
    with pytest.raises(DataError, match=r"more than 100 bytes; expected at most that \(split it"):
        read_obj(other, tmp_path)


def test_one_mesh_shared_by_many_nodes_counts_for_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = gltf(*(node(f"n{k}") for k in range(9)), node("box", BOX))
    for entry in document["nodes"][:-1]:
        entry["mesh"] = 0
    path = write_gltf(tmp_path / "a.gltf", document)
    assert len(world_meshes(read_gltf(path, tmp_path))) == 10
    monkeypatch.setattr(scene_source, "MAX_TRIANGLES", 100)
    with pytest.raises(DataError, match="108 triangles; expected at most 100"):
        read_gltf(path, tmp_path)


# ---------------------------------------------------------------- OBJ


def test_objects_of_an_obj_keep_their_names(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(obj({"chair_fmx": BOX, "Ring 1": torus(), "empty": (np.empty((0, 3)), np.empty((0, 3), np.int32))}))
    scene = read_obj(path, tmp_path)
    found = world_meshes(scene)
    assert set(found) == {"chair_fmx", "Ring 1"}
    assert np.allclose(found["chair_fmx"][0], BOX[0][BOX[1]], atol=1e-8)
    assert np.allclose(found["Ring 1"][0], torus()[0][torus()[1]], atol=1e-8)
    assert scene.up is None
    assert scene.notes == ("1 objects without faces are left out: empty",)


def test_groups_stand_for_objects_where_there_are_none(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text(obj({"one": BOX, "two": BOX}, "g"))
    assert [n.name for n in read_obj(path, tmp_path).nodes] == ["one", "two"]
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n")
    (only,) = read_obj(path, tmp_path).nodes
    assert (only.name, only.meshes[0].triangles.tolist()) == ("a", [[0, 1, 2]])


def test_polygons_materials_and_colours(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0.5 0\nnewmtl dull\n")
    path = tmp_path / "a.obj"
    path.write_text(
        "mtllib a.mtl\no plate\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1 3 4\n"
    )
    (plate,) = read_obj(path, tmp_path).nodes
    assert [(m.material, m.colour, len(m.triangles)) for m in plate.meshes] == [
        ("red", (255, 128, 0), 2),
        ("blue", GREY, 1),
    ]
    (tmp_path / "a.mtl").unlink()
    assert read_obj(path, tmp_path).missing_textures == ("a.mtl",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 0\nf 1 2 3\n", r"line 2: corner 2; expected a vertex of 1..1|line 2: corner '2'"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "a face of 2 corners"),
        ("v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex line is not three numbers"),
        ("v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex line is not three numbers"),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "expected finite coordinates"),
        ("v 0 0 0\nf 0 1 1\n", "corner '0'"),
        ("v 0 0 0\nf x 1 1\n", "corner 'x'"),
        ("mtllib ../a.mtl\n", "leads out of"),
    ],
)
def test_a_broken_obj_names_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.obj"
    path.write_text(text)
    with pytest.raises(DataError, match=message):
        read_obj(path, tmp_path)


# ---------------------------------------------------------------- label tables


def table(tmp_path: Path, name: str, text: str) -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def test_the_three_forms_of_a_table_say_the_same(tmp_path: Path) -> None:
    rows = [
        {"node": "Chair", "category": "chair", "movable": "true"},
        {"node": "Wall", "part": "glass", "category": "window"},
    ]
    columns = ("node", "part", "category", "movable")
    text = [columns, *([row.get(c, "") for c in columns] for row in rows)]
    tables = [
        read_labels(table(tmp_path, "a.csv", "\ufeff" + "\n".join(",".join(r) for r in text))),
        read_labels(table(tmp_path, "a.tsv", "\n".join("\t".join(r) for r in text))),
        read_labels(table(tmp_path, "a.json", json.dumps({"labels": rows}))),
    ]
    assert tables[0].labels == tables[1].labels == tables[2].labels
    assert tables[0].find("Chair")[1].movable is True
    assert tables[0].find("Chair.001")[1].category == "chair"
    assert tables[0].find("Chair.1") is None  # no suffix of Blender's
    assert tables[0].find("Wall.002", "glass.001")[1].category == "window"
    assert tables[0].find("Wall") is None


def test_an_exact_name_comes_before_one_without_its_suffix(tmp_path: Path) -> None:
    labels = read_labels(table(tmp_path, "a.csv", "node,category\nCube,chair\nCube.001,sofa\n"))
    assert [labels.find(n)[1].category for n in ("Cube", "Cube.001", "Cube.002")] == ["chair", "sofa", "chair"]


def test_rooms_and_height_of_a_json_table(tmp_path: Path) -> None:
    outline = [[0, 0], [4, 0], [4, 3]]
    document = {"rooms": [{"room_type": "living", "outline_xy": outline}], "height_m": 2.4}
    labels = read_labels(table(tmp_path, "a.json", json.dumps(document)))
    assert labels.rooms[0].room_type == "living"
    assert labels.rooms[0].outline_xy.tolist() == outline
    assert labels.height_m == 2.4


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "node,category\nSofa_1,couch sofa\n", r"row 2 \('Sofa_1'\): category 'couch sofa'.* nearest: sofa"),
        ("a.csv", "node,category\nX,zzz\n", "is unknown; known: floor, ceiling"),
        ("a.csv", "node,category,role\nX,sofa,seats\n", "role 'seats' is unknown; expected one of board"),
        ("a.csv", "node,category,movable\nX,sofa,perhaps\n", "movable is 'perhaps'; expected true or false"),
        ("a.csv", "name,label\nX,sofa\n", "expected node, category"),
        ("a.csv", "node,category\nX,sofa\nX,chair\n", "row 3: node 'X' is labelled twice"),
        ("a.json", '{"labels": [{"node": "X", "categry": "sofa"}]}', "expected node, category"),
        ("a.json", '{"labels": {"X": "sofa"}}', "labels is no list"),
        ("a.json", '{"lables": []}', "expected"),
        ("a.json", '{"rooms": [{"room_type": "x", "outline_xy": [[0, 0], [0, 1], [1, 1]]}]}', "counter-clockwise"),
        ("a.json", '{"height_m": "high"}', "height_m is 'high'"),
        ("a.json", "{", "no valid JSON"),
        ("a.xls", "", "ends in .csv, .tsv or .json"),
    ],
)  # fmt: skip
def test_a_wrong_table_names_its_row(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(DataError, match=message) as error:
        read_labels(table(tmp_path, name, text))
    assert str(error.value).startswith(str(tmp_path / name))


def test_nearest_names() -> None:
    known = ("sofa", "chair", "office_chair", "bookshelf", "dining_table", "table_lamp")
    assert nearest_names("OfficeChair.003", known)[0] in ("chair", "office_chair")
    assert nearest_names("my office chair 2", known)[0] == "office_chair"
    assert nearest_names("bokshelf", known) == ["bookshelf"]
    assert nearest_names("Cube", known) == []


def test_other_files_are_refused(tmp_path: Path) -> None:
    for name in ("a.fbx", "a.usdz", "a.ply", "a"):
        with pytest.raises(DataError, match=r"expected \.glb, \.gltf, \.obj"):
            read_source(tmp_path / name, tmp_path)
    with pytest.raises(DataError, match=r"a\.glb: cannot be read: No such file"):
        read_source(tmp_path / "a.glb", tmp_path)
