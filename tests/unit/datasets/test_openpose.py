"""The reader of OpenPose's JSON against files written here from its documented layout."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import openpose
from hsbench.datasets.importers.openpose import find_scale, joint_states, read_openpose, to_pixels
from hsbench.datasets.importers.pose_captures import openpose_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError, SchemaError
from hsbench.schema.poses import JointState
from hsbench.schema.skeletons import BODY_25, COCO_18
from hsbench.typing import FloatArray
from tests.unit.datasets.mutations import mutated, refused, refused_or_read

WIDTH, HEIGHT = 640, 480
ANY_FILE = settings(deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])


def person(rng: np.random.Generator, joints: int = 25, missing: tuple[int, ...] = ()) -> FloatArray:
    """(joints, 3) x, y, confidence of someone in a picture of 640 x 480, zero where missing."""
    found = np.stack(
        [rng.uniform(0, WIDTH - 1, joints), rng.uniform(0, HEIGHT - 1, joints), rng.uniform(0.1, 1, joints)], -1
    )
    found[list(missing)] = 0.0
    return found.round(3)


def people_json(
    people: list[FloatArray], key: str = "pose_keypoints_2d", identities: list[int] | None = None
) -> dict[str, Any]:
    named = identities or [-1] * len(people)
    return {
        "version": 1.3,
        "people": [
            {
                "person_id": [identity],
                key: keypoints.ravel().tolist(),
                "face_keypoints_2d": [],
                "hand_left_keypoints_2d": [],
            }
            for keypoints, identity in zip(people, named, strict=True)
        ],
    }


def write(path: Path, content: Any) -> Path:
    path.write_text(json.dumps(content))
    return path


def recording(folder: Path, frames: dict[int, list[FloatArray]], **options: Any) -> Path:
    folder.mkdir(exist_ok=True)
    for number, people in frames.items():
        write(folder / f"walk_{number:012d}_keypoints.json", people_json(people, **options))
    return folder


@pytest.mark.parametrize(
    ("joints", "key", "skeleton"),
    [(25, "pose_keypoints_2d", BODY_25), (18, "pose_keypoints_2d", COCO_18), (18, "pose_keypoints", COCO_18)],
)
def test_models_and_keys(tmp_path: Path, joints: int, key: str, skeleton: object) -> None:
    rng = np.random.default_rng(0)
    people = [person(rng, joints, missing=(3,)), person(rng, joints)]
    found = read_openpose(write(tmp_path / "a.json", people_json(people, key)))
    assert found.skeleton is skeleton
    assert np.array_equal(found.keypoints, np.stack(people))
    assert (found.frames.tolist(), found.frame.tolist(), found.track_id.tolist()) == ([0], [0, 0], [1, 2])
    assert not found.has_identities


def test_a_folder_is_a_recording(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    frames = {7: [], 10: [person(rng), person(rng)], 9: [person(rng)], 13: []}
    found = read_openpose(recording(tmp_path / "json", frames))
    assert found.frames.tolist() == [7, 9, 10, 13]
    assert found.frame.tolist() == [9, 10, 10]
    assert np.array_equal(found.keypoints, np.stack([*frames[9], *frames[10]]))
    episode = openpose_episode(found, "walk", "pixel", (WIDTH, HEIGHT), 30.0)
    assert episode.poses.timestamp_ns.tolist() == [66_666_667, 100_000_000, 100_000_000]
    assert episode.end_ns == 200_000_000  # the last picture, of nobody
    assert episode.sensor.height_m is None
    assert episode.sensor.camera.fx_px == 1.2 * WIDTH


def test_identities_where_openpose_tracked(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    folder = recording(tmp_path / "json", {0: [person(rng)] * 2}, identities=[4, 0])
    found = read_openpose(folder)
    assert found.has_identities
    assert found.track_id.tolist() == [1, 5]
    recording(folder, {1: [person(rng)] * 2}, identities=[3, 3])
    with pytest.raises(DataError, match="picture 1 has person_id 3 twice"):
        read_openpose(folder)


@given(data=st.data(), side=st.tuples(st.integers(2, 4000), st.integers(2, 4000)))
def test_every_scale_gives_the_same_pixels(data: st.DataObject, side: tuple[int, int]) -> None:
    width, height = side
    last = np.array([width - 1, height - 1])
    fraction = np.array(data.draw(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=5)))
    keypoints = np.ones((1, len(fraction), 3))
    expected = (fraction * last + 0.5).astype(np.float32)
    for scale, xy in (("pixel", fraction * last), ("unit", fraction), ("signed", 2 * fraction - 1)):
        keypoints[0, :, :2] = xy
        np.testing.assert_allclose(to_pixels(keypoints, scale, width, height)[0], expected, rtol=1e-6, atol=1e-3)


@given(st.integers(0, 2**32))
def test_the_scale_of_a_walk_is_found(seed: int) -> None:
    pixels = np.stack([person(np.random.default_rng(seed), missing=(0, 5))] * 2)
    missing = pixels[..., 2:] == 0
    unit = np.concatenate([pixels[..., :2] / (WIDTH - 1, HEIGHT - 1), pixels[..., 2:]], axis=-1)
    signed = np.where(missing, 0.0, np.concatenate([2 * unit[..., :2] - 1, pixels[..., 2:]], axis=-1))
    assert (find_scale(pixels), find_scale(unit), find_scale(signed)) == ("pixel", "unit", "signed")


def test_states_follow_the_confidence() -> None:
    states = joint_states(np.array([0.0, 1e-6, 0.05, 0.0501, 1.0, 1.006]))
    assert states.tolist() == [0, 1, 1, 2, 2, 2]
    assert states.dtype == np.uint8


def test_an_unknown_scale_is_refused() -> None:
    with pytest.raises(SchemaError, match="scale is 'metre'; expected one of pixel, unit, signed"):
        to_pixels(np.zeros((1, 25, 3)), "metre", 10, 10)


def test_people_outside_the_picture_show_the_wrong_size(tmp_path: Path) -> None:
    found = read_openpose(write(tmp_path / "a.json", people_json([person(np.random.default_rng(3))])))
    with pytest.raises(DataError, match=r"\d+% of the joints lie within 64 x 48 px; expected nearly all"):
        openpose_episode(found, "a", "pixel", (64, 48), 1.0)


def test_recordings_last_less_than_a_year(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    found = read_openpose(recording(tmp_path / "json", {0: [person(rng)], 999_999_999_999: [person(rng)]}))
    with pytest.raises(DataError, match="999,999,999,999 pictures at 30 Hz last more than a year"):
        openpose_episode(found, "a", "pixel", (WIDTH, HEIGHT), 30.0)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(4)
    folder = recording(tmp_path / "json", {i: [person(rng, missing=(15, 16))] for i in range(10)})
    out = tmp_path / "data"
    arguments = ["import", "openpose", str(folder), "--out", str(out), "--name", "walk"]
    assert run([*arguments, "--size", "640x480"]) == 2
    assert "--rate is needed" in capsys.readouterr().err
    for size in ("640", "0x480", "640x-1", f"{'9' * 5000}x1", "640x480x3"):
        assert run([*arguments, "--size", size, "--rate", "10"]) == 2
    assert run([*arguments, "--size", "640x480", "--rate", "10", "--focal", "500"]) == 0
    shown = capsys.readouterr()
    assert "10 poses of 1 tracks in 0.9 s" in shown.out
    assert "scale 'pixel'" in shown.err
    assert "no identities" in shown.err
    episode = load(out, truth=True)[0]
    assert episode.sensor.camera.fx_px == 500
    assert (episode.poses.joint_state[:, [15, 16]] == JointState.MISSING).all()
    assert np.isnan(episode.poses.joints_px[:, [15, 16]]).all()
    assert verify_files(out) == []
    assert verify_episode(episode) == []


# damage


def damaged(edit: str) -> Any:
    sound = people_json([person(np.random.default_rng(5)), person(np.random.default_rng(6))])
    second = sound["people"][1]
    if edit == "null people":
        sound["people"] = None
    elif edit == "null person":
        sound["people"][1] = None
    elif edit == "no people":
        del sound["people"]
    elif edit == "nobody":
        sound["people"] = []
    elif edit == "zeros":
        sound["people"] = people_json([np.zeros((25, 3))])["people"]
    elif edit == "no keypoints":
        del second["pose_keypoints_2d"]
    elif edit == "two models":
        second["pose_keypoints_2d"] = second["pose_keypoints_2d"][:54]
    elif edit == "a list":
        sound = [sound]
    elif edit == "a crowd":
        sound["people"] = [{}] * 2000
    elif edit.startswith("id="):
        second["person_id"] = json.loads(edit[3:])
    elif edit.startswith("count="):
        second["pose_keypoints_2d"] = [1.0] * int(edit[6:])
    else:
        index, value = edit.split("=")
        second["pose_keypoints_2d"][int(index)] = json.loads(value)
    return sound


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ("null people", "people is null; expected a list"),
        ("null person", r"people\[1\] is null; expected an object"),
        ("no people", "the file has no 'people'; found 'version'"),
        ("nobody", "no person in 1 pictures; expected somebody"),
        ("zeros", "no person in 1 pictures"),
        ("no keypoints", r"people\[1\] has no 'pose_keypoints_2d'"),
        ("two models", r"18 joints; expected 25 as before .two models"),
        ("a list", "the file is a list; expected an object"),
        ("a crowd", "people has 2,000 items; expected at most 1,000"),
        ("count=74", r"people\[1\].pose_keypoints_2d has 74 values; expected 75 .body-25. or 54 .coco-18"),
        ("count=45", "has 45 values"),
        ("count=0", "has 0 values"),
        ("count=90000", "has 90,000 items; expected at most 75"),
        ("7=null", r"people\[1\].pose_keypoints_2d\[7\] is null; expected a number"),
        ('7="12"', r"pose_keypoints_2d\[7\] is '12'; expected a number"),
        ("7=[]", r"pose_keypoints_2d\[7\] is a list"),
        ("7=true", r"pose_keypoints_2d\[7\] is True"),
        ("7=1e30", r"pose_keypoints_2d\[7\] is 1e\+30; expected a number of at most 100000"),
        ("8=-0.5", r"pose_keypoints_2d: joint 2 has confidence -0.5"),
        ("id=[]", r"person_id is a list; expected a whole number of -1"),
        ("id=[1.5]", r"person_id is 1.5"),
        ("id=[99999999999]", r"person_id is 99999999999"),
        ("id=null", r"person_id is null"),
    ],
)
def test_damage_is_named(tmp_path: Path, edit: str, message: str) -> None:
    refused(read_openpose, write(tmp_path / "damaged.json", damaged(edit)), message)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty; expected JSON"),
        (b'{"people": [{"pose_key', r"no valid JSON .*line 1 column"),
        (b'{"people": [NaN]}', "NaN is no JSON number"),
        (b'{"people": [1e999]}', "inf is no JSON number|1e999"),
        ('{"people": []}'.encode("utf-16"), "not UTF-8 at byte 0"),
        (b"[" * 100_000, "no valid JSON"),
        (b'{"people": [' + b"9" * 5000 + b"]}", "no valid JSON"),
    ],
)
def test_not_such_json(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    refused(read_openpose, path, message)


def test_folders_that_are_no_recording(tmp_path: Path) -> None:
    folder = tmp_path / "json"
    folder.mkdir()
    refused(read_openpose, folder, "holds no <name>_<12 digits>_keypoints.json")
    rng = np.random.default_rng(7)
    recording(folder, {3: [person(rng)]})
    write(folder / "photo_keypoints.json", people_json([]))
    with pytest.raises(DataError, match=r"photo_keypoints.json: has no frame number"):
        read_openpose(folder)
    (folder / "photo_keypoints.json").unlink()
    write(folder / "run_000000000001_keypoints.json", people_json([]))
    with pytest.raises(DataError, match="another recording than run_0"):
        read_openpose(folder)


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    folder = recording(tmp_path / "json", {i: [person(rng)] * 2 for i in range(4)})
    monkeypatch.setattr(openpose, "MAX_ROWS", 5)
    with pytest.raises(DataError, match="more than 5 people so far"):
        read_openpose(folder)
    monkeypatch.setattr(openpose, "MAX_FRAMES", 3)
    refused(read_openpose, folder, "more than 3 pictures")
    monkeypatch.setattr(openpose, "MAX_BYTES", 100)
    refused(read_openpose, folder / "walk_000000000000_keypoints.json", "more than 100 bytes")


@ANY_FILE
@given(data=st.data())
def test_mutations_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    rng = np.random.default_rng(9)
    sound = json.dumps(people_json([person(rng, 18), person(rng, 18, missing=(2,))], "pose_keypoints"))

    def build(found: openpose.OpenPoseRecording) -> object:
        return openpose_episode(found, "a", find_scale(found.keypoints), (WIDTH, HEIGHT), 30.0)

    refused_or_read(read_openpose, tmp_path / "mutated.json", data.draw(mutated(sound.encode())), build)
