"""Time-lapse episodes: poses at the times of pictures only, days and people by seed, truth of the view."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import SchemaError
from hsbench.io.changing_light import ChangingLight
from hsbench.io.episodes import read_episode, write_episode
from hsbench.io.frame_store import Film, Patch, Picture
from hsbench.io.splits import read_splits
from hsbench.schema import Episode, JointState
from hsbench.schema.occupancy import VIEW_UNSCORED
from hsbench.schema.states import Affordance
from hsbench.synth.activities import live
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Unit, find_recipe
from hsbench.synth.relit_room import display_table
from hsbench.synth.seeds import Seeds
from hsbench.synth.timelapse import TimelapseConfig, TimelapseSettings, sparse_life, timelapse_episode
from tests.unit.synth.living_rooms import living_room

CONFIG = find_recipe("timelapse-activity").config
SCENE = living_room(0)
NUMBER = 10001
MINUTES = 3


def settings() -> TimelapseSettings:
    """As the recipe's, but short, and people come at once."""
    made = TimelapseSettings.of(CONFIG, "val")
    life = replace(made.common.life, duration_s=60.0 * MINUTES, arrival_s=(5.0, 20.0))
    return replace(made, common=replace(made.common, life=life), timelapse=replace(made.timelapse, people=(2, 2)))


@cache
def episode(seed: int = 0) -> Episode:
    unit = Unit(Seeds(seed).child("scene").child(NUMBER), NUMBER, "val", "none", None)
    made = settings()
    scene_T_episode, sensor = place_rgbd(SCENE, made.common.camera, unit.seeds.rng("timelapse-camera"))
    sensor = replace(sensor, kind="monocular")
    return timelapse_episode(unit, "timelapse-activity", SCENE, scene_T_episode, sensor, made)


def test_poses_are_at_the_times_of_pictures_in_pixels() -> None:
    found = episode()
    truth = found.truth
    assert truth is not None
    assert truth.poses is not None
    assert found.poses is not None
    times = np.arange(2 * MINUTES) * 30 * 10**9
    assert set(truth.poses.poses.timestamp_ns) <= set(times)
    assert (np.unique(truth.poses.poses.timestamp_ns)[:5] == times[:5]).all()  # from t0 on
    assert set(found.poses.timestamp_ns) <= set(times)
    assert found.poses.skeleton == "coco-18"
    assert found.poses.joints_m is None
    assert found.poses.joints_px is not None
    seen = found.poses.joint_state != JointState.MISSING
    assert (found.poses.joints_px[seen] < [640, 480]).all()
    assert (found.poses.joints_px[seen] >= 0).all()
    assert found.end_ns == 60 * MINUTES * 10**9


def test_kept_poses_are_those_of_the_whole_life() -> None:
    config = replace(settings().common.life, people=2)
    times = np.arange(2 * MINUTES, dtype=np.int64) * 30 * 10**9
    sparse, whole = sparse_life(SCENE, Seeds(3), config, times), live(SCENE, Seeds(3), config)
    rows = np.isin(whole.poses.timestamp_ns, times)
    assert np.array_equal(sparse.poses.joints_m, whole.poses.joints_m[rows])
    assert np.array_equal(sparse.poses.track_id, whole.poses.track_id[rows])
    assert np.array_equal(sparse.action, whole.action[rows])
    assert sparse.events.activity == whole.events.activity
    assert np.array_equal(sparse.motions.timestamp_ns, whole.motions.timestamp_ns)


def test_truth_has_the_view_of_the_camera() -> None:
    truth = episode().truth
    assert truth is not None
    view = truth.view_affordance
    assert view is not None
    assert view.shape == (480, 640)
    assert (view & 1 << Affordance.WALKABLE).any()
    assert np.mean(view & VIEW_UNSCORED > 0) < 0.3
    assert truth.occupancy is None


