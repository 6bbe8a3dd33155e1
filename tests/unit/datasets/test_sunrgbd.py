"""The reader of SUN RGB-D folders on a made room whose camera, floor, box and walls are known exactly."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.room_boxes import CATEGORY_OF_NAME, RoomBox, box_object, category_of, plain_name
from hsbench.datasets.importers.room_captures import sunrgbd_episode
from hsbench.datasets.importers.sunrgbd import read_sunrgbd
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.transforms import apply
from hsbench.schema.categories import CATEGORIES
from tests.unit.datasets import room_files as made
from tests.unit.datasets.mutations import attempt, mutated

ANY_FILE = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize("yaw_rad", [0.0, 0.03, -0.4])
def test_camera_floor_and_box_are_found(tmp_path: Path, yaw_rad: float) -> None:
    frame = read_sunrgbd(made.sunrgbd_folder(tmp_path / "a", yaw_rad))
    episode, notes = sunrgbd_episode(frame, "a")
    sensor = episode.sensor
    assert sensor.height_m == pytest.approx(made.HEIGHT_M, abs=0.005)
    assert sensor.tilt_rad == pytest.approx(made.TILT_RAD, abs=2e-6)
    assert sensor.roll_rad == pytest.approx(made.ROLL_RAD, abs=2e-6)
    assert episode.truth is not None
    scene = episode.truth.scene
    assert scene is not None
    (table,) = scene.objects
    assert table.category_name == "dining_table"
    assert sensor.height_m is not None
    rise = sensor.height_m - made.HEIGHT_M  # by which the floor was misjudged
    centre, size = (made.BOX_LOW + made.BOX_HIGH) / 2, made.BOX_HIGH - made.BOX_LOW
    np.testing.assert_allclose(table.box[:3], centre + [0, 0, rise], atol=2e-4)
    # Its front looks at the camera, along -x, and the object's along its own -y.
    np.testing.assert_allclose(table.box[3:], [size[1], size[0], size[2], -math.pi / 2], atol=2e-4)
    np.testing.assert_allclose(table.scene_T_object[:2, 1], [1.0, 0.0], atol=2e-4)
    (room,) = scene.rooms
    assert room.room_type == "office"
    assert room.area_m2 == pytest.approx(made.WALL_X_M * (made.WALL_Y_M + 2.0), abs=1e-3)
    assert scene.height_m == pytest.approx(2.4 + rise, abs=2e-4)
    assert any("2 entries that are null" in note for note in notes)


def test_points_of_the_picture_lie_on_the_room(tmp_path: Path) -> None:
    episode, _ = sunrgbd_episode(read_sunrgbd(made.sunrgbd_folder(tmp_path / "a", 0.1)), "a")
    frame = episode.frames[0]
    assert frame.depth_m is not None
    points = apply(episode.sensor.world_T_camera, episode.sensor.camera.unproject(frame.depth_m))
    floor, ahead, left = points[..., 2], points[..., 0] - made.WALL_X_M, points[..., 1] - made.WALL_Y_M
    inside = ((points > made.BOX_LOW - 0.01) & (points < made.BOX_HIGH + 0.01)).all(axis=-1)
    near = (np.abs(floor) < 0.01) | (np.abs(ahead) < 0.01) | (np.abs(left) < 0.01) | inside
    assert near.all()
    assert inside.sum() > 100
    # Left stays left: the wall on the left is seen in the left half, which is red.
    assert frame.rgb is not None
    columns = np.nonzero(np.abs(left) < 0.01)[1]
    assert columns.max() < made.WIDTH / 2
    assert frame.rgb[10, 5, 0] > 200 > 50 > frame.rgb[10, 5, 2]


def test_import_and_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = made.sunrgbd_folder(tmp_path / "frame-1")
    assert run(["import", "sunrgbd", str(folder), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr()
    assert "1 objects in 10.5 m2" in told.out
    assert "2 entries that are null" in told.err
    assert verify_files(tmp_path / "out") == []
    episode = load(tmp_path / "out", truth=True)[0]
    assert verify_episode(episode) == []
    assert episode.episode_id == "frame-1"
    assert episode.frames[0].depth_m is not None
    found = read_sunrgbd(folder)
    np.testing.assert_allclose(episode.frames[0].depth_m, found.depth_m, atol=1e-6)
    np.testing.assert_array_equal(episode.frames[0].rgb, found.rgb)


def test_filled_depth_is_another_file(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    made.write_grey16(folder / "depth_bfx" / "a.png", made.rotated(np.full((made.HEIGHT, made.WIDTH), 2.0)))
    assert (read_sunrgbd(folder, filled=True).depth_m == 2.0).all()
    assert read_sunrgbd(folder).depth_m.std() > 0.1


def test_without_annotation(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    (folder / "annotation3Dlayout" / "index.json").unlink()
    episode, notes = sunrgbd_episode(read_sunrgbd(folder), "a")
    assert episode.truth is not None
    assert episode.truth.scene is not None
    outline = episode.truth.scene.rooms[0].outline_xy
    assert outline[:, 0].max() == pytest.approx(made.WALL_X_M, abs=0.01)
    assert outline[:, 1].max() == pytest.approx(made.WALL_Y_M, abs=0.01)
    assert any("no room is drawn" in note for note in notes)
    (folder / "annotation3Dfinal" / "index.json").unlink()
    (folder / "scene.txt").unlink()
    frame = read_sunrgbd(folder)
    episode, notes = sunrgbd_episode(frame, "a")
    assert (frame.room_type, episode.truth) == ("room", None)
    assert any("no truth" in note for note in notes)


def test_a_frame_without_objects_keeps_its_room(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    (folder / "annotation3Dfinal" / "index.json").write_text('{"objects": []}')
    episode, notes = sunrgbd_episode(read_sunrgbd(folder), "a")
    assert episode.truth is not None
    assert episode.truth.scene is not None
    assert episode.truth.scene.objects == ()
    assert not any("null" in note for note in notes)


def test_entries_without_an_outline_count_as_deleted(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    for name in ("annotation3Dfinal", "annotation3Dlayout"):
        change(folder, name, lambda entries: entries.insert(0, {"name": "gone", "polygon": []}))
    frame = read_sunrgbd(folder)
    assert (len(frame.boxes), frame.deleted) == (1, 3)
    assert frame.layout is not None
    assert frame.layout.name == "room"


@pytest.mark.parametrize("drawn", [True, False])
def test_a_floor_out_of_sight_is_that_of_the_annotation(tmp_path: Path, drawn: bool) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    episode, _ = sunrgbd_episode(read_sunrgbd(folder), "a")
    depth = episode.frames[0].depth_m
    assert depth is not None
    points = apply(episode.sensor.world_T_camera, episode.sensor.camera.unproject(depth))
    made.write_grey16(folder / "depth" / "a.png", made.rotated(np.where(points[..., 2] > 0.45, depth, 0.0)))
    if not drawn:
        (folder / "annotation3Dlayout" / "index.json").unlink()
    episode, notes = sunrgbd_episode(read_sunrgbd(folder), "a")
    assert episode.sensor.height_m == pytest.approx(made.HEIGHT_M, abs=1e-4)
    assert "the floor is not seen; by the annotation it is 1.30 m below the camera" in notes


def test_unknown_names_become_objects_and_are_told(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    change(folder, "annotation3Dfinal", lambda entries: entries[1].update(name="projector:broken"))
    episode, notes = sunrgbd_episode(read_sunrgbd(folder), "a")
    assert episode.truth is not None
    assert episode.truth.scene is not None
    assert episode.truth.scene.objects[0].category_name == "object"
    assert any("become 'object': projector" in note for note in notes)


def test_every_name_has_a_category_that_exists() -> None:
    known = {category.name for category in CATEGORIES}
    assert set(CATEGORY_OF_NAME.values()) <= known
    assert all(name == plain_name(name) for name in CATEGORY_OF_NAME)
    assert all(category_of(name) == name for name in known)
    assert category_of("Night_stand:left") == category_of("night stand") == "night_stand"


@given(
    size=st.tuples(*3 * [st.floats(0.05, 3.0)]),
    centre=st.tuples(*3 * [st.floats(-5.0, 5.0)]),
    yaw=st.floats(-3.1, 3.1),
    clockwise=st.booleans(),
)
def test_boxes_keep_their_size_place_and_front(
    size: tuple[float, float, float], centre: tuple[float, float, float], yaw: float, clockwise: bool
) -> None:
    front = np.array([math.sin(yaw), -math.cos(yaw)])
    side = np.array([-front[1], front[0]])  # to the left of the front
    signs = [(1, 1), (1, -1), (-1, -1), (-1, 1)]
    if clockwise:
        signs = [(f, -s) for f, s in signs]
    outline = np.array([centre[:2] + f * front * size[1] / 2 + s * side * size[0] / 2 for f, s in signs])
    box = RoomBox("chair", outline, centre[2] - size[2] / 2, centre[2] + size[2] / 2, front)
    item = box_object(box, 1)
    assert item is not None
    np.testing.assert_allclose(item.box[:6], [*centre, *size], atol=2e-3)
    np.testing.assert_allclose(item.scene_T_object[:2, 1], -front, atol=2e-4)
    item.solids[0].check()
    corner = np.array([*outline[0], box.top_m])
    assert item.solids[0].contains(centre + 0.9 * (corner - centre))
    assert not item.solids[0].contains(centre + 1.2 * (corner - centre))


def test_flat_boxes_are_left_out_and_counted(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    change(folder, "annotation3Dfinal", lambda entries: entries[1]["polygon"][0].update(Ymin=1.0, Ymax=1.0))
    episode, notes = sunrgbd_episode(read_sunrgbd(folder), "a")
    assert episode.truth is not None
    assert episode.truth.scene is not None
    assert episode.truth.scene.objects == ()
    assert "left out 1 boxes without a volume" in notes


# damage


def change(folder: Path, name: str, edit: Callable[[list[Any]], object]) -> None:
    path = folder / name / "index.json"
    document = json.loads(path.read_text())
    edit(document["objects"])
    path.write_text(json.dumps(document))


def box_edit(**values: Any) -> Callable[[Path], None]:
    return lambda folder: change(folder, "annotation3Dfinal", lambda entries: entries[1]["polygon"][0].update(values))


def text_edit(name: str, text: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        (folder / name).write_text(text)

    return edit


@pytest.mark.parametrize(
    ("damage", "match"),
    [
        (text_edit("intrinsics.txt", "80 0 47 0 80 37 0 0"), "intrinsics.txt: 8 values; expected 3 x 3"),
        (text_edit("intrinsics.txt", "80 0 0 0 80 0 47 37 1"), "the other order"),
        (text_edit("intrinsics.txt", "80 0 470 0 80 37 0 0 1"), "of another size of picture"),
        (text_edit("intrinsics.txt", "80 0 nan 0 80 37 0 0 1"), "value 3 is 'nan'; expected a finite number"),
        (text_edit("intrinsics.txt", ""), "0 values"),
        (text_edit("extrinsics/20150101000000.txt", "1 0 0 0 0 1 0 0 0 0 2 0"), "is no rotation"),
        (text_edit("extrinsics/20150101000000.txt", "1 0 0 0 0 1 0 0 0 0 -1 0"), "is no rotation"),
        (text_edit("extrinsics/20150101000000.txt", "1 0 0"), "3 values; expected 3 x 4"),
        (text_edit("scene.txt", "a\nb"), "expected one word"),
        (text_edit("annotation3Dfinal/index.json", ""), "is empty; expected JSON"),
        (text_edit("annotation3Dfinal/index.json", "[]"), "is a list; expected an object"),
        (text_edit("annotation3Dfinal/index.json", '{"objects": 3}'), "objects is a number; expected a list"),
        (text_edit("annotation3Dfinal/index.json", '{"objects": [{"polygon": []}]}'), r"objects\[0\] has no 'name'"),
        (text_edit("annotation3Dfinal/index.json", '{"objects": [{"name": 3}]}'), r"objects\[0\].name is 3"),
        (text_edit("annotation3Dlayout/index.json", '{"objects": [NaN]}'), "NaN is no JSON number"),
        (box_edit(X=[0, 1, 1]), r"objects\[1\].polygon\[0\] has 3 X and 4 Z"),
        (box_edit(X=[0, 1], Z=[0, 1]), "has 2 X and 2 Z; expected 3 or more"),
        (box_edit(X=[0, 1, 1, None]), r"X\[3\] is null; expected a number"),
        (box_edit(X=[0, 1000, 1000, 0]), "expected a number of at most 100"),
        (box_edit(X=[0.0] * 5000, Z=[0.0] * 5000), "5,000 items; expected at most 1,000"),
        (box_edit(Ymin="low"), "Ymin and Ymax"),
        (lambda folder: change(folder, "annotation3Dfinal", lambda e: e.extend([None] * 20_000)), "20,003 items"),
        (lambda folder: (folder / "image" / "a.jpg").unlink(), r"has no file \*.jpg"),
        (lambda folder: (folder / "image" / "a.jpg").write_bytes(b"\xff\xd8\xff"), "is no PNG or JPEG with a size"),
        (lambda folder: made.write_rgb(folder / "image" / "a.jpg", made.rgb((64, 48))), "64 x 48 px; expected"),
        (lambda folder: (folder / "depth" / "a.png").write_bytes(b""), "is not a PNG"),
        (lambda folder: made.write_grey16(folder / "depth" / "a.png", made.depth_m() * 1000), "plain millimetres"),
    ],
)  # fmt: skip
def test_damage_is_named_in_one_line(tmp_path: Path, damage: Callable[[Path], None], match: str) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    damage(folder)
    with pytest.raises(DataError, match=match) as caught:
        read_sunrgbd(folder)
    assert str(caught.value).isprintable()
    assert str(folder) in str(caught.value)


def test_byte_swapped_depth_is_refused(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    made.write_grey16(folder / "depth" / "a.png", made.rotated(made.depth_m()).astype(np.uint16).byteswap())
    with pytest.raises(DataError, match="depths exceed 16 m"):
        read_sunrgbd(folder)


def test_a_depth_image_without_reading_and_an_upside_down_camera(tmp_path: Path) -> None:
    folder = made.sunrgbd_folder(tmp_path / "a")
    made.write_grey16(folder / "depth" / "a.png", np.zeros((made.HEIGHT, made.WIDTH)))
    with pytest.raises(DataError, match="no reading at all"):
        sunrgbd_episode(read_sunrgbd(folder), "a")
    folder = made.sunrgbd_folder(tmp_path / "b")
    (folder / "extrinsics" / "20150101000000.txt").write_text("1 0 0 0 0 0 -1 0 0 1 0 0")
    with pytest.raises(DataError, match="expected a heading"):
        sunrgbd_episode(read_sunrgbd(folder), "b")


PARTS = (
    "intrinsics.txt", "extrinsics/20150101000000.txt", "scene.txt", "annotation3Dfinal/index.json",
    "annotation3Dlayout/index.json", "image/a.jpg", "depth/a.png",
)  # fmt: skip


@ANY_FILE
@given(data=st.data())
def test_mutated_files_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = made.sunrgbd_folder(tmp_path_factory.mktemp("m") / "a")
    path = folder / data.draw(st.sampled_from(PARTS))
    path.write_bytes(data.draw(mutated(path.read_bytes())))
    frame, refusal = attempt(lambda: read_sunrgbd(folder))
    if frame is not None:
        _, refusal = attempt(lambda: sunrgbd_episode(frame, "a"))
    assert refusal is None or str(refusal).isprintable()


def test_the_episode_camera_is_that_of_the_room() -> None:
    """The camera that the made files were traced with, by the convention of the schema."""
    pose = world_T_camera(made.HEIGHT_M, made.TILT_RAD, made.ROLL_RAD)
    np.testing.assert_allclose(pose[:3, :3], made.episode_R_camera(), atol=1e-9)
