"""A day of time-lapse: 1440 pictures over 24 h with changing light, 640x480, three people, on one process, to disk.

The goal is three minutes for planning the day, drawing the lights and the frames, and writing the recording. Memory is
what the process grows by from the first hour's frames to the last.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsbench.errors import HsbenchError
from hsbench.geometry.transforms import invert
from hsbench.io.frame_store import Film, Patch, write_recording
from hsbench.schema import Sensor
from hsbench.synth.activities import LifeConfig
from hsbench.synth.assemble import poses_in, scene_in
from hsbench.synth.daylight import Day
from hsbench.synth.film import Filming
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.render import Lighting, open_renderer
from hsbench.synth.rooms import RoomConfig, build_scene
from hsbench.synth.seeds import Seeds
from hsbench.synth.timelapse import film, sparse_life

pytestmark = pytest.mark.slow

FRAMES, PERIOD_NS = 1440, 60 * 10**9
GOAL_S = 180.0
SEEDS = Seeds(0)
DAY = Day(50.0, 120, 0.0, 0.4)
LIFE = LifeConfig(duration_s=86400.0, fps=10, people=3, mode="natural", from_outside=False, start_hour=0.0, empty_s=0.0)


def memory_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def now() -> tuple[float, float]:
    """Seconds of the clock, and seconds of computing: on a busy machine they differ."""
    return time.perf_counter(), time.process_time()


def watched(made: Film, peaks: list[float]) -> Iterator[Patch]:
    """The patches of a film; the process's peak memory is noted every hour."""
    for index in range(len(made)):
        yield made.patch(index)
        if index % 60 == 59:
            peaks.append(memory_mb())


def test_a_day_at_one_frame_a_minute(tmp_path: Path) -> None:
    try:
        renderer = open_renderer("auto")
    except HsbenchError as error:
        pytest.skip(str(error))
    scene = build_scene("scene-000000", SEEDS.child("room"), RoomConfig(), ("nordic",))
    scene_T_episode, sensor = place_rgbd(scene, CameraConfig(), SEEDS.rng("camera"))
    times_ns = np.arange(FRAMES, dtype=np.int64) * PERIOD_NS
    times = [now()]
    life = sparse_life(scene, SEEDS.child("life"), LIFE, times_ns)
    times.append(now())
    here = scene_in(invert(scene_T_episode), scene)
    poses = poses_in(invert(scene_T_episode), life.poses)
    view: Sensor = replace(sensor, kind="monocular")
    filming = Filming(here, life.bodies, poses, view, renderer, Lighting(1.0), life.motions, life.held)
    made = film(filming, life.events, DAY, times_ns, "camera", SEEDS.child("film"))
    assert made.light is not None
    times.append(now())
    peaks: list[float] = []
    write_recording(tmp_path, made.background, watched(made, peaks), made.light)
    times.append(now())
    size_mb = sum(path.stat().st_size for path in tmp_path.iterdir()) / 1e6
    seconds, computing = np.diff(np.array(times), axis=0).T
    print(
        f"\n24 h, {FRAMES} frames, {len(life.bodies)} people, {len(made.light.lights)} lights: {seconds.sum():.0f} s "
        f"(goal {GOAL_S:.0f}); life, lights, frames: {seconds.round()} s, computing {computing.round()} s; "
        f"{size_mb:.0f} MB; memory {peaks[0]:.0f} MB after an hour, {peaks[-1]:.0f} MB after the day"
    )
    assert len(peaks) == 24
