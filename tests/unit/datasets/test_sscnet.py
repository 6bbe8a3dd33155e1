"""The SSCNet reader against files that an independent encoder writes here, and against every kind of damage."""

from __future__ import annotations

import struct
from collections import Counter
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hsbench.datasets.importers import sscnet
from hsbench.errors import DataError, SchemaError
from hsbench.geometry import transforms
from hsbench.geometry.cameras import world_T_camera
from hsbench.geometry.grids import VoxelGrid
from hsbench.typing import AnyArray, FloatArray, UInt8Array

ORIGIN_M = (-1.5, 0.9, -0.05)
POSE = world_T_camera(1.2, 0.1)
reuses_files = settings(deadline=None, max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])


def encode_runs(labels_xyz: AnyArray) -> list[tuple[int, int]]:
    """Runs of a volume in file order (x slowest, then height, then y)."""
    flat = labels_xyz.transpose(0, 2, 1).ravel()
    starts = np.concatenate([[0], np.flatnonzero(flat[1:] != flat[:-1]) + 1, [len(flat)]])
    return [(int(flat[a]), int(b - a)) for a, b in pairwise(starts)]


def write_bin(
    path: Path,
    runs: list[tuple[int, int]],
    pose: FloatArray = POSE,
    origin: tuple[float, float, float] = ORIGIN_M,
) -> Path:
    header = struct.pack("<19f", *origin, *pose.ravel())
    path.write_bytes(header + b"".join(struct.pack("<II", value, run) for value, run in runs))
    return path


def write_png(path: Path, depth_mm: AnyArray) -> Path:
    """Depth in millimetres, each pixel rotated left by three bits of sixteen."""
    rotated = [[((int(mm) << 3) & 0xFFFF) | (int(mm) >> 13) for mm in row] for row in depth_mm]
    assert cv2.imwrite(str(path), np.array(rotated, dtype=np.uint16))
    return path


def empty_labels() -> UInt8Array:
    return np.zeros((240, 240, 144), dtype=np.uint8)


def one_line(error: pytest.ExceptionInfo[DataError], path: Path) -> str:
    message = str(error.value)
    assert "\n" not in message
    assert str(path) in message
    return message


# depth


@reuses_files
@given(depth_mm=hnp.arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 16000)))
def test_depth_round_trip(tmp_path: Path, depth_mm: AnyArray) -> None:
    depth_m = sscnet.read_depth_png(write_png(tmp_path / "depth.png", depth_mm))
    assert depth_m.dtype == np.float32
    np.testing.assert_allclose(depth_m, depth_mm / 1000.0, rtol=1e-7)
    assert ((depth_m == 0) == (depth_mm == 0)).all()


def test_plain_millimetres_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "plain.png"
    cv2.imwrite(str(path), np.arange(1000, 4000, dtype=np.uint16).reshape(50, 60))
    with pytest.raises(DataError, match="are these plain millimetres") as error:
        sscnet.read_depth_png(path)
    one_line(error, path)


@pytest.mark.parametrize(
    ("pixels", "found"),
    [
        (np.zeros((4, 5), np.uint8), "8-bit grey PNG"),
        (np.zeros((4, 5, 3), np.uint8), "8-bit colour or alpha PNG"),
        (np.zeros((4, 5, 3), np.uint16), "16-bit colour or alpha PNG"),
    ],
)
def test_other_pngs_are_refused(tmp_path: Path, pixels: AnyArray, found: str) -> None:
    path = tmp_path / "other.png"
    cv2.imwrite(str(path), pixels)
    with pytest.raises(DataError, match="expected 16-bit grey") as error:
        sscnet.read_depth_png(path)
    assert found in one_line(error, path)


@pytest.mark.parametrize("kept", [0, 7, 20, 40, 0.5, 0.99, -12])
def test_truncated_png(tmp_path: Path, kept: float) -> None:
    path = write_png(tmp_path / "depth.png", np.random.default_rng(0).integers(500, 8000, (40, 50)))
    data = path.read_bytes()
    path.write_bytes(data[: int(kept * len(data)) if isinstance(kept, float) else kept])
    with pytest.raises(DataError, match="PNG") as error:
        sscnet.read_depth_png(path)
    one_line(error, path)


def test_flipped_byte_in_png(tmp_path: Path) -> None:
    path = write_png(tmp_path / "depth.png", np.random.default_rng(0).integers(500, 8000, (40, 50)))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(DataError, match="damaged PNG"):
        sscnet.read_depth_png(path)


