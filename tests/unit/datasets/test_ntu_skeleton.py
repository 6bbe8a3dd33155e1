"""The reader of NTU RGB+D skeletons against recordings of known people that an independent encoder writes here."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import kinect_bodies, ntu_skeleton
from hsbench.datasets.importers.captures import KINECT_V2_DEPTH
from hsbench.datasets.importers.ntu_skeleton import read_ntu_skeleton
from hsbench.datasets.importers.pose_captures import ntu_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.poses import JointState
from hsbench.typing import AnyArray, FloatArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.test_kinect_csv import as_sdk, in_episode

Bodies = list[tuple[int, FloatArray, AnyArray]]  # identity, (25, 3) SDK camera space, (25,) state
FOCAL_PX, CX_PX, CY_PX = 366.0, 256.5, 208.25
ANY_FILE = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


def sdk_pixels(joints: FloatArray) -> FloatArray:
    """(25, 2) where the SDK's mirrored depth picture shows joints, from its definition."""
    x, y, z = joints.T
    with np.errstate(all="ignore"):
        return np.stack([CX_PX + FOCAL_PX * x / z, CY_PX - FOCAL_PX * y / z], axis=-1)


def body_text(identity: int, joints: FloatArray, state: AnyArray) -> list[str]:
    pixels = sdk_pixels(joints)
    lines = [f"{identity} 0 1 1 1 1 0 -0.1 0.14 2", "25"]
    for xyz, uv, s in zip(joints.tolist(), pixels.tolist(), state, strict=True):
        values = [*xyz, *uv, 960 + 3 * (uv[0] - 256), 540 + 3 * (uv[1] - 212), 0, 0, 0, 1]
        lines.append(" ".join([*map(repr, values), str(int(s))]))
    return lines


def ntu_lines(frames: list[Bodies]) -> list[str]:
    lines = [str(len(frames))]
    for bodies in frames:
        lines.append(str(len(bodies)))
        for body in bodies:
            lines += body_text(*body)
    return lines


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def person(
    distance_m: float = 2.7, facing_rad: float = np.pi, height_m: float = 1.1, tilt_rad: float = 0.1
) -> FloatArray:
    return as_sdk(in_episode(distance_m, facing_rad), height_m, tilt_rad)


TRACKED = np.full(25, 2)
A, B = 72057594037931648, 2**64 - 1


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    """Twelve frames: nobody, then A, then A and B in either order."""
    one: Bodies = [(A, person(), TRACKED)]
    two: Bodies = [(B, person(3.2), TRACKED), (A, person(), TRACKED)]
    return write(tmp_path / "S001.skeleton", ntu_lines([[], *[one] * 5, *[two] * 3, *[two[::-1]] * 3]))


@ANY_FILE
@given(data=st.data(), counts=st.lists(st.integers(0, 2), min_size=1, max_size=4).filter(any))
def test_round_trip(tmp_path: Path, data: st.DataObject, counts: list[int]) -> None:
    frames: list[Bodies] = []
    for count in counts:
        identities = data.draw(st.permutations([A, B]))[:count]
        draws = [
            (
                data.draw(hnp.arrays(np.float64, (25, 3), elements=st.floats(-10, 10))),
                data.draw(hnp.arrays(np.uint8, 25, elements=st.integers(0, 2))),
            )
            for _ in range(count)
        ]
        frames.append([(identity, *drawn) for identity, drawn in zip(identities, draws, strict=True)])
    bodies = read_ntu_skeleton(write(tmp_path / "a.skeleton", ntu_lines(frames))).bodies
    order = list(dict.fromkeys(identity for frame in frames for identity, _, _ in frame))
    expected = sorted(
        (round(i * 1e9 / 30), order.index(identity) + 1, k, i)
        for i, frame in enumerate(frames)
        for k, (identity, _, _) in enumerate(frame)
    )
    assert bodies.timestamp_ns.tolist() == [row[0] for row in expected]
    assert bodies.track_id.tolist() == [row[1] for row in expected]
    assert bodies.end_ns == round((len(frames) - 1) * 1e9 / 30)
    for row, (_, _, k, i) in enumerate(expected):
        _, joints, state = frames[i][k]
        assert np.array_equal(bodies.state[row], state)
        assert np.array_equal(
            bodies.joints_kinect_m[row], np.where(state[:, None] == 0, np.nan, joints), equal_nan=True
        )


