"""Recipe ``dining-duo``: two people at a table, watched by one RGB-D camera."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from hsbench.schema import Episode
from hsbench.synth.activities import live
from hsbench.synth.assemble import filmed_episode
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Unit
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.rooms import TEMPLATES, build_scene
from hsbench.synth.rooms.templates import even_weights


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The one episode of a unit; all that is random follows from ``unit.seeds``."""
    settings = RgbdSettings.of(config, unit.split)
    allowed = tuple(name for name, _ in settings.room.templates if TEMPLATES[name].room_type == "dining")
    room = replace(settings.room, templates=even_weights(allowed))
    scene = build_scene(unit.scene_id, unit.seeds.child("room"), room, settings.families)
    life = live(scene, unit.seeds.child("life"), settings.life)
    scene_T_episode, sensor = place_rgbd(scene, settings.camera, unit.seeds.rng("camera"))
    yield filmed_episode(unit, "dining-duo", scene, life, scene_T_episode, sensor, settings)