def test_png_that_claims_a_huge_image_is_refused_before_decoding(tmp_path: Path) -> None:
    path = write_png(tmp_path / "depth.png", np.ones((2, 2)))
    data = bytearray(path.read_bytes())
    data[16:24] = struct.pack(">II", 60000, 60000)
    path.write_bytes(data)
    with pytest.raises(DataError, match="60000 x 60000 px; expected at most 4096 px") as error:
        sscnet.read_depth_png(path)
    one_line(error, path)


def test_large_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sscnet, "MAX_PNG_BYTES", 60)
    monkeypatch.setattr(sscnet, "MAX_VOLUME_BYTES", 90)
    with pytest.raises(DataError, match="more than 60 bytes"):
        sscnet.read_depth_png(write_png(tmp_path / "depth.png", np.ones((9, 9))))
    with pytest.raises(DataError, match="more than 90 bytes"):
        sscnet.read_volume(write_bin(tmp_path / "v.bin", [(0, 1), (1, 2)]))


def test_missing_files(tmp_path: Path) -> None:
    for read in (sscnet.read_depth_png, sscnet.read_volume):
        with pytest.raises(DataError, match="cannot be read") as error:
            read(tmp_path / "absent")
        one_line(error, tmp_path / "absent")


# volume


def test_axes_and_voxel_centres(tmp_path: Path) -> None:
    labels = empty_labels()
    labels[3, 100, 40] = 7
    volume = sscnet.read_volume(write_bin(tmp_path / "v.bin", encode_runs(labels)))
    assert volume.labels.shape == (240, 240, 144)
    assert np.argwhere(volume.labels).tolist() == [[3, 100, 40]]
    assert volume.labels[3, 100, 40] == 7
    # The stored origin is the centre of voxel 0, the dataclass holds the minimum corner.
    centre = volume.grid.centres()[3, 100, 40]
    np.testing.assert_allclose(centre, np.array(ORIGIN_M) + 0.02 * np.array([3, 100, 40]), atol=1e-6)
    np.testing.assert_allclose(volume.origin_m, np.array(ORIGIN_M) - 0.01, atol=1e-6)


boxes = st.tuples(
    st.tuples(st.integers(0, 239), st.integers(0, 239), st.integers(0, 143)),
    st.tuples(st.integers(1, 240), st.integers(1, 240), st.integers(1, 144)),
    st.sampled_from([0, 1, 2, 18, 36, 255]),
)


@reuses_files
@given(painted=st.lists(boxes, min_size=1, max_size=4), yaw=st.floats(-3, 3), tilt=st.floats(-1, 1))
def test_volume_round_trip(tmp_path: Path, painted: list[AnyArray], yaw: float, tilt: float) -> None:
    labels = empty_labels()
    labels[0, 0, 0] = 5  # never uniform: that case has a test of its own
    for (x, y, z), (length, w, h), label in painted:
        labels[x : x + length, y : y + w, max(z, 1) : z + h] = label
    pose = transforms.planar(0.5, -2.0, yaw) @ world_T_camera(1.4, tilt)
    volume = sscnet.read_volume(write_bin(tmp_path / "v.bin", encode_runs(labels), pose))
    assert np.array_equal(volume.labels, labels)
    np.testing.assert_allclose(volume.world_T_camera, pose, atol=1e-6)
    assert transforms.is_rigid(volume.world_T_camera, 1e-12)


@pytest.mark.parametrize("label", [0, 255])
def test_uniform_volume_is_written_one_voxel_short_by_the_source(tmp_path: Path, label: int) -> None:
    for run in (8_294_399, 8_294_400):
        volume = sscnet.read_volume(write_bin(tmp_path / "v.bin", [(label, run)]))
        assert (volume.labels == label).all()


@pytest.mark.parametrize(
    ("runs", "message"),
    [
        ([(0, 8_294_400 - 2), (1, 1)], "runs sum to 8,294,399; expected 8,294,400"),
        ([(0, 8_294_400), (1, 1)], "runs sum to 8,294,401; expected 8,294,400"),
        ([(0, 60 * 36 * 60)], "runs sum to 129,600; .*another resolution"),
        ([(0, 2**32 - 1)] * 3, "runs sum to 12,884,901,885"),
        ([(0, 8_294_398), (37, 2)], "run 1 has label 37; expected 0-36 or 255"),
        ([(256, 8_294_400)], "run 0 has label 256"),
        ([(0, 8_294_400), (3, 0)], "run 1 has length 0"),
        ([], "76 bytes; expected 76 \\+ 8 per run"),
    ],
)
def test_bad_runs(tmp_path: Path, runs: list[tuple[int, int]], message: str) -> None:
    path = write_bin(tmp_path / "v.bin", runs)
    with pytest.raises(DataError, match=message) as error:
        sscnet.read_volume(path)
    one_line(error, path)


