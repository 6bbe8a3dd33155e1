"""Frames with poses drawn on them, clips, and the view command."""

from __future__ import annotations

import builtins
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from hsbench import load
from hsbench.cli.main import run
from hsbench.errors import DataError, MissingExtraError
from hsbench.geometry.cameras import EquirectangularCamera, PinholeCamera, TopDownCamera
from hsbench.geometry.transforms import apply
from hsbench.schema.episode import Episode, Frame, FrameList
from hsbench.schema.poses import PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.viz.clip import write_clip
from hsbench.viz.frames import CAPTION_PX, annotated, joint_pixels
from hsbench.viz.rerun_log import write_rerun

CAMERA = PinholeCamera(160, 120, 110.0, 110.0, 80.0, 60.0)
SENSOR = Sensor("rgbd", CAMERA, 1.6, 0.2)


def one_pose(joints_m: Any = None, joints_px: Any = None, timestamp_ns: int = 0) -> PoseTable:
    """One pose with all joints tracked."""
    return PoseTable(
        "coco-18",
        np.array([timestamp_ns]),
        np.ones(1, dtype=np.int32),
        np.full((1, 18), 2, dtype=np.uint8),
        None if joints_m is None else joints_m.astype(np.float32),
        None if joints_px is None else joints_px.astype(np.float32),
    )


def grey(timestamp_ns: int = 0, depth: bool = False) -> Frame:
    rgb = np.full((120, 160, 3), 90, dtype=np.uint8)
    return Frame(timestamp_ns, rgb, np.full((120, 160), 2.0, np.float32) if depth else None)


def episode(poses: PoseTable | None, *frames: Frame, sensor: Sensor = SENSOR) -> Episode:
    return Episode("e", "test", sensor, FrameList(frames), poses, 0, 10_000_000_000)


def test_3d_joints_are_drawn_where_the_camera_sees_them() -> None:
    pixels = np.random.default_rng(0).uniform((20, 20), (140, 100), (1, 18, 2))
    depth_m = np.random.default_rng(1).uniform(1.5, 4.0, (1, 18))
    rays = np.stack([(pixels[..., 0] - 80) / 110, (pixels[..., 1] - 60) / 110, np.ones((1, 18))], axis=-1)
    poses = one_pose(joints_m=apply(SENSOR.world_T_camera, rays * depth_m[..., None]))
    assert np.abs(joint_pixels(poses, SENSOR) - pixels).max() < 1e-3
    drawn = annotated(episode(poses, grey()), 0, 120)
    changed = (drawn[:120] != 90).any(axis=-1)
    at = pixels[0].astype(int)
    assert changed[at[:, 1], at[:, 0]].all()


def test_joints_from_above_need_no_camera_height() -> None:
    joints = np.zeros((1, 18, 3))
    joints[0, :, :2] = (1.0, -0.5)
    sensor = Sensor("topdown", TopDownCamera(64, 64, 0.1), None)
    assert np.allclose(joint_pixels(one_pose(joints_m=joints), sensor), (37.0, 22.0))


def test_poses_of_another_time_are_not_drawn() -> None:
    pixels = np.full((1, 18, 2), 50.0)
    near, far = (
        annotated(episode(one_pose(None, pixels, t), grey()), 0, 120)[:120] for t in (400_000_000, 600_000_000)
    )
    assert (near != 90).any()
    assert (far == 90).all()


def test_a_bone_across_the_seam_of_a_360_picture_is_not_drawn_through_it() -> None:
    pixels = np.full((1, 18, 2), 60.0)
    pixels[0, ::2, 0], pixels[0, 1::2, 0] = 5.0, 235.0
    sensor = Sensor("equirectangular", EquirectangularCamera(240, 120), None)
    frame = Frame(0, np.full((120, 240, 3), 90, dtype=np.uint8))
    drawn = annotated(episode(one_pose(None, pixels), frame, sensor=sensor), 0, 120)[:120]
    changed = (drawn != 90).any(axis=-1)
    assert changed[:, :12].any()
    assert changed[:, 228:].any()
    assert not changed[:, 20:220].any()


def test_a_frame_shows_rgb_depth_and_time() -> None:
    with_depth = annotated(episode(None, grey(depth=True)), 0, 60)
    assert with_depth.shape == (60 + CAPTION_PX, 80 + 6 + 80, 3)
    assert (with_depth[60:] < 100).any(), "the time is written below"
    with pytest.raises(DataError, match="frame 0 has neither rgb nor depth"):
        annotated(episode(None, Frame(0)), 0, 60)


@pytest.mark.parametrize("suffix", [".webp", ".mp4"])
def test_a_clip_holds_its_frames_in_order(tmp_path: Path, suffix: str) -> None:
    shades = (40, 90, 140, 190, 240)
    path = tmp_path / f"clip{suffix}"
    write_clip(path, (np.full((65, 97, 3), shade, dtype=np.uint8) for shade in shades), 5.0)
    if suffix == ".webp":
        found, animation = cv2.imreadanimation(str(path))
        assert found
        pictures, expected_ms = list(animation.frames), 200
        assert set(animation.durations) == {expected_ms}
    else:
        video = cv2.VideoCapture(str(path))
        assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(5.0)
        pictures = []
        while (read := video.read())[0]:
            pictures.append(read[1])
    assert len(pictures) == len(shades)
    for picture, shade in zip(pictures, shades, strict=True):
        assert picture.shape[:2] == (64, 96)
        assert abs(float(picture[..., :3].mean()) - shade) < 6
    assert list(tmp_path.iterdir()) == [path]


def test_a_clip_says_what_it_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"ends in \.gif; expected \.webp or \.mp4"):
        write_clip(tmp_path / "a.gif", [], 5.0)
    with pytest.raises(DataError, match="no picture"):
        write_clip(tmp_path / "a.webp", [], 5.0)
    assert not list(tmp_path.iterdir())


def test_rerun_is_asked_for_by_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "rerun":
            raise ModuleNotFoundError("No module named 'rerun'", name="rerun")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"needs rerun.*hsbench\[viz\]"):
        write_rerun(tmp_path / "e.rrd", episode(None, grey()))
    assert not list(tmp_path.iterdir())


def test_view_draws_a_data_set_and_an_episode_alike(
    rgbd: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = load(rgbd)[0]
    options = ["--pictures", "2", "--height", "64", "--clip", "none"]
    assert run(["view", str(rgbd), "--out", str(tmp_path / "a"), *options]) == 0
    assert run(["view", str(rgbd / "episodes" / first.episode_id), "--out", str(tmp_path / "b"), *options]) == 0
    pages = [tmp_path / name / f"{first.episode_id}.png" for name in "ab"]
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert cv2.imread(str(pages[0])).std() > 20
    capsys.readouterr()
    assert run(["view", str(rgbd), "--episode", "nobody"]) == 2
    assert "no episode 'nobody'" in capsys.readouterr().err
