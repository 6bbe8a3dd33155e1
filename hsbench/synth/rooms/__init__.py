"""Rooms: ``build_scene`` furnishes a room from seeds, a configuration and style families."""

from hsbench.synth.rooms.build import build_scene
from hsbench.synth.rooms.config import RoomConfig
from hsbench.synth.rooms.templates import COMMON_TEMPLATES, NOVEL_TEMPLATES, TEMPLATES

__all__ = ["COMMON_TEMPLATES", "NOVEL_TEMPLATES", "TEMPLATES", "RoomConfig", "build_scene"]
