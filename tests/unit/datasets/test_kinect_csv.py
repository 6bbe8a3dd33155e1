"""The Kinect CSV reader against recordings of a known person that an independent encoder writes here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hsbench.datasets.importers import kinect_csv
from hsbench.errors import DataError
from hsbench.typing import AnyArray, FloatArray

FRAME_TICKS = 330_000
# Joint index: metres to the person's own left, forward, up; feet on the floor.
PERSON = {
    **{0: (0, 0, 0.95), 1: (0, 0, 1.2), 2: (0, 0, 1.5), 3: (0, 0, 1.65), 20: (0, 0, 1.42)},
    **{4: (0.2, 0, 1.4), 5: (0.22, 0, 1.12), 6: (0.22, 0.05, 0.9), 7: (0.22, 0.06, 0.82)},
    **{8: (-0.2, 0, 1.4), 9: (-0.22, 0, 1.12), 10: (-0.22, 0.05, 0.9), 11: (-0.22, 0.06, 0.82)},
    **{12: (0.1, 0, 0.92), 13: (0.1, 0, 0.5), 14: (0.1, 0, 0.08), 15: (0.1, 0.13, 0.0)},
    **{16: (-0.1, 0, 0.92), 17: (-0.1, 0, 0.5), 18: (-0.1, 0, 0.08), 19: (-0.1, 0.13, 0.0)},
    **{21: (0.22, 0.06, 0.75), 22: (0.18, 0.08, 0.8), 23: (-0.22, 0.06, 0.75), 24: (-0.18, 0.08, 0.8)},
}
BODY = np.array([PERSON[joint] for joint in range(25)], dtype=np.float64)


def in_episode(distance_m: float, facing_rad: float = np.pi) -> FloatArray:
    """(25, 3) the person in the episode frame, ``distance_m`` ahead; facing pi looks at the sensor."""
    c, s = np.cos(facing_rad), np.sin(facing_rad)
    left, forward, up = BODY.T
    return np.stack([distance_m + forward * c - left * s, forward * s + left * c, up], axis=-1)


def as_sdk(episode: FloatArray, height_m: float, tilt_rad: float) -> FloatArray:
    """(..., 3) episode frame -> SDK camera space, from its definition: x to the sensor's left, y up, z ahead."""
    x, y, z = np.moveaxis(episode, -1, 0)
    c, s, z = np.cos(tilt_rad), np.sin(tilt_rad), z - height_m
    return np.stack([y, x * s + z * c, x * c - z * s], axis=-1)


def line(ticks: int, joints: AnyArray, state: AnyArray | int = 2, end: str = ",\r\n") -> str:
    states = np.broadcast_to(state, 25)
    fields = [f"{x!r},{y!r},{z!r},{s}" for (x, y, z), s in zip(joints.tolist(), states, strict=True)]
    return ",".join([str(ticks), *fields]) + end


def standing(frames: int, height_m: float = 1.1, tilt_rad: float = 0.1) -> list[str]:
    joints = as_sdk(in_episode(2.7), height_m, tilt_rad)
    return [line(1000 + i * FRAME_TICKS, joints) for i in range(frames)]


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("".join(lines), encoding="ascii", newline="")
    return path


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.data(),
    frames=st.integers(1, 5),
    start=st.integers(0, 2**50),
    end=st.sampled_from([",\r\n", ",\n", "\n"]),
)
def test_round_trip(tmp_path: Path, data: st.DataObject, frames: int, start: int, end: str) -> None:
    joints = data.draw(hnp.arrays(np.float64, (frames, 25, 3), elements=st.floats(-10, 10)))
    state = data.draw(hnp.arrays(np.uint8, (frames, 25), elements=st.integers(0, 2)))
    steps = data.draw(st.lists(st.integers(200_000, 10**9), min_size=frames, max_size=frames))
    ticks = [start + sum(steps[:i]) for i in range(frames)]
    lines = [line(ticks[i], joints[i], state[i], end) for i in range(frames)]
    recording = kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines))
    assert recording.timestamp_ns.dtype == np.int64
    assert recording.timestamp_ns.tolist() == [100 * t for t in ticks]
    assert np.array_equal(recording.state, state)
    assert recording.state.dtype == np.uint8
    expected = np.where(state[..., None] == 0, np.nan, joints)
    assert np.array_equal(recording.joints_kinect_m, expected, equal_nan=True)


def test_a_file_may_end_without_a_line_break(tmp_path: Path) -> None:
    lines = standing(2)
    lines[-1] = lines[-1].rstrip("\r\n")
    assert len(kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines)).timestamp_ns) == 2


