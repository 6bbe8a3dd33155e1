"""Recipe ``pairs``: one room and life as in ``rgbd-activity``, and three controlled variants of it.

``-hidden``: another object where nobody looks or goes; every published byte is the same. ``-life``: the same room and
camera, another life. ``-noise``: the same room, camera and life, other noise. The README beside this file is the data
sheet; ``config.toml`` holds every setting.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from hsbench.errors import DataError
from hsbench.geometry.transforms import invert
from hsbench.schema import Episode, Scene
from hsbench.synth.activities import Life, live
from hsbench.synth.assemble import filmed_episode, scene_in
from hsbench.synth.furniture import family
from hsbench.synth.pairs import exchanged, hidden_objects, is_unrevealed, same_poses
from hsbench.synth.placement import place_rgbd
from hsbench.synth.recipes import Unit
from hsbench.synth.rgbd import RgbdSettings


def build(config: Mapping[str, Any], unit: Unit) -> Iterator[Episode]:
    """The four episodes of a unit, from the first of its rooms that hides something nobody comes near."""
    settings, rooms = RgbdSettings.of(config, unit.split), int(config["search"]["rooms"])
    for number in range(rooms):
        attempt = replace(unit, seeds=unit.seeds.child(number))
        scene = settings.scene(unit.scene_id, attempt.seeds.child("room"))
        scene_T_episode, sensor = place_rgbd(scene, settings.camera, attempt.seeds.rng("rgbd-camera"))
        if not hidden_objects(scene_in(invert(scene_T_episode), scene), sensor):
            continue
        life = live(scene, attempt.seeds.child("life"), settings.life)
        film = partial(filmed_episode, scene_T_episode=scene_T_episode, sensor=sensor, settings=settings)
        base = film(attempt, "pairs", scene, life)
        twin = _twin(base, attempt, scene, life, film)
        if twin is not None:
            yield base
            yield twin
            other_life = live(scene, attempt.seeds.child("other-life"), settings.life)
            yield film(attempt, "pairs", scene, other_life, variant="-life")
            other_noise = replace(attempt, seeds=attempt.seeds.child("other-noise"))
            yield film(other_noise, "pairs", scene, life, variant="-noise")
            return
    raise DataError(f"none of {rooms} rooms hides an object that can be exchanged (allow more: rooms in [search])")


def _twin(base: Episode, unit: Unit, scene: Scene, life: Life, film: Callable[..., Episode]) -> Episode | None:
    """The same with another hidden object, or None where nothing hidden stays unrevealed."""
    assert base.truth is not None
    assert base.truth.scene is not None
    moved = frozenset(life.motions.object_id.tolist())
    for object_id in hidden_objects(base.truth.scene, base.sensor, moved):
        other = exchanged(scene, object_id, family(scene.style), unit.seeds.rng(f"exchange-{object_id}"))
        if other is None or not is_unrevealed(base.truth, object_id):
            continue
        twin = film(unit, "pairs", other, life, variant="-hidden")
        assert twin.truth is not None
        assert twin.truth.scene is not None
        hidden = object_id in hidden_objects(twin.truth.scene, twin.sensor, moved)
        if hidden and is_unrevealed(twin.truth, object_id) and same_poses(base.poses, twin.poses):
            return twin
    return None
