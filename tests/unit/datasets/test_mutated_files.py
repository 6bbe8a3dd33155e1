"""Readers whose own tests damage files by hand, on files damaged at random, and on eight kinds of wrong file each."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from hsbench.datasets.importers.kinect_csv import read_kinect_csv
from hsbench.datasets.importers.mat5 import read_mat5
from hsbench.datasets.importers.mat73 import read_mat73
from hsbench.datasets.importers.scene_gltf import read_gltf
from hsbench.datasets.importers.scene_labels import read_labels
from hsbench.datasets.importers.scene_obj import read_obj
from hsbench.datasets.importers.scene_placement import read_source
from hsbench.datasets.importers.sscnet import read_depth_png, read_volume
from tests.unit.datasets import test_kinect_csv, test_sscnet
from tests.unit.datasets.mutations import attempt, check_message, mutated, refused_or_read
from tests.unit.datasets.scene_files import ROOM_LABELS, glb, gltf, habitat, obj, room_nodes, sheet

Read = Callable[[Path], Any]

FLOOR = sheet((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))


def mat(path: Path) -> None:
    content = {"mapClass": np.arange(1, 9)[None], "className": np.array(["wall", "floor"], dtype=object)}
    buffer = io.BytesIO()
    savemat(buffer, content)
    path.write_bytes(buffer.getvalue())


def mat73(path: Path) -> None:
    pytest.importorskip("h5py", reason="the extra import is not installed")
    from tests.unit.datasets.test_nyucad import write73

    write73(path)


def habitat_scene(path: Path) -> None:
    turned = {"rotation": [0.6, 0.0, 0.8, 0.0], "translation_origin": "asset_local"}
    chair = {"template_name": "chair", "translation": [1.0, 0.45, -1.0], "uniform_scale": 1.2}
    big = {"template_name": "objects/big", "non_uniform_scale": [1.0, 0.5, 1.0], **turned}
    habitat(path.parent, [chair, big], COM=[0.4, 0.0, -0.5], units_to_meters=0.9)


def through_the_scene(path: Path) -> Any:
    """Read the scene that refers to a configuration."""
    return read_source(path.parent / "flat.scene_instance.json", path.parent)


def model_list(path: Path) -> None:
    (path.parent / "room.obj").write_text(obj({"floor": FLOOR}))
    entries = [{"file": "room.obj", "name": "a"}, {"file": "room.obj", "translation": [2, 1, 0], "up": "z"}]
    path.write_text(json.dumps({"models": entries}))


def png(path: Path) -> None:
    depth_mm = np.arange(500, 500 + 12 * 9).reshape(9, 12)
    path.write_bytes(test_sscnet.write_png(path.with_suffix(".png"), depth_mm).read_bytes())


def rooted(read: Callable[[Path, Path], Any]) -> Read:
    return lambda path: read(path, path.parent)


READERS: dict[str, tuple[str, Read, Callable[[Path], object]]] = {
    "kinect-csv": ("a.csv", read_kinect_csv, lambda p: test_kinect_csv.write(p, test_kinect_csv.standing(3))),
    "sscnet depth": ("a.png", read_depth_png, png),
    "sscnet volume": ("a.bin", read_volume, lambda p: test_sscnet.write_bin(p, [(0, 8_294_399), (3, 1)])),
    "glTF": ("a.gltf", rooted(read_gltf), lambda p: p.write_text(json.dumps(gltf(*room_nodes())))),
    "GLB": ("a.glb", rooted(read_gltf), lambda p: p.write_bytes(glb(gltf(*room_nodes())))),
    "OBJ": ("a.obj", rooted(read_obj), lambda p: p.write_text(obj({"floor": FLOOR, "rug": FLOOR}))),
    "label table": ("a.csv", read_labels, lambda p: p.write_text(ROOM_LABELS)),
    "label JSON": (
        "a.json",
        read_labels,
        lambda p: p.write_text(json.dumps({"labels": [{"node": "Chair", "category": "chair", "movable": True}]})),
    ),
    "list of models": ("scene.json", rooted(read_source), model_list),
    "Habitat scene": ("flat.scene_instance.json", rooted(read_source), habitat_scene),
    "Habitat stage": ("stage.stage_config.json", rooted(read_source), habitat_scene),
    "Habitat object": ("big.object_config.json", through_the_scene, habitat_scene),
    "MATLAB 5": ("a.mat", read_mat5, mat),
    "MATLAB 7.3": ("a.mat", lambda path: read_mat73(path, "model"), mat73),
}

WRONG: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "truncated": lambda sound: sound[: 2 * len(sound) // 5],
    "byte-swapped": lambda sound: np.frombuffer(sound[: len(sound) // 2 * 2], "<u2").byteswap().tobytes(),
    "zeros": lambda sound: bytes(len(sound)),
    "huge counts": lambda _: b"\xff\xff\xff\x7f" * 64,
    "null": lambda _: b"null",
    "NaN": lambda _: b"NaN,NaN,NaN\n" * 4,
    "another format": lambda _: b"%PDF-1.7\n1 0 obj\n<< /Type /Catalog >>\nendobj\n",
}
SHORTER_BUT_SOUND = {("label table", "truncated"), ("OBJ", "truncated")}
"""A table or a list of vertices that ends early at a line's end is one with fewer rows."""

each_reader = pytest.mark.parametrize("name", READERS)


@each_reader
def test_the_sound_file_is_read(name: str, tmp_path: Path) -> None:
    file, read, write = READERS[name]
    write(tmp_path / file)
    assert read(tmp_path / file) is not None


@each_reader
@pytest.mark.parametrize("kind", WRONG)
def test_eight_kinds_of_wrong_file_are_one_line_that_names_it(name: str, kind: str, tmp_path: Path) -> None:
    file, read, write = READERS[name]
    write(tmp_path / file)
    path = tmp_path / file
    damaged = WRONG[kind](path.read_bytes())
    if (name, kind) in SHORTER_BUT_SOUND:
        refused_or_read(read, path, damaged)
        return
    path.write_bytes(damaged)
    _, refusal = attempt(lambda: read(path))
    assert refusal is not None
    check_message(refusal, path)


@each_reader
@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_at_random_it_is_refused_or_read(name: str, tmp_path: Path, data: st.DataObject) -> None:
    file, read, write = READERS[name]
    write(tmp_path / file)
    path = tmp_path / file
    refused_or_read(read, path, data.draw(mutated(path.read_bytes())))
