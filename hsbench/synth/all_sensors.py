"""One room and one life, filmed by every sensor at once: ids, clock and truth agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.transforms import invert
from hsbench.schema.episode import NS_PER_S, Episode, EpisodeTruth, FrameList
from hsbench.schema.poses import TruePoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.activities import Life, live
from hsbench.synth.assemble import affordance_of, film, filmed_episode, frame_times, poses_in, scene_in
from hsbench.synth.config import settings
from hsbench.synth.detectors import DetectorConfig, detector
from hsbench.synth.film import Filming, room_lighting
from hsbench.synth.panorama import with_tripod
from hsbench.synth.placement import CameraConfig, SphereConfig, camera_config, place_camera, place_sphere
from hsbench.synth.recipes import Unit
from hsbench.synth.rgbd import RgbdConfig, RgbdSettings
from hsbench.typing import FloatArray


@dataclass(frozen=True)
class OverheadConfig:
    """The view from above: squared pixels, their side in metres, and pictures a second."""

    side_px: int = 512
    cell_m: float = 0.025
    frame_rate_hz: float = 2.0

    @property
    def camera(self) -> TopDownCamera:
        """The camera model."""
        return TopDownCamera(self.side_px, self.side_px, self.cell_m)


@dataclass(frozen=True)
class View:
    """A camera beside the RGB-D one: where it stands, what its detector sees, what it records."""

    camera: CameraConfig | SphereConfig
    detector: DetectorConfig
    recording: RgbdConfig


@dataclass(frozen=True)
class AllSensorsSettings:
    """``config.toml`` for one split: the sections of ``rgbd-activity``, [overhead], and [sphere], [timelapse] and
    [security], each with tables camera, poses and recording.
    """

    rgbd: RgbdSettings
    sphere: View
    timelapse: View
    security: View
    overhead: OverheadConfig

    @classmethod
    def of(cls, config: Mapping[str, Any], split: str) -> AllSensorsSettings:
        """Settings for a split. Raises SchemaError naming unknown keys."""

        def view(name: str) -> View:
            table = config[name]
            at = f"{name}.camera"
            camera: CameraConfig | SphereConfig = (
                settings(SphereConfig, table["camera"], at) if name == "sphere" else camera_config(table["camera"], at)
            )
            recording = settings(RgbdConfig, table["recording"], f"{name}.recording")
            return View(camera, detector(table["poses"], f"{name}.poses"), recording)

        return cls(
            RgbdSettings.of(config, split),
            view("sphere"),
            view("timelapse"),
            view("security"),
            settings(OverheadConfig, config["overhead"], "overhead"),
        )


def all_episodes(unit: Unit, dataset: str, config: AllSensorsSettings) -> Iterator[Episode]:
    """The episodes of a unit: of the RGB-D camera, which bears the unit's name, then -360, -timelapse, -security, and
    -overhead, whose frame is that of the 360 camera.
    """
    common = config.rgbd
    scene = common.scene(unit.scene_id, unit.seeds.child("room"))
    sphere_config = config.sphere.camera
    assert isinstance(sphere_config, SphereConfig)
    scene_T_sphere, sphere = place_sphere(scene, sphere_config, unit.seeds.rng("sphere-camera"))
    life = live(with_tripod(scene, scene_T_sphere[:2, 3]), unit.seeds.child("life"), common.life)

    def filmed(scene_T_episode: FloatArray, sensor: Sensor, view: RgbdSettings, variant: str) -> Episode:
        return filmed_episode(unit, dataset, scene, life, scene_T_episode, sensor, view, variant)

    yield filmed(*place_camera("rgbd", scene, common.camera, unit.seeds.rng("rgbd-camera")), common, "")
    yield filmed(scene_T_sphere, sphere, _seen_by(common, config.sphere), "-360")
    for name, view in (("timelapse", config.timelapse), ("security", config.security)):
        assert isinstance(view.camera, CameraConfig)
        place, sensor = place_camera("monocular", scene, view.camera, unit.seeds.rng(f"{name}-camera"))
        yield filmed(place, sensor, _seen_by(common, view), f"-{name}")
    yield overhead_episode(unit, dataset, scene, life, scene_T_sphere, config, "-overhead")


def _seen_by(common: RgbdSettings, view: View) -> RgbdSettings:
    return replace(common, detector=view.detector, recording=view.recording)


def overhead_episode(
    unit: Unit,
    dataset: str,
    scene: Scene,
    life: Life,
    scene_T_episode: FloatArray,
    config: AllSensorsSettings,
    variant: str,
) -> Episode:
    """The episode of a view from above: pictures and truth, and no observed poses."""
    end_ns = round(config.rgbd.life.duration_s * NS_PER_S)
    episode_T_scene = invert(scene_T_episode)
    scene = scene_in(episode_T_scene, scene)
    true = poses_in(episode_T_scene, life.poses)
    sensor = Sensor("topdown", config.overhead.camera, None)
    truth = EpisodeTruth(
        scene=scene,
        poses=TruePoseTable(true, life.action, np.empty(0, dtype=np.int64)),
        events=life.events,
        affordance=affordance_of(scene, None, life.motions, end_ns),
        motions=life.motions,
    )
    frames = FrameList()
    if unit.renderer is not None:
        lights = room_lighting(scene, np.zeros(2))
        filming = Filming(scene, life.bodies, true, sensor, unit.renderer, lights, life.motions, life.held)
        stamps = unit.filmed(frame_times(end_ns, config.overhead.frame_rate_hz))
        frames = film(filming, stamps, 0, "none")  # type: ignore[assignment]
    return Episode(f"{dataset}-{unit.number:06d}{variant}", dataset, sensor, frames, None, 0, end_ns, truth=truth)
