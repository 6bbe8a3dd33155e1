"""What recipes with a 360 camera share: their settings, and the episode of one in a room or flat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsbench.errors import SchemaError
from hsbench.geometry.convex import span
from hsbench.geometry.transforms import planar
from hsbench.schema.episode import Episode
from hsbench.schema.occupancy import AffordanceTruth
from hsbench.schema.scene import Part, Scene, SceneObject
from hsbench.schema.states import Affordance
from hsbench.synth.activities import LifeConfig, live
from hsbench.synth.activities.config import MOST_PEOPLE
from hsbench.synth.activity_maps.plan import hidden_rooms
from hsbench.synth.assemble import filmed_episode
from hsbench.synth.config import settings
from hsbench.synth.furniture import COMMON_FAMILIES, NOVEL_FAMILIES
from hsbench.synth.placement import SphereConfig, place_sphere
from hsbench.synth.recipes import Unit, is_watched_long
from hsbench.synth.rgbd import RgbdSettings
from hsbench.synth.rooms import COMMON_TEMPLATES, NOVEL_TEMPLATES, HomeConfig, RoomConfig, build_home
from hsbench.synth.rooms.templates import even_weights
from hsbench.synth.seeds import Seeds
from hsbench.truth.walkable import WalkMap
from hsbench.typing import FloatArray

TRIPOD_M = (0.24, 0.24, 1.9)  # what people walk around: the camera on its stand


@dataclass(frozen=True)
class PanoramaConfig:
    """What differs from scene to scene. people: how many there are, least and most; home_share: of scenes that are
    whole flats or offices, the others being single rooms. long_s: length of the scenes ``long_scenes``, first and last
    of val and of each test, counted from 0; the others are as long as [life] says.
    """

    people: tuple[int, int] = (1, 4)
    home_share: float = 0.1
    long_s: float = 3600.0
    long_scenes: tuple[int, int] = (2, 9)

    def __post_init__(self) -> None:
        least, most = self.people
        if not 1 <= least <= most <= MOST_PEOPLE:
            raise SchemaError(f"panorama.people is {self.people}; expected 1 <= least <= most <= {MOST_PEOPLE}")
        if not 0 <= self.home_share <= 1:
            raise SchemaError(f"panorama.home_share is {self.home_share}; expected a share of 0..1")


@dataclass(frozen=True)
class PanoramaSettings:
    """The sections of a recipe's ``config.toml`` for one split: [camera] and [panorama], and the others as for an RGB-D
    camera.
    """

    common: RgbdSettings
    camera: SphereConfig
    panorama: PanoramaConfig
    novel: bool

    @classmethod
    def of(cls, config: Mapping[str, Any], split: str) -> PanoramaSettings:
        """Settings for a split. Raises SchemaError naming unknown keys."""
        return cls(
            RgbdSettings.of({**config, "camera": {}}, split),
            settings(SphereConfig, config["camera"], "camera"),
            settings(PanoramaConfig, config["panorama"], "panorama"),
            split == "test-novel",
        )

    def scene(self, scene_id: str, seeds: Seeds) -> Scene:
        """A furnished room or home of a unit, or the imported scene."""
        if self.common.imported is not None or seeds.rng("home").random() >= self.panorama.home_share:
            return self.common.scene(scene_id, seeds.child("room"))
        templates = NOVEL_TEMPLATES if self.novel else COMMON_TEMPLATES
        home = HomeConfig(room=RoomConfig(templates=even_weights(templates)))
        return build_home(scene_id, seeds.child("room"), home, NOVEL_FAMILIES if self.novel else COMMON_FAMILIES)

    def life(self, unit: Unit) -> LifeConfig:
        """How the people of a unit live; their number is drawn."""
        least, most = self.panorama.people
        people = int(unit.seeds.child("panorama").rng("people").integers(least, most + 1))
        life = replace(self.common.life, people=people)
        return (
            replace(life, duration_s=self.panorama.long_s)
            if is_watched_long(unit.number, unit.split, self.panorama.long_scenes)
            else life
        )


def panorama_episode(unit: Unit, dataset: str, config: PanoramaSettings) -> Episode:
    """The episode of a 360 camera in the scene of a unit."""
    scene = config.scene(unit.scene_id, unit.seeds)
    plan = config.life(unit)
    scene_T_episode, sensor = place_sphere(scene, config.camera, unit.seeds.rng("sphere-camera"))
    around = with_tripod(scene, scene_T_episode[:2, 3])
    life = live(around, unit.seeds.child("panorama").child("life"), plan)
    episode = filmed_episode(unit, dataset, scene, life, scene_T_episode, sensor, replace(config.common, life=plan))
    truth = episode.truth
    assert truth is not None
    assert truth.scene is not None
    assert truth.affordance is not None
    affordance = _less_hidden_rooms(truth.affordance, truth.scene)
    return replace(episode, truth=replace(truth, affordance=affordance))


def with_tripod(scene: Scene, camera_xy: FloatArray) -> Scene:
    """The scene as people find it: with a 360 camera's stand at (2,), which is no part of pictures and truth."""
    x, y, z = TRIPOD_M
    stand = Part("stand", (40, 40, 40), solid=span((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)))
    number = max(item.object_id for item in scene.objects) + 1
    place = planar(float(camera_xy[0]), float(camera_xy[1]), 0.0)
    return replace(scene, objects=(*scene.objects, SceneObject(number, "object", place, (stand,))))


def _less_hidden_rooms(truth: AffordanceTruth, scene: Scene) -> AffordanceTruth:
    """Cells of other rooms out of the camera's sight ignored too; the scene is in the episode frame."""
    walkable = (truth.labels >> Affordance.WALKABLE & 1).astype(np.bool_)[::-1, ::-1]
    corner = -np.array(walkable.shape) * truth.cell_m / 2
    hidden = hidden_rooms(scene, WalkMap(corner, walkable, truth.cell_m), np.zeros(2))
    return replace(truth, ignored=truth.ignored | hidden[::-1, ::-1])
