"""Recipe ``rgbd-activity``: one furnished room, a person who explores it and lives in it, one static RGB-D camera.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.activities import live
from hsbench.synth.assemble import filmed_episode
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Unit
from hsbench.synth.rgbd import RgbdSettings


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The one episode of a unit."""
    settings = RgbdSettings.of(config, unit.split)
    scene = settings.scene(unit.scene_id, unit.seeds.child("room"))
    life = live(scene, unit.seeds.child("life"), settings.life)
    scene_T_episode, sensor = place_rgbd(scene, settings.camera, unit.seeds.rng("rgbd-camera"))
    yield filmed_episode(unit, "rgbd-activity", scene, life, scene_T_episode, sensor, settings)
