"""The reader of PiGraphs recordings against files written here from the layout that its own reader takes.

No real recording was at hand: what these tests cannot show is that real files have this layout.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import pigraphs
from hsbench.datasets.importers.pigraphs import floor_level, read_pigraphs, to_episode_frame
from hsbench.datasets.importers.pose_captures import pigraphs_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.geometry.transforms import rigid, rotation_z
from hsbench.typing import AnyArray, FloatArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.test_kinect_csv import as_sdk, in_episode

ANY_FILE = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
HEIGHT_M, TILT_RAD, TURN_RAD, FLOOR_M = 1.4, 0.2, 2.1, -0.3
TICKS = 333_333


def scan_T_kinect(height_m: float = HEIGHT_M, tilt_rad: float = TILT_RAD, turn_rad: float = TURN_RAD) -> FloatArray:
    """(4, 4) from its definition: where the sensor's left, up and ahead point in a scan with z up."""
    c, s = math.cos(tilt_rad), math.sin(tilt_rad)
    axes = np.array([[0.0, 1.0, 0.0], [s, 0.0, c], [c, 0.0, -s]]).T  # of a sensor that looks along x
    return rigid(rotation_z(turn_rad) @ axes, (3.0, -1.0, FLOOR_M + height_m))


def skeleton(joints: FloatArray, ticks: int, identity: int = 7, confidence: AnyArray | float = 2) -> dict[str, Any]:
    return {
        "trackingId": identity,
        "jointPositions": joints.tolist(),
        "jointConfidences": np.broadcast_to(confidence, 25).tolist(),
        "jointOrientations": [[0, 0, 0, 1]] * 25,
        "handState": [2, 1, 2, 0],
        "activities": [1, 1, 1, 1, 1],
        "leanState": [0.1, 0.2, 2],
        "clippedEdges": 0,
        "timestamp": ticks,
    }


def recording(frames: int = 12, distance_m: float = 2.5, **options: Any) -> dict[str, Any]:
    standing = as_sdk(in_episode(distance_m), HEIGHT_M, TILT_RAD)
    return {
        "id": "office_1_2015-01-01",
        "camera": scan_T_kinect().ravel().tolist(),
        "startTime": 5_000_000,
        "endTime": 5_400_000,
        "skeletons": [skeleton(standing, 10**9 + i * TICKS, **options) for i in range(frames)],
        "colorTimestamps": [],
        "depthTimestamps": [],
    }


def write(path: Path, content: Any) -> Path:
    path.write_text(json.dumps(content))
    return path


def test_a_standing_person_stands_where_they_were(tmp_path: Path) -> None:
    found = read_pigraphs(write(tmp_path / "a.json", recording()))
    assert found.bodies.joints_kinect_m.shape == (12, 25, 3)
    assert found.bodies.timestamp_ns.tolist() == [100 * TICKS * i for i in range(12)]
    assert floor_level(found) == pytest.approx(FLOOR_M, abs=1e-9)
    episode = pigraphs_episode(found, "a", FLOOR_M)
    np.testing.assert_allclose(episode.poses.joints_m, np.broadcast_to(in_episode(2.5), (12, 25, 3)), atol=1e-5)
    sensor = episode.sensor
    np.testing.assert_allclose([sensor.height_m, sensor.tilt_rad, sensor.roll_rad], [HEIGHT_M, TILT_RAD, 0], atol=1e-9)


