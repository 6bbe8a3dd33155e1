"""Recipe ``rgbd-activity``: one furnished room, a person who explores it and lives in it, one static RGB-D camera.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.assemble import RgbdConfig, rgbd_episode
from hsbench.synth.config import settings
from hsbench.synth.furniture import COMMON_FAMILIES, NOVEL_FAMILIES
from hsbench.synth.people import PosePreset
from hsbench.synth.placement import CameraConfig, place_rgbd
from hsbench.synth.recipes import Unit
from hsbench.synth.rooms import COMMON_TEMPLATES, NOVEL_TEMPLATES, TEMPLATES, RoomConfig, build_scene
from hsbench.synth.rooms.templates import even_weights

ROOM_TYPES = ("living", "bedroom", "dining", "study", "kitchen", "office", "meeting")  # room enough for a life


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The one episode of a unit."""
    novel = unit.split == "test-novel"
    room = settings(RoomConfig, config["room"], "room")
    templates = NOVEL_TEMPLATES if novel else COMMON_TEMPLATES
    room = replace(room, templates=even_weights(tuple(t for t in templates if TEMPLATES[t].room_type in ROOM_TYPES)))
    scene = build_scene(unit.scene_id, unit.seeds.child("room"), room, NOVEL_FAMILIES if novel else COMMON_FAMILIES)
    life_config = settings(LifeConfig, config["life"], "life")
    life = live(scene, unit.seeds.child("life"), life_config)
    camera = settings(CameraConfig, config["camera"], "camera")
    scene_T_episode, sensor = place_rgbd(scene, camera, unit.seeds.rng("rgbd-camera"))
    yield rgbd_episode(
        unit,
        "rgbd-activity",
        scene,
        life,
        scene_T_episode,
        sensor,
        settings(PosePreset, config["poses"], "poses"),
        settings(RgbdConfig, config["recording"], "recording"),
        life_config.duration_s,
    )