def test_tracks_are_people_whatever_their_order_in_the_file(sound: Path) -> None:
    bodies = read_ntu_skeleton(sound).bodies
    assert bodies.track_id.tolist() == [1] * 5 + [1, 2] * 6
    assert bodies.timestamp_ns[0] == 33_333_333  # the first frame has nobody
    nearest = bodies.joints_kinect_m[bodies.track_id == 1, :, 2]
    assert (nearest < bodies.joints_kinect_m[bodies.track_id == 2, :, 2].min()).all()


def test_pixels_that_are_no_number_are_unknown(tmp_path: Path, sound: Path) -> None:
    lines = sound.read_text().splitlines()
    fields = lines[5].split()
    fields[3:7] = ["nan", "-inf", "1e30", "NaN"]
    lines[5] = " ".join(fields)
    found = read_ntu_skeleton(write(tmp_path / "b.skeleton", lines))
    assert np.isnan(found.depth_px[0, 0]).all()
    assert np.isnan(found.colour_px[0, 0]).all()
    assert np.isfinite(found.depth_px[0, 1:]).all()


def test_the_camera_is_found_from_the_pixels_and_projects_onto_them_unmirrored(sound: Path) -> None:
    found = read_ntu_skeleton(sound)
    camera = ntu_skeleton.depth_camera(found)
    assert camera is not None
    values = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px]
    np.testing.assert_allclose(values, [FOCAL_PX, FOCAL_PX, 512 - CX_PX - 0.5, CY_PX + 0.5], atol=1e-9)
    episode = ntu_episode(found, "a", 1.1, 0.1)
    points = apply(invert(episode.sensor.world_T_camera), episode.poses.joints_m.astype(np.float64))
    pixels, _ = episode.sensor.camera.project(points)
    flipped = np.stack([512 - 0.5 - found.depth_px[..., 0], found.depth_px[..., 1] + 0.5], axis=-1)
    np.testing.assert_allclose(pixels, flipped, atol=1e-3)
    # facing the sensor, the left shoulder is on the right of a picture that is not mirrored
    assert (pixels[:, 4, 0] > pixels[:, 8, 0]).all()


def test_few_pixels_leave_the_typical_camera_and_wrong_ones_are_refused(tmp_path: Path, sound: Path) -> None:
    found = read_ntu_skeleton(sound)
    bare = ntu_skeleton.NtuRecording(found.bodies, np.full_like(found.depth_px, np.nan), found.colour_px)
    assert ntu_skeleton.depth_camera(bare) is None
    assert ntu_episode(bare, "a", 1.1, 0.1).sensor.camera == KINECT_V2_DEPTH
    swapped = ntu_skeleton.NtuRecording(found.bodies, found.depth_px[..., ::-1], found.colour_px)
    with pytest.raises(DataError, match="joints and depth pixels do not fit"):
        ntu_skeleton.depth_camera(swapped)


def test_height_and_tilt_are_estimated_over_all_bodies(tmp_path: Path) -> None:
    frames: list[Bodies] = [[(A, person(2.5), TRACKED), (B, person(3.5), TRACKED)] for _ in range(5)]
    found = read_ntu_skeleton(write(tmp_path / "a.skeleton", ntu_lines(frames)))
    np.testing.assert_allclose(kinect_bodies.estimate_camera(found.bodies), (1.1, 0.1), atol=1e-9)
    episode = ntu_episode(found, "a", 1.1, 0.1)
    standing = np.stack([in_episode(2.5), in_episode(3.5)])
    np.testing.assert_allclose(
        episode.poses.joints_m.reshape(5, 2, 25, 3), np.broadcast_to(standing, (5, 2, 25, 3)), atol=1e-5
    )


