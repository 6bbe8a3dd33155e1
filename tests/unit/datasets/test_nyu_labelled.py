"""The labelled frames of NYU v2 in a file written here from the layout: axes, numbers of things, categories, voxels.

*Unverified on real data*, but for the class map and the rotations (``tests/real/test_nyu_real.py``).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.nyu_labelled import CAMERA, NyuFrame, read_nyu_labelled, read_rotation
from hsbench.datasets.importers.room_captures import nyu_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError, MissingExtraError
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.transforms import apply
from hsbench.io.pixel_labels import PixelLabels
from hsbench.schema.categories import CATEGORIES, category
from hsbench.schema.states import VoxelState
from hsbench.typing import AnyArray, FloatArray
from tests.unit.datasets import room_files as made
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

h5py = pytest.importorskip("h5py")
ANY_FILE = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = ("chair", "floor", "air vent", "wall", "Frisbee")
FOCAL, SIZE = (518.8579, 519.4696), (640, 480)
GRID = VoxelGrid((0.0, -3.2, 0.0), (64, 64, 24), 0.1)


def depth() -> FloatArray:
    """(480, 640) of the made room, by rays written here; pixels are counted from 1."""
    u, v = np.meshgrid(np.arange(1, 641), np.arange(1, 481))
    rays = np.stack([(u - 325.5824) / FOCAL[0], (v - 253.7362) / FOCAL[1], np.ones(u.shape)], axis=-1)
    rays = rays @ made.episode_R_camera().T
    with np.errstate(divide="ignore"):
        planes = [-made.HEIGHT_M / rays[..., 2], made.WALL_X_M / rays[..., 0], made.WALL_Y_M / rays[..., 1]]
    return np.asarray(np.min([np.where(t > 0, t, np.inf) for t in planes], axis=0))


DEPTH = depth()


def labels() -> tuple[AnyArray, AnyArray]:
    """(480, 640) class and number: floor below, two walls, two chairs drawn on the floor, nothing at the border."""
    episode = made.episode_R_camera() @ np.array([0.0, 0.0, 1.0])
    assert episode[0] > 0
    points = CAMERA.unproject(DEPTH) @ made.episode_R_camera().T + [0, 0, made.HEIGHT_M]
    kind, number = np.full(DEPTH.shape, 4), np.ones(DEPTH.shape, int)
    kind[points[..., 2] < 0.02] = 2
    number[(kind == 4) & (np.abs(points[..., 1] - made.WALL_Y_M) < 0.02)] = 2
    kind[400:440, 200:300], number[400:440, 200:300] = 1, 3
    kind[400:440, 300:400], number[400:440, 300:400] = 1, 7
    kind[:10], number[-10:] = 0, 0
    return kind, number


def write(path: Path, edit: Callable[[dict[str, Any]], object] = lambda arrays: None, frames: int = 2) -> Path:
    """A file as MATLAB 7.3 writes one; the frame at index 1 is the made room, others are empty."""
    kind, number = labels()
    picture = made.rgb(SIZE).transpose(2, 1, 0)
    arrays: dict[str, Any] = {
        "images": np.stack([*(frames - 1) * [np.zeros_like(picture)], picture]),
        "depths": np.stack([*(frames - 1) * [np.ones((640, 480))], DEPTH.T]).astype(np.float32),
        "rawDepths": np.stack([*(frames - 1) * [np.zeros((640, 480))], DEPTH.T]).astype(np.float32),
        "labels": np.stack([*(frames - 1) * [np.zeros((640, 480))], kind.T]).astype(np.uint16),
        "instances": np.stack([*(frames - 1) * [np.zeros((640, 480))], number.T]).astype(np.uint8),
    }
    edit(arrays)
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            chunks = None if array.size == 0 else (1, *(min(side, 64) for side in array.shape[1:]))
            file.create_dataset(name, data=array, chunks=chunks, compression=None if chunks is None else "gzip")
        references = np.empty((1, len(NAMES)), dtype=h5py.ref_dtype)
        for k, name in enumerate(NAMES):
            file[f"#refs#/{k}"] = np.array([[ord(letter)] for letter in name], dtype=np.uint16)
            references[0, k] = file[f"#refs#/{k}"].ref
        file["names"] = references
    return path


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("nyu") / "nyu.mat")


@pytest.fixture(scope="module")
def frame(sound: Path) -> NyuFrame:
    return read_nyu_labelled(sound, 1)


def rotations(path: Path) -> Path:
    tilt = made.upright_R_camera() @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    blocks = ["\n".join(" ".join(f"{v:.6f}" for v in row) for row in matrix) for matrix in (np.eye(3), tilt)]
    path.write_text("\n\n".join(blocks) + "\n\n")
    return path


def test_pictures_are_upright_and_left_stays_left(frame: NyuFrame) -> None:
    np.testing.assert_array_equal(frame.rgb, made.rgb(SIZE))
    np.testing.assert_array_equal(frame.depth_m, DEPTH.astype(np.float32))
    assert frame.filled_m.shape == (480, 640)


def test_things_are_numbered_over_all_classes(frame: NyuFrame) -> None:
    assert frame.names == ("chair", "chair", "floor", "wall", "wall")
    assert frame.categories == frame.names
    kind, number = labels()
    for k, name in enumerate(frame.names, start=1):
        shown = frame.instance == k
        assert shown.any()
        assert set(kind[shown]) == {NAMES.index(name) + 1}
        assert len(set(number[shown])) == 1
        assert (frame.semantic[shown] == category(name).category_id).all()
    np.testing.assert_array_equal(frame.instance == 0, (kind == 0) | (number == 0))
    assert (frame.semantic[frame.instance == 0] == 0).all()


def class_map(path: Path) -> Path:
    names = np.empty((1, 40), dtype=object)
    names[0] = ["wall", "floor", "chair", *(f"other {k}" for k in range(36)), "window"]
    savemat(path, {"mapClass": np.array([[3, 2, 40, 1, 9]]), "className": names})
    return path


def test_the_map_of_40_classes_helps_where_a_name_has_no_category(tmp_path: Path) -> None:
    def vents(arrays: dict[str, Any]) -> None:
        arrays["labels"][arrays["labels"] == 1] = 3
        arrays["labels"][arrays["labels"] == 4] = 5

    path = write(tmp_path / "a.mat", vents)
    assert set(read_nyu_labelled(path, 1).categories) == {"floor", "object"}
    found = read_nyu_labelled(path, 1, class_map(tmp_path / "classes.mat"))
    assert found.names == ("floor", "air vent", "air vent", "Frisbee", "Frisbee")
    assert found.categories == ("floor", "window", "window", "object", "object")


def test_surfaces_in_voxels(frame: NyuFrame, tmp_path: Path) -> None:
    R = read_rotation(rotations(tmp_path / "r.txt"), 1)
    np.testing.assert_allclose(R, made.upright_R_camera(), atol=1e-5)
    episode, notes = nyu_episode(frame, "a", R, GRID)
    sensor = episode.sensor
    assert (sensor.height_m, sensor.tilt_rad, sensor.roll_rad) == pytest.approx(
        (made.HEIGHT_M, made.TILT_RAD, made.ROLL_RAD), abs=1e-4
    )
    assert any("pixels labelled so" in note for note in notes)
    assert episode.truth is not None
    assert episode.truth.occupancy is not None
    truth = episode.truth.occupancy
    held = np.argwhere(truth.semantic > 0)
    # Independently: every labelled voxel touches the plane that its category says, and chairs lie on the floor.
    low = np.asarray(GRID.origin_m) + held * GRID.voxel_m - 0.005
    high = low + GRID.voxel_m + 0.01
    names = np.array([CATEGORIES[k - 1].name for k in truth.semantic[tuple(held.T)]])
    on_floor = (low[:, 2] <= 0) & (high[:, 2] >= 0)
    ahead = (low[:, 0] <= made.WALL_X_M) & (high[:, 0] >= made.WALL_X_M)
    left = (low[:, 1] <= made.WALL_Y_M) & (high[:, 1] >= made.WALL_Y_M)
    assert on_floor[np.isin(names, ["floor", "chair"])].all()
    assert (ahead | left)[names == "wall"].all()
    assert {"floor", "chair", "wall"} == set(names)
    assert not truth.ignored[tuple(held.T)].any()
    assert (truth.state[tuple(held.T)] == VoxelState.SURFACE).all()
    free = (truth.semantic == 0) & ~truth.ignored
    assert (truth.state[free] == VoxelState.FREE).all()
    assert free.sum() > 1000


def test_the_instance_of_a_voxel_is_that_of_most_of_its_points(frame: NyuFrame) -> None:
    episode, _ = nyu_episode(frame, "a", made.upright_R_camera(), GRID)
    assert episode.truth is not None
    assert episode.truth.occupancy is not None
    found = episode.truth.occupancy.instance
    points = apply(episode.sensor.world_T_camera, CAMERA.unproject(frame.depth_m))
    cells = np.floor((points - np.asarray(GRID.origin_m)) / GRID.voxel_m).astype(int)
    cells[..., 2] = np.where(cells[..., 2] == -1, 0, cells[..., 2])  # the floor scatters about the grid's lower end
    votes: dict[tuple[int, ...], list[int]] = {}
    for at, number in zip(cells[frame.instance > 0].tolist(), frame.instance[frame.instance > 0].tolist(), strict=True):
        votes.setdefault(tuple(at), []).append(number)
    inside = {at: seen for at, seen in votes.items() if all(0 <= i < n for i, n in zip(at, GRID.shape, strict=True))}
    assert np.count_nonzero(found) == len(inside)
    for at, seen in inside.items():
        assert found[at] == max(sorted(set(seen)), key=seen.count)


def test_without_rotation_nothing_is_placed(frame: NyuFrame) -> None:
    episode, notes = nyu_episode(frame, "a", None, GRID)
    assert episode.truth is not None
    assert (episode.truth.occupancy, episode.truth.scene, episode.sensor.height_m) == (None, None, None)
    assert episode.truth.frames is not None
    assert np.array_equal(episode.truth.frames[0].instance, frame.instance)
    assert any("how the camera leans is not known" in note for note in notes)


def test_import_and_load(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    turned = rotations(tmp_path / "r.txt")
    out = tmp_path / "out"
    assert run(["import", "nyu-v2", str(sound), "--frame", "2", "--rotations", str(turned), "--out", str(out)]) == 0
    assert "5 labelled things" in capsys.readouterr().out
    assert verify_files(out) == []
    episode = load(out, truth=True)[0]
    assert verify_episode(episode) == []
    assert episode.episode_id == "NYU0002"
    assert episode.frames[0].depth_m is not None
    np.testing.assert_allclose(episode.frames[0].depth_m, DEPTH, atol=6e-4)  # millimetres on disk
    read = read_nyu_labelled(sound, 1)
    assert episode.truth is not None
    assert isinstance(labels := episode.truth.frames, PixelLabels)
    assert [(t.instance_id, t.name, t.category) for t in labels.things] == [
        (k, name, kind) for k, (name, kind) in enumerate(zip(read.names, read.categories, strict=True), start=1)
    ]
    assert np.array_equal(labels[0].instance, read.instance)
    assert np.array_equal(labels[0].semantic, read.semantic)
    coco = tmp_path / "coco"
    assert run(["export", str(out), "--to", "coco", "--truth", "--out", str(coco)]) == 0
    masks = json.loads((coco / "annotations" / "instances_unsplit.json").read_text())["annotations"]
    assert sorted((m["object_id"], m["category_id"], m["area"]) for m in masks) == [
        (k, category(kind).category_id, float(np.count_nonzero(read.instance == k)))
        for k, kind in enumerate(read.categories, start=1)
    ]
    capsys.readouterr()
    assert run(["import", "nyu-v2", str(sound), "--frame", "3", "--out", str(out)]) == 2
    assert "has 2 frames; frame 2 is none of them" in capsys.readouterr().err


# damage


def put(name: str, value: Callable[[AnyArray], AnyArray]) -> Callable[[dict[str, Any]], None]:
    return lambda arrays: arrays.update({name: value(arrays[name])})


@pytest.mark.parametrize(
    ("edit", "match"),
    [
        (lambda a: a.pop("instances"), "has no 'instances'; expected it"),
        (put("labels", lambda x: x.astype(float)), r"labels is float64 of shape \(2, 640, 480\); expected u"),
        (put("labels", lambda x: x.astype(np.uint64)), "labels is uint64; expected uint8 or uint16"),
        (put("labels", lambda x: x.transpose(0, 2, 1)), r"labels is uint16 of shape \(2, 480, 640\)"),
        (put("labels", lambda x: x.byteswap()), "labels of frame 1 reach 1024; expected 0 to 5"),
        (put("images", lambda x: x[:, :2]), r"images is uint8 of shape \(2, 2, 640, 480\)"),
        (put("rawDepths", lambda x: x * np.nan), "rawDepths hold nan; expected 0 to 16 m"),
        (put("rawDepths", lambda x: x.byteswap()), "rawDepths hold .*bytes swapped"),
        (put("depths", lambda x: x * 1000), "depths hold .*expected 0 to 16 m"),
        (put("depths", lambda x: x[:0]), "depths has 0 frames; frame 1 is none"),
        (put("instances", lambda x: x[:1]), "instances has 1 frames; frame 1 is none"),
    ],
)
def test_damage_is_named_in_one_line(
    tmp_path: Path, edit: Callable[[dict[str, Any]], None], match: str
) -> None:  # fmt: skip
    path = write(tmp_path / "a.mat", edit)
    refused(lambda p: read_nyu_labelled(p, 1), path, match)


def test_other_files(tmp_path: Path, sound: Path) -> None:
    path = tmp_path / "a.mat"
    refused(lambda p: read_nyu_labelled(p, 1), path, "cannot be read")
    for content in (b"", b"MATLAB 5.0", sound.read_bytes()[: sound.stat().st_size // 2]):
        path.write_bytes(content)
        refused(lambda p: read_nyu_labelled(p, 1), path, "cannot be read: .*expected MATLAB 7.3")
    path.write_bytes(sound.read_bytes())
    with h5py.File(path, "a") as file:
        del file["labels"]
        file["labels"] = h5py.ExternalLink("other.mat", "/labels")
    refused(lambda p: read_nyu_labelled(p, 1), path, "labels is no array in the file itself")
    with h5py.File(path, "a") as file:
        del file["labels"], file["names"]
        file.create_dataset("labels", (10**6, 640, 480), "u2", chunks=(2000, 640, 480))
        file["names"] = np.zeros((1, 3))
    refused(lambda p: read_nyu_labelled(p, 1), path, "labels has chunks .2000, 640, 480. of uint16; expected at most")
    with h5py.File(path, "a") as file:
        del file["labels"]
        file["labels"] = np.zeros((2, 640, 480), np.uint8)
    refused(lambda p: read_nyu_labelled(p, 1), path, r"names is float64 of shape \(1, 3\); expected \(1, classes\) ref")
    with h5py.File(path, "a") as file:
        del file["names"]
        file.create_dataset("names", (1, 3), h5py.ref_dtype)
    refused(lambda p: read_nyu_labelled(p, 1), path, "names 1 leads to no text")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("1 0 0\n0 1 0\n0 0 1\n", "3 rows; expected three for frame 1"),
        ("1 0 0\n" * 4 + "0 1\n1 0 0\n", r"rotation 1 has rows of \[3, 2, 3\] values"),
        ("1 0 0\n" * 6, "is no rotation"),
        ("1 0 0\n" * 3 + "1 0 0\n0 x 0\n0 0 1", "rotation 1: value 5 is 'x'"),
    ],
)
def test_damaged_rotations(tmp_path: Path, text: str, match: str) -> None:
    (tmp_path / "r.txt").write_text(text)
    refused(lambda path: read_rotation(path, 1), tmp_path / "r.txt", match)


def test_damaged_class_maps(tmp_path: Path, sound: Path) -> None:
    path = tmp_path / "classes.mat"
    for content in ({"mapClass": np.array([[41]])}, {"className": 3.0}, {"mapClass": "a", "className": "b"}):
        savemat(path, content)
        refused(lambda p: read_nyu_labelled(sound, 1, p), path, "has no mapClass")


@ANY_FILE
@given(data=st.data())
def test_mutated_files_are_read_or_refused(tmp_path: Path, sound: Path, data: st.DataObject) -> None:
    damaged = data.draw(mutated(sound.read_bytes()))
    refused_or_read(lambda p: read_nyu_labelled(p, 1), tmp_path / "a.mat", damaged)


def test_the_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"hsbench\[import\]"):
        read_nyu_labelled(tmp_path / "a.mat", 0)


def test_numbers_beyond_what_a_picture_can_hold() -> None:
    from hsbench.datasets.importers import nyu_labelled

    kind, number = np.divmod(np.arange(61_000).reshape(100, 610), 250)
    with pytest.raises(DataError, match="has 61,000 things; expected fewer than 60,000"):
        nyu_labelled._numbered("a.mat: frame 0", (kind + 1).astype(np.uint16), (number + 1).astype(np.uint8))
