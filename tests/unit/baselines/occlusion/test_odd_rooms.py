"""Rooms that give a method little: bare ones, nobody there, nobody seated, no depth, one frame. Answers are defined."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsbench import load
from hsbench.baselines.method import Predictor, Settings
from hsbench.baselines.occlusion.action import Activity, recognise
from hsbench.baselines.occlusion.boundary import estimate_boundary
from hsbench.baselines.occlusion.config import CarveConfig
from hsbench.baselines.occlusion.methods import METHODS
from hsbench.baselines.occlusion.shuffle import shuffled_activity
from hsbench.baselines.occlusion.up_axis import USUAL_HEIGHT_M, sensor_from_depth
from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.schema.episode import Episode, Frame, FrameList
from hsbench.schema.poses import JointState, PoseTable
from hsbench.schema.sensor import Sensor
from hsbench.schema.skeletons import COCO_18, KINECT_V2
from hsbench.schema.states import Action
from hsbench.tasks.scene_completion import GRID

SENSOR = Sensor("rgbd", PinholeCamera(160, 120, 113.0, 113.0, 80.0, 60.0), 1.6, 0.35)
NEVER = Activity(np.empty((0, 2)), np.empty(0, np.uint8), np.empty(0))
LOW, HIGH = np.array([-0.2, -1.8, 0.0]), np.array([4.0, 1.8, 2.5])
SCREEN_M = 0.8
WALL_M = 0.05 * np.sqrt(3.0) / 2.0 + 0.05  # what a voxel whose centre is counted as surface may reach into the room


def room_depth(screen: bool = False) -> np.ndarray:
    """(h, w) depth of a room without anything in it, or with a thin screen across that hides what is behind."""
    rays, eye = SENSOR.camera.rays() @ SENSOR.world_T_camera[:3, :3].T, SENSOR.world_T_camera[:3, 3]
    with np.errstate(divide="ignore"):
        walls = np.min((np.where(rays > 0, HIGH, LOW) - eye) / rays, axis=-1, where=rays != 0, initial=np.inf)
    at_screen = SCREEN_M / rays[..., 0]
    hidden = screen & (at_screen > 0) & (eye[2] + at_screen * rays[..., 2] < 1.4)
    return np.where(hidden, np.minimum(at_screen, walls), walls)


def frames(depth_m: np.ndarray) -> FrameList:
    return FrameList((Frame(0, None, depth_m.astype(np.float32)),))


def walkers(count: int, state: JointState = JointState.TRACKED, seated: bool = False) -> PoseTable:
    """Upright Kinect skeletons that cross the room, 30 a second; seated ones have their knees at the height of hips."""
    joints = np.zeros((count, len(KINECT_V2.names), 3), np.float32)
    joints[:, :, 0] = np.linspace(1.0, 3.0, count)[:, None]
    for name, height in {"head": 1.6, "neck": 1.45, "spine_base": 0.95, "hip": 0.92, "knee": 0.5}.items():
        for j, joint in enumerate(KINECT_V2.names):
            if joint.startswith(name):
                joints[:, j, 2] = height - 0.45 * (seated and name != "knee")
    joints[:, [KINECT_V2.index(f"knee_{side}") for side in ("left", "right")], 0] += 0.4 * seated
    if state == JointState.MISSING:
        joints[:] = np.nan
    stamps = np.arange(count, dtype=np.int64) * 33_333_333
    states = np.full(joints.shape[:2], state, np.uint8)
    return PoseTable(KINECT_V2.name, stamps, np.ones(count, np.int32), states, joints)


@pytest.fixture(scope="module")
def settings(rgbd: Path) -> Settings:
    return Settings(load(rgbd, "val"), load(rgbd, "train", truth=True))


@pytest.fixture(scope="module")
def predictors(settings: Settings) -> dict[str, Predictor]:
    return {name: method.prepare(settings) for name, method in METHODS.items()}


@pytest.fixture(scope="module")
def bare(settings: Settings) -> Episode:
    return replace(settings.data[0], sensor=SENSOR, frames=frames(room_depth()), poses=walkers(60), truth=None)


SCREENED, BLIND = frames(room_depth(screen=True)), frames(np.zeros((120, 160)))
FREEING = {
    "nobody sits": {"poses": walkers(300), "frames": SCREENED},
    "all sit": {"poses": walkers(300, seated=True), "frames": SCREENED},
}
CASES = FREEING | {
    "bare room": {},
    "nobody": {"poses": walkers(0), "frames": SCREENED},
    "one pose": {"poses": walkers(1), "frames": SCREENED},
    "nothing tracked": {"poses": walkers(300, JointState.INFERRED), "frames": SCREENED},
    "joints missing": {"poses": walkers(300, JointState.MISSING), "frames": SCREENED},
    "no depth": {"frames": BLIND},
    "no depth, nobody": {"poses": walkers(0), "frames": BLIND},
}


@pytest.mark.parametrize("case", CASES)
def test_every_method_answers_between_what_is_seen_and_all_solid(
    predictors: dict[str, Predictor], bare: Episode, case: str
) -> None:
    episode = replace(bare, **CASES[case])
    found = {name: answer(episode) for name, answer in predictors.items() if not METHODS[name].oracle}
    for name, answer in found.items():
        assert (answer.shape, answer.dtype) == (GRID.shape, bool)
        if name != "best-constant":
            assert (found["visible-only"] <= answer).all(), name
            assert (answer <= found["all-solid"]).all(), name
    # Nothing is freed where nobody was, nor where everything is seen.
    assert (found["all-solid"] & ~found["carve"]).any() == (case in FREEING)
    assert found["all-solid"].any() == (not case.startswith("no depth"))


def test_a_bare_room_is_empty_within_its_walls(predictors: dict[str, Predictor], bare: Episode) -> None:
    solid = predictors["all-solid"](bare)
    centres = GRID.centres()
    within = ((centres > LOW + WALL_M) & (centres < HIGH - WALL_M)).all(axis=-1)
    assert within.sum() > 50_000
    assert not solid[within].any()


def test_nobody_who_sits_leaves_no_seat(predictors: dict[str, Predictor], bare: Episode) -> None:
    screened = replace(bare, **FREEING["nobody sits"])
    carved = predictors["carve"](screened)
    assert set(recognise(walkers(300), CarveConfig()).action) == {Action.STAND}
    assert set(recognise(walkers(300, seated=True), CarveConfig()).action) == {Action.SIT}
    # What is freed is whole columns from the lowest hidden voxel up.
    freed = predictors["all-solid"](screened) & ~carved
    low = GRID.axis_centres(2) <= CarveConfig().stand_top_m
    assert freed.any()
    assert not (carved & ~predictors["visible-only"](screened))[freed.any(axis=2)][:, low].any()


def test_truth_without_people_frees_nothing(settings: Settings, predictors: dict[str, Predictor]) -> None:
    episode = replace(settings.data, truth=True)[0]
    assert episode.truth is not None
    assert episode.truth.poses is not None
    true = episode.truth.poses
    nobody = replace(
        true, poses=true.poses.select(np.zeros(len(true.poses), bool)), action=true.action[:0], match=true.match[:0]
    )
    none_seen = replace(episode, poses=walkers(0), truth=replace(episode.truth, poses=nobody, events=None))
    answer = predictors["carve-true-poses"](none_seen)
    assert np.array_equal(answer, predictors["all-solid"](episode))


def test_true_poses_count_until_the_watching_ends(settings: Settings, predictors: dict[str, Predictor]) -> None:
    """An oracle is handed all true poses of an episode that is cut short."""
    episode = replace(settings.data, truth=True)[0]
    predict, solid = predictors["carve-true-poses"], predictors["all-solid"](episode)
    freed = [int((solid & ~predict(episode.until(seconds))).sum()) for seconds in (0.0, 6.0, episode.duration_s)]
    assert freed[0] == 0
    assert freed[1] < freed[2]


def test_activity_of_an_empty_room_can_be_shuffled() -> None:
    nothing = estimate_boundary(SENSOR, np.zeros((120, 160)), None)
    room = estimate_boundary(SENSOR, room_depth(), walkers(60))
    for ours, theirs in ((nothing, room), (room, nothing), (nothing, nothing)):
        moved = shuffled_activity(NEVER, theirs, ours, np.random.default_rng(0))
        assert (moved.position.shape, len(moved.action), len(moved.pelvis_m)) == ((0, 2), 0, 0)


def test_a_sensor_without_depth_is_level() -> None:
    found = sensor_from_depth(SENSOR.camera, np.zeros((120, 160)))
    assert (found.height_m, found.tilt_rad, found.roll_rad) == (USUAL_HEIGHT_M, 0.0, 0.0)


def test_poses_in_pixels_are_refused() -> None:
    joints = np.zeros((2, len(COCO_18.names), 2), np.float32)
    poses = PoseTable(
        COCO_18.name,
        np.arange(2),
        np.ones(2, np.int32),
        np.full((2, len(COCO_18.names)), 2, np.uint8),
        joints_px=joints,
    )
    with pytest.raises(SchemaError, match="poses are 'coco-18'; expected joints of kinect-v2-25 in metres"):
        recognise(poses, CarveConfig())
