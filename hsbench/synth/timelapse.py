"""Time-lapse episodes: hours in a room by pictures many seconds apart, while daylight, lamps and exposure change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.cameras import PinholeCamera
from hsbench.geometry.numerics import quantise_angle
from hsbench.geometry.transforms import invert
from hsbench.io.frame_store import Film, Patch
from hsbench.schema.episode import NS_PER_S, Episode, EpisodeTruth, FrameList, Frames
from hsbench.schema.events import EventTable
from hsbench.schema.poses import PoseTable, TruePoseTable
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.activities import Life, LifeConfig
from hsbench.synth.activities.config import MOST_PEOPLE
from hsbench.synth.activities.life import joined, stream
from hsbench.synth.ahead import Ahead
from hsbench.synth.assemble import affordance_of, poses_in, scene_in
from hsbench.synth.config import settings
from hsbench.synth.daylight import Day
from hsbench.synth.detectors import Occluders, observe
from hsbench.synth.film import Filming
from hsbench.synth.indoor_light import light_states
from hsbench.synth.people.body import J
from hsbench.synth.recipes import Unit, is_watched_long
from hsbench.synth.relit_room import relit_room
from hsbench.synth.render import Lighting
from hsbench.synth.render.sources import Sources, person_lighting, sources_of
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.seeds import Seeds
from hsbench.truth.view_affordance import view_affordance
from hsbench.typing import BoolArray, FloatArray, IntArray

Range = tuple[float, float]

ASLEEP = "sleep"  # the activity for which people switch the lamp off
DAYS_OF_YEAR = 365


@dataclass(frozen=True)
class TimelapseConfig:
    """What a time-lapse records, and when and where. Ranges are drawn from uniformly.

    period_s: between pictures. start_hour: local solar time at t0. latitude_deg: north. people: how many there are,
    least and most. image_noise: preset of ``io.image_noise``. long_s: length of the scenes ``long_scenes``, first and
    last of val and of each test, counted from 0; the others are as long as [life] says.
    """

    period_s: float = 30.0
    start_hour: Range = (5.0, 20.0)
    latitude_deg: Range = (25.0, 60.0)
    people: tuple[int, int] = (1, 4)
    image_noise: str = "camera"
    long_s: float = 43200.0
    long_scenes: tuple[int, int] = (2, 9)

    def __post_init__(self) -> None:
        if not (self.period_s > 0 and self.long_s > 0):
            raise SchemaError(f"timelapse.period_s is {self.period_s}, long_s {self.long_s}; expected seconds > 0")
        for name, least, most in (("start_hour", 0, 24), ("latitude_deg", -90, 90), ("people", 1, MOST_PEOPLE)):
            low, high = getattr(self, name)
            if not least <= low <= high <= most:
                raise SchemaError(f"timelapse.{name} is ({low}, {high}); expected {least} <= least <= most <= {most}")


@dataclass(frozen=True)
class TimelapseSettings:
    """The sections of a recipe's ``config.toml`` for one split: [timelapse], and the others as for an RGB-D camera."""

    common: RgbdSettings
    timelapse: TimelapseConfig

    @classmethod
    def of(cls, config: Mapping[str, Any], split: str) -> TimelapseSettings:
        """Settings for a split. Raises SchemaError naming unknown keys."""
        common = RgbdSettings.of({**config, "recording": {}}, split)
        return cls(common, settings(TimelapseConfig, config["timelapse"], "timelapse"))

    def life(self, number: int, split: str, start_hour: float, seeds: Seeds) -> LifeConfig:
        """How the people of a scene live, from an hour on; their number is drawn."""
        least, most = self.timelapse.people
        people = int(seeds.rng("people").integers(least, most + 1))
        life = replace(self.common.life, people=people, start_hour=start_hour)
        return (
            replace(life, duration_s=self.timelapse.long_s)
            if is_watched_long(number, split, self.timelapse.long_scenes)
            else life
        )

    def day(self, seeds: Seeds) -> Day:
        """A day drawn; its north is in the scene's frame."""
        rng = seeds.rng("day")
        return Day(
            latitude_deg=round(float(rng.uniform(*self.timelapse.latitude_deg)), 2),
            day=int(rng.integers(DAYS_OF_YEAR)) + 1,
            start_hour=round(float(rng.uniform(*self.timelapse.start_hour)), 2) % 24.0,
            north_rad=quantise_angle(float(rng.uniform(-math.pi, math.pi))),
        )