def test_positions_of_missing_joints_are_not_checked(tmp_path: Path) -> None:
    state = np.full(25, 2)
    state[7] = 0
    joints = as_sdk(in_episode(2.0), 1.0, 0.0)
    joints[7] = [np.inf, 1e9, np.nan]
    recording = kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", [line(5, joints, state)]))
    assert np.isnan(recording.joints_kinect_m[0, 7]).all()
    assert np.isfinite(np.delete(recording.joints_kinect_m[0], 7, axis=0)).all()


# frames


def test_the_kinect_frame_is_turned_and_never_mirrored() -> None:
    right_handed = np.cross(*kinect_csv.to_camera_frame(np.array([[1.0, 0, 0], [0, 1.0, 0]])))
    np.testing.assert_array_equal(right_handed, kinect_csv.to_camera_frame(np.array([0, 0, 1.0])))
    # The sensor's left, up and ahead, in x right, y down, z forward.
    np.testing.assert_array_equal(kinect_csv.to_camera_frame(np.eye(3)), np.diag([-1.0, -1.0, 1.0]))


@pytest.mark.parametrize("facing_rad", [np.pi, 0.0, np.pi / 2, 2.5, -1.0])
def test_left_stays_left(facing_rad: float) -> None:
    kinect = as_sdk(in_episode(2.7, facing_rad), 1.1, 0.2)
    if facing_rad == np.pi:
        # Facing the sensor, the left shoulder has the smaller SDK x and is on the right of a picture.
        assert kinect[4, 0] < kinect[8, 0]
        assert kinect_csv.to_camera_frame(kinect)[4, 0] > kinect_csv.to_camera_frame(kinect)[8, 0]
    episode = kinect_csv.to_episode_frame(kinect, 1.1, 0.2)
    toes = episode[15] - episode[14]
    leftward = np.cross([0, 0, 1.0], toes)
    assert leftward @ (episode[4] - episode[8]) > 0.0


@given(distance=st.floats(1, 4), facing=st.floats(-3, 3), height=st.floats(0.3, 2.5), tilt=st.floats(-0.6, 0.6))
def test_episode_frame_undoes_the_sensor(distance: float, facing: float, height: float, tilt: float) -> None:
    episode = in_episode(distance, facing)
    found = kinect_csv.to_episode_frame(as_sdk(episode, height, tilt), height, tilt)
    np.testing.assert_allclose(found, episode, atol=1e-9)


# estimate


@settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(height=st.floats(0.5, 1.8), tilt=st.floats(-0.35, 0.35))
def test_camera_from_a_standing_person(tmp_path: Path, height: float, tilt: float) -> None:
    path = write(tmp_path / "joints.csv", standing(10, height, tilt))
    found = kinect_csv.estimate_camera(kinect_csv.read_kinect_csv(path))
    np.testing.assert_allclose(found, (height, tilt), atol=1e-9)


def test_estimate_survives_other_postures_and_lifted_feet(tmp_path: Path) -> None:
    lines = standing(20)
    sitting = in_episode(2.7)
    sitting[[13, 17], 0] -= 0.4
    sitting[2, 0] -= 0.6
    lifted = in_episode(2.7)
    lifted[19, 2] += 0.3
    for k, episode in enumerate([sitting] * 30 + [lifted] * 10):
        lines.append(line(10**8 + k * FRAME_TICKS, as_sdk(episode, 1.1, 0.1)))
    found = kinect_csv.estimate_camera(kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines)))
    np.testing.assert_allclose(found, (1.1, 0.1), atol=1e-9)


@pytest.mark.parametrize("joint", [2, 12, 17, 14, 19])
@pytest.mark.parametrize("state", [0, 1])
def test_no_estimate_from_joints_that_were_not_tracked(tmp_path: Path, joint: int, state: int) -> None:
    states = np.full(25, 2)
    states[joint] = state
    joints = as_sdk(in_episode(2.7), 1.1, 0.0)
    lines = [line(i * FRAME_TICKS, joints, states) for i in range(20)]
    recording = kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines))
    with pytest.raises(DataError, match=r"0 frames of a standing person.*expected at least 10") as error:
        kinect_csv.estimate_camera(recording)
    assert "\n" not in str(error.value)


def test_no_estimate_from_collapsed_joints(tmp_path: Path) -> None:
    lines = [line(i * FRAME_TICKS, np.zeros((25, 3))) for i in range(20)]
    recording = kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines))
    with pytest.raises(DataError, match="give the sensor's height and tilt"):
        kinect_csv.estimate_camera(recording)


# damage


