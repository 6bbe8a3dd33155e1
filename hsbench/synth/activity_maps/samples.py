"""Samples of simulated activity maps with their truth: many of one furnished scene, which is labelled once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hsbench.geometry.activity_map import rasterise_blurred
from hsbench.geometry.cameras import TopDownCamera
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.polygons import contains
from hsbench.geometry.rays import PackedSolids, pack_solids
from hsbench.geometry.transforms import invert, planar
from hsbench.schema.episode import NS_PER_S, ActivityMaps, Episode, EpisodeTruth, FrameList
from hsbench.schema.scene import Scene
from hsbench.schema.sensor import Sensor
from hsbench.synth.activity_maps.config import MapConfig, PlanarLifeConfig, SphereErrors
from hsbench.synth.activity_maps.life import live_in_plane
from hsbench.synth.activity_maps.observe import BODY_M, CHANNELS, observe_sphere, seen_share
from hsbench.synth.activity_maps.places import Places, find_places
from hsbench.synth.activity_maps.plan import of_task, plan_truth
from hsbench.synth.assemble import scene_in
from hsbench.synth.placement import most_central
from hsbench.synth.recipes import Unit
from hsbench.truth.affordance import AffordanceScene, afford
from hsbench.truth.sittable import SHOULDER_SEATED_M, SHOULDER_STANDING_M
from hsbench.truth.walkable import WalkMap
from hsbench.typing import Float32Array, FloatArray, IntArray

LEVELS = 255  # of a map's values: they compress well, and the last bits of a machine's exponentials do not show


@dataclass(frozen=True, eq=False)
class ReadyScene:
    """A scene made ready for samples, in its own frame: its labelled surfaces, where its life goes, what may stand in a
    line of sight, and (N, 2) where cameras may stand.
    """

    found: AffordanceScene
    places: Places
    solids: PackedSolids
    stands_xy: FloatArray


def map_episodes(
    unit: Unit, dataset: str, scene: Scene, life: PlanarLifeConfig, errors: SphereErrors, maps: MapConfig
) -> Iterator[Episode]:
    """The samples of a unit's scene, given in its own frame.

    ``<dataset>-<number>`` is the first, ``<dataset>-<number>-01`` and so on the others. Truth has the scene itself with
    the first alone.
    """
    seeds = unit.seeds.child(dataset)
    ready = make_ready(scene, maps, seeds.rng("places"))
    sensor = Sensor("topdown", TopDownCamera(maps.side_cells, maps.side_cells, maps.cell_m), None)
    for number in range(maps.samples_per_room):
        own = seeds.child(number)
        scene_T_episode, camera = _place_camera(ready, maps, own.rng("camera"))
        lived = live_in_plane(ready.places, own.rng("life"), life)
        seen = seen_share(camera, lived.body_xy.reshape(-1, 2), lived.shoulder_m.ravel(), ready.solids)
        seen = seen.reshape(lived.action.shape)
        marks, channel = observe_sphere(lived, scene_T_episode, seen, errors, own.rng("observe"))
        yield Episode(
            f"{dataset}-{unit.number:06d}" + (f"-{number:02d}" if number else ""),
            dataset,
            sensor,
            FrameList(),
            None,
            0,
            round(lived.action.shape[1] / life.rate_hz * NS_PER_S),
            ActivityMaps(draw_maps(marks, channel, maps), CHANNELS, maps.cell_m),
            EpisodeTruth(
                scene_in(invert(scene_T_episode), scene) if number == 0 else None,
                affordance=plan_truth(ready.found, scene_T_episode, maps),
            ),
        )


def make_ready(scene: Scene, maps: MapConfig, rng: np.random.Generator) -> ReadyScene:
    """Label a scene and find its places, once for all its samples."""
    found = of_task(afford(scene))
    low_m, high_m = SHOULDER_SEATED_M + min(BODY_M), max(maps.camera_height_m[1], SHOULDER_STANDING_M + max(BODY_M))
    solids = [solid for item in scene.objects for solid in item.solids]
    between = [solid for solid in solids if solid.bounds[0, 2] < high_m and solid.bounds[1, 2] > low_m]
    return ReadyScene(
        found, find_places(found, rng), pack_solids(between), central_cells(scene, found.walk, maps.central_share)
    )


def _place_camera(ready: ReadyScene, maps: MapConfig, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """(scene_T_episode (4, 4), camera (3,) in the scene)."""
    x, y = ready.stands_xy[rng.integers(len(ready.stands_xy))].tolist()
    scene_T_episode = planar(x, y, quantise_angle(rng.uniform(-math.pi, math.pi)))
    return scene_T_episode, np.array([x, y, float(quantise_m(rng.uniform(*maps.camera_height_m)))])


def central_cells(scene: Scene, walk: WalkMap, share: float) -> FloatArray:
    """(N, 2) middles of the walkable cells of the largest room, those nearest to all its others, N being a share.

    The middle of the room where nobody can stand in it.
    """
    outline = max(scene.rooms, key=lambda room: room.area_m2).outline_xy
    cells = walk.centres()[walk.free]
    cells = cells[contains(outline, cells)]
    if not len(cells):
        return quantise_m((outline.min(axis=0) + outline.max(axis=0)) / 2)[None]
    return most_central(cells, share)


def draw_maps(marks: FloatArray, channel: IntArray, maps: MapConfig) -> Float32Array:
    """(M, 2) marks in the episode frame, (M,) their channels -> (3, side, side) maps, row 0 the farthest ahead."""
    low, shape = (maps.low_m, maps.low_m), (maps.side_cells, maps.side_cells)
    grown = rasterise_blurred(marks, channel, len(CHANNELS), low, shape, maps.cell_m, maps.blur_m, maps.delta)
    return np.ascontiguousarray(np.rint(grown[:, ::-1, ::-1] * LEVELS) / np.float32(LEVELS), dtype=np.float32)
