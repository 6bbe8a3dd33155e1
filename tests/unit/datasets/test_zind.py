"""ZInD homes, written here by an independent encoder from rooms in metres, and damaged copies of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.zind import read_zind, zind_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.geometry.transforms import apply, invert
from hsbench.io.images import encode_jpeg
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

ANY_FILE = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
CAMERA_M, CEILING_M, METRES_PER_UNIT, PLAN_SCALE = 1.5, 2.4, 3.6, 0.4
ROOM_M = [[2.0, 1.0], [-1.5, 1.0], [-1.5, -3.0], [2.0, -3.0]]  # x ahead, y left
DOOR_M = ([2.0, -1.0], [2.0, -1.9], 0.0, 2.0)  # straight ahead and to the right
WIDTH, HEIGHT = 512, 256


def pano(points_m: list[list[float]]) -> list[list[float]]:
    """Episode metres to ZInD's plane: x left, y ahead, in heights of the camera."""
    unit = METRES_PER_UNIT * PLAN_SCALE
    return [[y / unit, x / unit] for x, y in points_m]


def entry(name: str = "pano_1") -> dict[str, Any]:
    unit = METRES_PER_UNIT * PLAN_SCALE
    left, right, low, high = DOOR_M
    camera = CAMERA_M / unit
    layout = {
        "vertices": pano(ROOM_M),
        "doors": [*pano([left, right]), [low / unit - camera, high / unit - camera]],
        "windows": [],
        "openings": [],
    }
    return {
        "image_path": f"panos/{name}.jpg", "label": "dining room", "camera_height": camera, "is_inside": True,
        "ceiling_height": CEILING_M / unit, "is_ceiling_flat": False, "layout_raw": layout, "layout_complete": layout,
        "floor_plan_transformation": {"rotation": 12.0, "scale": PLAN_SCALE, "translation": [1.0, 2.0]},
    }  # fmt: skip


def home(*entries: dict[str, Any]) -> dict[str, Any]:
    panoramas = {f"pano_{k}": e for k, e in enumerate(entries or (entry(),), start=1)}
    return {
        "scale_meters_per_coordinate": {"floor_01": METRES_PER_UNIT},
        "merger": {"floor_01": {"complete_room_01": {"partial_room_01": panoramas}}},
        "redraw": {},
    }


def painted() -> np.ndarray:
    """A panorama that shows the door red: pixel by pixel, where its ray meets the plane of its wall."""
    (ahead, y_left), (_, y_right), low, high = DOOR_M
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    azimuth, elevation = 2 * np.pi * (u / WIDTH - 0.5), np.pi * (0.5 - v / HEIGHT)  # azimuth to the right
    x, y, z = np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    far = ahead / np.maximum(x, 1e-9)
    red = (x > 0) & (y * far < y_left) & (y * far > y_right) & (z * far + CAMERA_M > low) & (z * far + CAMERA_M < high)
    return np.where(red[..., None], [255, 0, 0], [40, 120, 40]).astype(np.uint8)


def write(folder: Path, document: dict[str, Any] | None = None) -> Path:
    (folder / "panos").mkdir(parents=True, exist_ok=True)
    (folder / "panos" / "pano_1.jpg").write_bytes(encode_jpeg(painted(), 100))
    path = folder / "zind_data.json"
    path.write_text(json.dumps(document or home()))
    return path


def test_the_room_and_its_door_are_where_the_picture_shows_them(tmp_path: Path) -> None:
    (panorama,), notes = read_zind(write(tmp_path / "0001"))
    assert notes == []
    assert (panorama.room_type, panorama.flat_ceiling, panorama.inside) == ("dining_room", False, True)
    assert (panorama.camera_height_m, panorama.height_m) == (CAMERA_M, CEILING_M)
    assert sorted(panorama.outline_xy.tolist()) == sorted(ROOM_M)
    episode = zind_episode(panorama, "a")
    assert episode.sensor.height_m is None
    assert episode.truth is not None
    assert episode.truth.sensor is not None
    camera, camera_T_world = episode.sensor.camera, invert(episode.truth.sensor.world_T_camera)
    rgb = episode.frames[0].rgb
    door = next(item for item in episode.truth.scene.objects if item.category_name == "door")
    points = apply(door.scene_T_object, np.array([[x, 0.0, z] for x in (-0.41, 0, 0.41) for z in (0.05, 1.0, 1.95)]))
    pixels = np.floor(camera.project(apply(camera_T_world, points))[0]).astype(int)
    assert (rgb[pixels[:, 1], pixels[:, 0], 0] > 150).all()
    around = apply(door.scene_T_object, np.array([[x, 0.0, 1.0] for x in (-0.52, 0.52)] + [[0.0, 0.0, 2.1]]))
    pixels = np.floor(camera.project(apply(camera_T_world, around))[0]).astype(int)
    assert (rgb[pixels[:, 1], pixels[:, 0], 0] < 100).all()


