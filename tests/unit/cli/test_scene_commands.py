"""``hsbench import scene`` and ``hsbench export`` from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from hsbench.cli.main import run
from hsbench.io.scene_folder import read_scene
from tests.unit.datasets.scene_files import ROOM_LABELS, gltf, room_nodes, write_gltf
from tests.unit.episode_builders import same

LABELS = ("--labels", "{base}/labels.csv")


@pytest.fixture
def room(tmp_path: Path) -> Path:
    (tmp_path / "labels.csv").write_text(ROOM_LABELS)
    return write_gltf(tmp_path / "room.gltf", gltf(*room_nodes()))


@pytest.mark.filterwarnings("always::UserWarning")
def test_a_room_is_imported_exported_and_imported_again(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = room.parent
    out, again = base / "scene", base / "again"
    assert run(["import", "scene", str(room), "--labels", str(base / "labels.csv"), "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert f"{out}: 7 objects, 1 rooms of 12.0 m2, 2.50 m high" in told.out
    assert "1 dining_table, 1 floor, 2 sofa" in told.out
    assert "m2 walkable" in told.out
    assert "note: rooms are estimated" in told.err
    assert "note: meshes with open pieces" in told.err
    files = {kind: base / f"room.{kind}" for kind in ("glb", "json", "svg", "png")}
    assert (
        run(["export", str(out), "--glb", str(files["glb"]), "--json", str(files["json"]), "--plan", str(files["svg"])])
        == 0
    )
    assert run(["export", str(out), "--plan", str(files["png"]), "--width", "700"]) == 0
    assert files["glb"].read_bytes()[:4] == b"glTF"
    assert len(json.loads(files["json"].read_text())["objects"]) == 7
    assert files["svg"].read_text().startswith("<svg")
    assert cv2.imread(str(files["png"])).shape[1] == 700
    assert run(["import", "scene", str(files["glb"]), "--out", str(again), "--name", "room"]) == 0
    first, second = read_scene(out), read_scene(again)
    assert np.allclose([o.box for o in first.objects], [o.box for o in second.objects], atol=2e-6)
    assert same(first.rooms, second.rooms)
    with np.load(out / "occupancy.npz") as a, np.load(again / "occupancy.npz") as b:
        assert np.array_equal(a["instance"], b["instance"])
        assert np.array_equal(a["semantic"], b["semantic"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["import", "scene", "{room}", "--out", "{base}/x"], "nodes have no label"),
        (["import", "scene", "{room}", "--labels", "{base}/labels.csv", "--out", "{base}"], "exists already"),
        (["import", "scene", "{room}", "--labels", "{base}/gone.csv", "--out", "{base}/x"], "cannot be read"),
        (["import", "scene", "{base}/gone.glb", "--out", "{base}/x"], "cannot be read"),
        (["import", "scene", "{room}", *LABELS, "--up", "z", "--out", "{base}/x"], "try --up y"),
        (["import", "scene", "{room}", *LABELS, "--scale", "1000", "--out", "{base}/x"], "try --scale 1"),
        (["export", "{base}", "--json", "{base}/x.json"], "holds no scene.json"),
        (["export", "{base}"], "nothing to write"),
        (["export", "{base}", "--plan", "x.pdf"], r"ends in .svg or .png"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_and_leave_nothing(
    room: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    before = {f.name for f in room.parent.iterdir()}
    assert run([a.format(room=room, base=room.parent) for a in arguments]) == 2
    assert message in capsys.readouterr().err
    assert {f.name for f in room.parent.iterdir()} == before


def test_a_data_set_needs_an_episode(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "dataset.json").write_text("{}")
    assert run(["export", str(tmp_path), "--json", str(tmp_path / "x.json")]) == 2
    assert "give --episode ID" in capsys.readouterr().err
    assert run(["export", str(tmp_path), "--episode", "e-1", "--json", str(tmp_path / "x.json")]) == 2
    assert "episodes/e-1 holds no scene.json" in capsys.readouterr().err
