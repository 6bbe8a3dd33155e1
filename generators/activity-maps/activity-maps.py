"""Recipe ``activity-maps``: furnished scenes, simulated activity maps of a 360 camera in them, and what they afford.

The README beside this file is the data sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.activity_maps import MapConfig, PlanarLifeConfig, SphereErrors, map_episodes
from hsbench.synth.config import settings
from hsbench.synth.furniture import COMMON_FAMILIES, NOVEL_FAMILIES
from hsbench.synth.recipes import Unit
from hsbench.synth.rooms import (
    COMMON_TEMPLATES,
    NOVEL_TEMPLATES,
    TEMPLATES,
    HomeConfig,
    RoomConfig,
    build_home,
    build_scene,
)
from hsbench.synth.rooms.templates import even_weights

ROOM_TYPES = ("living", "bedroom", "dining", "study", "kitchen", "office", "meeting")  # room enough for a life


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The samples of a unit, all in one scene."""
    novel = unit.split == "test-novel"
    maps = settings(MapConfig, config["maps"], "maps")
    seeds, families = unit.seeds.child("room"), NOVEL_FAMILIES if novel else COMMON_FAMILIES
    if unit.seeds.rng("home").random() < maps.home_share:
        templates = NOVEL_TEMPLATES if novel else COMMON_TEMPLATES
        home = HomeConfig(room=RoomConfig(templates=even_weights(templates)))
        scene = build_home(unit.scene_id, seeds, home, families)
    else:
        templates = tuple(t for t in (NOVEL_TEMPLATES if novel else COMMON_TEMPLATES) if _is_lived_in(t))
        room = replace(settings(RoomConfig, config["room"], "room"), templates=even_weights(templates))
        scene = build_scene(unit.scene_id, seeds, room, families)
    yield from map_episodes(
        unit,
        "activity-maps",
        scene,
        settings(PlanarLifeConfig, {**config["life"], **(config["novel-life"] if novel else {})}, "life"),
        settings(SphereErrors, config["errors"], "errors"),
        maps,
    )


def _is_lived_in(template: str) -> bool:
    return TEMPLATES[template].room_type in ROOM_TYPES
