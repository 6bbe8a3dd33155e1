from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import DataError, SchemaError
from hsbench.io.atomic import json_bytes
from hsbench.io.scene_folder import read_occupancy, read_scene, write_scene
from hsbench.io.scene_json import scene_description
from tests.unit.episode_builders import occupancy, same, scene


def test_a_scene_comes_back(tmp_path: Path) -> None:
    truth = occupancy()
    walkable = {"free": np.ones((3, 4), bool), "origin_xy": np.zeros(2), "cell_m": np.array(0.05)}
    write_scene(tmp_path / "a", scene(), truth, walkable, {"files": {}})
    assert same(read_scene(tmp_path / "a"), scene())
    assert same(read_occupancy(tmp_path / "a"), truth)
    assert set(json.loads((tmp_path / "a" / "manifest.json").read_text())) == {
        "scene.json", "scene.npz", "occupancy.json", "occupancy.npz", "walkable.npz", "source.json",
    }  # fmt: skip


def test_a_bare_scene_is_enough_and_is_never_overwritten(tmp_path: Path) -> None:
    write_scene(tmp_path / "a", scene())
    assert same(read_scene(tmp_path / "a"), scene())
    before = (tmp_path / "a" / "scene.json").read_bytes()
    with pytest.raises(DataError, match="exists already"):
        write_scene(tmp_path / "a", scene(mesh=False))
    assert (tmp_path / "a" / "scene.json").read_bytes() == before


def test_the_truth_of_an_episode_is_read_too(tmp_path: Path) -> None:
    write_scene(tmp_path / "truth", scene())
    assert same(read_scene(tmp_path), scene())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("rooms"), "rooms"),
        (lambda d: d["objects"][0].pop("parts"), "KeyError on 'parts'"),
        (lambda d: d["objects"][0].update(category="couch"), "category 'couch' is unknown"),
        (lambda d: d["objects"].pop(), "scene geometry holds"),
    ],
)
def test_a_damaged_description_names_the_folder(tmp_path: Path, change: object, message: str) -> None:
    write_scene(tmp_path / "a", scene())
    path = tmp_path / "a" / "scene.json"
    content = json.loads(path.read_text())
    change(content)  # type: ignore[operator]
    path.write_text(json.dumps(content))
    with pytest.raises((DataError, SchemaError), match=message) as error:
        read_scene(tmp_path / "a")
    assert str(tmp_path / "a") in str(error.value)


def test_what_is_no_scene_says_what_makes_one(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="hsbench import scene makes one"):
        read_scene(tmp_path)
    (tmp_path / "episode.json").write_text("{}")
    with pytest.raises(DataError, match="packed inputs hold no truth"):
        read_scene(tmp_path)


# ---------------------------------------------------------------- the description for people


def test_the_description_says_what_the_scene_says() -> None:
    ours = scene()
    described = json.loads(json_bytes(scene_description(ours)))
    assert [o["object_id"] for o in described["objects"]] == [o.object_id for o in ours.objects]
    for entry, item in zip(described["objects"], ours.objects, strict=True):
        box = entry["box"]
        assert np.allclose([*box["centre"], *box["size"], box["yaw_rad"]], item.box, atol=1e-4)
        assert [p["name"] for p in entry["parts"]] == [p.name for p in item.parts]
        assert [p["role"] for p in entry["parts"]] == [p.role for p in item.parts]
        low = np.min([p["low"] for p in entry["parts"]], axis=0)
        assert np.allclose(low, item.vertices.min(axis=0), atol=1e-4)
    assert described["rooms"][0]["area_m2"] == pytest.approx(36.0)
    assert described["objects"][1]["room"] == 0
