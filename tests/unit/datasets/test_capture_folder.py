"""Folders of one's own captures: what they hold comes back, and what is not as assumed is refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers.capture_folder import capture_episodes
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.io.images import encode_jpeg, write_png
from tests.unit.datasets.mutations import mutated, refused, refused_or_read
from tests.unit.datasets.test_footage import openpose
from tests.unit.datasets.test_footage_views import place, seen, with_person
from tests.unit.datasets.test_kinect_csv import as_sdk, in_episode, line

ANY_FILE = settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
COUNT = 4
HEIGHT_M, TILT_DEG = 1.3, 12.0
CAMERA = {"width_px": 320, "height_px": 240, "fx_px": 280.0, "fy_px": 280.0, "cx_px": 160.0, "cy_px": 120.0}
DESCRIPTIONS: dict[str, dict[str, Any]] = {
    "rgbd": {"rate_hz": 2.0, "camera": CAMERA, "height_m": HEIGHT_M, "tilt_deg": TILT_DEG, "roll_deg": 0.0,
             "poses_start_s": 0.5},
    "360": {"rate_hz": 0.1, "height_m": 1.45, "poses_rate_hz": 10.0},
    "timelapse": {"rate_hz": 0.2, "focal_px": None},
}  # fmt: skip


def write_capture(folder: Path, kind: str) -> Path:
    (folder / "rgb").mkdir(parents=True)
    (folder / "capture.json").write_text(json.dumps(DESCRIPTIONS[kind]))
    view = seen(place(4))
    if kind == "360":
        view = cv2.resize(view, (320, 160))
    for k in range(COUNT):
        picture = view if kind == "360" else with_person(view, 30 * k, k)
        (folder / "rgb" / f"p{k}.jpg").write_bytes(encode_jpeg(picture))
    if kind == "rgbd":
        (folder / "depth").mkdir()
        for k in range(COUNT):
            write_png(folder / "depth" / f"p{k}.png", np.full((240, 320), 2000 + k, dtype=np.uint16))
        joints = as_sdk(in_episode(2.7), HEIGHT_M, np.radians(TILT_DEG))
        (folder / "poses.csv").write_bytes("".join(line(10_000_000 * k, joints) for k in range(3)).encode())
    else:
        openpose(folder / "openpose", [0, 2])
    return folder


@pytest.mark.parametrize("kind", DESCRIPTIONS)
def test_a_capture_becomes_an_episode(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = write_capture(tmp_path / "kitchen", kind), tmp_path / "data"
    assert run(["import", "capture", kind, str(folder), "--out", str(out)]) == 0
    assert "note: assumed: " in capsys.readouterr().err
    assert list(verify_files(out)) == []
    (episode,) = load(out, truth=True)
    assert verify_episode(episode) == []
    assert (episode.episode_id, episode.dataset, len(episode.frames)) == ("kitchen", f"capture-{kind}", COUNT)
    rate_hz = DESCRIPTIONS[kind]["rate_hz"]
    assert episode.frames.timestamps_ns.tolist() == [round(k * 1e9 / rate_hz) for k in range(COUNT)]
    poses = episode.poses
    if kind == "rgbd":
        assert (episode.sensor.height_m, episode.sensor.tilt_rad) == (HEIGHT_M, pytest.approx(np.radians(TILT_DEG)))
        assert float(np.median(episode.frames[2].depth_m)) == pytest.approx(2.002)
        assert poses.timestamp_ns.tolist() == [500_000_000, 1_500_000_000, 2_500_000_000]
        assert np.allclose(poses.joints_m[0], in_episode(2.7), atol=1e-4)
        assert episode.end_ns == 2_500_000_000
    elif kind == "360":
        assert episode.sensor.height_m is None
        assert episode.placed_sensor.height_m == 1.45
        assert poses.timestamp_ns.tolist() == [0, 200_000_000]
        assert load(out)[0].placed_sensor.height_m is None
    else:
        assert poses.timestamp_ns.tolist() == [0, 10_000_000_000]


def test_a_pushed_timelapse_camera_begins_an_episode(tmp_path: Path) -> None:
    folder = write_capture(tmp_path / "kitchen", "timelapse")
    for k in range(COUNT, COUNT + 4):
        (folder / "rgb" / f"p{k}.jpg").write_bytes(encode_jpeg(seen(place(4), 25)))
    episodes, _ = capture_episodes("timelapse", folder, "a")
    assert [(e.episode_id, len(e.frames)) for e in episodes] == [("a-00", 4), ("a-01", 4)]


def edited(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        document = json.loads((folder / "capture.json").read_text())
        change(document)
        (folder / "capture.json").write_text(json.dumps(document))

    return edit


def put(name: str, data: bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(data)


def depth(value: int, size: tuple[int, int] = (240, 320)) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        for k in range(COUNT):
            write_png(folder / "depth" / f"p{k}.png", np.full(size, value, dtype=np.uint16))

    return change


MALFORMED: dict[str, tuple[str, Callable[[Path], object], str, str]] = {
    "no description": ("rgbd", lambda f: (f / "capture.json").unlink(), "capture.json", "cannot read"),
    "empty description": ("360", put("capture.json", b""), "capture.json", "no valid JSON"),
    "null camera": ("rgbd", edited(lambda d: d.update(camera=None)), "capture.json", "camera is None; expected an"),
    "unknown key": ("360", edited(lambda d: d.update(tilt=3)), "capture.json", "has unknown 'tilt'"),
    "missing key": ("timelapse", edited(lambda d: d.pop("focal_px")), "capture.json", "lacks focal_px"),
    "negative rate": ("timelapse", edited(lambda d: d.update(rate_hz=-1.0)), "capture.json", "a rate is -1"),
    "NaN": ("rgbd", edited(lambda d: d.update(height_m=float("nan"))), "capture.json", "NaN is no JSON number"),
    "no pictures": ("360", lambda f: shutil.rmtree(f / "rgb"), "kitchen", "has no folder rgb"),
    "no depth": ("rgbd", lambda f: shutil.rmtree(f / "depth"), "kitchen", "4 pictures lack their other half"),
    "one depth too few": ("rgbd", lambda f: (f / "depth" / "p2.png").unlink(), "kitchen", "such as p2"),
    "depth in tenths": ("rgbd", depth(20_000 * 3), "depth", "60 m at the median.*another unit"),
    "empty depth": ("rgbd", depth(0), "depth", "nowhere a reading"),
    "small depth": ("rgbd", depth(900, (120, 160)), "p0.png", "160 x 120 px; expected 320 x 240"),
    "truncated depth": ("rgbd", put("depth/p1.png", b"\x89PNG\r\n\x1a\n"), "p1.png", "no PNG"),
    "picture of another size": ("rgbd", put("rgb/p1.jpg", encode_jpeg(seen(place(4))[:100])), "p1.jpg", "320 x 100 px"),
    "no panorama": ("360", put("rgb/p0.jpg", encode_jpeg(seen(place(4)))), "p0.jpg", "twice as wide as high"),
    "damaged poses": ("rgbd", put("poses.csv", b"1,2,3\n"), "poses.csv", "expected"),
    "nobody": ("360", lambda f: nobody(f / "openpose"), "openpose", "no person"),
    "poses of other pictures": ("timelapse", lambda f: openpose_at(f, 40), "rgb", "frame 40 is none of the 4"),
}  # fmt: skip


def nobody(folder: Path) -> None:
    for path in folder.iterdir():
        path.write_text('{"people": []}')


def openpose_at(folder: Path, frame: int) -> None:
    shutil.rmtree(folder / "openpose")
    openpose(folder / "openpose", [frame])


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_captures_are_refused(case: str, tmp_path: Path) -> None:
    kind, change, name, match = MALFORMED[case]
    folder = write_capture(tmp_path / "kitchen", kind)
    change(folder)
    refused(lambda _: capture_episodes(kind, folder, "a"), folder / name, match)


def test_a_moved_camera_is_refused(tmp_path: Path) -> None:
    folder = write_capture(tmp_path / "kitchen", "360")
    for k in range(COUNT, COUNT + 4):
        (folder / "rgb" / f"p{k}.jpg").write_bytes(encode_jpeg(cv2.resize(seen(place(5)), (320, 160))))
    refused(lambda _: capture_episodes("360", folder, "a"), folder / "rgb", r"the camera moved at p4\.jpg")


@pytest.mark.parametrize("kind", DESCRIPTIONS)
@ANY_FILE
@given(data=st.data())
def test_damaged_descriptions_are_refused_or_read(kind: str, tmp_path: Path, data: st.DataObject) -> None:
    folder = tmp_path / "kitchen"
    if not folder.exists():
        write_capture(folder, kind)
    damaged = data.draw(mutated(json.dumps(DESCRIPTIONS[kind]).encode()))
    path = folder / "capture.json"
    refused_or_read(lambda _: None, path, damaged, lambda _: capture_episodes(kind, folder, "a"))
