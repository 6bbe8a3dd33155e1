"""Neither the direction of the walls nor the size of the room can be read off the episode frame or the camera in it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import kstest, spearmanr

from hsbench.geometry.transforms import invert
from hsbench.io.resources import resource
from hsbench.schema import Room, Scene, Sensor
from hsbench.schema.codec import sensor_to_json
from hsbench.synth.activity_maps import MapConfig
from hsbench.synth.activity_maps.samples import _place_camera as place_stand
from hsbench.synth.all_sensors import AllSensorsSettings
from hsbench.synth.assemble import scene_in
from hsbench.synth.config import settings
from hsbench.synth.panorama import PanoramaSettings
from hsbench.synth.placement import HEADROOM_M, CameraConfig, SphereConfig, place_camera, place_sphere
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.rooms import RoomConfig
from hsbench.synth.seeds import Seeds
from hsbench.synth.timelapse import TimelapseSettings

EPISODES = 500
LEAST_P = 0.01  # the seeds are fixed: a test that passes always passes

Placed = tuple[np.ndarray, Sensor | None]
"""(scene_T_episode (4, 4), the sensor as published but for the height of a 360 camera)."""


def config(name: str) -> dict[str, Any]:
    return tomllib.loads((resource("generators") / name / "config.toml").read_text(encoding="utf-8"))


class Cameras(NamedTuple):
    """How the recipes set up their sensors."""

    rgbd: CameraConfig
    sphere: SphereConfig
    timelapse: CameraConfig
    every_rgbd: CameraConfig
    every_sphere: SphereConfig
    ordinary: CameraConfig
    security: CameraConfig
    maps: MapConfig


@cache
def cameras() -> Cameras:
    every = AllSensorsSettings.of(config("all-sensors"), "train")
    return Cameras(
        RgbdSettings.of(config("rgbd-activity"), "train").camera,
        PanoramaSettings.of(config("activity-360"), "train").camera,
        TimelapseSettings.of(config("timelapse-activity"), "train").common.camera,
        every.rgbd.camera,
        every.sphere.camera,
        every.timelapse.camera,
        every.security.camera,
        settings(MapConfig, config("activity-maps")["maps"], "maps"),
    )


def stands(scene: Scene) -> Any:
    """Where the camera of an activity map may stand, as far as placing it asks."""
    return SimpleNamespace(stands_xy=scene.rooms[0].outline_xy.mean(axis=0) + np.linspace(-1, 1, 22).reshape(11, 2))


PLACED: dict[str, Callable[[Scene, Seeds], Placed]] = {
    "rgbd-activity": lambda scene, unit: place_camera("rgbd", scene, cameras().rgbd, unit.rng("rgbd-camera")),
    "activity-360": lambda scene, unit: place_sphere(scene, cameras().sphere, unit.rng("sphere-camera")),
    "timelapse-activity": lambda scene, unit: place_camera(
        "monocular", scene, cameras().timelapse, unit.rng("timelapse-camera")
    ),
    "all-sensors": lambda scene, unit: place_camera("rgbd", scene, cameras().every_rgbd, unit.rng("rgbd-camera")),
    "all-sensors-360": lambda scene, unit: place_sphere(scene, cameras().every_sphere, unit.rng("sphere-camera")),
    "all-sensors-timelapse": lambda scene, unit: place_camera(
        "monocular", scene, cameras().ordinary, unit.rng("timelapse-camera")
    ),
    "all-sensors-security": lambda scene, unit: place_camera(
        "monocular", scene, cameras().security, unit.rng("security-camera")
    ),
    "activity-maps": lambda scene, unit: (
        place_stand(stands(scene), cameras().maps, unit.child("activity-maps").child(0).rng("camera"))[0],
        None,
    ),
}
"""Scene and node of a unit -> place and sensor, by recipe and sensor. A map has no sensor of its own to publish; the
view from above has the frame of the 360 camera beside it.
"""

every_sensor = pytest.mark.parametrize("name", PLACED)


def empty(width_m: float, depth_m: float, height_m: float) -> Scene:
    outline = np.array([[0.0, 0.0], [width_m, 0.0], [width_m, depth_m], [0.0, depth_m]])
    return Scene("s", (Room("living", outline),), height_m, ())


def unit(number: int) -> Seeds:
    """The node of a unit, as ``hsbench generate`` makes it."""
    return Seeds(0).child("scene").child(number)


def heading(scene_T_episode: np.ndarray) -> float:
    return math.atan2(scene_T_episode[1, 0], scene_T_episode[0, 0])


def assert_uniform(yaw: np.ndarray) -> None:
    """Yaw modulo 90 degrees: no departure of its distribution, nor of its first three harmonics (Rayleigh's test)."""
    quarter = np.mod(yaw, math.pi / 2) / (math.pi / 2)
    assert kstest(quarter, "uniform").pvalue > LEAST_P
    for harmonic in (1, 2, 3):
        length = abs(np.exp(2j * math.pi * harmonic * quarter).mean())
        assert math.exp(-len(quarter) * length**2) > LEAST_P


def test_the_test_of_uniformity_finds_what_it_should() -> None:
    drawn = np.random.default_rng(0).uniform(-math.pi, math.pi, EPISODES)
    assert_uniform(drawn)
    for biased in (np.zeros(EPISODES), np.round(drawn, 0), np.where(np.arange(EPISODES) % 3 == 0, 0.3, drawn)):
        with pytest.raises(AssertionError):
            assert_uniform(biased)


@every_sensor
def test_heading_and_sensor_know_nothing_of_the_room(name: str) -> None:
    """Exactly: in a room of another size the same unit has the same heading, and publishes the same camera.

    The lowest ceiling here leaves every camera its headroom; under a lower one it hangs lower.
    """
    place = PLACED[name]
    rooms = [empty(*size) for size in ((3.6, 3.4, 3.2), (6.0, 3.4, 2.9), (9.0, 12.0, 2.6))]
    for number in range(12):
        placed = [place(room, unit(number)) for room in rooms]
        assert len({heading(pose) for pose, _ in placed}) == 1
        assert len({str(None if sensor is None else sensor_to_json(sensor)) for _, sensor in placed}) == 1


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n == "all-sensors-security" else []) for n in PLACED],
)
def test_headings_are_uniform_modulo_a_right_angle(name: str) -> None:
    room = empty(2.2, 2.0, 2.6)
    assert_uniform(np.array([heading(PLACED[name](room, unit(number))[0]) for number in range(EPISODES)]))


