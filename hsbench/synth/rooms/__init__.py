"""Rooms: ``build_scene`` furnishes a room, ``build_home`` a flat or office, from seeds, a configuration and families."""

from hsbench.synth.rooms.build import build_home, build_scene
from hsbench.synth.rooms.config import PROGRAMMES, HomeConfig, RoomConfig
from hsbench.synth.rooms.templates import COMMON_TEMPLATES, NOVEL_TEMPLATES, TEMPLATES

__all__ = [
    "COMMON_TEMPLATES",
    "NOVEL_TEMPLATES",
    "PROGRAMMES",
    "TEMPLATES",
    "HomeConfig",
    "RoomConfig",
    "build_home",
    "build_scene",
]