def test_command(tmp_path: Path, sound: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    assert run(["import", "ntu-skeleton", str(sound), "--out", str(out)]) == 0
    assert "17 poses of 2 tracks in 0.4 s, camera 1.10 m high, looking 5.7 deg down" in capsys.readouterr().out
    episode = load(out, truth=True)[0]
    assert (episode.dataset, episode.episode_id, episode.end_ns) == ("ntu-skeleton", "S001", 366_666_667)
    assert (episode.poses.joint_state == JointState.TRACKED).all()
    assert verify_files(out) == []
    assert verify_episode(episode) == []
    assert run(["import", "ntu-skeleton", str(sound), "--out", str(out), "--height", "1"]) == 2


# damage: the first body of the sound file has its header on line 4, its joints on lines 6 to 30


def edited(lines: list[str], edit: str) -> list[str]:
    if "=" in edit:  # line:field=value
        place, value = edit.split("=")
        line, _, column = place.partition(":")
        fields = lines[int(line) - 1].split()
        fields[int(column)] = value
        return [*lines[: int(line) - 1], " ".join(fields), *lines[int(line) :]]
    if edit == "truncated":
        return lines[:20]
    if edit == "half a line":
        return [*lines[:20], lines[20][:40]]
    if edit == "twice":
        return lines + lines
    if edit == "zero bodies":
        return ["3", "0", "0", "0"]
    if edit == "no frames":
        return ["0"]
    if edit == "short body":
        return lines[:29] + lines[30:]
    raise AssertionError(edit)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("truncated", "ends after line 20; expected a joint .an incomplete copy"),
        ("half a line", r"line 21: \d values; expected 12 of a joint"),
        ("twice", r"line \d+: more lines after the last of 12 frames"),
        ("zero bodies", "3 frames without any body; expected somebody"),
        ("no frames", "0 frames without any body"),
        ("short body", r"line 30: 1 values; expected 12 of a joint"),
        ("1:0=99999999999999", "line 1: '99999999999999' frames; expected a whole number of 0 to 10,000"),
        ("1:0=-3", "line 1: '-3' frames"),
        ("1:0=9999", r"ends after line \d+; expected the number of bodies"),
        ("2:0=4294967295", "line 2: '4294967295' bodies; expected a whole number of 0 to 6"),
        ("2:0=nan", "line 2: 'nan' bodies"),
        ("4:0=-1", "line 4: identity is '-1'"),
        ("4:0=18446744073709551616", "line 4: identity is '18446744073709551616'"),
        ("4:7=x", "line 4: .*expected numbers only"),
        ("5:0=24", "line 5: 24 joints; expected 25 .another sensor"),
        ("5:0=32000", "line 5: 32000 joints; expected 25"),
        ("5:0=99999999", "line 5: '99999999' joints"),
        ("6:0=nan", r"lines 6-30: joint 0 lies at \[nan, .*expected metres"),
        ("7:2=2700", r"lines 6-30: joint 1 lies at .*2700.*millimetres"),
        ("8:11=3", "lines 6-30: joint 2 has state 3; expected 0, 1 or 2"),
        ("8:11=nan", "lines 6-30: joint 2 has state nan"),
        ("9:3=abc", "line 9: .*expected numbers only"),
    ],
)
def test_damage_is_named(sound: Path, tmp_path: Path, edit: str, message: str) -> None:
    refused(
        read_ntu_skeleton, write(tmp_path / "damaged.skeleton", edited(sound.read_text().splitlines(), edit)), message
    )


def test_an_identity_occurs_once_in_a_frame(tmp_path: Path) -> None:
    frames: list[Bodies] = [[(A, person(), TRACKED), (A, person(3.0), TRACKED)]]
    refused(read_ntu_skeleton, write(tmp_path / "a.skeleton", ntu_lines(frames)), "an identity occurs twice in frame 0")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty; expected the number of frames"),
        (b" \n\n", "is empty"),
        ("1\n0\n".encode("utf-16-be"), "line 1: "),
        ("1\n0\n".encode("utf-16"), "byte 0 is not ASCII"),
        (b"\x89PNG\r\n", "byte 0 is not ASCII"),
    ],
)
def test_not_such_a_text(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.skeleton"
    path.write_bytes(content)
    refused(read_ntu_skeleton, path, message)


def test_missing_file(tmp_path: Path) -> None:
    refused(read_ntu_skeleton, tmp_path / "absent.skeleton", "cannot be read")


def test_what_a_file_claims_is_not_allocated(tmp_path: Path, sound: Path) -> None:
    lines = ["10000", "6", *sound.read_text().splitlines()[3:40]]
    path = write(tmp_path / "claims.skeleton", lines)
    tracemalloc.start()
    refused(read_ntu_skeleton, path, "line ")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < ntu_skeleton.MAX_BYTES + 2_000_000  # the buffer of a bounded read, and this file


def test_limits(tmp_path: Path, sound: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ntu_skeleton, "MAX_LINES", 100)
    refused(read_ntu_skeleton, sound, "lines; expected at most 100")
    monkeypatch.setattr(ntu_skeleton, "MAX_BYTES", 1000)
    refused(read_ntu_skeleton, sound, "more than 1,000 bytes")


@ANY_FILE
@given(data=st.data())
def test_mutations_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    text = "\n".join(ntu_lines([[], [(A, person(), TRACKED)], [(B, person(), TRACKED), (A, person(), TRACKED)]])) + "\n"

    refused_or_read(
        read_ntu_skeleton,
        tmp_path / "mutated.skeleton",
        data.draw(mutated(text.encode())),
        lambda found: ntu_episode(found, "a", 1.1, 0.1),
    )