def test_a_home_becomes_a_data_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "0001", home(entry(), entry("pano_2")))
    assert run(["import", "zind", str(path), "--out", str(tmp_path / "data")]) == 0
    told = capsys.readouterr()
    assert "note: 1 panoramas have no picture here, left out: pano_2.jpg" in told.err
    assert "the ceiling is not flat" in told.out
    dataset = load(tmp_path / "data", truth=True)
    (episode,) = dataset
    assert episode.episode_id == "0001-pano_1"
    assert (tmp_path / "data" / "episodes" / "0001-pano_1" / "inputs" / "frames" / "000000_rgb.jpg").read_bytes() == (
        tmp_path / "0001" / "panos" / "pano_1.jpg"
    ).read_bytes()
    assert list(verify_files(tmp_path / "data")) == []
    assert verify_episode(episode) == []
    assert load(tmp_path / "data")[0].truth is None


def changed(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    document = json.loads(json.dumps(home()))
    change(document)
    return document


def of_entry(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    return changed(lambda d: change(d["merger"]["floor_01"]["complete_room_01"]["partial_room_01"]["pano_1"]))


MALFORMED: dict[str, tuple[dict[str, Any], str]] = {
    "no merger": (changed(lambda d: d.pop("merger")), "no 'merger'"),
    "a list": (changed(lambda d: d.update(merger=[])), "is no object"),
    "no layout": (of_entry(lambda e: e.update(layout_complete=3, layout_raw=None)), "is a number; expected an object"),
    "no scale": (changed(lambda d: d["scale_meters_per_coordinate"].update(floor_01=None)), "have no scale"),
    "feet": (changed(lambda d: d["scale_meters_per_coordinate"].update(floor_01=11.8)), "camera would be 4.92 m high"),
    "negative scale": (changed(lambda d: d["scale_meters_per_coordinate"].update(floor_01=-1)), "expected more than 0"),
    "low ceiling": (of_entry(lambda e: e.update(ceiling_height=0.5)), "ceiling is 0.5 high"),
    "NaN": (of_entry(lambda e: e["layout_complete"]["vertices"].append([float("nan"), 1.0])), "NaN is no JSON number"),
    "null corner": (of_entry(lambda e: e["layout_complete"]["vertices"].append(None)), r"vertices\[4\] is null"),
    "two corners": (of_entry(lambda e: e["layout_complete"].update(vertices=[[0, 1], [1, 0]])), "2 corners"),
    "no corner": (of_entry(lambda e: e["layout_complete"].update(vertices=[])), "0 corners"),
    "door of two rows": (of_entry(lambda e: e["layout_complete"]["doors"].pop()), "doors has 2 rows"),
    "huge corner": (of_entry(lambda e: e["layout_complete"]["vertices"][0].__setitem__(0, 1e9)), "at most 1000"),
    "outside": (of_entry(lambda e: e.update(image_path="../../etc/passwd")), "leads out of"),
    "no picture": (of_entry(lambda e: e.update(image_path="panos/pano_9.jpg")), "no picture here"),
}  # fmt: skip


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_homes_are_refused(case: str, tmp_path: Path) -> None:
    document, match = MALFORMED[case]
    refused(read_zind, write(tmp_path / "0001", document), match)


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "no PNG or JPEG"),
        (encode_jpeg(painted())[:300], "damaged|no PNG or JPEG|without an end"),
        (encode_jpeg(np.zeros((10, 30, 3), np.uint8)), "twice as wide as high"),
    ],
)
def test_other_pictures_are_refused(data: bytes, match: str, tmp_path: Path) -> None:
    (panorama,), _ = read_zind(write(tmp_path / "0001"))
    panorama.image.write_bytes(data)
    refused(lambda _: zind_episode(panorama, "a"), panorama.image, match)


@ANY_FILE
@given(data=st.data())
def test_damaged_homes_are_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    path = write(tmp_path / "0001")
    damaged = data.draw(mutated(path.read_bytes()))
    refused_or_read(read_zind, path, damaged, lambda found: zind_episode(found[0][0], "a"))


def test_the_painted_door_is_in_the_right_half() -> None:
    columns = np.flatnonzero(painted()[HEIGHT // 2, :, 0] == 255)
    assert columns.min() > WIDTH / 2
    assert cv2.countNonZero(painted()[..., 0]) > 0
