"""The readers of recorded poses on real files (never part of this project), and damaged copies of them.

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout. Pictures of what was checked go
to the tests' own folders (``--basetemp`` keeps them).
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsbench.baselines.occlusion.action import recognise
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.cli.main import run
from hsbench.datasets.dataset import load
from hsbench.datasets.importers import kinect_bodies
from hsbench.datasets.importers.coco_keypoints import read_annotations
from hsbench.datasets.importers.kimore_csv import read_kimore_csv
from hsbench.datasets.importers.ntu_skeleton import read_ntu_skeleton
from hsbench.datasets.importers.openpose import find_scale, read_openpose
from hsbench.datasets.importers.pose2room import read_pose2room, to_kinect
from hsbench.datasets.importers.pose_captures import coco_episodes, ntu_episode, openpose_episode, pose2room_episode
from hsbench.datasets.verify import verify_episode, verify_files
from hsbench.geometry.transforms import apply, invert
from hsbench.schema.poses import JointState, PoseTable
from hsbench.typing import FloatArray, UInt8Array
from tests.unit.datasets.mutations import mutated, refused_or_read

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
pytestmark = pytest.mark.skipif(
    not REALDATA.is_dir(), reason=f"needs the real captures in realdata ({REALDATA}; set HSBENCH_REALDATA)"
)
SKELETON, VIDEO2D = REALDATA / "skeleton", REALDATA / "video2d"
NTU = {
    "S001C001P001R001A011": {
        "frames": 82,
        "people": 1,
        "inferred": 113,
        "focal_px": 366.3,
        "centre_px": (256.3, 208.5),
    },
    "S001C003P008R002A058": {
        "frames": 70,
        "people": 2,
        "inferred": 403,
        "focal_px": 366.4,
        "centre_px": (262.5, 209.8),
    },
}
LEFT_SHOULDER, RIGHT_SHOULDER, LEFT_ANKLE, LEFT_FOOT = 4, 8, 14, 15
# Joint pair: shortest and longest length, in metres, of an adult.
BONES = {
    **{(0, 1): (0.2, 0.4), (1, 20): (0.15, 0.35), (2, 3): (0.08, 0.25), (4, 8): (0.25, 0.5)},
    **{(4, 5): (0.17, 0.36), (8, 9): (0.17, 0.36), (5, 6): (0.15, 0.34), (9, 10): (0.15, 0.34)},
    **{(12, 13): (0.26, 0.55), (16, 17): (0.26, 0.55), (13, 14): (0.26, 0.52), (17, 18): (0.26, 0.52)},
}


def median_bones(joints_m: FloatArray, state: UInt8Array) -> dict[tuple[int, int], float]:
    """Median length of every bone of ``BONES`` whose ends are tracked in at least a tenth of the rows."""
    found = {}
    for a, b in BONES:
        tracked = (state[:, [a, b]] == JointState.TRACKED).all(axis=1)
        if tracked.mean() >= 0.1:
            found[a, b] = float(np.median(np.linalg.norm(joints_m[tracked, a] - joints_m[tracked, b], axis=1)))
    return found


def draw(path: Path, picture: UInt8Array, poses: PoseTable, joints_px: FloatArray) -> None:
    """Write a picture with every row's bones drawn over it: left limbs red, right ones green."""
    names = poses.layout.names
    for row in joints_px:
        for a, b in poses.layout.bones:
            if np.isfinite(row[[a, b]]).all():
                colour = (0, 0, 255) if "left" in names[b] else (0, 200, 0) if "right" in names[b] else (255, 160, 0)
                cv2.line(picture, *(tuple(map(int, row[j])) for j in (a, b)), colour, 2)
    cv2.imwrite(str(path), picture)
    assert path.stat().st_size > 1000


# NTU RGB+D


