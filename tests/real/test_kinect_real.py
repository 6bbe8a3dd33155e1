"""The Kinect CSV reader on four recordings of the LabanotationSuite (MIT, never part of this project).

Looked for in ``$HSBENCH_REALDATA``, else in ``../shared/realdata`` beside the checkout.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from hsbench.datasets.importers import kinect_csv
from hsbench.errors import DataError
from hsbench.typing import FloatArray

REALDATA = Path(os.environ.get("HSBENCH_REALDATA", Path(__file__).parents[3] / "shared" / "realdata"))
SKELETON = REALDATA / "skeleton"
pytestmark = pytest.mark.skipif(
    not SKELETON.is_dir(), reason=f"needs the real captures in {SKELETON} (set HSBENCH_REALDATA)"
)

STANDING = ("Ges01_wavehand", "Ges04_comehere", "Ges05_demopoint")
NEAR = "joints"
NECK, HEAD = 2, 3
LEFT_SHOULDER, LEFT_WRIST, RIGHT_SHOULDER, RIGHT_WRIST = 4, 6, 8, 10
ANKLES, FEET = [14, 18], [15, 19]
# Joint pair: shortest and longest length, in metres, of an adult.
UPPER_BONES = {
    **{(0, 1): (0.2, 0.4), (1, 20): (0.15, 0.35), (2, 3): (0.08, 0.25), (4, 8): (0.28, 0.5)},
    **{(4, 5): (0.2, 0.36), (8, 9): (0.2, 0.36), (5, 6): (0.18, 0.32), (9, 10): (0.18, 0.32)},
}
LEGS = {(12, 13): (0.28, 0.55), (16, 17): (0.28, 0.55), (13, 14): (0.28, 0.5), (17, 18): (0.28, 0.5)}


def read(name: str) -> kinect_csv.KinectRecording:
    return kinect_csv.read_kinect_csv(SKELETON / f"laban_kinect2_{name}.csv")


def in_episode(name: str) -> FloatArray:
    recording = read(name)
    return kinect_csv.to_episode_frame(recording.joints_kinect_m, *kinect_csv.estimate_camera(recording))


@pytest.mark.parametrize(
    ("name", "frames", "seconds"),
    [("Ges01_wavehand", 154, 5.17), ("Ges04_comehere", 172, 5.87), ("Ges05_demopoint", 190, 6.37), (NEAR, 371, 12.40)],
)
def test_length_and_rate(name: str, frames: int, seconds: float) -> None:
    recording = read(name)
    assert recording.joints_kinect_m.shape == (frames, 25, 3)
    assert recording.state.shape == (frames, 25)
    time_s = recording.timestamp_ns * 1e-9
    assert abs(time_s[-1] - time_s[0] - seconds) < 0.01
    assert abs(np.median(np.diff(time_s)) - 1 / 30) < 0.001
    assert np.diff(time_s).min() > 0.03
    assert (recording.state > 0).all()
    assert np.isfinite(recording.joints_kinect_m).all()


@pytest.mark.parametrize("name", [*STANDING, NEAR])
def test_bones_are_human_and_stable(name: str) -> None:
    recording = read(name)
    for (a, b), (low, high) in (UPPER_BONES if name == NEAR else UPPER_BONES | LEGS).items():
        tracked = (recording.state[:, [a, b]] == kinect_csv.TRACKED).all(axis=1)
        assert tracked.mean() > 0.5
        length = np.linalg.norm(recording.joints_kinect_m[:, a] - recording.joints_kinect_m[:, b], axis=1)[tracked]
        assert low < np.median(length) < high
        # The sensor fits no fixed skeleton: a limb that points at it is a fifth too short or too long.
        assert np.mean(np.abs(length / np.median(length) - 1.0) < 0.2) > 0.8
        assert np.median(np.abs(np.diff(length))) < 0.006


@pytest.mark.parametrize("name", [*STANDING, NEAR])
def test_a_person_who_faces_the_sensor_has_left_at_smaller_sdk_x(name: str) -> None:
    joints_kinect = read(name).joints_kinect_m
    assert (joints_kinect[:, LEFT_SHOULDER, 0] < joints_kinect[:, RIGHT_SHOULDER, 0]).all()
    joints_camera = kinect_csv.to_camera_frame(joints_kinect)
    assert (joints_camera[:, LEFT_SHOULDER, 0] > joints_camera[:, RIGHT_SHOULDER, 0]).all()
    assert (joints_camera[:, HEAD, 1] < joints_camera[:, 0, 1]).mean() > 0.95


@pytest.mark.parametrize("name", STANDING)
def test_left_is_left_of_where_the_toes_point(name: str) -> None:
    episode = in_episode(name)
    toes = (episode[:, FEET] - episode[:, ANKLES]).mean(axis=1)
    leftward = np.cross([0.0, 0.0, 1.0], toes)
    assert ((leftward * (episode[:, LEFT_SHOULDER] - episode[:, RIGHT_SHOULDER])).sum(axis=1) > 0).all()
    assert (toes[:, 0] < 0).all()  # they face the sensor


@pytest.mark.parametrize("name", STANDING)
def test_a_standing_person_stands_on_the_floor(name: str) -> None:
    height_m, tilt_rad = kinect_csv.estimate_camera(read(name))
    assert 0.8 < height_m < 1.8
    assert 0.0 < np.rad2deg(tilt_rad) < 10.0
    episode = in_episode(name)
    assert (episode[:, HEAD, 2] > episode[:, NECK, 2]).all()
    assert (episode[:, NECK, 2] > episode[:, FEET, 2].max(axis=1) + 1.0).all()
    assert (np.abs(episode[:, FEET, 2].min(axis=1)) < 0.05).all()
    assert ((episode[:, ANKLES, 2] > -0.02) & (episode[:, ANKLES, 2] < 0.2)).all()
    assert 1.3 < np.median(episode[:, HEAD, 2]) < 2.0
    assert (np.abs(episode[:, 0, 0] - 2.75) < 0.3).all()


def test_one_sensor_in_one_place_is_estimated_alike() -> None:
    estimates = np.array([kinect_csv.estimate_camera(read(name)) for name in STANDING])
    assert np.ptp(estimates[:, 0]) < 0.1
    assert np.ptp(np.rad2deg(estimates[:, 1])) < 2.0


def test_a_person_near_the_sensor_shows_no_floor() -> None:
    with pytest.raises(DataError, match="give the sensor's height and tilt"):
        kinect_csv.estimate_camera(read(NEAR))


@pytest.mark.parametrize(
    ("name", "moving", "resting"),
    [
        ("Ges01_wavehand", RIGHT_WRIST, LEFT_WRIST),
        ("Ges04_comehere", LEFT_WRIST, RIGHT_WRIST),
        ("Ges05_demopoint", RIGHT_WRIST, LEFT_WRIST),
    ],
)
def test_the_gesture_moves_the_hand_and_not_the_person(name: str, moving: int, resting: int) -> None:
    episode = in_episode(name)
    path_m = np.linalg.norm(np.diff(episode, axis=0), axis=-1).sum(axis=0)
    assert path_m[moving] > 1.5 * path_m[resting]
    assert np.ptp(episode[:, moving, 2]) > 0.5
    assert np.ptp(episode[:, 0], axis=0).max() < 0.15
    if name == "Ges01_wavehand":
        assert episode[:, moving, 2].max() > episode[:, HEAD, 2].max()
        assert path_m[resting] < 0.5
