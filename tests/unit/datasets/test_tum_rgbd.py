"""The reader of TUM RGB-D folders on made sequences: exact times, the pairing rule, and when a camera stands still."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import tum_rgbd
from hsbench.datasets.importers.room_captures import tum_episode
from hsbench.datasets.importers.tum_rgbd import CAMERAS, associate, camera_name, nearest, read_tum_rgbd
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.geometry.cameras import BrownCamera
from hsbench.geometry.transforms import apply, quaternion_from_matrix
from hsbench.typing import FloatArray
from tests.unit.datasets import room_files as made
from tests.unit.datasets.mutations import attempt, check_message, mutated

ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
START_NS = 1_311_868_164_363_181_000
STEP_NS = 33_333_000
YAW_RAD = 0.7
NAME = "rgbd_dataset_freiburg3_made"
SIZE = (640, 480)


def seconds(ns: int) -> str:
    return f"{ns // 10**9}.{ns % 10**9 // 1000:06d}"


def pose_line(ns: int, position: Iterable[float] = (1.0, 2.0, 1.55), turn_rad: float = 0.0) -> str:
    w, x, y, z = quaternion_from_matrix(made.upright_R_camera(YAW_RAD + turn_rad))
    return f"{seconds(ns)} {' '.join(f'{v:.4f}' for v in position)} {x:.6f} {y:.6f} {z:.6f} {w:.6f}"


def sequence(
    folder: Path,
    frames: int = 40,
    moved: Callable[[int], tuple[float, float]] = lambda i: (0.0, 0.0),
    pictures: bool = True,
) -> Path:
    """A folder whose depth is 7 ms late and whose poses come at 100 Hz. moved: metres and radians at each frame."""
    folder.mkdir(parents=True)
    stamps = [START_NS + i * STEP_NS for i in range(frames)]
    late = [ns + 7_000_000 for ns in stamps]
    header = "# made images\n# timestamp filename\n"
    (folder / "rgb.txt").write_text(header + "".join(f"{seconds(t)} rgb/{seconds(t)}.png\n" for t in stamps))
    (folder / "depth.txt").write_text(header + "".join(f"{seconds(t)} depth/{seconds(t)}.png\n" for t in late))
    poses = []
    for t in range(START_NS - 20_000_000, late[-1] + 20_000_000, 10_000_000):
        metres, radians = moved(round((t - START_NS) / STEP_NS))
        poses.append(pose_line(t, (1.0 + metres, 2.0, 1.55), radians))
    (folder / "groundtruth.txt").write_text("# ground truth\n" + "\n".join(poses) + "\n")
    if pictures:
        camera = CAMERAS["freiburg3"]
        depth = trace(camera.cx_px, camera.cy_px, camera.fx_px)
        for name in {0, frames // 2, frames - 1}:
            made.write_rgb(folder / "rgb" / f"{seconds(stamps[name])}.png", made.rgb(SIZE))
            made.write_grey16(folder / "depth" / f"{seconds(late[name])}.png", depth * 5000)
    return folder


def trace(cx_px: float, cy_px: float, focal: float) -> FloatArray:
    """Depth for a principal point given in our pixels, in which the first has its centre at 0.5."""
    return made.depth_m(focal, (cx_px + 0.5, cy_px + 0.5), SIZE)


def test_times_are_exact_and_the_camera_is_placed(tmp_path: Path) -> None:
    found = read_tum_rgbd(sequence(tmp_path / NAME))
    assert (found.first, found.pairs, found.unposed, len(found.frames)) == (0, 40, 0, 40)
    np.testing.assert_array_equal(found.frames.timestamps_ns, np.arange(40) * STEP_NS)
    episode, notes = tum_episode(found, "a")
    sensor = episode.sensor
    assert sensor.height_m == pytest.approx(made.HEIGHT_M, abs=0.005)
    assert (sensor.tilt_rad, sensor.roll_rad) == pytest.approx((made.TILT_RAD, made.ROLL_RAD), abs=1e-5)
    assert episode.end_ns == 39 * STEP_NS
    assert any("pairs 0 to 39 of 40" in note for note in notes)
    frame = episode.frames[39]
    assert frame.depth_m is not None
    assert frame.rgb is not None
    points = apply(sensor.world_T_camera, sensor.camera.unproject(frame.depth_m))
    left = np.abs(points[..., 1] - made.WALL_Y_M) < 0.02
    assert left.sum() > 1000
    assert frame.rgb[left][:, 0].min() > 200  # the wall on the left is in the red half
    episode, _ = tum_episode(found, "a", 1.1)
    assert episode.sensor.height_m == pytest.approx(1.1)


def test_import_and_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = sequence(tmp_path / NAME, frames=30)
    colour = next(folder.glob("rgb/*"))
    for line in (folder / "rgb.txt").read_text().splitlines()[2:]:
        (folder / line.split()[1]).write_bytes(colour.read_bytes())
    for line in (folder / "depth.txt").read_text().splitlines()[2:]:
        made.write_grey16(folder / line.split()[1], np.full((480, 640), 10_000))
    assert run(["import", "tum-rgbd", str(folder), "--out", str(tmp_path / "out"), "--height", "1.3"]) == 0
    assert "30 frames in 1.0 s" in capsys.readouterr().out
    assert verify_files(tmp_path / "out") == []
    episode = load(tmp_path / "out")[0]
    assert verify_episode(episode) == []
    np.testing.assert_array_equal(episode.frames.timestamps_ns, np.arange(30) * STEP_NS)
    assert episode.frames[7].depth_m is not None
    assert (episode.frames[7].depth_m == 2.0).all()


# pairs


times = st.lists(st.integers(0, 12), min_size=1, max_size=4, unique=True).map(sorted)


@given(a=times, b=times)
def test_pairs_are_those_of_the_greedy_rule(a: list[int], b: list[int]) -> None:
    """Nearest first, each once, at most 20 ms apart: against the rule applied to every pair."""
    step = 4_000_000
    found = associate(np.array(a) * step, np.array(b) * step)
    near = [(abs(x - y), i, j) for i, x in enumerate(a) for j, y in enumerate(b) if abs(x - y) * step <= 20_000_000]
    expected: list[tuple[int, int]] = []
    for _, i, j in sorted(near):
        if all(i != k and j != m for k, m in expected):
            expected.append((i, j))
    assert [tuple(pair) for pair in found.tolist()] == sorted(expected)


def test_a_pair_is_not_taken_from_a_nearer_one() -> None:
    ms = 1_000_000
    found = associate(np.array([0, 10]) * ms, np.array([9, 28]) * ms)
    assert found.tolist() == [[1, 0]]  # 0 and 28 are too far apart, 9 is nearer to 10
    assert associate(np.array([0]), np.array([20 * ms + 1])).tolist() == []


@given(a=times, b=times)
def test_nearest(a: list[int], b: list[int]) -> None:
    step = 4_000_000
    found = nearest(np.array(a) * step, np.array(b) * step)
    for x, index in zip(a, found, strict=True):
        best = min(range(len(b)), key=lambda j: (abs(b[j] - x), j))
        assert index == (best if abs(b[best] - x) * step <= 20_000_000 else -1)


# motion


@pytest.mark.parametrize(
    ("moved", "first", "count"),
    [
        (lambda i: (0.0 if i < 35 else 0.5, 0.0), 0, 35),
        (lambda i: (0.1 * max(0, 10 - i), 0.0), 10, 60),
        (lambda i: (0.0, math.radians(3.0) if i >= 40 else 0.0), 0, 40),
        (lambda i: (0.015 * (i % 2), 0.0), 0, 70),
    ],
)
def test_the_first_stretch_without_motion(
    tmp_path: Path, moved: Callable[[int], tuple[float, float]], first: int, count: int
) -> None:
    found = read_tum_rgbd(sequence(tmp_path / NAME, 70, moved, pictures=False))
    assert (found.first, len(found.frames)) == (first, count)
    assert found.frames.timestamps_ns[0] == 0
    assert found.sway_m < tum_rgbd.STILL_M


def test_moving_cameras_are_refused(tmp_path: Path) -> None:
    folder = sequence(tmp_path / NAME, 70, lambda i: (0.01 * i, 0.0), pictures=False)
    with pytest.raises(DataError, match=r"the camera moves: .* for 3 frames at most; expected 30 or more"):
        read_tum_rgbd(folder)


def test_pairs_without_a_pose_are_left_out(tmp_path: Path) -> None:
    folder = sequence(tmp_path / NAME)
    lines = (folder / "groundtruth.txt").read_text().splitlines()
    (folder / "groundtruth.txt").write_text("\n".join(lines[:20] + lines[40:]))
    found = read_tum_rgbd(folder)
    assert 0 < found.unposed < 8
    assert len(found.frames) == 40 - found.unposed
    assert any("pairs without a pose" in note for note in tum_episode(found, "a")[1])


def test_cameras() -> None:
    assert camera_name(Path("/x/rgbd_dataset_freiburg2_desk")) == "freiburg2"
    with pytest.raises(DataError, match="its name tells no camera"):
        camera_name(Path("/x/office"))
    for name in ("freiburg1", "freiburg2"):
        assert isinstance(CAMERAS[name], BrownCamera)


# damage


def replaced(name: str, old: str, new: str) -> Callable[[Path], None]:
    def damage(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return damage


FIRST = seconds(START_NS)
POSE = pose_line(START_NS - 20_000_000)


@pytest.mark.parametrize(
    ("damage", "match"),
    [
        (lambda f: (f / "groundtruth.txt").unlink(), "groundtruth.txt: cannot be read"),
        (lambda f: (f / "rgb.txt").write_bytes(b""), "rgb.txt: nothing but comments"),
        (lambda f: (f / "rgb.txt").write_text("# only\n"), "rgb.txt: nothing but comments"),
        (lambda f: (f / "depth.txt").write_bytes(b"\xff\xfe"), "depth.txt: is no text at byte 0"),
        (replaced("rgb.txt", FIRST, "nan"), "rgb.txt line 3: time 'nan'; expected seconds"),
        (replaced("rgb.txt", FIRST, "99999999999.0"), "rgb.txt line 3: time"),
        (replaced("rgb.txt", FIRST, "1e9"), "rgb.txt line 3: time"),
        (replaced("rgb.txt", FIRST, "1411868164.0"), "rgb.txt line 4: time does not ascend"),
        (replaced("rgb.txt", f" rgb/{FIRST}", ""), "rgb.txt line 3: 1 words"),
        (replaced("rgb.txt", f" rgb/{FIRST}", " ../secret"), "expected one within the folder"),
        (replaced("rgb.txt", f" rgb/{FIRST}", " /etc/passwd"), "expected one within the folder"),
        (replaced("groundtruth.txt", POSE, f"{POSE} 1"), "groundtruth.txt line 2: 9 words"),
        (
            replaced("groundtruth.txt", POSE, POSE.replace(" 1.5500 ", " NaN ")),
            "line 2 after the time: value 3 is 'NaN'",
        ),
        (replaced("groundtruth.txt", POSE, POSE.replace(" 1.5500 ", " 1550 ")), "line 2: position .*millimetres"),
        (replaced("groundtruth.txt", POSE, " ".join(POSE.split()[:4] + ["0"] * 4)), "line 2: quaternion of length 0"),
    ],
)
def test_damage_is_named_in_one_line(tmp_path: Path, damage: Callable[[Path], None], match: str) -> None:
    folder = sequence(tmp_path / NAME, pictures=False)
    damage(folder)
    with pytest.raises(DataError, match=match) as caught:
        read_tum_rgbd(folder)
    check_message(caught.value, folder)


def test_pictures_of_two_sequences(tmp_path: Path) -> None:
    folder = sequence(tmp_path / NAME, pictures=False)
    text = (folder / "depth.txt").read_text()
    (folder / "depth.txt").write_text(text.replace(FIRST[:7], "1400000"))
    with pytest.raises(DataError, match="no colour and depth picture within 20 ms"):
        read_tum_rgbd(folder)


def test_too_dense_lists_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = sequence(tmp_path / NAME, pictures=False)
    monkeypatch.setattr(tum_rgbd, "MAX_LINES", 100)
    with pytest.raises(DataError, match="lines; expected at most 100"):
        read_tum_rgbd(folder)
    with pytest.raises(DataError, match="pairs of pictures within 20 ms; expected at most 100"):
        associate(np.arange(40), np.arange(40))


def test_pictures_of_another_size_or_missing(tmp_path: Path) -> None:
    found = read_tum_rgbd(sequence(tmp_path / NAME))
    with pytest.raises(DataError, match="cannot be read"):
        found.frames[1]
    made.write_grey16(found.frames.folder / found.frames.depth[0], made.depth_m() * 5000)
    with pytest.raises(DataError, match="96 x 72 px; expected"):
        tum_episode(found, "a")
    made.write_grey16(found.frames.folder / found.frames.depth[0], np.zeros((480, 640)))
    with pytest.raises(DataError, match="no reading at all"):
        tum_episode(found, "a")


@ANY_FILE
@given(data=st.data())
def test_mutated_lists_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = sequence(tmp_path_factory.mktemp("m") / NAME, 34, pictures=False)
    path = folder / data.draw(st.sampled_from(["rgb.txt", "depth.txt", "groundtruth.txt"]))
    path.write_bytes(data.draw(mutated(path.read_bytes())))
    _, refusal = attempt(lambda: read_tum_rgbd(folder))
    if refusal is not None:
        check_message(refusal, folder)