@pytest.mark.parametrize("name", NTU)
def test_ntu_figures(name: str) -> None:
    expected = NTU[name]
    bodies = read_ntu_skeleton(SKELETON / f"ntu_{name}.skeleton").bodies
    frames, people = expected["frames"], expected["people"]
    assert bodies.joints_kinect_m.shape == (frames * people, 25, 3)
    assert bodies.track_id.tolist() == list(range(1, people + 1)) * frames
    assert bodies.end_ns == round((frames - 1) / 30 * 1e9)
    assert np.array_equal(bodies.timestamp_ns, np.repeat(np.round(np.arange(frames) / 30 * 1e9), people))
    assert (bodies.state == JointState.INFERRED).sum() == expected["inferred"]
    assert (bodies.state > JointState.MISSING).all()
    x = bodies.joints_kinect_m[..., 0]
    assert (x[:, LEFT_SHOULDER] < x[:, RIGHT_SHOULDER]).all()  # towards the sensor, and mirrored by the SDK
    lengths = median_bones(bodies.joints_kinect_m, bodies.state)
    assert len(lengths) >= 9
    for bone, length in lengths.items():
        assert BONES[bone][0] < length < BONES[bone][1], bone


@pytest.mark.parametrize("name", NTU)
def test_ntu_joints_land_on_their_pixels(name: str, tmp_path: Path) -> None:
    recording = read_ntu_skeleton(SKELETON / f"ntu_{name}.skeleton")
    episode = ntu_episode(recording, name, 1.7, 0.3)
    camera = episode.sensor.camera
    assert abs(camera.fx_px - NTU[name]["focal_px"]) < 0.5
    assert abs(camera.fy_px - NTU[name]["focal_px"]) < 0.5
    mirrored_centre = (512 - 0.5 - camera.cx_px, camera.cy_px - 0.5)
    np.testing.assert_allclose(mirrored_centre, NTU[name]["centre_px"], atol=0.1)
    points = apply(invert(episode.sensor.world_T_camera), episode.poses.joints_m.astype(np.float64))
    pixels, _ = camera.project(points)
    given_px = np.stack([512 - 0.5 - recording.depth_px[..., 0], recording.depth_px[..., 1] + 0.5], axis=-1)
    assert np.abs(pixels - given_px).max() < 0.5
    assert camera.contains(pixels).all()
    # the colour camera lies 5 cm beside the depth camera: one straight line from pixel to pixel, but for parallax
    for axis in (0, 1):
        slope, offset = np.polyfit(recording.depth_px[..., axis].ravel(), recording.colour_px[..., axis].ravel(), 1)
        left = recording.colour_px[..., axis] - slope * recording.depth_px[..., axis] - offset
        assert 2.8 < slope < 3.0
        assert np.abs(left).max() < 8
    assert (recording.colour_px < (1920, 1080)).all()
    assert (recording.colour_px >= 0).all()
    draw(
        tmp_path / f"{name}.png",
        np.full((424, 512, 3), 255, np.uint8),
        episode.poses,
        pixels[:: NTU[name]["frames"] // 4],
    )


def test_ntu_on_the_command_line_is_a_person_who_stands(tmp_path: Path) -> None:
    out = tmp_path / "data"
    recording = SKELETON / "ntu_S001C001P001R001A011.skeleton"
    assert run(["import", "ntu-skeleton", str(recording), "--out", str(out)]) == 0
    episode = load(out, truth=True)[0]
    assert 1.5 < episode.sensor.height_m < 2.0
    feet = np.nanmin(episode.poses.joints_m[:, [15, 19], 2], axis=1)
    assert np.abs(np.median(feet)) < 0.05
    assert 1.3 < np.median(episode.poses.joints_m[:, 3, 2]) < 2.0
    assert len(recognise(episode.poses, CarveConfig()).position) > 0.9 * len(episode.poses)
    assert verify_files(out) == []
    assert verify_episode(episode) == []


# KIMORE


def test_kimore_figures() -> None:
    bodies = read_kimore_csv(SKELETON / "kimore_p2_JointPositionExercise4.csv")
    assert bodies.joints_kinect_m.shape == (1585, 25, 3)
    assert bodies.end_ns == 52_800_000_000
    x = bodies.joints_kinect_m[..., 0]
    assert (x[:, LEFT_SHOULDER] < x[:, RIGHT_SHOULDER]).mean() > 0.99
    for bone, length in median_bones(bodies.joints_kinect_m, bodies.state).items():
        assert BONES[bone][0] < length < BONES[bone][1], bone
    height_m, tilt_rad = kinect_bodies.estimate_camera(bodies)
    assert 1.0 < height_m < 2.0
    assert abs(tilt_rad) < 0.2


# OpenPose


def test_openpose_lies_on_its_photograph(tmp_path: Path) -> None:
    picture = cv2.imread(str(VIDEO2D / "hmr_random.jpg"))
    height_px, width_px = picture.shape[:2]
    found = read_openpose(VIDEO2D / "hmr_random_keypoints.json")
    assert (found.skeleton.name, found.keypoints.shape) == ("coco-18", (2, 18, 3))
    assert find_scale(found.keypoints) == "pixel"
    episode = openpose_episode(found, "photo", "pixel", (width_px, height_px), 1.0)
    poses = episode.poses
    assert (poses.joint_state == JointState.MISSING).sum(axis=1).tolist() == [3, 7]
    assert (poses.joint_state == JointState.TRACKED).sum(axis=1).tolist() == [15, 11]
    seen = poses.joint_state > JointState.MISSING
    assert episode.sensor.camera.contains(poses.joints_px[seen].astype(np.float64)).all()
    assert poses.joints_px[0, 1].tolist() == pytest.approx([447.67 + 0.5, 204.633 + 0.5])
    # both show their backs (no nose, no eyes), so right shoulders are on the right
    assert (poses.joint_state[:, [0, 14, 15]] == JointState.MISSING).all()
    assert (poses.joints_px[:, 2, 0] > poses.joints_px[:, 5, 0]).all()
    neck, knee, ankle = 1, 9, 10
    assert poses.joints_px[0, neck, 1] < poses.joints_px[0, knee, 1] < poses.joints_px[0, ankle, 1]
    draw(tmp_path / "openpose.png", picture, poses, poses.joints_px.astype(np.float64))


# COCO


def test_coco_figures() -> None:
    path = VIDEO2D / "mmpose_coco_test_coco.json"
    found = read_annotations(path)
    assert [(image.image_id, image.width_px, image.height_px) for image in found.images] == [
        (785, 640, 425),
        (40083, 500, 333),
        (196141, 640, 429),
        (197388, 640, 392),
    ]
    assert np.bincount(found.image).tolist() == [1, 2, 4, 5]
    assert (found.crowds, found.unlabelled) == (0, 2)
    listed = [a for a in json.loads(path.read_text())["annotations"] if a["num_keypoints"]]
    order = sorted(range(len(listed)), key=lambda i: listed[i]["image_id"])
    assert [listed[i]["num_keypoints"] for i in order] == (found.state > 0).sum(axis=1).tolist()
    assert found.joints_px[0, 0].tolist() == [367.5, 81.5]
    for row, i in enumerate(order):
        x, y, width, height = listed[i]["bbox"]
        # the box is of what is seen: hidden joints may lie outside; labels are rounded to pixels
        joints = found.joints_px[row][found.state[row] == JointState.TRACKED]
        assert ((joints > (x - 1, y - 1)) & (joints < (x + width + 2, y + height + 2))).all()


def test_coco_photographs_on_the_command_line(tmp_path: Path) -> None:
    out = tmp_path / "data"
    assert run(["import", "coco-keypoints", str(VIDEO2D / "mmpose_coco_test_coco.json"), "--out", str(out)]) == 0
    data = load(out, truth=True)
    assert data.episode_ids == ("000000000785", "000000040083", "000000196141", "000000197388")
    assert [len(episode.poses) for episode in data] == [1, 2, 4, 5]
    assert verify_files(out) == []


def test_coco_left_is_left_of_people_who_face_the_camera(tmp_path: Path) -> None:
    found = read_annotations(VIDEO2D / "mmpose_coco_test_coco.json")
    nose, left_eye, right_eye = 0, 1, 2
    faces = (found.state[:, [nose, left_eye, right_eye]] == JointState.TRACKED).all(axis=1)
    assert faces.sum() >= 5
    assert (found.joints_px[faces, left_eye, 0] > found.joints_px[faces, right_eye, 0]).all()
    for episode in coco_episodes(found):
        camera = episode.sensor.camera
        blank = np.full((camera.height_px, camera.width_px, 3), 255, np.uint8)
        draw(tmp_path / f"{episode.episode_id}.png", blank, episode.poses, episode.poses.joints_px.astype(np.float64))


# Pose2Room


def test_pose2room_figures() -> None:
    sample = read_pose2room(SKELETON / "pose2room_demo_input_joints_1.npy")
    assert sample.joints_m.shape == (341, 53, 3)
    assert sample.was_left_handed
    assert (sample.boxes, sample.room) == ((), None)
    kinect, state = to_kinect(sample.joints_m)
    for (a, b), (low, high) in BONES.items():
        if b == 3:
            continue  # the head is the base of the skull
        lengths = np.linalg.norm(kinect[:, a] - kinect[:, b], axis=1)
        assert low - 0.06 < np.median(lengths) < high, (a, b)  # its spine starts higher
        if (a, b) not in ((4, 8), (1, 20), (0, 1)):
            assert np.ptp(lengths) < 0.01  # one rig
    assert (state > JointState.MISSING).all()


def test_pose2room_people_walk_ahead_with_feet_on_the_floor_and_left_on_their_left(tmp_path: Path) -> None:
    sample = read_pose2room(SKELETON / "pose2room_demo_input_joints_1.npy")
    episode = pose2room_episode(sample, "demo")
    joints = episode.poses.joints_m.astype(np.float64)
    toes = joints[:, [15, 19]] - joints[:, [14, 18]]
    forward = toes.mean(axis=1) * (1, 1, 0)
    leftward = np.cross([0.0, 0.0, 1.0], forward)
    for left, right in ((4, 8), (12, 16), (14, 18)):
        assert ((leftward * (joints[:, left] - joints[:, right])).sum(axis=1) > 0).mean() > 0.95
    step = np.diff(joints[:, 0], axis=0) * (1, 1, 0)
    walking = np.linalg.norm(step, axis=1) > 0.1
    assert walking.sum() > 50
    assert ((step * forward[:-1]).sum(axis=1)[walking] > 0).mean() > 0.9
    assert np.linalg.norm(step, axis=1).max() * 5 < 2.5  # metres a second, at five frames a second
    assert np.abs(joints[:, [15, 19], 2].min(axis=1)).max() < 0.05
    assert (joints[:, 3, 2] > joints[:, 0, 2]).mean() > 0.95
    assert episode.end_ns == 68_000_000_000
    pixels, _ = episode.sensor.camera.project(joints)
    assert episode.sensor.camera.contains(pixels).all()
    plan = np.full((episode.sensor.camera.height_px, episode.sensor.camera.width_px, 3), 255, np.uint8)
    draw(tmp_path / "pose2room.png", plan, episode.poses, pixels[::20])


# damage


def head_of(path: Path, lines: int) -> bytes:
    return b"\n".join(path.read_bytes().split(b"\n")[:lines]) + b"\n"


READERS: dict[str, tuple[Callable[[Path], object], Callable[[], bytes]]] = {
    "skeleton": (
        read_ntu_skeleton,
        lambda: b"3" + head_of(SKELETON / "ntu_S001C003P008R002A058.skeleton", 1 + 3 * (1 + 2 * 27))[2:],
    ),
    "csv": (read_kimore_csv, lambda: head_of(SKELETON / "kimore_p2_JointPositionExercise4.csv", 26)),
    "openpose.json": (read_openpose, lambda: (VIDEO2D / "hmr_random_keypoints.json").read_bytes()),
    "coco.json": (read_annotations, lambda: (VIDEO2D / "mmpose_coco_test_coco.json").read_bytes()),
    "npy": (read_pose2room, lambda: (SKELETON / "pose2room_demo_input_joints_1.npy").read_bytes()),
}


@pytest.mark.parametrize("suffix", READERS)
@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutations_of_real_files_are_read_or_refused(tmp_path: Path, suffix: str, data: st.DataObject) -> None:
    read, content = READERS[suffix]
    sound = content()
    (tmp_path / f"sound.{suffix}").write_bytes(sound)
    read(tmp_path / f"sound.{suffix}")
    refused_or_read(read, tmp_path / f"mutated.{suffix}", data.draw(mutated(sound)))
