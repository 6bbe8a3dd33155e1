"""VoteNet's and mmdet3d's text of the made room: both ways to write a box, points as depth, pickles refused."""

from __future__ import annotations

import io
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.room_captures import sunrgbd_text_episode
from hsbench.datasets.importers.sunrgbd_text import CLASSES, SunRgbdText, read_sunrgbd_text
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.typing import FloatArray
from tests.unit.datasets import room_files as made
from tests.unit.datasets.mutations import attempt, check_message, mutated

ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = ("label.txt", "calib.txt", "image.jpg", "pc.npz")


def upright_points() -> FloatArray:
    """(N, 3) what the made depth shows, x right, y ahead, z up, from the camera."""
    depth = made.depth_m()
    u, v = np.meshgrid(np.arange(1, made.WIDTH + 1), np.arange(1, made.HEIGHT + 1))
    x, y = (u - made.CENTRE[0]) / made.FOCAL * depth, (v - made.CENTRE[1]) / made.FOCAL * depth
    return np.stack([x, y, depth], axis=-1).reshape(-1, 3) @ made.upright_R_camera().T


def label_row() -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Centre, half sizes along the heading, across it and up, and the heading: towards the camera, so -y upright."""
    low, high = made.BOX_LOW, made.BOX_HIGH
    x, y, z = (low + high) / 2
    half = (high - low) / 2
    return np.array([-y, x, z - made.HEIGHT_M]), half, (0.0, -1.0)


def frame_files(folder: Path) -> Path:
    centre, (along, across, up), heading = label_row()
    numbers = [1, 2, 30, 40, *centre, across, along, up, *heading]
    folder.mkdir()
    (folder / "label.txt").write_text("table " + " ".join(f"{n:.6f}" for n in numbers) + "\n")
    angle = -math.atan2(heading[1], heading[0])
    np.save(folder / "bbox.npy", np.array([[*centre, along, across, up, angle, CLASSES.index("table")]]))
    tilt = made.upright_R_camera() @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    K = np.array([[made.FOCAL, 0, made.CENTRE[0]], [0, made.FOCAL, made.CENTRE[1]], [0, 0, 1]])
    lines = [" ".join(f"{v:.6f}" for v in matrix.ravel(order="F")) for matrix in (tilt, K)]
    (folder / "calib.txt").write_text("\n".join(lines) + "\n")
    made.write_rgb(folder / "image.jpg", made.rgb())
    points = np.concatenate([upright_points(), np.zeros((made.WIDTH * made.HEIGHT, 3))], axis=1).astype(np.float32)
    np.savez_compressed(folder / "pc.npz", pc=points)
    (folder / "points.bin").write_bytes(points.astype("<f4").tobytes())
    return folder


def read(folder: Path, boxes: str = "label.txt", points: str | None = "pc.npz") -> SunRgbdText:
    return read_sunrgbd_text(
        folder / boxes, folder / "calib.txt", folder / "image.jpg", None if points is None else folder / points
    )


@pytest.mark.parametrize("points", ["pc.npz", "points.bin", None])
@pytest.mark.parametrize("boxes", ["label.txt", "bbox.npy"])
def test_camera_and_box_are_found(tmp_path: Path, boxes: str, points: str | None) -> None:
    frame = read(frame_files(tmp_path / "a"), boxes, points)
    episode, notes = sunrgbd_text_episode(frame, "a")
    sensor = episode.sensor
    assert sensor.height_m == pytest.approx(made.HEIGHT_M, abs=0.005)
    assert (sensor.tilt_rad, sensor.roll_rad) == pytest.approx((made.TILT_RAD, made.ROLL_RAD), abs=3e-6)
    assert episode.truth is not None
    assert episode.truth.scene is not None
    (table,) = episode.truth.scene.objects
    assert sensor.height_m is not None
    size, rise = made.BOX_HIGH - made.BOX_LOW, sensor.height_m - made.HEIGHT_M
    centre = (made.BOX_LOW + made.BOX_HIGH) / 2 + [0, 0, rise]
    np.testing.assert_allclose(table.box, [*centre, size[1], size[0], size[2], -math.pi / 2], atol=3e-4)
    assert any("no room is drawn" in note for note in notes)
    assert sensor.kind == ("monocular" if points is None else "rgbd")


def test_points_give_back_the_depth_image(tmp_path: Path) -> None:
    frame = read(frame_files(tmp_path / "a"))
    assert frame.depth_m is not None
    np.testing.assert_allclose(frame.depth_m, made.depth_m(), rtol=1e-5)
    points = np.load(tmp_path / "a" / "pc.npz")["pc"]
    np.savez_compressed(tmp_path / "a" / "pc.npz", pc=points[::7])
    sparse = read(tmp_path / "a").depth_m
    assert sparse is not None
    assert (sparse > 0).sum() == len(points[::7])
    np.testing.assert_allclose(sparse[sparse > 0], made.depth_m()[sparse > 0], rtol=1e-5)


def test_nothing_labelled_and_no_points(tmp_path: Path) -> None:
    folder = frame_files(tmp_path / "a")
    (folder / "label.txt").write_text("")
    np.save(folder / "bbox.npy", np.zeros((0, 8)))
    for boxes in ("label.txt", "bbox.npy"):
        episode, notes = sunrgbd_text_episode(read(folder, boxes, None), "a")
        assert (episode.truth, episode.sensor.height_m) == (None, None)
        assert episode.sensor.tilt_rad == pytest.approx(made.TILT_RAD, abs=3e-6)
        assert any("height of the camera is not known" in note for note in notes)


def test_import_and_load(tmp_path: Path) -> None:
    folder = frame_files(tmp_path / "a")
    files = [str(folder / name) for name in ("label.txt", "calib.txt", "image.jpg")]
    out = tmp_path / "out"
    assert run(["import", "sunrgbd-text", *files, "--points", str(folder / "pc.npz"), "--out", str(out)]) == 0
    assert run(["import", "sunrgbd-text", *files, "--out", str(out), "--name", "picture-only"]) == 0
    assert verify_files(out) == []
    episodes = [load(out, truth=True)[k] for k in range(2)]
    assert [episode.episode_id for episode in episodes] == ["image", "picture-only"]
    assert all(verify_episode(episode) == [] for episode in episodes)
    assert episodes[1].frames[0].depth_m is None


@pytest.mark.parametrize(
    ("name", "content", "match"),
    [
        ("label.txt", b"table 1 2 3", "label.txt line 1: 4 fields; expected 13"),
        ("label.txt", b"\n\nbed" + b" 1" * 11 + b" x", "line 3 after the class: value 12 is 'x'"),
        ("label.txt", b"bed" + b" nan" * 12, "value 1 is 'nan'"),
        ("label.txt", b"bed" + b" 1" * 7 + b" -1 1 1 1 0", "half sizes"),
        ("label.txt", b"bed" + b" 1" * 10 + b" 0 0", "expected a direction"),
        ("label.txt", b"bed" + b" 1" * 4 + b" 4000 1 1 1 1 1 1 0", "line 1 reaches"),
        ("label.txt", b"\xff\xfe\x00", "is no text at byte 0"),
        ("calib.txt", b"", "0 lines; expected Rtilt and K"),
        ("calib.txt", b"1 0 0 0 1 0 0 0 1\n80 0 0 0 80 0 47 37", "line 2: 8 values; expected 9"),
        ("calib.txt", b"1 0 0 0 1 0 0 0 1\n80 0 47 0 80 37 0 0 1", "line 2: .*the other order"),
        ("calib.txt", b"2 0 0 0 1 0 0 0 1\n80 0 0 0 80 0 47 37 1", "line 1: .* is no rotation"),
        ("image.jpg", b"GIF89a", "is no PNG or JPEG"),
        ("pc.npz", b"", "expected an NPZ file"),
    ],
)
def test_damage_is_named_in_one_line(tmp_path: Path, name: str, content: bytes, match: str) -> None:
    folder = frame_files(tmp_path / "a")
    (folder / name).write_bytes(content)
    with pytest.raises(DataError, match=match) as caught:
        read(folder)
    check_message(caught.value, folder / name)


def npy(array: Any, **options: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array, **options)
    return file.getvalue()


def claimed(shape: tuple[int, ...]) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return file.getvalue() + bytes(64)


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "header cannot be read"),
        (npy(np.zeros((2, 7))), r"shape \(2, 7\); expected \(boxes, 8\)"),
        (npy(np.zeros((2, 8)))[:-3], "an incomplete copy"),
        (claimed((10**12, 8)), "as its header says"),
        (npy(np.zeros((2, 8), dtype=object), allow_pickle=True), "objects would need pickle"),
        (npy(np.full((2, 8), np.nan)), "row 0 has a value that is not finite"),
        (npy(np.ones((2, 8)) * [1, 1, 1, 1, 1, 1, 1, 10]), "row 0 is of class 10; expected 0 to 9"),
        (npy(np.ones((2, 8)) * [1, 1, 1, 1, 1, 1, 1, 0.5]), "row 0 is of class 0.5"),
        (npy(np.ones((2, 8)).astype("<f8").byteswap()), "row 0"),
    ],
)
def test_damaged_box_arrays(tmp_path: Path, content: bytes, match: str) -> None:
    folder = frame_files(tmp_path / "a")
    (folder / "bbox.npy").write_bytes(content)
    with pytest.raises(DataError, match=match) as caught:
        read(folder, "bbox.npy")
    check_message(caught.value, folder / "bbox.npy")


def test_pickles_are_not_opened(tmp_path: Path) -> None:
    folder = frame_files(tmp_path / "a")
    for name in ("sunrgbd_infos_train.pkl", "label.json"):
        (folder / name).write_bytes(pickle.dumps([{"annos": {}}]))
    with pytest.raises(DataError, match="can run code when it is opened; expected the frame's label") as caught:
        read(folder, "sunrgbd_infos_train.pkl")
    check_message(caught.value, folder / "sunrgbd_infos_train.pkl")
    with pytest.raises(DataError, match=r"ends in '.json'; expected a label"):
        read(folder, "label.json")


def test_points_of_another_frame_are_refused(tmp_path: Path) -> None:
    folder = frame_files(tmp_path / "a")
    points = np.load(folder / "pc.npz")["pc"]
    np.savez(folder / "pc.npz", pc=points * np.array([1, -1, 1, 1, 1, 1], np.float32))
    with pytest.raises(DataError, match=r"0% of 6,912 points lie in the picture; .*another frame"):
        read(folder)
    (folder / "points.bin").write_bytes(points.byteswap().tobytes())
    with pytest.raises(DataError, match=r"point 0 is .*bytes swapped"):
        read(folder, points="points.bin")
    (folder / "points.bin").write_bytes(points.tobytes()[:-1])
    with pytest.raises(DataError, match="expected 24 a point"):
        read(folder, points="points.bin")
    (folder / "points.bin").write_bytes(b"")
    with pytest.raises(DataError, match="of 0 points"):
        read(folder, points="points.bin")


@ANY_FILE
@given(data=st.data())
def test_mutated_files_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = frame_files(tmp_path_factory.mktemp("m") / "a")
    name = data.draw(st.sampled_from([*NAMES, "bbox.npy", "points.bin"]))
    (folder / name).write_bytes(data.draw(mutated((folder / name).read_bytes())))
    boxes = "bbox.npy" if name == "bbox.npy" else "label.txt"
    frame, refusal = attempt(lambda: read(folder, boxes, "points.bin" if name == "points.bin" else "pc.npz"))
    if refusal is not None:
        check_message(refusal, folder / name)
        return
    assert frame is not None
    _, refusal = attempt(lambda: sunrgbd_text_episode(frame, "a"))
    assert refusal is None or str(refusal).isprintable()
