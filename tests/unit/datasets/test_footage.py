"""Footage as episodes: folders and videos with a moved camera, with people, with gaps, with damage."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.coco_keypoints import COCO_NAMES
from hsbench.datasets.importers.footage import footage_episodes, read_footage
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.errors import DataError
from hsbench.io.image_frames import ImageFrames
from hsbench.io.images import encode_jpeg, encode_png
from hsbench.typing import UInt8Array
from tests.unit.datasets.mutations import attempt, mutated, refused
from tests.unit.datasets.test_footage_views import place, seen, with_person
from tests.unit.io.test_image_frames import write_video

ANY_FILE = settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
FIRST, SECOND = 7, 5


def film() -> list[UInt8Array]:
    """A person walks; after seven pictures the camera is pushed by 6 % of its width."""
    picture = place(3)
    views = [seen(picture)] * FIRST + [seen(picture, 20, 5)] * SECOND
    return [with_person(view, 20 * k, k) for k, view in enumerate(views)]


def write_folder(folder: Path, pictures: list[UInt8Array], first: int = 1) -> Path:
    folder.mkdir()
    for k, picture in enumerate(pictures, start=first):
        (folder / f"frame{k}.jpg").write_bytes(encode_jpeg(picture))
    return folder


@pytest.mark.parametrize("kind", ["folder", "video", "kept"])
def test_a_film_becomes_an_episode_for_each_view(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pictures = film()
    if kind == "folder":
        source, options = write_folder(tmp_path / "cam", pictures), ["--rate", "0.2"]
    else:
        source = write_video(tmp_path / "cam.mp4", pictures, rate_hz=5.0)
        options = ["--keep-video"] if kind == "kept" else []
    step_ns = 5_000_000_000 if kind == "folder" else 200_000_000
    out = tmp_path / "data"
    assert run(["import", "footage", str(source), "--out", str(out), *options]) == 0
    assert f"2 views, so 2 episodes: the camera moved, or the film was cut, at {FIRST * step_ns / 1e9:.1f} s" in (
        capsys.readouterr().err
    )
    assert list(verify_files(out)) == []
    first, second = load(out)
    assert (first.episode_id, second.episode_id) == ("cam-00", "cam-01")
    assert first.frames.timestamps_ns.tolist() == [k * step_ns for k in range(FIRST)]
    assert second.frames.timestamps_ns.tolist() == [k * step_ns for k in range(FIRST, FIRST + SECOND)]
    assert (second.t0_ns, second.end_ns) == (FIRST * step_ns, (FIRST + SECOND - 1) * step_ns)
    for episode, start in ((first, 0), (second, FIRST)):
        assert verify_episode(episode) == []
        assert (episode.sensor.kind, episode.sensor.camera.width_px, episode.sensor.height_m) == (
            "monocular",
            320,
            None,
        )
        for k in (len(episode.frames) - 1, 0):
            assert np.abs(episode.frames[k].rgb.astype(int) - pictures[start + k]).mean() < 8
        assert isinstance(episode.frames, ImageFrames)
        background = episode.frames.background
        assert np.abs(background.astype(int) - seen(place(3), *((0, 0) if start == 0 else (20, 5)))).mean() < 8
    stored = sorted(p.name for p in (out / "episodes" / "cam-01" / "inputs" / "frames").iterdir())
    assert ("video.mp4" in stored) == (kind == "kept")
    if kind == "folder":
        assert (out / "episodes" / "cam-01" / "inputs" / "frames" / "000000_rgb.jpg").read_bytes() == (
            source / f"frame{FIRST + 1}.jpg"
        ).read_bytes()


def test_gaps_and_unreadable_pictures_are_named(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "cam", film()[:FIRST])
    (folder / "frame3.jpg").unlink()
    (folder / "frame5.jpg").write_bytes((folder / "frame5.jpg").read_bytes()[:400])
    (folder / "frame6.jpg").write_bytes(b"")
    (folder / "notes.txt").write_text("no picture")
    (episode,), notes = footage_episodes(read_footage(folder, 1.0), "a")
    assert episode.frames.timestamps_ns.tolist() == [0, 10**9, 3 * 10**9, 6 * 10**9]
    assert any("1 numbers are missing among the names, after frame2.jpg" in note for note in notes)
    assert any("2 pictures are unreadable and left out: frame5.jpg, frame6.jpg" in note for note in notes)
    for k in (1, 2, 4):
        (folder / f"frame{k}.jpg").write_bytes(b"x")
    with pytest.raises(DataError, match=r"5 of 6 pictures are unreadable, such as: .*frame1\.jpg"):
        footage_episodes(read_footage(folder, 1.0), "a")


def test_pictures_while_the_camera_moves_are_named(tmp_path: Path) -> None:
    a, b = seen(place(1)), seen(place(2))
    folder = write_folder(tmp_path / "cam", [a, a, a, seen(place(7)), seen(place(8)), b, b, b])
    episodes, notes = footage_episodes(read_footage(folder, 1.0), "a")
    assert [len(e.frames) for e in episodes] == [3, 3]
    assert any("2 pictures between two views are left out: frame4.jpg, frame5.jpg" in note for note in notes)
    (whole,), _ = footage_episodes(read_footage(folder, 1.0), "a", split=False)
    assert len(whole.frames) == 8
    (folder / "frame8.jpg").write_bytes(encode_jpeg(a[:100, :100]))
    with pytest.raises(DataError, match="pictures of 2 sizes; expected one view"):
        footage_episodes(read_footage(folder, 1.0), "a", split=False)


def test_pictures_turned_by_exif_have_their_size_as_shown(tmp_path: Path) -> None:
    (tmp_path / "cam").mkdir()
    upright = encode_jpeg(seen(place(3))[:60, :100])
    entry = b"\x12\x01\x03\x00" + b"\x01\x00\x00\x00" + b"\x06\x00\x00\x00"  # orientation 6: a quarter turn
    tiff = b"II*\x00\x08\x00\x00\x00" + b"\x01\x00" + entry + bytes(4)
    block = b"Exif\0\0" + tiff
    turned = upright[:2] + b"\xff\xe1" + (len(block) + 2).to_bytes(2, "big") + block + upright[2:]
    for k in range(3):
        (tmp_path / "cam" / f"{k}.jpg").write_bytes(turned)
    assert run(["import", "footage", str(tmp_path / "cam"), "--rate", "1", "--out", str(tmp_path / "data")]) == 0
    (episode,) = load(tmp_path / "data")
    assert (episode.sensor.camera.width_px, episode.sensor.camera.height_px) == (60, 100)
    assert verify_episode(episode) == []


def openpose(folder: Path, frames: list[int]) -> Path:
    folder.mkdir()
    for k in frames:
        people = [{"person_id": [-1], "pose_keypoints_2d": [10.0 + k, 20.0, 0.9] * 25}]
        (folder / f"cam_{k:012d}_keypoints.json").write_text(json.dumps({"version": 1.3, "people": people}))
    return folder


def coco(path: Path, names: list[str]) -> Path:
    images = [{"id": k, "file_name": name, "width": 320, "height": 240} for k, name in enumerate(names)]
    people = [
        {"image_id": k, "category_id": 1, "keypoints": [30 + k, 40, 2] * 17, "iscrowd": 0} for k in range(len(names))
    ]
    joints = [{"id": 1, "name": "person", "keypoints": list(COCO_NAMES)}]
    path.write_text(json.dumps({"images": images, "annotations": people, "categories": joints}))
    return path


@pytest.mark.parametrize("kind", ["openpose", "coco"])
def test_poses_come_along_to_the_episode_of_their_picture(kind: str, tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "cam", film())
    out = tmp_path / "data"
    if kind == "openpose":
        options = ["--openpose", str(openpose(tmp_path / "json", [0, 6, 7, 11])), "--scale", "pixel"]
    else:
        options = ["--coco", str(coco(tmp_path / "coco.json", [f"frame{k + 1}.jpg" for k in (0, 6, 7, 11)]))]
    assert run(["import", "footage", str(folder), "--rate", "1", "--out", str(out), *options]) == 0
    first, second = load(out)
    assert (first.poses.timestamp_ns // 10**9).tolist() == [0, 6]
    assert (second.poses.timestamp_ns // 10**9).tolist() == [7, 11]
    x = [p[0, 0] for e in (first, second) for p in e.poses.joints_px]
    assert x == ([10.5, 16.5, 17.5, 21.5] if kind == "openpose" else [30.5, 31.5, 32.5, 33.5])


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (["--rate", "1", "--openpose", "{json}"], "frame 40 is none of the 12 pictures"),
        (["--rate", "1", "--coco", "{coco}"], r"holds no other\.jpg"),
        ([], "neither its name nor EXIF data"),
        (["--rate", "1", "--scale", "unit"], "give --openpose too"),
        (["--rate", "1", "--keep-video"], "is a folder"),
        (["--rate", "1", "--coco", "{coco}", "--openpose", "{json}"], "expected one of them"),
        (["--rate", "0"], "0"),
    ],
)
def test_options_that_do_not_fit(
    options: list[str], match: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_folder(tmp_path / "cam", film())
    files = {"json": openpose(tmp_path / "json", [0, 40]), "coco": coco(tmp_path / "coco.json", ["other.jpg"])}
    given_options = [option.format(**files) for option in options]
    assert run(["import", "footage", str(folder), "--out", str(tmp_path / "data"), *given_options]) == 2
    assert re.search(match, " ".join(capsys.readouterr().err.split()))
    assert not (tmp_path / "data").exists()


def video(path: Path) -> Path:
    return write_video(path, [seen(place(3))[:64, :96]] * 20)


@pytest.mark.parametrize(
    ("damage", "match"),
    [
        (lambda data: b"", "no readable video"),
        (lambda data: b"not a film", "no readable video"),
        (lambda data: data[:60], "no readable video"),
        (lambda data: data.replace(b"moov", b"nope"), "no readable video"),
        (lambda data: data.replace(b"ftyp", b"xxxx").replace(b"mdat", b"xxxx").replace(b"moov", b"xxxx"), "video"),
        (lambda data: bytes(len(data)), "no readable video"),
        (lambda data: data[: len(data) // 2], "no readable video"),
        (lambda data: data[::-1], "no readable video"),
    ],
)
def test_damaged_videos_are_refused(damage: object, match: str, tmp_path: Path) -> None:
    path = video(tmp_path / "a.mp4")
    path.write_bytes(damage(path.read_bytes()))  # type: ignore[operator]
    refused(read_footage, path, match)


def test_an_incomplete_video_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", [seen(place(3))[:64, :96]] * 20)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
    found = read_footage(path)
    assert 0 < len(found) < 20
    assert found.notes == (f"20 frames are stated, {len(found)} decode; the rest is missing (an incomplete copy?)",)
    (episode,), _ = footage_episodes(found, "a")
    assert len(episode.frames) >= len(found) - 1


def test_other_sources_are_refused(tmp_path: Path) -> None:
    refused(read_footage, tmp_path / "none.mp4", "is missing")
    (tmp_path / "empty").mkdir()
    refused(read_footage, tmp_path / "empty", "holds no picture")
    (tmp_path / "empty" / "film.mp4").touch()
    refused(read_footage, tmp_path / "empty", r"name the video: film\.mp4")
    (tmp_path / "text.txt").write_text("x")
    refused(read_footage, tmp_path / "text.txt", "expected a video that ends in")


@ANY_FILE
@given(data=st.data())
def test_damaged_videos_are_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    sound = tmp_path / "sound.mp4"
    if not sound.exists():
        video(sound)
    path = tmp_path / "a.mp4"
    path.write_bytes(data.draw(mutated(sound.read_bytes())))
    _, refusal = attempt(lambda: footage_episodes(read_footage(path), "a"))
    assert refusal is None or (path.name in str(refusal) and str(refusal).isprintable())


@ANY_FILE
@given(data=st.data(), png=st.booleans())
def test_damaged_pictures_are_left_out_or_read(tmp_path: Path, data: st.DataObject, png: bool) -> None:
    folder = tmp_path / "cam"
    folder.mkdir(exist_ok=True)
    picture = seen(place(3))[:24, :32]
    for k in range(3):
        (folder / f"f{k}.png").write_bytes(encode_png(picture))
    (folder / "f9.png").write_bytes(data.draw(mutated(encode_png(picture) if png else encode_jpeg(picture))))
    episodes, _ = footage_episodes(read_footage(folder, 1.0), "a")
    assert len(episodes[0].frames) in (3, 4)
