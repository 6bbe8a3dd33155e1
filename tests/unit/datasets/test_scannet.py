"""ScanNet folders, written here from the documented layout: a room of known size with a table and a person in it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.importers.ply import read_ply
from hsbench.datasets.importers.scannet import read_scannet, scannet_scene
from hsbench.io.scene_folder import read_occupancy, read_scene
from hsbench.schema.categories import category
from hsbench.typing import FloatArray, IntArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

ANY_FILE = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
ROOM_M = np.array([4.0, 3.0, 2.5])
TABLE_M = np.array([[1.0, 1.0, 0.7], [2.0, 1.6, 0.75]])
PERSON_M = np.array([[3.0, 0.5, 0.0], [3.3, 0.9, 1.7]])
LIFT_M = 0.35  # the floor of the scan
STEP_M = 0.25
TURN = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, -2.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
NAME = "scene0000_00"


def sheet(corner: Sequence[float], u: Sequence[float], v: Sequence[float]) -> tuple[FloatArray, IntArray]:
    """A rectangle as a grid of triangles, counter-clockwise about u x v."""
    counts = [max(1, round(float(np.linalg.norm(edge)) / STEP_M)) for edge in (u, v)]
    s, t = np.meshgrid(*(np.linspace(0, 1, n + 1) for n in counts), indexing="ij")
    points = np.asarray(corner) + s[..., None] * np.asarray(u) + t[..., None] * np.asarray(v)
    index = np.arange(s.size).reshape(s.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return points.reshape(-1, 3), triangles


def box(low: FloatArray, high: FloatArray) -> list[tuple[FloatArray, IntArray]]:
    x, y, z = np.diag(high - low)
    return [
        sheet(low, y, x), sheet(low + z, x, y), sheet(low, x, z), sheet(low + y, z, x), sheet(low, z, y),
        sheet(low + x, y, z),
    ]  # fmt: skip


def scan() -> tuple[FloatArray, IntArray, IntArray, IntArray]:
    """(points, triangles, label, segment) of the room: floor, two walls, a table, a person, a scrap of a chair."""
    x, y, z = np.diag(ROOM_M)
    zero = np.zeros(3)
    things = [
        (2, [sheet(zero, x, y)]),
        (1, [sheet(zero, z, x)]),
        (1, [sheet(zero, y, z)]),
        (7, box(*TABLE_M)),
        (31, box(*PERSON_M)),
        (5, [sheet([0.2, 2.0, 0.4], [0.3, 0, 0], [0, 0.3, 0])]),
    ]
    points, triangles, label, segment, start = [], [], [], [], 0
    for number, (kind, sheets) in enumerate(things):
        for p, t in sheets:
            points.append(p)
            triangles.append(t + start)
            label.append(np.full(len(p), kind))
            segment.append(np.full(len(p), 10 * number))
            start += len(p)
    return (
        np.concatenate(points) + [0, 0, LIFT_M],
        np.concatenate(triangles),
        np.concatenate(label),
        np.concatenate(segment),
    )


def ply(points: FloatArray, triangles: IntArray, label: IntArray | None = None, order: str = "<") -> bytes:
    fields = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("red", "u1"), ("green", "u1"), ("blue", "u1"), ("alpha", "u1")]
    names = {"f4": "float", "u1": "uchar", "u2": "ushort"}
    if label is not None:
        fields.append(("label", "u2"))
    rows = np.zeros(len(points), dtype=[(name, order + kind) for name, kind in fields])
    for axis, values in zip("xyz", points.T, strict=True):
        rows[axis] = values
    rows["red"], rows["green"], rows["blue"] = 200, 100, 50
    if label is not None:
        rows["label"] = label
    faces = np.zeros(len(triangles), dtype=[("n", "u1"), ("i", order + "i4", (3,))])
    faces["n"], faces["i"] = 3, triangles
    head = ["ply", f"format binary_{'little' if order == '<' else 'big'}_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property {names[kind]} {name}" for name, kind in fields]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(head).encode() + rows.tobytes() + faces.tobytes()


def write_scan(folder: Path) -> Path:
    folder.mkdir(parents=True)
    points, triangles, label, segment = scan()
    scanned = (points - TURN[:3, 3]) @ TURN[:3, :3]  # what the alignment turns back
    (folder / f"{NAME}_vh_clean_2.ply").write_bytes(ply(scanned, triangles))
    (folder / f"{NAME}_vh_clean_2.labels.ply").write_bytes(ply(scanned, triangles, label))
    (folder / f"{NAME}_vh_clean_2.0.010000.segs.json").write_text(json.dumps({"segIndices": segment.tolist()}))
    names = ["floor", "wall", "wall", "table", "person"]
    groups = [{"objectId": k, "segments": [10 * k], "label": name} for k, name in enumerate(names)]
    (folder / f"{NAME}.aggregation.json").write_text(json.dumps({"segGroups": groups}))
    numbers = " ".join(f"{value:g}" for value in TURN.ravel())
    (folder / f"{NAME}.txt").write_text(f"axisAlignment = {numbers}\ncolorHeight = 968\n")
    return folder


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scan(tmp_path_factory.mktemp("scannet") / NAME)


def test_a_scan_becomes_the_room_it_was_made_of(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "scene"
    assert run(["import", "scannet", str(sound), "--out", str(out)]) == 0
    notes = capsys.readouterr().err
    assert "1 people who stood still" in notes
    assert "z = 0.35 m" in notes
    scene = read_scene(out)
    assert scene.scene_id == NAME
    assert sorted(item.category_name for item in scene.objects) == ["dining_table", "floor", "object", "wall", "wall"]
    (room,) = scene.rooms
    assert room.area_m2 == pytest.approx(12.0, rel=0.05)
    assert np.abs(room.outline_xy.max(axis=0) - ROOM_M[:2]).max() <= 0.06
    assert scene.height_m == pytest.approx(2.5, abs=1e-4)
    table = next(item for item in scene.objects if item.category_name == "dining_table")
    assert np.allclose([table.vertices.min(axis=0), table.vertices.max(axis=0)], TABLE_M, atol=1e-5)
    assert table.parts[0].colour == (200, 100, 50)
    solid = read_occupancy(out)
    inside = solid.semantic == category("dining_table").category_id
    centres = solid.grid.centres()[inside]
    assert inside.any()
    assert ((centres > TABLE_M[0] - 0.05) & (centres < TABLE_M[1] + 0.05)).all()
    assert run(["import", "scannet", str(sound), "--out", str(out)]) == 2  # the folder is there already


def test_without_alignment_it_says_so(sound: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(sound, tmp_path / "scan")
    (folder / f"{NAME}.txt").write_text("colorHeight = 968\n")
    found = read_scannet(folder)
    assert any("may lie askew" in note for note in found.notes)
    assert np.allclose(found.points @ TURN[:3, :3].T + TURN[:3, 3], read_scannet(sound).points, atol=1e-5)


def edit_json(path: Path, change: Callable[[dict[str, object]], object]) -> None:
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


MESH, LABELS = f"{NAME}_vh_clean_2.ply", f"{NAME}_vh_clean_2.labels.ply"
SEGS, AGGREGATION, TEXT = f"{NAME}_vh_clean_2.0.010000.segs.json", f"{NAME}.aggregation.json", f"{NAME}.txt"


def replaced(name: str, old: bytes, new: bytes) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        data = (folder / name).read_bytes()
        assert old in data
        (folder / name).write_bytes(data.replace(old, new))

    return change


def cut(name: str, keep: float) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[: int(keep * _size(folder / name))])


def _size(path: Path) -> int:
    return path.stat().st_size


def remade(label: int = 0, nan: bool = False, drop: int = 0, order: str = "<") -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        points, triangles, labels, _ = scan()
        if nan:
            points[7, 1] = np.nan
        if drop:
            points, labels = points[:-drop], labels[:-drop]
            triangles = triangles[(triangles < len(points)).all(axis=1)]
        data = ply(points, triangles, np.where(labels == 7, label, labels) if label else labels, order)
        name = MESH if nan else LABELS
        (folder / name).write_bytes(data)

    return change


MALFORMED: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "truncated": (cut(MESH, 0.5), MESH, r"bytes follow the header; expected .*incomplete copy"),
    "empty": (cut(LABELS, 0), LABELS, "no header of PLY"),
    "byte-swapped": (replaced(MESH, b"binary_little", b"binary_big"), MESH, "corners|coordinates|no triangle|reaches"),
    "NaN": (remade(nan=True), MESH, r"vertex 7 is .*nan.*; expected finite"),
    "huge counts": (replaced(MESH, b"element face ", b"element face 9999999"), MESH, r"faces; expected 1 to"),
    "no label": (lambda f: shutil.copy(f / MESH, f / LABELS), LABELS, "no whole-numbered label"),
    "raw label": (remade(label=1163), LABELS, "label 1163; expected 0 to 40"),
    "other mesh": (remade(drop=4), LABELS, "vertices; expected .* as the mesh"),
    "fewer segments": (lambda f: edit_json(f / SEGS, lambda d: d["segIndices"].pop()), SEGS, "segIndices; expected"),
    "null segment": (
        lambda f: edit_json(f / SEGS, lambda d: d["segIndices"].__setitem__(3, None)), SEGS, r"\[3\] is None",
    ),
    "null groups": (lambda f: edit_json(f / AGGREGATION, lambda d: d.update(segGroups=None)), AGGREGATION, "null"),
    "null group": (
        lambda f: edit_json(f / AGGREGATION, lambda d: d["segGroups"].append(None)), AGGREGATION, r"\[5\] is null",
    ),
    "alien segment": (
        lambda f: edit_json(f / AGGREGATION, lambda d: d["segGroups"][1]["segments"].append(77)), AGGREGATION,
        "segment 77 is no vertex's",
    ),
    "shared segment": (
        lambda f: edit_json(f / AGGREGATION, lambda d: d["segGroups"][1]["segments"].append(0)), AGGREGATION,
        "segment 0 belongs to another group",
    ),
    "no JSON": (replaced(SEGS, b"[", b""), SEGS, "no valid JSON"),
    "alignment": (replaced(TEXT, b" -1 ", b" -2 "), TEXT, "no rigid transform"),
    "quads": (replaced(MESH, b"list uchar int vertex_indices", b"list uchar int corners"), MESH, "line 12"),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_scans_are_refused(case: str, sound: Path, tmp_path: Path) -> None:
    change, name, match = MALFORMED[case]
    folder = shutil.copytree(sound, tmp_path / "scan")
    change(folder)
    refused(lambda _: read_scannet(folder), folder / name, match)


@pytest.mark.parametrize("name", [MESH, LABELS, SEGS, AGGREGATION, TEXT])
@ANY_FILE
@given(data=st.data())
def test_damaged_files_are_refused_or_read(name: str, sound: Path, tmp_path: Path, data: st.DataObject) -> None:
    folder = tmp_path / "scan"
    if not folder.exists():
        shutil.copytree(sound, folder)
    damaged = data.draw(mutated((sound / name).read_bytes()))
    refused_or_read(lambda _: read_scannet(folder), folder / name, damaged, lambda found: scannet_scene(found, "a"))


def test_ascii_and_both_byte_orders_give_one_mesh(tmp_path: Path) -> None:
    points, triangles, label, _ = scan()
    rows = [" ".join(f"{value:.9g}" for value in point) for point in points.astype(np.float32)]
    head = ["ply", "format ascii 1.0", "comment made here", f"element vertex {len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_index", "end_header"]
    faces = [f"3 {a} {b} {c}" for a, b, c in triangles]
    files = [tmp_path / name for name in ("a.ply", "b.ply", "c.ply")]
    files[0].write_text("\n".join([*head, *rows, *faces]) + "\n")
    files[1].write_bytes(ply(points, triangles, label, "<"))
    files[2].write_bytes(ply(points, triangles, label, ">"))
    for file in files:
        mesh = read_ply(file)
        assert np.array_equal(mesh.points, points.astype(np.float32))
        assert np.array_equal(mesh.triangles, triangles)


@ANY_FILE
@given(data=st.data())
def test_damaged_ascii_meshes_are_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    text = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    text += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    refused_or_read(read_ply, tmp_path / "a.ply", data.draw(mutated(text)))
