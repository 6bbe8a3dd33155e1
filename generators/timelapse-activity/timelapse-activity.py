"""Recipe ``timelapse-activity``: one furnished room, people who live in it for hours, pictures every half minute.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Unit
from hsbench.synth.timelapse import TimelapseSettings, timelapse_episode


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The one episode of a unit."""
    settings = TimelapseSettings.of(config, unit.split)
    scene = settings.common.scene(unit.scene_id, unit.seeds.child("room"))
    scene_T_episode, sensor = place_rgbd(scene, settings.common.camera, unit.seeds.rng("timelapse-camera"))
    sensor = replace(sensor, kind="monocular")
    yield timelapse_episode(unit, "timelapse-activity", scene, scene_T_episode, sensor, settings)
