"""Rooms: ``build_scene`` furnishes a room, ``build_home`` a flat or office, from seeds, settings and style families."""

from hsbench.synth.rooms.build import build_home, build_scene
from hsbench.synth.rooms.config import HomeConfig, RoomConfig
from hsbench.synth.rooms.room_kinds import PROGRAMMES
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