@given(height=st.floats(0.3, 2.5), tilt=st.floats(-0.7, 0.7), turn=st.floats(-3, 3), distance=st.floats(1, 4))
def test_the_episode_frame_undoes_any_pose(height: float, tilt: float, turn: float, distance: float) -> None:
    person = in_episode(distance, facing_rad=0.4)
    found = pigraphs.PigraphsRecording("a", bodies=None, scan_T_kinect=scan_T_kinect(height, tilt, turn))  # type: ignore[arg-type]
    episode_T_kinect, episode_T_camera = to_episode_frame(found, FLOOR_M)
    kinect = as_sdk(person, height, tilt)
    np.testing.assert_allclose(kinect @ episode_T_kinect[:3, :3].T + episode_T_kinect[:3, 3], person, atol=1e-9)
    np.testing.assert_allclose(episode_T_camera[:3, 3], [0, 0, height], atol=1e-9)
    assert np.linalg.det(episode_T_camera[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(
        episode_T_camera[:3, 0], [0, -1, 0], atol=1e-9
    )  # the camera's right is right of its heading


def test_feet_give_the_floor_of_people_who_sit_too(tmp_path: Path) -> None:
    content = recording()
    sitting = in_episode(2.5)
    sitting[:14, 2] -= 0.4
    content["skeletons"] += [skeleton(as_sdk(sitting, HEIGHT_M, TILT_RAD), 2 * 10**9 + i) for i in range(20)]
    found = read_pigraphs(write(tmp_path / "a.json", content))
    assert floor_level(found) == pytest.approx(FLOOR_M, abs=1e-9)


def test_no_floor_without_feet(tmp_path: Path) -> None:
    confidence = np.full(25, 2)
    confidence[15] = 1
    found = read_pigraphs(write(tmp_path / "a.json", recording(confidence=confidence)))
    with pytest.raises(DataError, match="0 rows with both feet tracked; expected at least 10"):
        floor_level(found)


@pytest.mark.parametrize("largest", [1, 2])
def test_confidences_are_tracking_states_or_halves_of_them(tmp_path: Path, largest: int) -> None:
    confidence = np.array([0, 1, 2] * 8 + [2]) * largest / 2
    found = read_pigraphs(write(tmp_path / "a.json", recording(confidence=confidence)))
    assert found.bodies.state[0].tolist() == [0, 1, 2] * 8 + [2]
    assert np.isnan(found.bodies.joints_kinect_m[:, 0::3][:, :8]).all()


def test_two_people_at_a_time(tmp_path: Path) -> None:
    content = recording(frames=2)
    other = recording(frames=2, distance_m=3.5, identity=2**64 - 1)
    content["skeletons"] = [s for pair in zip(other["skeletons"], content["skeletons"], strict=True) for s in pair]
    content["skeletons"][2:] = content["skeletons"][:1:-1]
    found = read_pigraphs(write(tmp_path / "a.json", content))
    assert found.bodies.track_id.tolist() == [1, 2, 1, 2]
    depth = found.bodies.joints_kinect_m[:, 0, 2]
    assert (depth[[0, 2]] > depth[[1, 3]]).all()


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "office_1.json", recording())
    out = tmp_path / "data"
    assert run(["import", "pigraphs", str(path), "--out", str(out)]) == 0
    assert "12 poses of 1 tracks in 0.4 s, camera 1.40 m high, looking 11.5 deg down" in capsys.readouterr().out
    assert run(["import", "pigraphs", str(path), "--out", str(out), "--floor", "0", "--name", "b"]) == 0
    assert "camera 1.10 m high" in capsys.readouterr().out
    assert verify_files(out) == []
    assert verify_episode(load(out, truth=True)[0]) == []


# damage


def edited(edit: str) -> Any:
    content = recording()
    person = content["skeletons"][1]
    if edit == "null skeletons":
        content["skeletons"] = None
    elif edit == "null skeleton":
        content["skeletons"][1] = None
    elif edit == "nobody":
        content["skeletons"] = []
    elif edit == "no camera":
        del content["camera"]
    elif edit == "column major":
        content["camera"] = scan_T_kinect().T.ravel().tolist()
    elif edit == "mirrored":
        content["camera"] = (scan_T_kinect() @ np.diag([-1, 1, 1, 1])).ravel().tolist()
    elif edit == "short camera":
        content["camera"] = content["camera"][:12]
    elif edit == "joints":
        person["jointPositions"] = person["jointPositions"][:20]
    elif edit == "flat joint":
        person["jointPositions"][4] = [1.0, 2.0]
    elif edit == "null joint":
        person["jointPositions"][4] = None
    elif edit == "null coordinate":
        person["jointPositions"][4][1] = None
    elif edit == "millimetres":
        person["jointPositions"][4][2] = 900.0
    elif edit == "confidences":
        person["jointConfidences"] = person["jointConfidences"][:24]
    elif edit == "confidence":
        person["jointConfidences"][3] = 1.7
    elif edit == "confidence 9":
        person["jointConfidences"][3] = 9
    elif edit == "time":
        person["timestamp"] = 5
    elif edit == "huge time":
        person["timestamp"] = 2**63
    elif edit == "no time":
        del person["timestamp"]
    elif edit == "twice":
        person["timestamp"] = content["skeletons"][0]["timestamp"]
    elif edit == "identity":
        person["trackingId"] = -1
    elif edit == "id":
        content["id"] = 3
    return content


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("null skeletons", "skeletons is null; expected a list"),
        ("null skeleton", r"skeletons\[1\] is null; expected an object"),
        ("nobody", "skeletons is empty; expected somebody"),
        ("no camera", "the file has no 'camera'"),
        ("column major", "is not rigid; expected camera to scan .stored column major"),
        ("mirrored", "is not rigid; expected camera to scan"),
        ("short camera", "camera has 12 values; expected 16"),
        ("joints", r"skeletons\[1\].jointPositions has 20 joints; expected 25"),
        ("flat joint", r"skeletons\[1\].jointPositions\[4\] has 2 values; expected 3"),
        ("null joint", r"skeletons\[1\].jointPositions\[4\] is null"),
        ("null coordinate", r"skeletons\[1\].jointPositions\[4\]\[1\] is null; expected a number"),
        ("millimetres", r"skeletons\[1\]: joint 4 lies at .*900.0.*millimetres"),
        ("confidences", r"skeletons\[1\].jointConfidences has 24 values; expected 25"),
        ("confidence", r"skeletons\[1\]: joint 3 has state 1.7"),
        ("confidence 9", r"skeletons\[1\].jointConfidences\[3\] is 9; expected a number of at most 2"),
        ("time", r"skeletons\[1\]: time goes from 1000000000 to 5; expected ascending"),
        ("huge time", r"skeletons\[1\].timestamp is 9223372036854775808"),
        ("no time", r"skeletons\[1\] has no 'timestamp'"),
        ("twice", r"skeletons\[1\] repeats a trackingId at one time"),
        ("identity", r"skeletons\[1\].trackingId is -1"),
        ("id", "id is 3; expected a text"),
    ],
)
def test_damage_is_named(tmp_path: Path, edit: str, message: str) -> None:
    refused(read_pigraphs, write(tmp_path / "damaged.json", edited(edit)), message)