@pytest.mark.parametrize(
    "camera", ["rgbd", "sphere", "timelapse", "every_rgbd", "every_sphere", "ordinary", "security"]
)
def test_no_ceiling_cuts_the_height_of_a_camera(camera: str) -> None:
    """A height that is cut is the ceiling's less the headroom, and tells it."""
    assert getattr(cameras(), camera).height_m[1] <= RoomConfig().ceiling_m[0] - HEADROOM_M


# ---------------------------------------------------------------- rooms as they are generated


class Sample(NamedTuple):
    """An episode's truth, and the numbers that its description publishes."""

    wall_yaw: float
    size_m: tuple[float, float, float]
    area_m2: float
    published: tuple[float, ...]


@pytest.fixture(scope="session")
def scenes() -> list[Scene]:
    rooms = RgbdSettings.of(config("rgbd-activity"), "train")
    return [rooms.scene(f"scene-{number:06d}", unit(number).child("room")) for number in range(EPISODES)]


def sample(name: str, scene: Scene, number: int) -> Sample:
    """What there is of a unit without its life and pictures."""
    scene_T_episode, sensor = PLACED[name](scene, unit(number))
    seen = scene_in(invert(scene_T_episode), scene)
    corners = seen.rooms[0].outline_xy
    along = np.roll(corners, -1, axis=0) - corners
    yaw = np.arctan2(along[:, 1], along[:, 0])
    assert np.abs(np.exp(4j * yaw) - np.exp(4j * yaw[0])).max() < 0.01  # every wall says the same
    width_m, depth_m = np.ptp(scene.rooms[0].outline_xy, axis=0)
    told = () if sensor is None or sensor.kind == "equirectangular" else (sensor.height_m, sensor.tilt_rad)
    return Sample(float(yaw[0]), (width_m, depth_m, scene.height_m), scene.rooms[0].area_m2, told)


@pytest.mark.slow
@every_sensor
def test_walls_of_generated_rooms_lie_anyhow_and_no_number_tells_their_size(name: str, scenes: list[Scene]) -> None:
    samples = [sample(name, scene, number) for number, scene in enumerate(scenes)]
    assert_uniform(np.array([s.wall_yaw for s in samples]))
    sizes = np.array([(*s.size_m[:2], s.area_m2) for s in samples])
    for number in np.array([s.published for s in samples]).T:
        for size in sizes.T:
            assert spearmanr(number, size).pvalue > LEAST_P
        quarter = np.array([s.wall_yaw for s in samples]) * 4
        for wave in (np.cos(quarter), np.sin(quarter)):
            assert spearmanr(number, wave).pvalue > LEAST_P