def timelapse_episode(
    unit: Unit, dataset: str, scene: Scene, scene_T_episode: FloatArray, sensor: Sensor, config: TimelapseSettings
) -> Episode:
    """The episode of a monocular camera in a scene, which is given in its own frame.

    Day, people and all noise follow from ``unit.seeds``.
    """
    seeds = unit.seeds.child(dataset)
    day = config.day(seeds)
    plan = config.life(unit.number, unit.split, day.start_hour, seeds)
    end_ns = round(plan.duration_s * NS_PER_S)
    times_ns = np.arange(0, end_ns, round(config.timelapse.period_s * NS_PER_S), dtype=np.int64)
    life = sparse_life(scene, seeds.child("life"), plan, times_ns)
    episode_T_scene = invert(scene_T_episode)
    scene, true = scene_in(episode_T_scene, scene), poses_in(episode_T_scene, life.poses)
    occluders = Occluders.of(scene, life.motions)
    observed, match = observe(
        true, life.bodies, occluders, sensor, config.common.detector, seeds.child("observe"), times_ns
    )
    assert isinstance(sensor.camera, PinholeCamera)
    truth = EpisodeTruth(
        scene=scene,
        poses=TruePoseTable(true, life.action, match),
        events=life.events,
        affordance=affordance_of(scene, None, life.motions, end_ns),
        motions=life.motions,
        view_affordance=view_affordance(scene, sensor.camera, sensor.world_T_camera, life.motions, 0, end_ns),
    )
    frames: Frames = FrameList()
    if unit.renderer is not None:
        shown_ns = unit.filmed(times_ns)
        filming = Filming(scene, life.bodies, true, sensor, unit.renderer, Lighting(1.0), life.motions, life.held)
        turn = math.atan2(episode_T_scene[1, 0], episode_T_scene[0, 0])
        day = replace(day, north_rad=quantise_angle(day.north_rad + turn))
        frames = film(filming, life.events, day, shown_ns, config.timelapse.image_noise, seeds, unit.threads)
    return Episode(f"{dataset}-{unit.number:06d}", dataset, sensor, frames, observed, 0, end_ns, truth=truth)


def sparse_life(scene: Scene, seeds: Seeds, config: LifeConfig, times_ns: IntArray) -> Life:
    """A life of which poses are kept at some times only; its events and motions are whole."""
    return joined([_at_times(block, times_ns) for block in stream(scene, seeds, config)])


def _at_times(block: Life, times_ns: IntArray) -> Life:
    kept = np.isin(block.poses.timestamp_ns, times_ns)
    held = None if block.held is None else block.held[kept]
    return replace(block, poses=block.poses.select(kept), action=block.action[kept], held=held)


def film(
    filming: Filming, events: EventTable, day: Day, times_ns: IntArray, image_noise: str, seeds: Seeds, threads: int = 1
) -> Film:
    """The pictures of a life at (n,) times, by some threads ahead. day: its north is in the episode frame."""
    scene, sensor, seconds = filming.shown, filming.sensor, times_ns / NS_PER_S
    daylight = sources_of(scene)
    awake = awake_in_rooms(filming.poses, events, daylight, times_ns)
    states = light_states(scene, daylight, day, seconds, awake, seeds.child("light"))
    room = relit_room(filming.room, daylight, states, seconds)
    camera_xy = sensor.world_T_camera[:2, 3]

    def begin(index: int) -> Callable[[], Patch]:
        background, time_ns = room.background(index), int(times_ns[index])
        sources = states.sources(scene, daylight, index)
        exposure = room.day_exposure * float(room.light.exposure[index])
        lights = person_lighting(sources, camera_xy, exposure)
        return partial(filming.peopled, background, *room.picture(background, index, time_ns), time_ns, lights)

    noise_seed = int(seeds.rng("image-noise").integers(2**62))
    return Film(
        room.still, times_ns, Ahead(begin, len(times_ns), threads), noise_seed, "none", False, image_noise, room.light
    )


def awake_in_rooms(poses: PoseTable, events: EventTable, sources: Sources, times_ns: IntArray) -> BoolArray:
    """(n, R) whether somebody who is awake is in each room at (n,) times."""
    assert poses.joints_m is not None
    awake = np.zeros((len(times_ns), len(sources.rooms)), dtype=np.bool_)
    sleeps = np.array([activity == ASLEEP for activity in events.activity], dtype=np.bool_)
    row = np.searchsorted(times_ns, poses.timestamp_ns)
    room = sources.room_of(poses.joints_m[:, J["spine_base"], :2].astype(np.float64))
    for k in np.flatnonzero(np.isin(poses.timestamp_ns, times_ns)):
        now = poses.timestamp_ns[k]
        asleep = sleeps & (events.person_id == poses.track_id[k]) & (events.start_ns <= now) & (now <= events.end_ns)
        awake[row[k], room[k]] |= not asleep.any()
    return awake