@pytest.mark.parametrize("kept", [0, 11, 75, 80, 92])
def test_truncated_volume(tmp_path: Path, kept: int) -> None:
    path = write_bin(tmp_path / "v.bin", [(0, 8_000_000), (1, 200_000), (2, 94_400)])
    assert (sscnet.read_volume(path).labels == 2).sum() == 94_400
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(DataError, match="incomplete copy") as error:
        sscnet.read_volume(path)
    one_line(error, path)


@pytest.mark.parametrize(
    ("pose", "hint"),
    [
        (POSE.T, "stored column major"),
        (POSE * 2.0, "is not rigid"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "is not rigid"),
        (np.full((4, 4), np.nan), "is not rigid"),
        (np.zeros((4, 4)), "is not rigid"),
    ],
)
def test_poses_that_are_not_rigid(tmp_path: Path, pose: FloatArray, hint: str) -> None:
    path = write_bin(tmp_path / "v.bin", [(0, 8_294_400)], pose)
    with pytest.raises(DataError, match=hint) as error:
        sscnet.read_volume(path)
    one_line(error, path)


def test_origin_that_is_not_finite(tmp_path: Path) -> None:
    path = write_bin(tmp_path / "v.bin", [(0, 8_294_400)], origin=(0.0, float("inf"), 0.0))
    with pytest.raises(DataError, match="expected three finite metres"):
        sscnet.read_volume(path)


# frame


def test_read_frame(tmp_path: Path) -> None:
    png = write_png(tmp_path / "a.png", np.full((480, 640), 2000))
    volume = write_bin(tmp_path / "a.bin", [(0, 8_294_399), (3, 1)])
    frame = sscnet.read_frame(png, volume)
    assert frame.depth_m.shape == (480, 640)
    assert frame.volume.labels[-1, -1, -1] == 3
    np.testing.assert_allclose(frame.camera.unproject(frame.depth_m)[240, 320, :2], 2.0 * 0.5 / 518.8579)
    with pytest.raises(DataError, match="is this the volume"):
        sscnet.read_frame(volume, png)
    with pytest.raises(DataError, match="wrong order"):
        sscnet.read_volume(png)


def test_read_frame_of_another_size(tmp_path: Path) -> None:
    png = write_png(tmp_path / "a.png", np.full((6, 5), 2000))
    with pytest.raises(DataError, match="5 x 6 px; expected 640 x 480") as error:
        sscnet.read_frame(png, tmp_path / "a.bin")
    one_line(error, png)


def frame_with(pose: FloatArray) -> sscnet.SscnetFrame:
    labels = np.full((240, 240, 144), sscnet.UNKNOWN, dtype=np.uint8)
    volume = sscnet.SscnetVolume((-2.4, -2.4, -0.06), sscnet.VOXEL_M, pose, labels)
    return sscnet.SscnetFrame(sscnet.CAMERA, np.zeros((480, 640), np.float32), volume)