def test_an_episode_on_disk_gives_back_view_noise_and_light(tmp_path: Path) -> None:
    """Pictures made up: what frames hold is the business of other tests."""
    rng = np.random.default_rng(0)
    lights = tuple(rng.integers(0, 5000, (8, 6, 3), dtype=np.uint16) for _ in range(2))
    ones = np.ones((3, 2, 3), dtype=np.float32)
    light = ChangingLight(lights, ones, np.array([0.5, 1.0, 30.0], dtype=np.float32), display_table())
    still = Picture(light.rgb(0), np.zeros((8, 6), np.uint16), np.zeros((8, 6), np.uint16))
    nothing = Picture(np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.uint16), np.zeros((0, 0), np.uint16))
    times = np.arange(3, dtype=np.int64) * 30 * 10**9
    patches = [Patch(int(t), 0, 0, np.zeros((0, 0), dtype=bool), nothing) for t in times]
    made = replace(episode(), frames=Film(still, times, patches.__getitem__, 9, "none", False, "camera", light))
    write_episode(tmp_path / "e", made, "scene", "val")
    noisy, clean = (read_episode(tmp_path / "e", truth=True, image_noise=name) for name in (None, "none"))
    assert noisy.truth is not None
    assert made.truth is not None
    assert np.array_equal(noisy.truth.view_affordance, made.truth.view_affordance)
    for k in range(3):
        assert noisy.frames[k].depth_m is None
        assert np.array_equal(noisy.frames[k].rgb, made.frames[k].rgb)
        assert np.array_equal(clean.frames[k].rgb, light.rgb(k))
        assert not np.array_equal(noisy.frames[k].rgb, clean.frames[k].rgb)
    with pytest.raises(SchemaError, match="image noise preset is 'grain'"):
        read_episode(tmp_path / "e", image_noise="grain").frames[0]


def test_the_same_seed_gives_the_same_episode_and_another_another() -> None:
    first, other = episode(), episode(1)
    episode.cache_clear()
    again = episode()
    assert first.poses is not None
    assert again.poses is not None
    assert other.poses is not None
    assert np.array_equal(first.poses.joints_px, again.poses.joints_px, equal_nan=True)
    assert first.poses.joints_px.shape != other.poses.joints_px.shape or not np.array_equal(
        first.poses.joints_px, other.poses.joints_px, equal_nan=True
    )


def test_days_and_people_stay_in_their_ranges() -> None:
    made = TimelapseSettings.of(CONFIG, "train")
    days = [made.day(Seeds(k)) for k in range(200)]
    assert all(25 <= d.latitude_deg <= 60 for d in days)
    assert all(5 <= d.start_hour <= 18 for d in days)
    assert {d.day for d in days} <= set(range(1, 366))
    assert np.ptp([d.north_rad for d in days]) > 6
    lives = [made.life(k, "train", 9.0, Seeds(k)) for k in range(60)]
    assert {life.people for life in lives} == {2, 3, 4}
    assert {(life.start_hour, life.duration_s) for life in lives} == {(9.0, 14400.0)}


def test_eight_scenes_of_val_and_of_each_test_are_long() -> None:
    made = TimelapseSettings.of(CONFIG, "val")
    lengths: dict[str, list[float]] = {}
    for number, split in read_splits("timelapse-activity").numbers("full"):
        lengths.setdefault(split, []).append(made.life(number, split, 9.0, Seeds(0)).duration_s)
    assert {split: (len(n), n.count(43200.0)) for split, n in lengths.items()} == {
        "train": (120, 0),
        "val": (40, 8),
        "test-seen": (30, 8),
        "test-novel": (30, 8),
    }


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("period_s", 0.0, "period_s is 0.0"),
        ("start_hour", (9.0, 25.0), r"start_hour is \(9.0, 25.0\)"),
        ("people", (0, 3), r"people is \(0, 3\)"),
        ("latitude_deg", (50.0, 20.0), r"latitude_deg is \(50.0, 20.0\)"),
    ],
)
def test_settings_out_of_range_are_named(key: str, value: object, message: str) -> None:
    with pytest.raises(SchemaError, match=message):
        TimelapseConfig(**{key: value})  # type: ignore[arg-type]