def test_a_sensor_that_looks_straight_down_has_no_heading(tmp_path: Path) -> None:
    content = recording()
    content["camera"] = scan_T_kinect(tilt_rad=math.pi / 2).ravel().tolist()
    found = read_pigraphs(write(tmp_path / "a.json", content))
    with pytest.raises(DataError, match="expected a heading"):
        to_episode_frame(found, 0.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b'{"id": "a", "camera": [1, 0', "no valid JSON .*line 1 column"),
        (b'{"camera": [NaN]}', "NaN is no JSON number"),
        ("{}".encode("utf-16"), "not UTF-8 at byte 0"),
    ],
)
def test_not_such_json(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    refused(read_pigraphs, path, message)


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "a.json", recording())
    monkeypatch.setattr(pigraphs, "MAX_SKELETONS", 3)
    refused(read_pigraphs, path, "skeletons has 12 items; expected at most 3")
    monkeypatch.setattr(pigraphs, "MAX_BYTES", 100)
    refused(read_pigraphs, path, "more than 100 bytes")


@ANY_FILE
@given(data=st.data())
def test_mutations_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    sound = json.dumps(recording(frames=2))

    refused_or_read(
        read_pigraphs,
        tmp_path / "mutated.json",
        data.draw(mutated(sound.encode())),
        lambda found: pigraphs_episode(found, "a", FLOOR_M),
    )
