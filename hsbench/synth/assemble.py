"""A filmed life as an episode: everything moved into the episode frame, observed, and its truth computed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from hsbench.geometry.cameras import CentralCamera, EquirectangularCamera
from hsbench.geometry.grids import VoxelGrid
from hsbench.geometry.numerics import quantise_angle, quantise_m
from hsbench.geometry.transforms import apply, invert, planar
from hsbench.io.frame_store import Film, Patch
from hsbench.schema.episode import NS_PER_S, Episode, EpisodeTruth, FrameList
from hsbench.schema.motions import ObjectMotions
from hsbench.schema.occupancy import AffordanceTruth, OccupancyTruth
from hsbench.schema.poses import PoseTable, TruePoseTable
from hsbench.schema.scene import Room, Scene, SceneObject
from hsbench.schema.sensor import Sensor
from hsbench.schema.states import Affordance
from hsbench.synth.activities import Life
from hsbench.synth.activities.life import stamps as stamps_at
from hsbench.synth.ahead import Ahead
from hsbench.synth.detectors import Occluders, observe
from hsbench.synth.film import Filming, Person, room_lighting
from hsbench.synth.people import capsules
from hsbench.synth.recipes import Unit
from hsbench.synth.rgbd import RgbdSettings
from hsbench.truth.affordance import affordance_truth
from hsbench.truth.evidence import first_swept
from hsbench.truth.moving import ignored
from hsbench.truth.objects import object_truth
from hsbench.truth.occupancy import solid_occupancy
from hsbench.truth.sight import ray_image, true_states
from hsbench.truth.unveiled import first_seen
from hsbench.typing import Float32Array, FloatArray, IntArray, UInt8Array

# Task affordance-topdown.
SCORED_LABELS = np.uint8(1 << Affordance.WALKABLE | 1 << Affordance.SITTABLE | 1 << Affordance.INTERACTABLE)


def filmed_episode(
    unit: Unit,
    dataset: str,
    scene: Scene,
    life: Life,
    scene_T_episode: FloatArray,
    sensor: Sensor,
    settings: RgbdSettings,
    variant: str = "",
) -> Episode:
    """The episode of a static sensor in a scene (given in its own frame) where a life goes on.

    The height of a 360 camera is told by truth alone.
    variant: ends the episode's id, where a unit has several. All noise follows from ``unit.seeds``, whatever the id.
    """
    config = settings.recording
    end_ns = round(settings.life.duration_s * NS_PER_S)
    episode_T_scene = invert(scene_T_episode)
    scene = scene_in(episode_T_scene, scene)
    true = poses_in(episode_T_scene, life.poses)
    seeds = unit.seeds.child(dataset)
    looks = stamps_at(np.arange(round(settings.life.duration_s * config.pose_rate_hz)), config.pose_rate_hz)
    occluders = Occluders.of(scene, life.motions)
    observed, match = observe(true, life.bodies, occluders, sensor, settings.detector, seeds.child("observe"), looks)

    assert isinstance(sensor.camera, CentralCamera)
    image = ray_image(scene, sensor.camera, sensor.world_T_camera)
    semantic, instance = solid_occupancy(scene, config.grid)
    states = true_states(scene, config.grid, sensor.camera, sensor.world_T_camera, image)
    occupancy = OccupancyTruth(
        config.grid,
        semantic,
        instance,
        states,
        ignored(semantic, lambda moved: solid_occupancy(moved, config.grid)[0], scene, life.motions, 0, end_ns),
        _swept(life, true, config.grid),
        first_seen(scene, config.grid, sensor.camera, sensor.world_T_camera, states, life.motions, 0, end_ns),
    )
    truth = EpisodeTruth(
        scene=scene,
        poses=TruePoseTable(true, life.action, match),
        events=life.events,
        occupancy=occupancy,
        objects=object_truth(scene, image, occupancy, life.events),
        affordance=affordance_of(scene, config.grid, life.motions, end_ns),
        motions=life.motions,
    )
    episode_id = f"{dataset}-{unit.number:06d}{variant}"
    frames = FrameList()
    if unit.renderer is not None:
        noise_seed = int(seeds.rng("depth-noise").integers(2**62))
        stamps = unit.filmed(frame_times(end_ns, config.frame_rate_hz))
        filming = Filming(
            scene,
            life.bodies,
            true,
            sensor,
            unit.renderer,
            room_lighting(scene, sensor.world_T_camera[:2, 3]),
            life.motions,
            life.held,
        )
        frames = film(filming, stamps, noise_seed, config.depth_noise, unit.threads)  # type: ignore[assignment]
    if isinstance(sensor.camera, EquirectangularCamera):
        sensor, truth = replace(sensor, height_m=None), replace(truth, sensor=sensor)
    return Episode(episode_id, dataset, sensor, frames, observed, 0, end_ns, truth=truth)


def scene_in(episode_T_scene: FloatArray, scene: Scene) -> Scene:
    """The scene in the episode frame, its poses quantised again so that they are the same bytes on every machine."""
    moved = scene.moved(episode_T_scene)
    objects = tuple(
        SceneObject(o.object_id, o.category_name, _quantised(o.scene_T_object), o.parts, o.movable)
        for o in moved.objects
    )
    rooms = tuple(Room(r.room_type, quantise_m(r.outline_xy)) for r in moved.rooms)
    return Scene(moved.scene_id, rooms, moved.height_m, objects, moved.style)


def _quantised(pose: FloatArray) -> FloatArray:
    """An upright pose with its position rounded to .1 mm and its yaw to .01 degree."""
    yaw = quantise_angle(math.atan2(pose[1, 0], pose[0, 0]))
    x, y, z = quantise_m(pose[:3, 3])
    return planar(float(x), float(y), yaw, float(z))


def poses_in(episode_T_scene: FloatArray, poses: PoseTable) -> PoseTable:
    """3D poses in the episode frame, quantised to .1 mm."""
    assert poses.joints_m is not None
    joints = quantise_m(apply(episode_T_scene, poses.joints_m.astype(np.float64))).astype(np.float32)
    return PoseTable(poses.skeleton, poses.timestamp_ns, poses.track_id, poses.joint_state, joints)


def affordance_of(scene: Scene, grid: VoxelGrid | None, motions: ObjectMotions, end_ns: int) -> AffordanceTruth:
    """Affordance at t0, in a grid where one is given.

    Cells are ignored where what is scored of them differs for more than half of the time.
    """

    def scored(at: Scene) -> UInt8Array:
        return np.asarray(affordance_truth(at).labels & SCORED_LABELS)

    truth = affordance_truth(scene, grid)
    return replace(truth, ignored=ignored(truth.labels & SCORED_LABELS, scored, scene, motions, 0, end_ns))


def _swept(life: Life, poses: PoseTable, grid: VoxelGrid) -> Float32Array:
    """(nx, ny, nz) seconds at which any body first entered a voxel, +inf = never."""
    assert poses.joints_m is not None
    swept = np.full(grid.shape, np.inf, dtype=np.float32)
    for person, body in enumerate(life.bodies, start=1):
        rows = poses.track_id == person
        ends, radii = capsules(body, poses.joints_m[rows].astype(np.float64))
        np.minimum(swept, first_swept(ends, radii, poses.timestamp_ns[rows] / NS_PER_S, grid), out=swept)
    return swept


def frame_times(end_ns: int, rate_hz: float) -> IntArray:
    """(n,) int64: t0 and then every 1 / rate seconds, before the end."""
    period_ns = round(NS_PER_S / rate_hz)
    return np.arange(0, end_ns, period_ns, dtype=np.int64)


POSED_AT_ONCE = 16
"""Frames whose people are posed together: a quarter of the time each, a few MB in all."""


def film(filming: Filming, stamps: IntArray, noise_seed: int, noise_preset: str, threads: int = 1) -> Film:
    """The pictures of a static sensor at (n,) times, rendered when asked for; asked in order, by some threads ahead."""
    background = filming.background()

    @lru_cache(maxsize=1)
    def people(chunk: int) -> list[list[Person]]:
        return filming.people(stamps[chunk * POSED_AT_ONCE :][:POSED_AT_ONCE].tolist())

    def begin(index: int) -> Callable[[], Patch]:
        chunk, place = divmod(index, POSED_AT_ONCE)
        return filming.begun(background, int(stamps[index]), people(chunk)[place])

    return Film(
        background,
        stamps,
        Ahead(begin, len(stamps), threads),
        noise_seed,
        noise_preset,
        has_depth=filming.sensor.kind == "rgbd",
    )