@given(yaw=st.floats(-3.1, 3.1), tilt=st.floats(-1.2, 1.2), roll=st.floats(-0.3, 0.3), x=st.floats(-9, 9))
def test_episode_frame(yaw: float, tilt: float, roll: float, x: float) -> None:
    expected = world_T_camera(1.3, tilt) @ transforms.rigid(transforms.rotation_z(roll), (0, 0, 0))
    ssc_T_episode = transforms.planar(x, 2.5, yaw)
    episode_T_camera, episode_T_ssc = sscnet.to_episode_frame(frame_with(ssc_T_episode @ expected))
    np.testing.assert_allclose(episode_T_camera, expected, atol=1e-9)
    np.testing.assert_allclose(episode_T_ssc @ ssc_T_episode, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(episode_T_camera[:2, 3], 0.0, atol=1e-9)


def test_a_camera_that_looks_down_has_no_heading() -> None:
    with pytest.raises(DataError, match="expected a heading"):
        sscnet.to_episode_frame(frame_with(world_T_camera(2.0, np.pi / 2)))


def test_resampling() -> None:
    # The camera stands at (1, 0.5) and looks along +y, so episode x is the file's y and episode y its -x.
    frame = frame_with(transforms.planar(1.0, 0.5, np.pi / 2) @ world_T_camera(1.2, 0.2))
    # A box of 0.2 m: file x 0.8-1.0, y 1.5-1.7, z 0.1-0.3.
    grid = frame.volume.grid
    low, high = (np.round((np.array(p) - grid.origin_m) / 0.02).astype(int) for p in ([0.8, 1.5, 0.1], [1, 1.7, 0.3]))
    frame.volume.labels[:, :, :] = 0
    frame.volume.labels[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = 9
    _, episode_T_ssc = sscnet.to_episode_frame(frame)
    target = VoxelGrid((-1.0, -3.2, 0.0), (88, 128, 48), 0.05)
    labels = sscnet.resample_labels(frame.volume, episode_T_ssc, target)
    where = np.argwhere(labels == 9)
    np.testing.assert_allclose(np.array(target.origin_m) + where.min(0) * 0.05, [1.0, 0.0, 0.1], atol=1e-9)
    np.testing.assert_allclose(np.array(target.origin_m) + (where.max(0) + 1) * 0.05, [1.2, 0.2, 0.3], atol=1e-9)
    assert len(where) == 4 * 4 * 4
    # File x from -2.4 to 2.4 is episode y from -1.4 to 3.4; what lies outside the file's volume is unknown.
    y = target.axis_centres(1)
    assert (labels[30, y < -1.4, 10] == sscnet.UNKNOWN).all()
    assert (labels[30, y > -1.4, 10] == sscnet.EMPTY).all()


def test_resampling_onto_its_own_grid_changes_nothing() -> None:
    labels = np.random.default_rng(1).integers(0, 37, (24, 20, 16)).astype(np.uint8)
    volume = sscnet.SscnetVolume((0.1, -0.3, -0.06), 0.02, POSE, labels)
    assert np.array_equal(sscnet.resample_labels(volume, np.eye(4), volume.grid), labels)


# down-sampling and classes


def downsample_block_by_block(labels: AnyArray, factor: int) -> AnyArray:
    """The rule of ``downSample.m``, one block at a time."""
    result = np.zeros([side // factor for side in labels.shape], dtype=np.uint8)
    for index in np.ndindex(*result.shape):
        block = labels[tuple(slice(i * factor, (i + 1) * factor) for i in index)].ravel().tolist()
        vacant = [v for v in block if v in (0, 255)]
        voters = block if len(vacant) > 0.95 * factor**3 else [v for v in block if v not in (0, 255)]
        counts = Counter(voters)
        result[index] = min(v for v in counts if counts[v] == max(counts.values()))
    return result


@settings(deadline=None)
@given(data=st.data(), factor=st.sampled_from([1, 2, 4]))
def test_downsampling_against_the_rule_block_by_block(data: st.DataObject, factor: int) -> None:
    seed = data.draw(st.integers(0, 2**32 - 1))
    vacant = data.draw(st.sampled_from([0.0, 0.5, 0.9, 0.95, 0.99]))
    rng = np.random.default_rng(seed)
    labels = rng.choice([1, 2, 36], size=(8, 12, 4))
    empties = rng.random(labels.shape) < vacant
    labels[empties] = rng.choice([0, 255], size=int(empties.sum()))
    labels = labels.astype(np.uint8)
    expected = downsample_block_by_block(labels, factor)
    assert np.array_equal(sscnet.downsample_labels(labels, factor), expected)


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ({0: 64}, 0),
        ({255: 64}, 255),
        ({0: 32, 255: 32}, 0),
        ({0: 31, 255: 33}, 255),
        ({0: 61, 4: 3}, 0),
        ({0: 60, 4: 4}, 4),
        ({0: 30, 255: 31, 4: 3}, 255),
        ({0: 20, 255: 40, 4: 4}, 4),
        ({0: 50, 9: 7, 4: 7}, 4),
        ({255: 50, 9: 8, 4: 6}, 9),
    ],
)
def test_downsampling_of_one_block(counts: dict[int, int], expected: int) -> None:
    block = np.repeat(list(counts), list(counts.values())).astype(np.uint8)
    shuffled = np.random.default_rng(0).permutation(block).reshape(4, 4, 4)
    assert sscnet.downsample_labels(shuffled).tolist() == [[[expected]]]


def test_downsampling_needs_a_multiple() -> None:
    with pytest.raises(SchemaError, match="three multiples of the factor 4"):
        sscnet.downsample_labels(np.zeros((8, 8, 6), np.uint8))


def test_eleven_classes() -> None:
    assert len(sscnet.CLASSES_36) == len(sscnet.ELEVEN_OF_36) == 37
    for name in ("empty", "ceiling", "floor", "wall", "window", "chair", "bed", "sofa", "table", "tvs"):
        mapped = sscnet.eleven_classes(np.array([sscnet.CLASSES_36.index(name)]))
        assert sscnet.CLASSES_11[int(mapped[0])] == name
    assert sscnet.eleven_classes(np.array([[17, 255, 36, 26]], np.uint8)).tolist() == [[8, 255, 11, 11]]
    with pytest.raises(SchemaError, match="reach 37"):
        sscnet.eleven_classes(np.array([0, 37, 255], np.uint8))