def damaged(edit: str) -> list[str]:
    lines = standing(4)
    fields = lines[2].strip().removesuffix(",").split(",")
    if edit == "short":
        lines[2] = ",".join(fields[:50]) + "\n"
    elif edit == "long":
        lines[2] = ",".join(["1"] * 5000) + "\n"
    elif edit == "decimal commas":
        lines[2] = lines[2].replace(".", ",")
    elif edit == "header":
        lines.insert(0, ",".join(["t", *("x,y,z,s",) * 25]) + "\n")
    elif edit == "blank":
        lines.insert(2, "\n")
    elif edit == "time backwards":
        lines[2], lines[3] = lines[3], lines[2]
    elif edit == "time repeats":
        lines[2] = lines[1]
    elif edit == "time negative":
        lines[0] = "-5" + lines[0][4:]
    elif edit == "time huge":
        lines[3] = "9" * 18 + lines[3][lines[3].index(",") :]
    elif edit == "time digits":
        lines[3] = "9" * 9999 + lines[3][lines[3].index(",") :]
    elif edit == "milliseconds":
        lines = [str(100 + 33 * i) + text[text.index(",") :] for i, text in enumerate(lines)]
    elif edit == "microseconds":
        lines = [str(100 + 33_333 * i) + text[text.index(",") :] for i, text in enumerate(lines)]
    elif edit == "millimetres":
        lines[2] = line(10**8, 1000 * as_sdk(in_episode(2.0), 1.0, 0.0))
    else:
        column, value = edit.split("=")
        fields[int(column)] = value
        lines[2] = ",".join(fields) + "\n"
    return lines


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("short", r"line 3: 50 fields; expected 101: time and 25 x \(x, y, z, state\).*incomplete copy"),
        ("long", "line 3: more than 101 fields; expected 101"),
        ("decimal commas", "line 3: more than 101 fields"),
        ("header", "line 1: .*a header line"),
        ("blank", "line 3: 1 fields"),
        ("time backwards", "line 4: time goes from 991000 to 661000; expected increasing times"),
        ("time repeats", "line 3: time goes from 331000 to 331000"),
        ("time negative", "line 1: time is -5"),
        ("time huge", "line 4: time is 9+; expected 0 to 92233720368547758 ticks"),
        ("time digits", "line 4: .*expected numbers only"),
        ("milliseconds", "median step is 33 ticks of 100 ns; .*are these milli- or microseconds"),
        ("microseconds", "median step is 33333 ticks"),
        ("millimetres", r"line 3: a coordinate of \d+ m; expected at most 10 \(millimetres"),
        ("4=3", "line 3: joint 0 has state 3; expected 0, 1 or 2"),
        ("8=1.5", r"line 3: joint 1 has state 1.5; .*shifted columns"),
        ("100=nan", "line 3: joint 24 has state nan"),
        ("1=nan", "line 3: a coordinate of nan m"),
        ("2=-inf", "line 3: a coordinate of inf m"),
        ("0=12.5", "line 3: .*expected numbers only"),
        ("7=abc", "line 3: .*expected numbers only"),
        ("7=", "line 3: .*expected numbers only"),
    ],
)
def test_damage_is_named(tmp_path: Path, edit: str, message: str) -> None:
    path = write(tmp_path / "joints.csv", damaged(edit))
    with pytest.raises(DataError, match=message) as error:
        kinect_csv.read_kinect_csv(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400 + len(str(path))


def test_recordings_made_frame_by_frame_have_steps_of_any_length(tmp_path: Path) -> None:
    joints = as_sdk(in_episode(2.0), 1.0, 0.0)
    lines = [line(t, joints) for t in (0, 10**7, 10**9)]
    assert kinect_csv.read_kinect_csv(write(tmp_path / "joints.csv", lines)).timestamp_ns[-1] == 10**11


@pytest.mark.parametrize("content", [b"", b"\n\n", b"  \r\n"])
def test_empty_file(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "joints.csv"
    path.write_bytes(content)
    with pytest.raises(DataError, match="is empty; expected one line of 101 fields"):
        kinect_csv.read_kinect_csv(path)


def test_not_text(tmp_path: Path) -> None:
    path = tmp_path / "joints.csv"
    path.write_bytes("1,2,3".encode("utf-16"))
    with pytest.raises(DataError, match="byte 0 is not ASCII") as error:
        kinect_csv.read_kinect_csv(path)
    assert "\n" not in str(error.value)


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "joints.csv", standing(4))
    monkeypatch.setattr(kinect_csv, "MAX_FRAMES", 3)
    with pytest.raises(DataError, match="4 lines; expected at most 3 frames"):
        kinect_csv.read_kinect_csv(path)
    monkeypatch.setattr(kinect_csv, "MAX_BYTES", 1000)
    with pytest.raises(DataError, match="larger than 1,000 bytes"):
        kinect_csv.read_kinect_csv(path)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        kinect_csv.read_kinect_csv(tmp_path / "absent.csv")
